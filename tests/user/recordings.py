# SPDX-License-Identifier: MIT
"""recordings.py - a table of what loggers write, and every program that reads recordings.

A case is the bytes of a file, settings of the model (recording.c), and what must come of them: numbers, or a refusal, `FILE:LINE:
..` and a hint. examples/recording.h alone prints its numbers; train.c and range.c must take the same file, or refuse it in the same
words. Then every case is damaged in many ways: a program ends with 0, or with 1 and a hint. Last line: N passed, N failed.
"""
import math
import os
import random
import re
import resource
import subprocess
import sys

DIR = "build/recordings"
FLAGS = ["-std=c99", "-D_POSIX_C_SOURCE=200809L", "-O1", "-ffp-contract=off", "-I.", "-Iexamples", "-I" + DIR]
CHECKED = ["-g1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
passed = failed = 0


def check(what, ok, text=""):
    global passed, failed
    passed, failed = passed + bool(ok), failed + (not ok)
    if not ok:
        print(f"{what}: {text}")


def build(source, out, *more):
    subprocess.run(["gcc", *FLAGS, *more, source, "-o", f"{DIR}/{out}", "-lpthread", "-lm"], check=True)


def run(program, *words):
    done = subprocess.run([f"{DIR}/{program}", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=60)
    return done.returncode, done.stdout.decode(errors="replace"), done.stderr.decode(errors="replace")


# ---- cases ----

def printed(*recordings):
    """What recording.c prints of them: rows of numbers without t, 10 ms apart."""
    rows = [["%g:" % (.01 * i) + "".join(f" {x:g}" for x in row) for i, row in enumerate(r)] for r in recordings]
    return f"{sum(map(len, rows))} samples\n" + "\n\n".join("\n".join(r) for r in rows) + "\n"


ONE = printed([(1.5, 2), (1.52, 2), (1.54, 2)])
TWO = printed([(1.5, 2), (1.52, 2), (1.54, 2)], [(1.5, 2), (1.52, 2), (1.54, 2)])
TAU = printed([(1.5, 2, 7), (1.52, 2, 8), (1.54, 2, 9)])
ROWS = b"0,1.5,2\n0.01,1.52,2\n0.02,1.54,2\n"
FILE = b"t,q,qd\n" + ROWS


def moving(q, qd=None, dt=0.01, count=60):
    """A recording of q(t) and, unless None, qd(t)."""
    return "".join(f"{i * dt:.4f},{q(i * dt):.6f}" + (f",{qd(i * dt):.6f}" if qd else "") + "\n" for i in range(count)).encode()


def stamped(*stamps, apart=",", head="t,q,qd\n"):
    values = ["1.5", "1.52", "1.54"]
    return (head.replace(",", apart) + "".join(apart.join([t, q, "2"]) + "\n" for t, q in zip(stamps, values))).encode()


CASES = [
    # bytes and lines
    ("plain", FILE, "", ONE),
    ("no header", ROWS, "", ONE),
    ("mark of UTF-8", b"\xef\xbb\xbf" + FILE, "", ONE),
    ("mark of UTF-8, no header", b"\xef\xbb\xbf" + ROWS, "", ONE),
    ("UTF-16 LE", b"\xff\xfe" + FILE.decode().encode("utf-16le"), "", r":1: a byte 0, or a mark of UTF-16"),
    ("UTF-16 BE", b"\xfe\xff" + FILE.decode().encode("utf-16be"), "", r":1: a byte 0, or a mark of UTF-16"),
    ("UTF-16 without a mark", FILE.decode().encode("utf-16le"), "", r":1: a byte 0"),
    ("UTF-32", FILE.decode().encode("utf-32"), "", r":1: a byte 0"),
    ("CR LF", FILE.replace(b"\n", b"\r\n"), "", ONE),
    ("CR", FILE.replace(b"\n", b"\r"), "", ONE),
    ("CR LF, two recordings", FILE.replace(b"\n", b"\r\n") + b"\r\n" + ROWS.replace(b"\n", b"\r\n"), "", TWO),
    ("CR, two recordings", FILE.replace(b"\n", b"\r") + b"\r" + ROWS.replace(b"\n", b"\r"), "", TWO),
    ("no last newline", FILE[:-1], "", ONE),
    ("a byte 0", FILE.replace(b"1.52", b"1.5\x002"), "", r":3: a byte 0"),
    ("empty lines at both ends", b"\n\n" + FILE + b"\n\n\n", "", ONE),
    ("an empty line after every row", FILE.replace(b"\n", b"\n\n"), "", r": no sample follows another one"),
    ("lines of commas between recordings", FILE + b",,\n" + ROWS, "", TWO),
    ("lines of semicolons and blanks", FILE + b" ; ;\n" + ROWS, "", TWO),
    ("a long comment", b"# " + b"x" * 60000 + b"\n" + FILE, "", ONE),
    ("a long line", b"# " + b"x" * 70000 + b"\n" + FILE, "", r":1: more than 65790 letters in a line"),
    ("empty", b"", "", r" is empty"),
    ("a header alone", b"t,q,qd\n", "", r" has no samples"),
    ("one sample", b"0,1,2\n", "", r": no sample follows another one: 1 samples in 1 recordings\nhint: a recording has many rows"),
    *[("compressed, " + name, mark + FILE, "", rf": compressed \({name}.*\)\nhint: unpack it") for name, mark in (
        ("gzip", b"\x1f\x8b\x08\0"), ("zip", b"PK\x03\x04"), ("bzip2", b"BZh9"), ("xz", b"\xfd7zXZ\0"),
        ("zstd", b"\x28\xb5\x2f\xfd"))],
    *[(f"cut off behind {end!r}", FILE + end, "", ONE) for end in (b"0", b"0.03,", b"0.03,1.56", b"0.03,1.56,", b"0.03,1.56,-",
                                                                 b"0.03,1.56,1.2e", b"0.03,1.5e")],
    ("cut off, but with an end", FILE + b"0.03,1.56,1.2e\n", "", r':5: column 3: expected a finite number, found "1.2e"'),
    ("a word without an end", FILE + b"0.03,1.56,NA", "", r':5: column 3: .*found "NA"\nhint: a sample is missing'),
    ("an error before the end", FILE + b"0.03,1.5e,2", "", r':5: column 2: expected a finite number, found "1.5e"'),
    # comments
    ("comment #", b"# a pendulum\n" + FILE.replace(b"0.01", b"# here\n0.01"), "", ONE),
    ("comment %", b"% a pendulum, 3 kg\n" + FILE, "", ONE),
    ("comment //", b"// a pendulum\n" + ROWS, "", ONE),
    ("names in a comment", b"# t,q,qd\n" + ROWS, "", ONE),
    ("forces in a comment", b"# t q1 tau1\n" + ROWS, "torque=1 smooth=1", printed([(1.5, 2, 2), (1.52, 2, 2), (1.54, 2, 2)])),
    ("a comment behind numbers", FILE.replace(b"1.52,2", b"1.52,2 # here"), "",
     r':3: column 3: expected a finite number, found "2 # '),
    # separators
    ("semicolons", FILE.replace(b",", b";"), "", ONE),
    ("semicolons and decimal commas", FILE.replace(b",", b";").replace(b".", b","), "", ONE),
    ("tabs", FILE.replace(b",", b"\t"), "", ONE),
    ("tabs and decimal commas", FILE.replace(b",", b"\t").replace(b".", b","), "", ONE),
    ("blanks", FILE.replace(b",", b" "), "", ONE),
    ("columns padded with blanks", b"   t     q     qd  \n  0     1.5   2   \n  0.01  1.52  2\n  0.02  1.54  2\n", "", ONE),
    ("commas and blanks", FILE.replace(b",", b" , "), "", ONE),
    ("commas and tabs", FILE.replace(b",", b",\t"), "", ONE),
    ("names by blanks, numbers by commas", b"t q qd\n" + ROWS, "", ONE),
    ("names by commas, numbers by blanks", b"t,q,qd\n" + ROWS.replace(b",", b" "), "", ONE),
    ("sep=", b"sep=;\n" + FILE.replace(b",", b";"), "", ONE),
    ("another separator later", FILE.replace(b"0.02,1.54,2", b"0.02;1.54;2"), "", r':4: .*found "0.02;1.54;2"'),
    ("blanks and commas", FILE.replace(b"0.01,1.52", b"0.01 1.52"), "", r':3: .*found "0.01 1.52"'),
    ("semicolons, points and commas", FILE.replace(b",", b";").replace(b"1.52", b"1,52"), "",
     r':3: column 2: "1,52" has another decimal'),
    ("blanks and decimal commas", b"0 1,5 2\n0 1,5 2\n", "", r":1: column 1: expected a time, found"),
    ("trailing commas", FILE.replace(b"\n", b",\n"), "", ONE),
    ("two trailing commas in rows alone", FILE.replace(b"2\n", b"2,,\n"), "", ONE),
    ("a column of nothing", b"t,q,qd,tau\n" + ROWS.replace(b"\n", b",\n"), "", r":1: 4 names, but 3 columns in line 2"),
    ("a missing last number", b"t,q,qd,tau\n0,1.5,2,7\n0.01,1.52,2,\n", "", r":3: 3 columns, the lines before it have 4"),
    ("an empty column", FILE.replace(b"1.52", b""), "", r":3: column 2 is empty"),
    ("an empty column of blanks", FILE.replace(b"1.52", b"  "), "", r":3: column 2 is empty"),
    ("an empty column between tabs", FILE.replace(b",", b"\t").replace(b"1.52", b""), "", r":3: column 2 is empty"),
    ("an empty t", FILE.replace(b"0.01", b""), "", r':3: column 1: expected a time, found ""'),
    ("one column too few", FILE.replace(b"1.52,2", b"1.52"), "", r":3: 2 columns, the lines before it have 3"),
    ("one column too many", FILE.replace(b"1.52,2", b"1.52,2,3"), "", r":3: 4 columns, the lines before it have 3"),
    ("too few for the model", b"0,1\n0.01,1\n", "N=2", r":1: 2 columns, but the model needs t, 2 q, 2 qd: 5"),
    ("too many for the model", b"0,1,2,3,4\n", "", r":1: 5 columns, but the model needs"),
    # numbers
    ("quoted numbers", b'"t","q","qd"\n' + re.sub(rb"[\d.]+", rb'"\g<0>"', ROWS), "", ONE),
    ("single quotes", b"'t','q','qd'\n" + re.sub(rb"[\d.]+", rb"'\g<0>'", ROWS), "", ONE),
    ("blanks in quotes", FILE.replace(b"1.52", b'" 1.52 "'), "", ONE),
    ("quoted decimal commas", FILE.replace(b"1.52", b'"1,52"'), "", r':3: column 2: .*found "1,52"'),
    ("a quote that stays open in the first row", b'"' + ROWS, "", r':1: column 1: expected a time, found ""0"'),
    ("a single quote that stays open", b"'6,l,-\n" + FILE, "", r":1: column 1: expected a time, found"),
    ("a quote that stays open in the first name", b'"' + FILE, "", ONE),
    ("a quote that stays open", FILE.replace(b"1.52", b'"1.52'), "", r':3: '),
    ("Fortran", FILE.replace(b"1.52", b"0.152D+01").replace(b"1.54", b".154d1"), "", ONE),
    ("Fortran, decimal commas", FILE.replace(b",", b";").replace(b".", b",").replace(b"1,52", b"0,152D+01"), "", ONE),
    ("hexadecimal", FILE.replace(b"1.5,", b"0x1.8p0,"), "", ONE),
    ("hexadecimal with a d", b"0,0xd,2\n1e-2,0xd.8p0,2\n", "", printed([(13, 2), (13.5, 2)])),
    ("exponents, signs, no digit before the point", b"0,+.15e1,2.\n1E-2,1.52e+0,+2\n.2e-1,154e-2,2\n", "", ONE),
    ("nan", FILE.replace(b"1.52", b"nan"), "", r':3: column 2: expected a finite number, found "nan"'),
    ("NaN first", b"nan,nan,nan\n" + ROWS, "", r':1: column 1: expected a time, found "nan"'),
    ("inf", FILE.replace(b"1.52", b"-Infinity"), "", r':3: column 2: expected a finite number, found "-Infinity"'),
    ("too large", FILE.replace(b"1.52", b"1e39"), "", r':3: column 2: expected a finite number, found "1e39"'),
    ("an acceleration that overflows", b"0,1,2\n0.01,1,2.9e38\n0.02,1,2\n", "", r": recording 1: qdd 1 overflows"),
    ("one rate that overflows", b"0.01,.8803,2.998\n0.07,2667,2.8911\n0.1,.2955,2.866\n0.11,.324,2.8381e38\n", "",
     r": recording 1: qd 1 overflows"),
    ("1.#IND", FILE.replace(b"1.52", b"-1.#IND"), "", r':3: column 2: .*found "-1.#IND"'),
    ("1_000", FILE.replace(b"1.52", b"1_000"), "", r':3: column 2: .*found "1_000"'),
    ("1'000", FILE.replace(b"1.52", b"1'000"), "", r''':3: column 2: .*found "1'000"'''),
    ("1.000,5", FILE.replace(b",", b";").replace(b"1.52", b"1.000,5"), "", r':3: column 2: .*found "1.000,5"'),
    ("1,000.5 in quotes", FILE.replace(b"1.52", b'"1,000.5"'), "", r':3: column 2: .*found "1,000.5"'),
    ("1,000 bare", FILE.replace(b"1.52", b"1,000"), "", r":3: 4 columns, the lines before it have 3"),
    ("a unit behind a number", FILE.replace(b"1.52", b"1.52rad"), "", r':3: column 2: .*found "1.52rad"'),
    ("a minus of Unicode", FILE.replace(b"1.52", "\u22121.52".encode()), "", ':3: column 2: .*found "\u22121.52"'),
    ("a column of text", FILE.replace(b"2\n", b"2,OK\n").replace(b"qd\n", b"qd,state\n"), "",
     r':2: column 4: expected a finite number, found "OK"'),
    ("text in a row", FILE.replace(b"0.01,1.52,2", b"stopped"), "", r':3: expected numbers, found "stopped"'),
    ("a row of NA", FILE.replace(b"0.01,1.52,2", b"NA,NA,NA"), "",
     r':3: expected numbers, found "NA,NA,NA"\nhint: a sample is missing'),
    ("NA", FILE.replace(b"1.52", b"NA"), "", r':3: column 2: .*found "NA"\nhint: a sample is missing'),
    ("#N/A in the first column", FILE.replace(b"0.01,", b"#N/A,"), "",
     r':3: column 1: expected a time, found "#N/A"\nhint: a sample is missing'),
    ("#N/A in the first row", FILE.replace(b"0,1.5,", b"#N/A,1.5,"), "", r':2: column 1: expected a time, found "#N/A"'),
    ("a comment that begins so", FILE.replace(b"0.01,", b"#N/A here: nothing\n0.01,"), "", ONE),
    ("a first row of NA", b"t,q,qd\nNA,NA,NA\n" + ROWS, "", r':2: expected numbers, found "NA,NA,NA"'),
    ("a first row of -", b"-,-,-\n" + ROWS, "", r':1: columns 1 and 2 are both called "-"'),
    ("a typing error in the first row", ROWS.replace(b"1.5,", b"1.5x,"), "", r':1: column 2: .*found "1.5x"'),
    ("a first row that is all errors", b"0x,1.5x,2x\n" + ROWS, "", r':1: column 1: expected a time, found "0x"'),
    ("control characters in a message", FILE.replace(b"1.52", b"1.\x1b[31m\x07"), "", r':3: .*found "1\.\?\[31m\?"'),
    # names
    ("names in quotes", b'"t","a, b","c;d"\n' + ROWS, "", ONE),
    ("an empty name", b",q,qd\n" + ROWS, "", ONE),
    ("a title above names", b"Recording of the pendulum\n" + FILE, "", ONE),
    ("names above each recording", FILE + b"\n" + FILE, "", TWO),
    ("files after each other", FILE + FILE, "", TWO),
    ("files with marks after each other", (b"\xef\xbb\xbf" + FILE) * 2, "", TWO),
    ("files with marks and CR LF", (b"\xef\xbb\xbf" + FILE.replace(b"\n", b"\r\n")) * 2, "", TWO),
    ("files with marks and blank lines, no header", (b"\xef\xbb\xbf" + ROWS + b"\n") * 2, "", TWO),
    ("two marks", b"\xef\xbb\xbf" * 2 + FILE, "", ONE),
    ("names in comments after each other", (b"# t,q,qd\n" + ROWS) * 2, "", TWO),
    ("titles and names in comments after each other", (b"# run\n# t,q,qd\n" + ROWS) * 2, "", TWO),
    ("names, then in a comment", FILE + b"#t,q,qd \n" + ROWS, "", TWO),
    ("names in a comment, then not", b"# t,q,qd\n" + ROWS + FILE, "", TWO),
    ("a remark twice", b"# here\n" + ROWS[:20] + b"# here\n" + ROWS[20:], "", ONE),
    ("files with units after each other", (b"t;q;qd\ns;rad;rad/s\n" + ROWS.replace(b",", b";")) * 2, "", TWO),
    ("names twice", b"t,x,x\n" + ROWS, "", r':1: columns 2 and 3 are both called "x"'),
    ("too many names", b"t,q,qd,tau\n" + ROWS, "", r":1: 4 names, but 3 columns in line 2"),
    ("too few names", b"t,q\n" + ROWS, "", r":1: 2 names, but 3 columns in line 2"),
    ("numbers among names", b"t,1,2\n" + ROWS, "", ONE),
    ("numbers among names, no time", b"x0,1.5,2\n" + ROWS, "", r':1: column 1: expected a time, found "x0"'),
    ("no time in the first row", b"t,q,qd\nNov 25 18:10:05,1.5,2\n" + ROWS, "", r':2: column 1: expected a time, found "Nov'),
    ("no time in any row", b"Mon,1.5,2\nTue,1.5,2\n", "", r" has no samples\nhint: .*, which begins with a time"),
    ("no time in a row", FILE + b"later,1.5,2\n", "", r':5: column 1: expected a time, found "later"'),
    # text above
    ("text with numbers", b"Robot: arm, 3 joints\n" + FILE, "", ONE),
    ("text with numbers, no header", b"Robot: arm, 3 joints\n" + ROWS, "", ONE),
    ("lines of text", b"Logger,v3,rate,100,Hz\nArm 2\n\nserial,17\n" + FILE, "", ONE),
    ("text of as many columns", b"Robot,arm,3 joints\n" + FILE, "", ONE),
    ("text below the header", b"t,q,qd\nsee wiki\n" + ROWS, "", ONE),
    ("text below the header that says another order", b"t,qd,q\nsee wiki\n" + ROWS, "", r':1: column 2 is called "qd"'),
    ("a row that is missing at first", b"t,q,qd\n-,-,-\n" + ROWS, "", r':2: .*found "-,-,-"\nhint: a sample is missing'),
    ("columns in another order", b"t,qd,q\n" + ROWS, "", r':1: column 2 is called "qd", but stands where q is expected'),
    ("forces first", b"t,tau1,q1,qd1\n0,7,1.5,2\n", "", r':1: column 2 is called "tau1", but stands where q'),
    ("joints in another order in tau", b"t,q1,q2,qd1,qd2,tau2,tau1\n0,1,2,3,4,5,6\n", "N=2",
     r':1: column 7 is called "tau1", but stands behind "tau2"\nhint: '),
    ("joints in another order in all", b"t,q[2],q[1],qd[2],qd[1]\n0,1,2,3,4\n", "N=2",
     r':1: column 3 is called "q\[1\]", but stands behind "q\[2\]"'),
    ("a joint twice", b"t,q1,q_1 [rad],qd1,qd2\n0,1,2,3,4\n", "N=2",
     r':1: column 3 is called "q_1 \[rad\]", but stands behind "q1"'),
    ("joints of numbers that are far apart", b"t,q9,q10,dq9,dq10\n0,1,1,0,0\n.01,1,1,0,0\n", "N=2",
     printed([(1, 1, 0, 0), (1, 1, 0, 0)])),
    ("interleaved", b"t,q1,qd1,q2,qd2\n0,1,2,3,4\n", "N=2", r':1: column 3 is called "qd1", but stands where q'),
    ("a model of fewer joints", b"t,q1,q2,q3\n0,1,2,3\n", "", r':1: column 3 is called "q2", but stands where qd'),
    ("no t", b"q1,qd1,tau1\n0,1.5,2\n", "smooth=1", r':1: column 1 is called "q1", but stands where t'),
    ("index", b",t,q,qd\n0,0,1.5,2\n1,.01,1.52,2\n", "", r':1: column 3 is called "q", but stands where qd'),
    ("tau", b"t,q1,qd1,tau1\n0,1.5,2,7\n0.01,1.52,2,8\n0.02,1.54,2,9\n", "torque=1", TAU),
    ("upper_vel is no force", b"t,q1,q2,upper_vel,lower_vel\n0,1,2,3,4\n", "N=2 torque=1 smooth=1",
     r":2: no tau columns, which torque=1"),
    ("taught is no force", b"t,q1,taught\n0,1,2\n", "torque=1 smooth=1", r":2: no tau columns, which torque=1"),
    ("v is no force", b"t,q1,q2,u,v\n0,1,2,3,4\n", "N=2 torque=1 smooth=1", r":2: no tau columns, which torque=1"),
    *[(name + " is a force", b"t,q1," + name.encode() + b"\n0,1,7\n0.01,1,8\n0.02,1,9\n", "torque=1 smooth=1",
       printed([(1, 0, 7), (1, 0, 8), (1, 0, 9)])) for name in ("u", "u1", "u_elbow", "u[1]", "tau", "tau1", "Tau_1", "tau[Nm]")],
    ("no qd", moving(lambda t: math.sin(3 * t)), "", None),
    # units of t
    ("row of units", b"t;q;qd\ns;rad;rad/s\n" + ROWS.replace(b",", b";"), "", ONE),
    ("row of units, ms", stamped("0", "10", "20", apart=";").replace(b"\n", b"\nms;deg;deg/s\n", 1), "", ONE),
    ("row of units in brackets", stamped("0", "10", "20").replace(b"\n", b"\n[ms],[rad],[rad/s]\n", 1), "", ONE),
    ("a row of something else", FILE.replace(b"\n", b"\nfurlong,rad,rad/s\n", 1), "", r':2: expected numbers, found "furlong,rad'),

        ("a row of units that contradicts the name", stamped("0", "10", "20", head="t_ms,q,qd\n").replace(
        b"\n", b"\nus,rad,rad/s\n", 1), "", r':2: expected numbers, found "us,rad'),
    ("units alone", b"s,rad,rad/s\n" + ROWS, "", ONE),
    ("units alone, two joints", b"s,rad,rad,rad/s,rad/s\n0,1,1,0,0\n.01,1,1,0,0\n", "N=2", printed([(1, 1, 0, 0), (1, 1, 0, 0)])),
    *[("t called " + name, stamped(*stamps, head=name + ",q,qd\n"), "", ONE) for name, stamps in (
        ("t_ms", ("0", "10", "20")), ("time [ms]", ("5", "15", "25")), ("timestamp_us", ("0", "10000", "20000")),
        ("t(ns)", ("0", "10000000", "20000000")), ("Time (s)", ("0", "0.01", "0.02")), ("ms", ("0", "10", "20")),
        ("time_\u00b5s", ("0", "10000", "20000")), ("t [min]", ("0", "1.6666666666667e-4", "3.3333333333333e-4")),
        ("t_ms", ("1700000000000", "1700000000010", "1700000000020")),
        ("stamp_ns", ("1234567890123456789", "1234567890133456789", "1234567890143456789")))],
    # times since 1970
    ("seconds", stamped("1700000000.00", "1700000000.01", "1700000000.02"), "", ONE),
    ("seconds to the nanosecond", stamped("1700000000.999000001", "1700000001.009000001", "1700000001.019000001"), "", ONE),
    ("milliseconds", stamped("1700000000000", "1700000000010", "1700000000020"), "", ONE),
    ("microseconds", stamped("1700000000000000", "1700000000010000", "1700000000020000"), "", ONE),
    ("nanoseconds", stamped("1700000000000000000", "1700000000010000000", "1700000000020000000"), "", ONE),
    ("nanoseconds, quoted", stamped('"1700000000000000000"', '"1700000000010000000"', '"1700000000020000000"'), "", ONE),
    ("milliseconds with decimal commas", FILE.replace(b",", b";").replace(b".", b",").replace(b"\n0", b"\n1700000000000").replace(
        b"00000,01", b"00010,0").replace(b"00000,02", b"00020,"), "", ONE),
    ("with an exponent", stamped("1.70000000000e12", "1.70000000001e12", "1.70000000002e12"), "", ONE),
    ("uptime that looks like it", stamped("1000000000000", "1000000001000", "1000000002000"), "",
     r":2: if t is in milliseconds since 1970, samples are 1 s apart"),
    ("20 digits", stamped("17000000000000000000", "17000000000100000000", "17000000000200000000"), "",
     r":2: steps of t are 9.9.*e.07 s"),
    ("seconds with too few digits", stamped("1.7e9", "1.7e9", "1.7e9"), "",
     r": 2 of 2 steps of t are 0; possible cause: too few digits of t"),
    # ISO 8601
    *[("date and time " + a, stamped(a, b, c), "", ONE) for a, b, c in (
        ("2026-11-25T18:10:05", "2026-11-25T18:10:05.01", "2026-11-25T18:10:05.02"),
        ("2026-11-25 18:10:05.99", "2026-11-25 18:10:06", "2026-11-25 18:10:06.010"),
        ("2026-11-25T18:10:05.000Z", "2026-11-25T18:10:05.010Z", "2026-11-25T18:10:05.020Z"),
        ("2026-12-31T23:59:59.990+01:00", "2027-01-01T00:00:00.000+01:00", "2027-01-01T00:00:00.010+01:00"),
        ("2024-02-28T23:59:59.99", "2024-02-29T00:00:00", "2024-02-29T00:00:00.01"),
        ("2100-02-28T23:59:59.99", "2100-03-01T00:00:00", "2100-03-01T00:00:00.01"),
        ("2026-10-25T02:59:59.99+0200", "2026-10-25T02:00:00.00+01", "2026-10-25T02:00:00.01+0100"),
        ("1969-12-31T23:59:59.99Z", "1970-01-01T00:00:00Z", "1970-01-01T00:00:00.01Z"),
        ('"2026-11-25 18:10:05,120"', '"2026-11-25 18:10:05,130"', '"2026-11-25 18:10:05,140"'),
        ("18:10:05.120", "18:10:05.130", "18:10:05.140"))],
    ("date and time, blanks", stamped("2026-11-25 18:10:05.12", "2026-11-25 18:10:05.13", "2026-11-25 18:10:05.14", apart=" "), "",
     ONE),
    ("date and time, commas", stamped("2026-11-25 18:10:05,12", "2026-11-25 18:10:05,13", "2026-11-25 18:10:05,14", apart=";"), "",
     ONE),
    ("dates alone", b"2026-11-30,1,0\n2026-12-01,1,0\n2026-12-02,1,0\n", "", "3 samples\n0: 1 0\n86400: 1 0\n172800: 1 0\n"),
    ("dates with hours alone", stamped("2026-11-25T18", "2026-11-25T19", "2026-11-25T20"), "",
     r':2: column 1: expected a time, found "2026'),
    ("times of the day over midnight", stamped("23:59:59.99", "00:00:00.00", "00:00:00.01"), "",
     r":3: t goes back .*\nhint: a time of the day begins anew at midnight: write the date"),
    ("no such date", stamped("2026-02-29T00:00:00", "2026-02-29T00:00:01", "2026-02-29T00:00:02"), "", r':2: .*expected a time'),
    ("no such time", stamped("2026-02-28T24:00:00", "2026-02-28T24:00:01", "2026-02-28T24:00:02"), "", r':2: .*expected a time'),
    ("another calendar", stamped("11/25/2026 18:10:05", "11/25/2026 18:10:06", "11/25/2026 18:10:07"), "",
     r':2: .*expected a time'),
    ("two forms of t", stamped("2026-11-25T18:10:05", "0.01", "0.02"), "", r':3: column 1: "0.01" is written otherwise'),
    ("a zone that ends", stamped("2026-11-25T18:10:05Z", "2026-11-25T18:10:05.01", "2026-11-25T18:10:05.02Z"), "",
     r':3: .*written otherwise'),
    ("date and clock apart", b"2026-11-25,18:10:05,1\n", "", r':1: column 2: .*found "18:10:05"'),
    # steps
    ("another rate", b"".join(b"%g,%g,2\n" % (.01 * i, 1 + .02 * i) for i in range(9)) + b"\n" +
     b"0,1,2\n0.02,1.04,2\n0.04,1.08,2\n0.06,1.12,2\n", "", printed(*[[(1 + .02 * i, 2) for i in range(n)] for n in (9, 7)])),
    ("a missing row", b"0,1,2\n.01,1.02,2\n.03,1.06,2\n.04,1.08,2\n", "", printed([(1 + .02 * i, 2) for i in range(5)])),
    ("a row twice", b"0,1,2\n.01,1.02,2\n.01,1.02,2\n.02,1.04,2\n", "", printed([(1 + .02 * i, 2) for i in range(3)])),
    ("t starts again", b"0,1,2\n.01,1.02,2\n0,1,2\n.01,1.02,2\n", "", printed(*[[(1, 2), (1.02, 2)]] * 2)),
    ("the first rows in another order", b"0,1,2\n.02,1,2\n.01,1,2\n.03,1,2\n", "", r":3: t goes back from 0.02 to 0.01 s"),
    ("t goes back", b"0,1,2\n.01,1,2\n.02,1,2\n.019,1,2\n.03,1,2\n", "", r":4: t goes back from 0.02 to 0.019 s"),
    # jumps
    ("a jump", b"0,3.1,1\n.01,3.11,1\n.02,-3.16,1\n.03,-3.15,1\n", "", r":3: q of joint 1 jumps by 6.27"),
    ("a jump in the first step", b"0,3.138,1\n.01,-3.14,1\n.02,-3.13,1\n", "", r":2: q of joint 1 jumps by 6.278"),
    ("a jump in the only step", b"0,3.138,1\n.01,-3.14,1\n", "", r":2: q of joint 1 jumps by 6.278"),
    ("a jump in the last step", b"0,-3.13,1\n.01,-3.14,1\n.02,3.138,1\n", "", r":3: q of joint 1 jumps by 6.278"),
    ("to and fro from the first step on", b"0,3.141,1\n.01,-3.141,1\n.02,3.141,1\n.03,-3.14,1\n", "",
     r":2: q of joint 1 jumps by 6.28"),
    ("a jump in the first step of the second one", b"0,1,0\n.01,1,0\n.02,1,0\n\n0,3.138,1\n.01,-3.14,1\n.02,-3.13,1\n", "",
     r":6: q of joint 1 jumps by 6.278"),
    ("degrees, in the first step of an angle", b"0,359.9,1\n.01,.1,1\n.02,.3,1\n", "angles=1", r":2: q of joint 1 jumps by 359.8"),
    ("an angle may jump", b"0,3.138,1\n.01,-3.14,1\n.02,-3.13,1\n", "angles=1", None),
    *[("a fast turn, " + what, moving(lambda t: (17 * t + 3) % math.tau - math.pi, speed, 0.02), keys,
       r":\d+: q of joint 1 jumps by 5.94") for what, speed, keys in (("qd", lambda t: 17, ""), ("q alone", None, "smooth=1"))],
    ("two turns at once", moving(lambda t: 3 * t + 4 * math.pi * (t > 0.3), lambda t: 3), "", r":\d+: q of joint 1 jumps by 12.6"),
    *[(f"a wild sample, {off}", moving(lambda t: math.sin(3 * t) + off * (abs(t - 0.3) < 0.001), lambda t: 3 * math.cos(3 * t)), "",
       None) for off in (1, -1, 100, math.pi)],
    ("two recordings without a blank line", moving(lambda t: math.sin(3 * t) + 0.4 * (t > 0.3), lambda t: 3 * math.cos(3 * t)), "",
     r":32: q of joint 1 jumps by 0.4.*\nhint: a blank line before it"),
    ("an angle far from where it was", moving(lambda t: math.sin(3 * t) + 2 * (t > 0.3), lambda t: 3 * math.cos(3 * t)), "angles=1",
     r":32: q of joint 1 jumps by 2"),
    *[(f"{what}, q alone", moving(q), "smooth=1", r":\d+: q of joint 1 jumps by " + words) for what, q, words in (
        ("two turns", lambda t: 3 * t + 4 * math.pi * (t > 0.3), "12.6, as an encoder"),
        ("two recordings", lambda t: math.sin(3 * t) + 0.4 * (t > 0.3), r".* beside it tells .*\nhint: a blank line"),
        ("half a turn", lambda t: 3 * t + math.pi * (t > 0.3), r"3.172 in one"))],
    ("qd is not used, then q alone tells", moving(lambda t: math.sin(3 * t) + 0.4 * (t > 0.3), lambda t: 3 * math.cos(3 * t)),
     "smooth=1 unused=1", r":32: q of joint 1 jumps by 0.4"),
    ("more wild samples than are left out", moving(lambda t: math.sin(3 * t) - (round(100 * t) % 60 == 9), count=300), "smooth=1",
     r":10: q of joint 1 jumps by .* in one sample, and back in the next one; possible cause: a wild sample\nhint: a blank line"),
    *[(f"{what}, q alone", moving(q), "smooth=1", None) for what, q in (
        ("a wild sample", lambda t: math.sin(3 * t) - (abs(t - 0.3) < 0.001)),
        ("a wild sample of 100", lambda t: math.sin(3 * t) + 100 * (abs(t - 0.3) < 0.001)),
        ("an encoder of 4 bits", lambda t: math.floor(math.sin(9 * t) / 0.39) * 0.39),
        ("an impact", lambda t: abs(math.sin(9 * t))),
        ("a slow encoder of 12 bits", lambda t: round(0.05 * math.sin(t) * 652) / 652),
        ("at rest, then fast", lambda t: 5 * max(t - 0.5, 0) ** 2), ("a stop", lambda t: min(3 * t, 1)),
        ("a slider in mm, that starts at once", lambda t: 625 * max(t - 0.3, 0)))],
    ("noisy qd", moving(lambda t: math.sin(9 * t), lambda t: 9 * math.cos(9 * t) + 3 * math.sin(1e6 * t * t)), "", None),
    ("a wild qd", moving(lambda t: math.sin(9 * t), lambda t: 9 * math.cos(9 * t) + 1e9 * (abs(t - 0.3) < 0.001)), "", None),
    ("a stop, and qd of a filter",
     moving(lambda t: min(3 * t, 1), lambda t: 3 if t < 1 / 3 else 3 * math.exp((1 / 3 - t) / 0.03)), "", None),
    ("a slider in mm, qd in m/s", moving(lambda t: 60 * math.sin(9 * t), lambda t: 0.54 * math.cos(9 * t)), "", None),
    ("an encoder of 4 bits", moving(lambda t: math.floor(math.sin(9 * t) / 0.39) * 0.39, lambda t: 9 * math.cos(9 * t)), "", None),
    ("an impact", moving(lambda t: abs(math.sin(9 * t)), lambda t: math.copysign(9 * math.cos(9 * t), math.tan(9 * t))), "", None),
    ("a slow encoder of 12 bits", moving(lambda t: round(0.05 * math.sin(t) * 652) / 652, lambda t: 0.05 * math.cos(t)), "", None),
    ("at rest, then fast", moving(lambda t: 5 * max(t - 0.5, 0) ** 2, lambda t: 10 * max(t - 0.5, 0)), "", None),
    ("torques of 0 alone", "".join(f"{.01 * i:.2f},{.01 * i * i:g},0,0\n" for i in range(30)).encode(), "torque=1",
     r": torque=1, but every tau is 0: there is nothing to learn torques from\nhint: record"),
    ("a fast slider does not", b"0,0,600\n.01,6,600\n.02,12,600\n.03,18,600\n", "", None),
]


def of_columns(*columns, dt=0.01, count=60):
    """Two recordings of functions of t."""
    rows = "".join(",".join([f"{i * dt:.4f}"] + [f"{c(i * dt):.6f}" for c in columns]) + "\n" for i in range(count))
    return (rows + "\n" + rows).encode()


SINE, COSINE, NOTHING = lambda t: math.sin(3 * t), lambda t: 3 * math.cos(3 * t), lambda t: 0
# what is read, but not without a word: a pattern that is said, or, behind !, that is not
TOLD = [
    ("a unit in the header", b"t [s],q1 [rad],qd1 [deg/s]\n" + ROWS, "",
     r':1: column 3: its unit "deg/s" counts with a column map alone'),
    ("a unit in the row of units", b"t,q1,qd1\ns,deg,deg/s\n" + ROWS, "",
     r':2: column 2: its unit "deg" counts with a column map alone'),
    ("a unit at the end of a name", b"t,q1_deg,qd1\n" + ROWS, "", r':1: column 2: its unit "deg" counts with a column map alone'),
    ("a unit of a velocity at the end of a name", b"t,q1,qd1_deg_s\n" + ROWS, "", r':1: column 3: its unit "deg/s" counts with'),
    ("the end of a name that is no unit", b"t,q1_left,qd1_rad_s\n" + ROWS, "", "!its unit"),
    ("a joint that stands still", of_columns(SINE, lambda t: 1, COSINE, NOTHING), "N=2",
     r"warning: .*f\.csv: joint 2 does not move in any recording: leave it out\n"),
    ("a dead encoder", of_columns(SINE, lambda t: 1, COSINE, COSINE), "N=2", r"joint 2 does not move .*a dead encoder, for its qd"),
    ("a joint that stands elsewhere in each recording", moving(SINE, lambda t: 1)[:-1].replace(b"\n", b",3,0\n") + b",3,0\n\n" +
     moving(SINE, lambda t: 2)[:-1].replace(b"\n", b",3,0\n") + b",3,0\n", "N=2", r"joint 2 does not move in any recording"),
    ("qd of 0 of a joint that hardly moves", of_columns(SINE, lambda t: 1e-3 * math.sin(t), COSINE, NOTHING), "N=2",
     r"warning: .*: joint 2 moves, but its qd is 0 in every sample"),
    ("a torque that stands still", of_columns(SINE, COSINE, lambda t: 4), "torque=1", r"warning: .*: tau1 does not change in any"),
    ("no motor", of_columns(SINE, SINE, COSINE, COSINE, COSINE, NOTHING), "N=2 torque=1", r"f\.csv: tau2 is 0 in every sample\n"),
    ("no motor is no warning", of_columns(SINE, SINE, COSINE, COSINE, COSINE, NOTHING), "N=2 torque=1", "!warning"),
    ("a torque that nobody asks for", of_columns(SINE, COSINE, lambda t: 4), "", "!tau1"),
    ("separators alone", FILE + b",,\n" + ROWS, "", r"f\.csv: separators alone in 1 lines, which are read as blank lines\n"),
    ("a blank line", FILE + b"\n" + ROWS, "", "!separators"),
    ("text", b"Robot: arm, 3 joints\n" + ROWS, "", r"f\.csv:1: text, not a header: line 2 has another number of columns"),
    ("two sliders in mm",
     of_columns(lambda t: 9 * SINE(t), lambda t: 8 * SINE(t), lambda t: 9 * COSINE(t), lambda t: 8 * COSINE(t)), "N=2",
     r"joint 1 goes from .* ROLN_SCALE each\n.*joint 2 goes from .* ROLN_SCALE each\n"),
    ("two sliders in mm, ROLN_SCALE each",
     of_columns(lambda t: 9 * SINE(t), lambda t: 8 * SINE(t), lambda t: 9 * COSINE(t), lambda t: 8 * COSINE(t)), "N=2 each=1",
     "!ROLN_SCALE"),
    ("a wild q", moving(lambda t: SINE(t) - (abs(t - 0.3) < 0.001), COSINE), "",
     r"f\.csv:31: q1 is wild: -0\.2167, beside 0\.7643: the row is left out\n"),
    ("a wild qd, in two rows", moving(SINE, lambda t: COSINE(t) + 9e9 * (abs(t - 0.3) < 0.011 and t != 0.3)), "",
     r"f\.csv:30: qd1 is wild: 9e\+09, beside .*; so are 1 more rows: left out\n"),
    ("four rows in a row", moving(SINE, lambda t: COSINE(t) + 9 * (0.295 < t < 0.335)), "", r"so are 3 more rows: left out\n"),
    ("a wild torque", of_columns(SINE, COSINE, lambda t: SINE(t) + 65535 * (abs(t - 0.3) < 0.001)), "torque=1",
     r"f\.csv:31: tau1 is wild: 6\.554e\+04, beside .*; so are 1 more rows: left out\n"),
    *[(f"{what} is not wild", of_columns(q, qd, tau), "torque=1", "!wild") for what, q, qd, tau in (
        ("a pulse on a motor at rest", SINE, COSINE, lambda t: 5 * (abs(t - 0.3) < 0.001)),
        ("a step", lambda t: min(3 * t, 1), lambda t: 3 * (t < 1 / 3), lambda t: 5 * (t > 0.3)),
        ("an impact", lambda t: abs(math.sin(9 * t)), lambda t: math.copysign(9 * math.cos(9 * t), math.tan(9 * t)), COSINE),
        ("a motor that switches", SINE, COSINE, lambda t: math.copysign(1, math.sin(1e4 * t))),
        ("a start from rest", lambda t: 5 * max(t - 0.55, 0) ** 2, lambda t: 10 * max(t - 0.55, 0), COSINE),
        ("an encoder at rest that flickers", lambda t: SINE(t) * 1e-9 + 0.01 * (t > 0.5) + 1e-3 * (round(100 * t) % 7 == 0),
         NOTHING, COSINE))],
    ("a row that is cut off", FILE + b"0.03,1.56,-1.2e", "",
     r"f\.csv:5: the file ends in the middle of this row, which is left out\n"),
    ("no row that is cut off", FILE + b"0.03,1.56,2", "", "!the file ends"),
    ("all move", of_columns(SINE, SINE, COSINE, COSINE), "N=2", "!warning"),
]


def write(text):
    path = f"{DIR}/f.csv"
    with open(path, "wb") as f:
        f.write(text)
    return path


def judge(name, text, keys, want):
    path = write(text)
    words = keys.split()
    joints = 2 if "N=2" in words else 1
    code, out, err = run("recording", path, *(words or ["N=1"]))
    last = err.rstrip("\n").split("\n")[-1]
    reads = want is None or want[0].isdigit()
    if reads:
        numbers = "".join(re.split(r"^(?=\d+ samples$)", out, flags=re.M)[1:])
        check(name, code == 0 and want in (None, numbers), f"ended with {code}, {out}{err}")
    else:
        ok = code == 1 and re.match(re.escape(path) + want, err) and last.startswith("hint: ") and err.count("\n") == 2
        check(name, ok, f"ended with {code}, wanted {want}, said {out}{err}")
    if {"angles=1", "inputs=1", "unused=1"} & set(words):
        return
    for program, more in (("train", ["steps=1", f"out={DIR}/o"]), ("range", [f"{DIR}/{'one' if joints == 1 else 'two'}"])):
        if program == "range" and "torque=1" in words:
            continue
        words = [w for w in words if not w.startswith("N=")]
        same = run(f"{program}{joints}", path, *([] if program == "train" else more), *words, *(more if program == "train" else []))
        said = same[2].replace("but one needs", "but the model needs").replace("but two needs", "but the model needs")
        if reads:
            check(f"{name}: {program}", same[0] in (0, 1, 2, 3) and not re.search(r"f\.csv(:\d+)?: .*\nhint", same[2]), same[2])
            check(f"{name}: {program}, its end", program == "train" or same[0] == 0, same[2])
        else:
            check(f"{name}: {program}", same[0] == 1 and said == err, f"ended with {same[0]}, said {same[2]} for {err}")


def judge_told(name, text, keys, pattern):
    code, out, err = run("recording", write(text), *(keys.split() or ["N=1"]))
    said = re.search(pattern.lstrip("!"), out)
    check(name, code == 0 and bool(said) != pattern.startswith("!"), f"ended with {code}, {out[:300]}{err}")


def judge_full():
    """range.c, where there is no room for its files: the old ones stay, and nothing is beside them."""
    def names():
        return {name: open(f"{DIR}/{name}", "rb").read() for name in os.listdir(DIR) if name.startswith("one")}
    path = write(FILE)
    run("range1", path, f"{DIR}/one")
    before = names()
    for room in 0, 100, len(before["one_weights.h"]) - 1:
        done = subprocess.run([f"{DIR}/range1", path, f"{DIR}/one"], stdout=subprocess.PIPE, stderr=subprocess.PIPE,
                              preexec_fn=lambda room=room: resource.setrlimit(resource.RLIMIT_FSIZE, (room, room)))
        check(f"room for {room} bytes", done.returncode == 1 and b"cannot write" in done.stderr and names() == before, done.stderr)


# ---- damaged files ----

PIECES = [b",", b";", b"\t", b" ", b"\n", b"\r", b"\0", b'"', b"'", b"#", b"%", b"-", b".", b"e", b"nan", b"1e999", b"0x", b":",
          b"T", b"Z", b"+", b"\xef\xbb\xbf", b"\xff", b"2026-11-25", b"ms", b"tau", b"9" * 30, b"x" * 300, b"\n\n", b",,,,,,,,,,"]


def damaged(rng, text):
    text = bytearray(text)
    for _ in range(rng.randrange(1, 4)):
        at, kind = rng.randrange(len(text) + 1), rng.randrange(5)
        if kind == 0:
            text[at:at + 1] = bytes([rng.randrange(256)])
        elif kind == 1:
            text[at:at] = rng.choice(PIECES)
        elif kind == 2:
            del text[at:at + rng.randrange(1, 9)]
        elif kind == 3:
            del text[at:]
        else:
            end = at + rng.randrange(40)
            text[at:at] = text[at:end]
    return bytes(text)


def fuzz(count):
    rng = random.Random(1)
    for k in range(count):
        name, text, keys, _ = rng.choice(CASES)
        if len(text) > 1000:
            continue
        path = write(damaged(rng, text))
        code, out, err = run("recording", path, *(keys.split() or ["N=1"]))
        ok = code == 0 and not err or code == 1 and err.rstrip("\n").split("\n")[-1].startswith("hint: ") and err.startswith(path)
        if not ok:
            os.replace(path, f"{DIR}/found.{k}.csv")
            check(f"damaged, {name}, {DIR}/found.{k}.csv", False, f"ended with {code}, {out[-300:]}{err[-300:]}")
    check("damaged", True)


def main():
    os.chdir(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
    os.makedirs(DIR, exist_ok=True)
    for name, joints in ("one", 1), ("two", 2):
        with open(f"{DIR}/{name}.h", "w") as f:
            f.write(f'#define ROLN_NAME {name}\n#define ROLN_AE {joints}\n#define ROLN_MLP 4\n#include "roln.h"\n')
        for program in "train", "range":
            build(f"examples/{program}.c", f"{program}{joints}", f"-DMODEL={name}")
        weights = f'#include "{name}.h"\n#include <stdio.h>\nint main(void) {{ static {name}_params p; static unsigned char b' \
            f'[{name}_packed_size]; static {name}_start w; uint64_t seed = 1; {name}_init(&p, &seed, &w.init); ' \
            f'{name}_pack(&p, b); return !fwrite(b, sizeof b, 1, stdout); }}\n'
        with open(f"{DIR}/weights.c", "w") as f:
            f.write(weights)
        build(f"{DIR}/weights.c", "weights")
        with open(f"{DIR}/{name}.roln", "wb") as f:
            subprocess.run([f"{DIR}/weights"], stdout=f, check=True)
    build("tests/user/recording.c", "recording", *CHECKED)
    os.makedirs(f"{DIR}/empty", exist_ok=True)
    code, out, err = run("recording", f"{DIR}/empty")
    check("an empty folder", code == 1 and re.match(f"{DIR}/empty: no file in it ends in .csv.*\nhint: ", err), err)
    os.environ["ASAN_OPTIONS"] = "detect_leaks=0"       # a program that ends does not give back
    for case in CASES:
        judge(*case)
    for case in TOLD:
        judge_told(*case)
    judge_full()
    fuzz(int(sys.argv[1]) if len(sys.argv) > 1 else 400)
    print(f"{passed} passed, {failed} failed")
    return failed > 0


sys.exit(main())
