# SPDX-License-Identifier: MIT
"""logger.py - recordings as loggers write them, of two pendulums whose motion is known: column maps, units, several files, clocks
that jitter, samples that are missing, noise.

Every case says what must come of it: numbers near the true motion at the new times, a lag below a bound, or a refusal with a hint.
recording.c prints what examples/recording.h reads; train.c is asked what it holds out. Last line: N passed, N failed.
"""
import math
import os
import random
import re
import shutil
import struct
import subprocess
import sys

DIR = "build/logger"
FLAGS = ["-std=c99", "-D_POSIX_C_SOURCE=200809L", "-O1", "-ffp-contract=off", "-I.", "-Iexamples", "-I" + DIR]
CHECKED = ["-g1", "-fsanitize=address,undefined", "-fno-sanitize-recover=all"]
passed = failed = 0


def check(what, ok, text=""):
    global passed, failed
    passed, failed = passed + bool(ok), failed + (not ok)
    if not ok:
        print(f"{what}: {text}")


def run(program, *words):
    done = subprocess.run([f"{DIR}/{program}", *words], stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=120)
    return done.returncode, done.stdout.decode(errors="replace"), done.stderr.decode(errors="replace")


# ---- the truth: qdd_j = tau_j - k_j sin q_j - 0.1 qd_j ----

STEP = 0.001
STIFF = (9.81, 20)


def torque(j, t):
    return (3 * math.sin(2.1 * t + j) + 2 * math.sin(5.3 * t + 3 * j)) * (1 + j)


def simulate(seconds):
    """States q1, q2, qd1, qd2 every STEP, by Runge-Kutta."""
    def rates(t, x):
        return [x[2], x[3]] + [torque(j, t) - STIFF[j] * math.sin(x[j]) - 0.1 * x[2 + j] for j in (0, 1)]
    x, rows = [0.4, -0.7, 0, 0], []
    for i in range(int(seconds / STEP) + 2):
        rows.append(x)
        t, h = i * STEP, STEP
        a = rates(t, x)
        b = rates(t + h / 2, [u + h / 2 * v for u, v in zip(x, a)])
        c = rates(t + h / 2, [u + h / 2 * v for u, v in zip(x, b)])
        e = rates(t + h, [u + h * v for u, v in zip(x, c)])
        x = [u + h / 6 * (k + 2 * l + 2 * m + n) for u, k, l, m, n in zip(x, a, b, c, e)]
    return rows


SECONDS = 20
ROWS = simulate(SECONDS + 1)


def truth(t):
    """q1, q2, qd1, qd2, qdd1, qdd2, tau1, tau2 at any time: a cubic from sample to sample."""
    i = min(int(t / STEP), len(ROWS) - 2)
    u, out = t / STEP - i, []
    for j in (0, 1):
        a, b, va, vb = ROWS[i][j], ROWS[i + 1][j], ROWS[i][2 + j] * STEP, ROWS[i + 1][2 + j] * STEP
        c, e = 3 * (b - a) - 2 * va - vb, 2 * (a - b) + va + vb
        out.append((a + u * (va + u * (c + u * e)), (va + u * (2 * c + 3 * u * e)) / STEP))
    q, qd, tau = [x[0] for x in out], [x[1] for x in out], [torque(j, t) for j in (0, 1)]
    return q + qd + [tau[j] - STIFF[j] * math.sin(q[j]) - 0.1 * qd[j] for j in (0, 1)] + tau


QDD = (4, 5)
PLAIN = "t,q1,q2,qd1,qd2,tau1,tau2\n"
MAP = ["q=q?", "qd=qd?", "tau=tau?"]


def row_of(t, noise=None):
    x = truth(t)
    x = x[:4] + x[6:]
    return [v + noise.gauss(0, s) for v, s in zip(x, (2e-4, 2e-4, 0.05, 0.05, 0.1, 0.1))] if noise else x


def table(times, stamps=None, head=PLAIN, noise=None, form="%.9g"):
    stamps = stamps or ["%.9g" % t for t in times]
    return (head + "".join(s + "," + ",".join(form % v for v in row_of(t, noise)) + "\n" for t, s in zip(times, stamps))).encode()


def write(text, name="f.csv"):
    path = f"{DIR}/{name}"
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "wb") as f:
        f.write(text if isinstance(text, bytes) else text.encode())
    return path


def read(what, *words):
    """dt and recordings, rows of q, qd, qdd, tau, that recording.c prints; None if it refuses."""
    code, out, err = run("recording", *words, "N=2", "all=1")
    if code:
        check(what, False, f"ended with {code}: {out[-500:]}{err}")
        return None, [], out
    said, text = re.split(r"^\d+ samples$", out, flags=re.M)
    parts = [[[float(v) for v in line.replace(":", "").split()] for line in part.split("\n") if line]
             for part in text.split("\n\n")]
    dt = (parts[0][-1][0] - parts[0][0][0]) / (len(parts[0]) - 1)
    return dt, [[r[1:] for r in part] for part in parts], said


def errors(part, begin, dt, columns=range(8), skip=0):
    """rms error over rms of motion, and lag in s, of each column, against the truth from time `begin` on."""
    out = []
    for c in columns:
        off = square = slope = cross = mean = 0
        rows = range(skip, len(part) - skip)
        for i in rows:
            mean += truth(begin + i * dt)[c] / len(rows)
        for i in rows:
            t = begin + i * dt
            x, d = truth(t)[c], (truth(t + 5e-4)[c] - truth(max(t - 5e-4, 0))[c]) / 1e-3
            e = part[i][c] - x
            off, square, slope, cross = off + e * e, square + (x - mean) ** 2, slope + d * d, cross - e * d
        out.append((math.sqrt(off / square), cross / slope))
    return out


def near(what, part, begin, dt, bound, lag=None, columns=range(8), skip=0):
    found = errors(part, begin, dt, columns, skip)
    check(what, all(e < bound for e, _ in found), "errors " + " ".join("%.2g" % e for e, _ in found))
    if lag:
        check(what + ", lag", all(abs(s) < lag for _, s in found), "lags " + " ".join("%.2g" % s for _, s in found))


# ---- clocks ----

def clocks():
    rng = random.Random(1)
    even = [0.005 * i for i in range(2000)]

    dt, parts, said = read("even", write(table(even)), *MAP)
    check("even: as it is", len(parts) == 1 and len(parts[0]) == 2000 and "resampled" not in said and "filter" not in said, said)
    off = max(abs(parts[0][i][c] - float("%.6g" % row_of(even[i])[c])) for i in range(0, 2000, 7) for c in range(4))
    check("even: the numbers of the file", off < 1.1e-5, off)

    jitter = [t + rng.uniform(0, 0.004) for t in even]
    dt, parts, said = read("jitter", write(table(jitter)), *MAP, "filter=off")
    check("jitter: told", re.search(r"time: steps of .* ms; resampled to 5 ms \(200 Hz\) by local cubics\n", said), said)
    check("jitter: one recording", len(parts) == 1 and abs(len(parts[0]) - 2000) < 3 and abs(dt - 0.005) < 1e-6, len(parts))
    near("jitter: q, qd, tau", parts[0], jitter[0], dt, 4e-4, 2e-5, (0, 1, 2, 3, 6, 7), 3)
    near("jitter: qdd", parts[0], jitter[0], dt, 0.01, 1e-4, QDD, 3)
    rows = table(jitter).decode().split("\n")
    dt, held, said = read("jitter, in the plain order", write("\n".join(rows)), "torque=1", "filter=off")
    near("jitter, in the plain order: q", held[0], jitter[0], dt, 4e-4, None, (0, 1, 2, 3), 3)
    # a torque that is held from its sample on acts half a step later than one that is measured there
    lag = errors(held[0], jitter[0], dt, (6, 7), 3)
    check("a torque that is held", all(0.0015 < s < 0.0035 for _, s in lag), lag)

    clock = [i / 320 for i in range(3200)]
    dt, parts, said = read("stamps rounded to ms", write(table(clock, ["%.3f" % t for t in clock])), *MAP)
    check("stamps rounded to ms: told", "a clock of 3.125 ms rounded to 1 ms\n" in said and "resampled" not in said, said)
    check("stamps rounded to ms: all samples", len(parts[0]) == 3200 and abs(dt - 0.003125) < 1e-8, dt)
    near("stamps rounded to ms", parts[0], 0, 0.003125, 1e-5, None, (0, 1, 2, 3, 6, 7))
    dt, parts, said = read("stamps rounded to 10 ms", write(table(clock, ["%.2f" % t for t in clock])), *MAP)
    check("stamps rounded to 10 ms", len(parts[0]) == 3200 and abs(dt - 0.003125) < 1e-6, said)

    for seconds, rate, refused in (2.4, 40, True), (8, 12, True), (40, 12, False):
        rows = [i / rate for i in range(int(seconds * rate))]
        text = write(table(rows, ["%d" % (7 + t + 1e-9) for t in rows]), "whole.csv")
        code, out, err = run("recording", text, *MAP, "N=2", "filter=off")
        told = re.match(r".*whole.csv: t is rounded to 1 s, and recordings are so short .*\nhint: .* t=none dt=", err)
        check(f"stamps rounded to a second, of {seconds} s", code == refused and bool(told) == refused, out[:300] + err)
    part = [t for t in clock if t < 10]
    for form in "%.7f", "%.6f":
        floats = [form % struct.unpack("f", struct.pack("f", 1e5 + t))[0] for t in part]
        dt, parts, said = read("stamps of 32 bits", write(table(part, floats)), *MAP)
        check(f"stamps of 32 bits, {form}", len(parts[0]) == 3200 and "clock of 3.125 ms rounded to 7.81 ms" in said, said)

    some = [t for t in even if rng.random() > 0.05 or t in (even[0], even[-1])]
    dt, parts, said = read("5 % missing", write(table(some)), *MAP, "filter=off")
    check("5 % missing: told", f"{2000 - len(some)} samples missing; resampled to 5 ms" in said, said)
    check("5 % missing: as many as there were", len(parts) == 1 and len(parts[0]) == 2000, len(parts[0]))
    near("5 % missing", parts[0], 0, dt, 1e-4, 1e-5, (0, 1, 2, 3, 6, 7))
    kept = [round(t / 0.005) for t in some]
    off = max(abs(parts[0][i][c] - float("%.6g" % row_of(even[i])[c])) for i in kept[::5] for c in range(4))
    check("5 % missing: those that are there stay", off < 1.1e-5, off)

    gap = [t for t in even if not 3 < t < 3.2] + [10.5 + t for t in even[:3]]
    dt, parts, said = read("a gap", write(table(gap)), *MAP, "filter=off")
    check("a gap: two recordings, and a rest", len(parts) == 3 and "split at 2 gaps of more than 5.5 steps" in said, said)
    near("a gap: behind it", parts[1], 3.2, dt, 1e-4, None, (0, 1, 2, 3))

    bursts = write(table(even, ["%.4f" % (i // 200 * 2 + 0.001 * (i % 200)) for i in range(len(even))]))
    dt, parts, said = read("stamps of reception", bursts, *MAP, "filter=off")
    check("stamps of reception: told", re.search(r"warning: .*f\.csv: gaps take 89 % of the time; possible cause: t is when "
                                                 r"samples were received.*t=none dt=", said), said)
    check("a gap is no such thing", "warning" not in read("a gap", write(table(gap)), *MAP, "filter=off")[2])

    dt, parts, said = read("another rate", write(table(even)), *MAP, "dt=0.008", "filter=off")
    check("dt=", abs(dt - 0.008) < 1e-6 and "resampled to 8 ms (125 Hz)" in said, said)
    near("dt=", parts[0], 0, dt, 2e-3, 2e-5, (0, 1, 2, 3, 6, 7), 3)

    dt, parts, said = read("no qd", write(table(jitter)), "q=q?", "tau=tau?")
    check("no qd: told", "qd is the derivative of q" in said, said)
    near("no qd", parts[0], jitter[0], dt, 0.02, 2e-4, (2, 3), 8)

    twice = table(even).decode().strip().split("\n")
    dt, parts, said = read("t starts again", write("\n".join(twice + twice[1:])), *MAP)
    check("t starts again: told", len(parts) == 2 and re.search(r":2002: t starts again: a new recording", said), said)


# ---- noise ----

def noise():
    for what, times in ("even", [0.002 * i for i in range(10000)]), ("jitter", None):
        rng = random.Random(2)
        times = times or [0.002 * i + rng.uniform(0, 1e-3) for i in range(10000)]
        path = write(table(times, noise=rng))
        _, raw, _ = read(f"noise, {what}, no filter", path, *MAP, "filter=off", "torque=1")
        dt, parts, said = read(f"noise, {what}", path, *MAP, "torque=1")
        told = re.search(r"filter: ([\d.]+) Hz \(-3 dB\), zero phase, the same for q, qd, tau; ([\d.]+) s at both ends", said)
        check(f"noise, {what}: told", told and re.search(r"noise is \S+ % of the acceleration of joint", said), said)
        if not told:
            continue
        hz, cut = float(told[1]), 0.38875 / float(told[1])
        check(f"noise, {what}: a band above the motion, below the noise", 1 < hz < 25, said)
        check(f"noise, {what}: what is left out", abs(cut - float(told[2])) < 0.01 * cut, said)
        near(f"noise, {what}: q, qd, qdd, tau", parts[0], times[0] + cut, dt, 0.03, 1e-3)
        better = [a[0] / b[0] for a, b in zip(errors(parts[0], times[0] + cut, dt), errors(raw[0], times[0], dt))]
        check(f"noise, {what}: less than before", max(better[2:]) < 0.25, better)
        _, parts, said = read(f"noise, {what}, filter=5", path, *MAP, "torque=1", "filter=5")
        near(f"noise, {what}, filter=5", parts[0], times[0] + 0.38875 / 5, dt, 0.05, 1e-3)
    rng = random.Random(3)
    times = [0.001 * i for i in range(8000)]
    coarse = [[math.floor(v / 1e-3 + 0.5) * 1e-3 for v in truth(t)[:2]] for t in times]
    text = "t,q1,q2\n" + "".join("%.3f,%.6f,%.6f\n" % (t, *q) for t, q in zip(times, coarse))
    dt, parts, said = read("an encoder alone", write(text), "q=q?")
    hz = re.search(r"filter: ([\d.]+) Hz", said)
    check("an encoder alone: filtered", hz, said)
    if not hz:
        return
    near("an encoder alone", parts[0], 0.38875 / float(hz[1]), dt, 0.03, 1e-3, (0, 1, 2, 3))
    lines = text.splitlines(True)
    for what, kept in (("one sample lost", lines[:3001] + lines[3002:]), ("three lost", lines[:2001] + lines[2004:]),
                       ("lost here and there", [r for i, r in enumerate(lines) if i == 0 or i % 97]),
                       ("a gap", lines[:3001] + lines[3401:]), ("one nan", lines[:3001] + ["3.000,nan,nan\n"] + lines[3002:])):
        _, parts, said = read(f"an encoder alone, {what}", write("".join(kept)), "q=q?")
        now = re.search(r"filter: ([\d.]+) Hz", said)
        check(f"an encoder alone, {what}: the same filter", now and abs(float(now[1]) / float(hz[1]) - 1) < 0.1, said)


# ---- columns ----

def columns():
    times = [0.01 * i for i in range(300)]
    want = [row_of(t) for t in times]

    def same(what, text, *words, tau=True, bound=2e-5):
        dt, parts, said = read(what, text if isinstance(text, str) and os.path.exists(text) else write(text), *words)
        if not parts:
            return said
        scale = [max(abs(r[c]) for r in want) for c in range(6)]
        off = max(abs(r[c if c < 4 else c + 2] - w[c]) / scale[c] for r, w in zip(parts[0], want) for c in range(6 if tau else 4))
        check(what, off < bound and abs(dt - 0.01) < 1e-6 and len(parts[0]) == 300, f"{off:.2g} {dt} {len(parts[0])} {said}")
        return said

    def lines(order, form="%.9g", apart=",", head="", more=""):
        out = head
        for t, r in zip(times, want):
            out += apart.join(str(v) if isinstance(v, str) else form % v for v in order(t, r)) + more + "\n"
        return out

    degree = math.pi / 180
    plain = lambda t, r: [t] + r
    said = same("by number", lines(lambda t, r: ["run", t, 7] + r), "t=2", "q=4:5", "qd=6:7", "tau=8:9")
    check("by number: the table", re.search(r"^ +4  - +q1 +as it is +-?[\d.]+ +[\d.]+$", said, re.M) and
          re.search(r"^ +2  - +t +s +0 +2.99  100 Hz$", said, re.M), said)
    back = lines(lambda t, r: [r[5], r[4], r[3], r[2], r[1], r[0], t])
    same("one by one, in another order", back, "t=7", "q=6,5", "qd=4,3", "tau=2,1")
    head = "time,pos_meas1,pos_meas2,pos_filt1,vel_meas1,vel_meas2,tau_con1,tau_con2,tau_meas1,tau_meas2\n"
    with_more = lambda t, r: [t, r[0], r[1], 0, r[2], r[3], 0, 0, r[4], r[5]]
    said = same("by pattern", lines(with_more, head=head), "q=pos_meas*", "qd=vel_meas*", "tau=tau_meas*")
    check("by pattern: the table", re.search(r"^ +9  tau_meas1 +tau1 ", said, re.M), said)
    same("by name", lines(with_more, head=head), "t=time", "q=pos_meas1,pos_meas2", "qd=vel_meas1,vel_meas2",
         "tau=tau_meas1,tau_meas2")
    same("names in a comment", lines(plain, head="# " + PLAIN), *MAP)
    by_number = ["t=1", "q=2:3", "qd=4:5", "tau=6:7"]
    same("by number, in spite of a header of other columns", lines(plain, head="log of today\n"), *by_number)
    same("blanks", lines(plain, apart="  ", head=PLAIN.replace(",", " ")), *MAP)
    same("tabs", lines(plain, apart="\t", head=PLAIN.replace(",", "\t")), *MAP)
    comma = lambda *a, **k: lines(*a, **k).replace(".", ",")
    same("semicolons, decimal commas", PLAIN.replace(",", ";") + comma(plain, apart=";"), *MAP)
    same("a mark, CR LF", b"\xef\xbb\xbf" + lines(plain, head=PLAIN).replace("\n", "\r\n").encode(), *MAP)
    same("comments", "% a pendulum\n" + lines(plain, head=PLAIN).replace("\n0.05,", "\n# here\n0.05,"), *MAP)
    # units
    in_row = lambda t, r: [1000 * t, r[0] / degree, r[1] / degree, r[2] * 30 / math.pi, r[3] * 30 / math.pi, r[4], r[5]]
    units = lambda t, r: in_row(t, r)[:5] + [1e3 * r[4] / 2, 1e3 * r[5] / -3]
    map_of = ["t=1,ms", "q=2:3,deg", "qd=4:5,rpm", "tau=6:7,mA*2,-3"]
    said = same("deg, rpm, mA", lines(units), *map_of)
    check("deg, rpm, mA: the table", re.search(r"tau2 +mA\*-3 ", said) and re.search(r"qd1 +rpm ", said), said)
    said_by = lines(lambda t, r: [t] + [v / degree for v in r[:4]] + [v * 1e3 for v in r[4:]],
                    head="t,a [deg],b [deg],va [deg/s],vb [deg/s],m1 (mNm),m2 (mNm)\n")
    same("units by names", said_by, "q=a,b", "qd=va,vb", "tau=m*")
    said = same("units at the end of names", lines(lambda t, r: [1e3 * t] + [v / degree for v in r[:4]] + [v * 1e3 for v in r[4:]],
                head="t_ms,a_deg,b_deg,va_deg_s,vb_deg_s,m1_mNm,m2_mNm\n"), "t=t_ms", "q=?_deg", "qd=v*", "tau=m*")
    check("units at the end of names: the table", re.search(r" a_deg +q1 +deg ", said) and re.search(r" qd2 +deg/s ", said), said)
    same("text that holds a separator, in quotes", lines(lambda t, r: ['"warn, 1.0"' if t > 1 else "", t] + r,
                                                         head="text," + PLAIN), *MAP)
    more = "".join(f",more{i}" for i in range(9000))
    same("9,000 columns", lines(lambda t, r: [t] + r + [0] * 9000, head=PLAIN[:-1] + more + "\n"), *MAP)
    row = "ms;deg;deg;rpm;rpm;Nm;Nm\n"
    same("a row of units", lines(in_row, apart=";", head=PLAIN.replace(",", ";") + row), *MAP)
    same("the map before the row of units", lines(lambda t, r: in_row(t, r)[:5] + [1e3 * v for v in r[4:]], apart=";",
                                                  head=PLAIN.replace(",", ";") + row), "q=q?", "qd=qd?", "tau=tau?,mNm")
    turn = 2 * math.pi
    counts = (4096e3, 1024e3, 4096e3, 1024e3)
    same("counts", lines(lambda t, r: [t] + [v / turn * c for v, c in zip(r, counts)] + r[4:]),
         "t=1", "q=2:3,counts/4096e3,1024e3", "qd=4:5,counts/s/4096e3,1024e3", "tau=6:7")
    same("no motor", lines(plain), "t=1", "q=2:3", "qd=4:5", "tau=6,0", tau=False)
    same("no t", lines(lambda t, r: r), "q=1:2", "qd=3:4", "tau=5:6", "dt=0.01")
    same("no t in spite of one", lines(plain), "t=none", "q=2:3", "qd=4:5", "tau=6:7", "dt=0.01")
    missing = lines(plain).split("\n")
    missing[100], missing[150] = missing[100].rsplit(",", 1)[0] + ",nan", missing[150].rsplit(",", 2)[0] + ","
    said = same("numbers that are missing", "\n".join(missing), "t=1", "q=2:3", "qd=4:5", "tau=6:7", "filter=off", bound=1e-4)
    check("numbers that are missing: told", re.search(r"f.csv:101: a number is missing", said) and "missing: 2\n" in said, said)
    # a first row without numbers, rows without any, words of several programs: none of them is a header, or ends the file
    with_units = PLAIN.replace("tau1", "tau1 [mNm]").replace("tau2", "tau2 [mNm]")
    in_mnm = lambda t, r: [t] + r[:4] + [v * 1e3 for v in r[4:]]
    text = lines(in_mnm, head=with_units)
    for word in ("NA", "NULL", "-", "nan", ""):
        row = "-0.01" + ("," + word) * 6 + "\n"
        for what, words in ("names", MAP), ("numbers", by_number):
            said = same(f"a first row of {word or 'nothing'}, {what}", text.replace("\n", "\n" + row, 1), *words)
            check(f"a first row of {word or 'nothing'}, {what}: told", "missing: 1\n" in said and "mNm" in said, said)
    row = ",".join(["NA"] * 7) + "\n"
    same("a first row of NA alone", text.replace("\n", "\n" + row, 1), *MAP)
    same("text below the header", text.replace("\n", "\nsee wiki\n", 1), *by_number)
    without_t = lines(lambda t, r: r + [7], head=PLAIN[2:-1] + ",state\n").split("\n")
    for word in ("NA", "", "nan", "-1.#IND", "1.#QNAN0", "NaT", "\\N", "n.a.", "#VALUE!", "#N/A"):
        for k in (100, 150):
            without_t[k] = ",".join([word] * 6) + ",7"
        said = same(f"no t, rows of {word or 'nothing'}", "\n".join(without_t), *MAP, "t=none", "dt=0.01", "filter=off", bound=1e-4)
        check(f"no t, rows of {word or 'nothing'}: told", "missing: 2\n" in said, said)
    # the last row is cut off
    whole = lines(plain, head=PLAIN)
    for words in MAP, by_number, []:
        for end in "3.00,0.1,0.2,0.3,0.4,0.5,-1.2e", "3.00,0.1,0.2,0.3,0.4,0.5,-", "3.00,0.1,0.2", "3.00,0.1,0.", "3":
            said = same(f"cut off behind {end}, {words[:1]}", whole + end, *words, tau=bool(words))
            check(f"cut off behind {end}, {words[:1]}: told", re.search(
                r"f.csv:302: (the file ends in|\d cells, the first row has 7)", said), said)
    said = same("cut off in a column of text", lines(plain, head=PLAIN[:-1] + ",state\n", more=",moving")[:-4], *MAP)
    check("cut off in a column of text: nothing is lost", not re.search(r"f.csv:\d", said), said)
    # columns of text that the map does not name, more than numbers, which hold another separator
    for what, apart, cells in (("nine", ",", ["OK", "auto", "arm-A", "no fault", "joint", "run", "Mr X", "yes", "on"]),
                               ("with a comma", "\t", ["ok, running"]), ("with a semicolon", ",", ["a;b"])):
        same(f"columns of text, {what}", lines(plain, apart=apart, more=apart + apart.join(cells), head=PLAIN[:-1].replace(
            ",", apart) + "".join(f"{apart}s{k}" for k in range(len(cells))) + "\n"), *MAP)
    # a cell that is lost in the middle: its row is left out, for its neighbours have moved
    more = lambda t, r: [t] + r + [7, 24.1]
    for what, apart, end, kept in (("commas", ",", "", slice(0, 0)), ("commas at the ends of rows", ",", ",,", slice(0, 0)),
                                   ("blanks", " ", "", slice(0, 0)), ("a cell at the end", ",", "", slice(-1, None))):
        rows = lines(more, apart=apart, head=PLAIN[:-1].replace(",", apart) + apart + "current" + apart + "volt\n",
                     more=end).strip("\n").split("\n")
        for k in (100, 150):
            cells = rows[k].split(apart)
            del cells[kept if kept.start else slice(5, 6)]
            rows[k] = apart.join(cells)
        said = same(f"a lost cell, {what}", "\n".join(rows) + "\n", *MAP, "filter=off", bound=1e-4)
        check(f"a lost cell, {what}: told", re.search(r"f.csv:101: \d+ cells, the first row has \d+: a cell is lost", said) and
              "missing: 2\n" in said, said)
    rows = lines(more, head=PLAIN[:-1] + ",current,volt\n").split("\n")
    for k in range(1, 100):
        rows[k] = rows[k].rsplit(",", k % 2 + 1)[0] + ",,"
    said = same("empty cells at the end", "\n".join(rows), *MAP)
    check("empty cells at the end: no row is left out", "left out" not in said, said)
    # a column of text at the end, whose separator some rows lack: used columns are where they were, unless a cell of them is lost
    rows = lines(lambda t, r: [t] + r + ["note"], head=PLAIN[:-1] + ",comment\n").strip("\n").split("\n")
    for k in range(2, len(rows)):
        if k % 3:
            rows[k] = rows[k].rsplit(",", 1)[0]
    said = same("rows without their text", "\n".join(rows) + "\n", *MAP)
    check("rows without their text: no row is left out", "left out" not in said, said)
    for k in (100, 150):  # with its text, and without
        cells = rows[k].split(",")
        del cells[2]
        rows[k] = ",".join(cells)
    said = same("a lost cell in front of text", "\n".join(rows) + "\n", *MAP, "filter=off", bound=1e-4)
    check("a lost cell in front of text: told", "missing: 2\n" in said, said)


def several():
    times = [0.01 * i for i in range(300)]
    folder = f"{DIR}/folder"
    shutil.rmtree(folder, ignore_errors=True)
    order = []
    for k, name in enumerate(("run1.csv", "run2.csv", "run10.csv")):
        part = [t + 0.01 * k for t in times]
        text = table(part).decode()
        if k == 2:      # another order, and another column
            rows = [r.split(",") for r in text.strip().split("\n")]
            text = "\n".join(",".join([r[6], r[5], "0" if i else "state"] + r[:5]) for i, r in enumerate(rows)) + "\n"
        write(text, "folder/" + name)
        order.append(truth(part[0])[0])
    write("nothing", "folder/notes.md")
    write("name,ms\n", "folder/o_errors.csv")
    dt, parts, said = read("a folder", folder, *MAP)
    check("a folder: in the order of numbers", [round(p[0][0], 5) for p in parts] == [round(x, 5) for x in order], said)
    off = max(abs(r[c] - truth(0.02 + 0.01 * i)[c]) for i, r in enumerate(parts[2]) for c in (0, 1, 2, 3, 6, 7))
    check("a folder: a pattern takes the columns of all files in one order", off < 1e-3, off)
    check("a folder: told", re.search(r"folder: 2 other files are not read\n", said), said)
    check("a folder: all of it", "3 files: 3 recordings, 900 samples\n" in said, said)
    dt, parts, said = read("files", f"{folder}/run10.csv", f"{folder}/run1.csv", *MAP)
    check("files", [round(p[0][0], 5) for p in parts] == [round(order[k], 5) for k in (2, 0)], said)

    def trained(what, pattern, *words):
        code, out, err = run("train", *words, "steps=1", f"out={DIR}/o")
        check(what, code in (0, 3) and re.search(pattern, out, re.M), f"ended with {code}: {out[:2500]}{err}")
        return out

    long = write(table([0.01 * i for i in range(2000)]), "long.csv")
    out = trained("one recording is cut into blocks", r"^3 recordings \(1 held out\), 2000 samples", long)
    check("the table, before the training", out.index("column  name") < out.index("Gauss-Newton"), out)
    trained("shorter blocks", r"^7 recordings \(3 held out\), 2000 samples", long, "held=0.15", "look=0.5")
    trained("held=none", r"^2 recordings \(1 held out\), 2200 samples(.*\n)*held=none: errors below are of", long, "held=none")
    trained("blocks of several files", r"^\d+ recordings \(1 held out\), 900 samples", folder, *MAP)
    trained("held= a file", r"^3 recordings \(1 held out\), 900 samples", folder, *MAP, "held=run10.csv")
    trained("held= a pattern", r"^3 recordings \(2 held out\), 900 samples", folder, *MAP, "held=run1*")
    trained("held= two files", r"^3 recordings \(2 held out\), 900 samples", folder, *MAP, "held=run1.csv,run2.csv")
    three = [table([t + 0.1 * k for t in times]) for k in range(3)]
    plain = write(b"\n".join(three), "three.csv")
    trained("several recordings in one file: the last one", r"^3 recordings \(1 held out\), 900 samples", plain)
    short = write(table(times[:2]), "short.csv")
    code, out, err = run("train", short, *MAP, f"out={DIR}/o")
    check("two rows", code == 1 and re.match(r"1 recordings of .*short.csv, 2 samples, and held=0.1: .*\nhint: .*longer", err), err)
    code, out, err = run("train", folder, *MAP, "held=run7.csv", f"out={DIR}/o")
    check("held= no file", code == 1 and "held=run7.csv: no recording is of such a file\nhint: " in err, err)
    code, out, err = run("train", folder, *MAP, "held=run1.csv,run7.csv", f"out={DIR}/o")
    check("held= one that is no file", code == 1 and "held=run7.csv: no recording" in err, err)
    one, two = write(three[0], "one.csv"), write(three[1] + b"\n" + three[0], "two.csv")
    code, out, err = run("train", one, two, f"out={DIR}/o")
    check("a recording twice", code == 1 and re.search(
        r"two.csv:304: the same motion as the recording at .*one.csv:2\nhint: ", err), err)
    code, out, err = run("train", one, two, "steps=1", "held=none", f"out={DIR}/o")
    check("a recording twice, held=none", code in (0, 3), err)
    code, out, err = run("train", f"{DIR}/nowhere", f"out={DIR}/o")
    check("no file", code == 1 and re.match(f"cannot read {DIR}/nowhere: .+\nhint: ", err), err)
    os.makedirs(f"{DIR}/empty", exist_ok=True)
    code, out, err = run("train", f"{DIR}/empty", f"out={DIR}/o")
    check("an empty folder", code == 1 and "no file in it ends in .csv" in err and "hint: " in err, err)
    code, out, err = run("range", folder, f"{DIR}/o", *MAP)
    check("range.c reads the same", code == 0 and "the range of 900 samples" in out, out + err)


def units_of_files():
    """Two files that differ in their units, names or order: read alike, or refused with the name of the file."""
    times = [0.01 * i for i in range(300)]
    folder = f"{DIR}/two"

    def both(first, second, *words, scale=1000):
        shutil.rmtree(folder, ignore_errors=True)
        for name, head, by in (("1.csv", first, 1000), ("2.csv", second, scale)):
            rows = [row_of(t) for t in times]
            write(head + "\n" + "".join("%.9g," % t + ",".join("%.9g" % v for v in r[:4] + [v * by for v in r[4:]]) + "\n"
                                        for t, r in zip(times, rows)), f"two/{name}")
        return run("recording", folder, *words, "N=2", "all=1")

    plain = PLAIN.strip()
    with_units = plain.replace("tau1", "tau1 [mNm]").replace("tau2", "tau2 [mNm]")
    in_nm = with_units.replace("mNm", "Nm")
    unknown = with_units.replace("mNm", "milliNm")
    for what, head in (("no unit", plain), ("an unknown unit", unknown)):
        for files, at in (((with_units, head), 2), ((head, with_units), 2)):
            code, _, err = both(*files, *MAP)
            check(f"{what} in file {1 + (files[1] == head)}", code == 1 and re.match(
                r'.*/2\.csv:2: column 6, tau1, has (.*), but (?!\1)(the unit mNm|no unit|the unknown unit "milliNm") in the first '
                r"file\n"
                r"hint: .*tau=tau\?,mNm\n", err), f"{code} {err}")
            code, _, err = run("train", f"{folder}/1.csv", f"test={folder}/2.csv", *MAP, "steps=1", f"out={DIR}/o")
            check(f"{what} in file {1 + (files[1] == head)}, test=", code == 1 and re.match(
                r".*/2\.csv:2: column 6, tau1, has .* in the first file\nhint: .*tau=tau\?,mNm\n", err), f"{code} {err}")
    for files in (unknown, in_nm), (in_nm, unknown), (unknown, plain), (plain, unknown):
        code, _, err = both(*files, *MAP)
        check("an unknown unit beside Nm or none", code == 1 and re.match(
            r'.*/2\.csv:2: column 6, tau1, has .*the unknown unit "milliNm".* in the first file\nhint: ', err), f"{code} {err}")
    code, out, err = both(unknown, unknown, *MAP)
    check("the same unknown unit", code == 0 and out.count("unknown") == 2, out + err)
    # names that differ far behind their beginning, in another order and another unit
    long = "/a_namespace_of_more_than_forty_letters_in_all/"
    names = "t," + ",".join(long + x for x in ("q[0]", "q[1]", "dq[0]", "dq[1]", "tau[0] [mNm]", "tau[1] [mNm]"))
    swapped = "t," + ",".join(long + x for x in ("q[1]", "q[0]", "dq[1]", "dq[0]", "tau[1] [Nm]", "tau[0] [Nm]"))
    code, out, err = both(names, swapped, f"q={long}q*", f"qd={long}dq*", f"tau={long}tau*", scale=1)
    parts = [[[float(v) for v in line.split()[1:]] for line in part.split("\n")] for part in
             out[out.find("samples\n0:") + 8:].strip().split("\n\n")]
    check("long names in another order", code == 0 and len(parts) == 2 and all(
        abs(a[c] - b[c ^ 1]) < 1e-4 * (abs(a[c]) + 1) for a, b in zip(*parts) for c in range(8)), out[:900] + err)
    check("long names: the table", re.search(r"^ +2  /a_namesp\.\._all/q\[0\]  q1 ", out, re.M) and
          " of the first file" not in out, out)
    check("an index in brackets is no unit", "its unit" not in out, out)
    tables = []
    for order in (0, 1, 2, 3, 4, 5), (1, 0, 3, 2, 5, 4):
        names = ["t"] + [plain.split(",")[1 + k] for k in order]
        other = write(table(times[:200]), "train.csv")
        test = write(",".join(names) + "\n" + "".join("%.9g," % t + ",".join("%.9g" % row_of(t)[k] for k in order) + "\n"
                                                      for t in times), "test.csv")
        code, out, err = run("train", other, f"test={test}", *MAP, "torque=1", "steps=1", f"out={DIR}/o")
        with open(f"{DIR}/o_errors.csv", encoding="utf-8") as f:
            tables.append([line for line in f if "test.csv" in line])
        check("test=: told as a later file is", code in (0, 3) and "test.csv:1: column" not in out, f"{code} {out[-500:]}{err}")
    check("test=: read in the order of the first file", len(tables[0]) > 3 and tables[0] == tables[1], tables)
    code, out, err = both(with_units, in_nm, *MAP, scale=1)
    check("another unit, which is known", code == 0 and "unit" not in out.split("column  name")[0], f"{code} {out[:500]}{err}")
    code, out, _ = both(with_units, in_nm, *MAP[:2], "tau=tau?,mNm")
    told = re.search(r"^.*/2\.csv:1: column 6 is in Nm, but tau=tau\?,mNm says mNm, which counts$", out, re.M)
    check("file and map differ", code == 0 and told and "1.csv:1:" not in out, out[:500])
    code, out, _ = both(plain, plain.replace("tau", "torque"), *MAP[:2], "tau=t*u*")
    check("other names", code == 0 and re.search(
        r"^.*/2\.csv:1: column 6 is called torque1, tau1 of the first file is tau1$", out, re.M), out[:500])
    swapped = plain.replace("tau1,tau2", "tau2,tau1")
    # without a map: names and units of a later file
    for words in [], ["test"]:
        def later(second):
            code, out, err = both(plain.replace("q1,q2", "hip,knee"), second)
            if words and code < 2:
                code, out, err = run("train", f"{folder}/1.csv", f"test={folder}/2.csv", "steps=1", f"out={DIR}/o")
            return code, out, err
        code, _, err = later(plain.replace("q1,q2", "knee,hip"))
        check("no map, names in another order", code == 1 and re.match(
            r".*/2\.csv:1: column 2 is called knee, but stands where hip is in the first file\nhint: ", err), f"{code} {err}")
        code, out, err = later(plain.replace("q1,q2", "hip,ankle"))
        check("no map, other names", code in (0, 3) and out.count(
            "2.csv:1: column 3 is called ankle, that of the first file knee\n") == 1, f"{code} {out[:500]}{err}")
        for second in plain.replace("q1", "hip_deg").replace("q2", "knee_deg"), plain.replace(
                "q1,q2", "hip,knee") + "\ns,deg,deg,deg/s,deg/s,Nm,Nm":
            code, out, err = later(second)
            check("no map, a unit in the second file", code in (0, 3) and re.search(
                r'2\.csv:\d: column 2: its unit "deg" counts with a column map alone', out), f"{code} {out[:500]}{err}")
    write("t,q1,q2,tau1,tau2\n" + "".join("%.2f,%.9g,%.9g,1,2\n" % (t, *row_of(t)[:2]) for t in times), "test.csv")
    write(table(times[:200]), "train.csv")
    code, out, err = run("train", f"{DIR}/train.csv", f"test={DIR}/test.csv", "steps=1", f"out={DIR}/o")
    check("no map, other columns in test=", code in (0, 3) and "test.csv:1: column" not in out, f"{code} {out[:500]}{err}")
    code, out, err = both(plain + "\ns,deg,deg,deg/s,deg/s,Nm,Nm", plain)
    check("no map, a unit in the first file alone", code == 0 and out.count("counts with a column map alone") == 1 and
          'warning: build/logger/two/2.csv:1: no unit here, but "deg" in the file before' in out, out[:500] + err)
    # units of t: of some files alone, unknown, not that of the map
    code, _, err = both("t_ms" + plain[1:], plain, *MAP)
    check("a unit of t in the first file alone", code == 1 and re.match(
        r".*/2\.csv:1: t has no unit, unlike in .*/1\.csv\nhint: .*t=1,ms", err), f"{code} {err}")
    code, _, err = both(plain, "t_ms" + plain[1:])
    check("a unit of t in the second file alone, no map", code == 1 and re.match(
        r".*/2\.csv:1: t has a unit, unlike in .*/1\.csv\nhint: ", err), f"{code} {err}")
    code, _, err = run("train", f"{folder}/1.csv", f"test={folder}/2.csv", *MAP, "steps=1", f"out={DIR}/o")
    check("a unit of t in test= alone", code == 1 and re.match(r".*/2\.csv:1: t has a unit, unlike in .*/1\.csv\n", err), err)
    for head, words in ((plain, ["t=1,ms"]), ("t [s]" + plain[1:], []), ("t [ms]" + plain[1:], ["t=1,s"])):
        code, out, err = both(head, plain, *MAP, *words)
        check(f"units of t that agree: {head[:6]} {words}", code == 0, f"{code} {err}")
    check("a unit of t that is not that of the map",
          out.count("1.csv:1: column 1, t, is in units of 0.001 s, but t= says 1 s") == 1, out)
    for words in MAP, []:
        code, out, _ = both("t [days]" + plain[1:], "t [days]" + plain[1:], *words)
        check("an unknown unit of t", code == 0 and out.count('column 1: the unit "days" of t is unknown') == 1, out[:500])
    shutil.rmtree(folder)
    for name, by in ("1.csv", 1), ("2.csv", 1), ("3.csv", 1000):
        write(table(times, ["%.9g" % (by * t) for t in times]), f"two/{name}")
    code, out, err = run("recording", folder, *MAP, "N=2")
    check("a file of other steps", code == 1 and re.match(
        r".*/3\.csv:2: steps of t are 10 s, but in all recordings 0\.01 s\nhint: .*dt=10\n", err), f"{code} {out[:500]}{err}")
    write(table([1e-3 * t for t in times]), "fast.csv")
    code, out, err = run("recording", f"{DIR}/fast.csv", *MAP, "N=2", "filter=off")
    check("a rate of 100 kHz", "fast.csv: samples are 1e-05 s apart; possible cause: t is not in seconds" in out, out)
    code, _, err = both(plain, swapped, *MAP[:2], "tau=tau1,0")     # the second joint has no motor
    check("names, and a joint without motor", code == 0, err)
    code, out, _ = both(plain, swapped, *MAP[:2], "tau=t?u2,0")
    check("a pattern, and a joint without motor", code == 0 and ".csv:1: column" not in out, out[:500])
    code, out, _ = both(plain, plain, *MAP)
    check("the same names", code == 0 and ".csv:1: column" not in out, out[:500])
    text = "t,q1,q2,qd1,qd2,tau1,tau2,temperature\ns,deg,deg,deg/s,deg/s,Nm,Nm,\n"
    rows = [row_of(t) for t in times]
    text += "".join(",".join("%.9g" % v for v in [t] + [v * 180 / math.pi for v in r[:4]] + r[4:] + [20]) + "\n"
                    for t, r in zip(times, rows))
    dt, parts, said = read("a row of units whose last cell is empty", write(text), *MAP)
    check("a row of units whose last cell is empty: read", parts and all(
        abs(r[c] - w[c]) < 1e-4 for r, w in zip(parts[0], rows) for c in range(4)), said[:300])


# ---- delay ----

def late(rate, delay, held, seconds=10, bits=0, noise=0.0, qd=True):
    """Recordings of torques that act `delay` s after their stamp: held from a sample to the next, or as a sensor measures them."""
    h, rng, text = 0.0005, random.Random(5), PLAIN if qd else "t,q1,q2,tau1,tau2\n"
    for run_of in range(3):
        def sent(j, t):
            return torque(j, (math.floor(t * rate + 1e-6) / rate if held else t) + 31 * run_of)
        x = [0.4, -0.7, 0, 0]
        every = round(1 / rate / h)
        for i in range(int(seconds / h)):
            t = i * h
            if i % every == 0:
                step = 2 * math.pi / (1 << bits) if bits else 0
                q = [math.floor(v / step + 0.5) * step if bits else v for v in x[:2]]
                tau = [sent(j, t) + noise * rng.gauss(0, 1) for j in (0, 1)]
                text += ",".join("%.10g" % v for v in [t, *q, *(x[2:] if qd else []), *tau]) + "\n"
            tau = [sent(j, t + h / 2 - delay) for j in (0, 1)]   # held within every h
            a = [tau[j] - STIFF[j] * math.sin(x[j]) - 0.1 * x[2 + j] for j in (0, 1)]
            m = [x[j] + h / 2 * x[2 + j] for j in (0, 1)] + [x[2 + j] + h / 2 * a[j] for j in (0, 1)]
            b = [tau[j] - STIFF[j] * math.sin(m[j]) - 0.1 * m[2 + j] for j in (0, 1)]
            x = [x[j] + h * m[2 + j] for j in (0, 1)] + [x[2 + j] + h * b[j] for j in (0, 1)]
        text += "\n"
    return write(text, "late.csv")


def delays():
    short = ("torque=1", "seconds=1", "steps=1", "threads=1", f"out={DIR}/o")

    def torque_error(out):
        told = re.search(r"torque error in validation blocks: ([\d.]+) %", out)
        return float(told[1]) if told else math.inf

    for what, rate, ms, held, bound, more in (
            ("1 kHz", 1000, 0, True, 0.1, {}), ("1 kHz", 1000, 2.5, True, 0.1, {}), ("1 kHz", 1000, 12, True, 0.1, {}),
            ("100 Hz", 100, 2.5, True, 1, {}), ("100 Hz", 100, 5, True, 1, {}),
            ("1 kHz, measured", 1000, 0, False, 0.1, {}), ("1 kHz, measured", 1000, 5, False, 0.1, {}),
            ("100 Hz, measured", 100, 12, False, 1, {}), ("too early", 1000, -3, False, 0.1, {}),
            ("14 bits", 1000, 5, True, 1, {"bits": 14, "qd": False}), ("14 bits", 1000, 0, True, 1, {"bits": 14, "qd": False}),
            ("noise", 1000, 12, False, 2, {"bits": 14, "qd": False, "noise": 0.3})):
        name = f"delay, {what}, {ms} ms"
        path = late(rate, ms / 1e3, held, **more)
        columns_of = [] if held else MAP if more.get("qd", True) else [MAP[0], MAP[2]]
        code, out, err = run("train", path, *columns_of, "delay=auto", *short)
        told = re.search(r"^delay: (none, of )?(\S+) \+- (\S+) ms", out, re.M)
        check(f"{name}: told", code in (0, 3) and told, f"{code} {out[:1500]}{err}")
        if not told:
            continue
        found, within = float(told[2]), float(told[3])
        check(f"{name}: found", abs(found - ms) <= within < bound, told[0])
        check(f"{name}: used", (told[1] is None) == (ms != 0), told[0])
        with open(f"{DIR}/o_weights.h", encoding="utf-8") as f:
            written = re.search(r"^#define two_DELAY ROLN_C\((\S+)\)$", f.read(), re.M)
        off = abs(float(written[1]) * 1e3 - (found if ms else 0)) if written else math.inf
        check(f"{name}: written", off < 0.01 * abs(found) + 1e-9, told[0])
        if ms in (12, -3) and not more:     # what shifts is what acts
            _, as_it_is, _ = run("train", path, *columns_of, *short)
            _, shifted, _ = run("train", path, *columns_of, f"delay={ms / 1e3}", *short)
            check(f"{name}: torques fit", torque_error(shifted) < 0.1 * torque_error(as_it_is) and
                  abs(torque_error(shifted) - torque_error(out)) < 0.1 * torque_error(as_it_is),
                  f"{torque_error(as_it_is)} {torque_error(shifted)} {torque_error(out)}")
            samples = [int(re.search(r"held out\), (\d+) samples", o)[1]) for o in (as_it_is, shifted)]
            lost = 3 * math.ceil(abs(ms) / 1e3 * rate) - 9, 3 * math.ceil(abs(ms) / 1e3 * rate) + 9
            check(f"{name}: samples", lost[0] <= samples[0] - samples[1] <= lost[1] or not held, samples)
    path = write(table([0.01 * i for i in range(300)]))
    code, out, err = run("train1", path, "torque=1", "delay=auto", f"out={DIR}/o")
    check("delay, an autoencoder", code == 1 and "delay=auto is for models whose coordinates are the joints" in err and
          "\nhint: " in err, err)
    for what, words, want in (("no number", ["delay=soon", "torque=1"], r"delay=soon: a number of seconds, -10 .. 10, or auto"),
                              ("no torques", ["delay=0.005"], r"delay=0.005 shifts the torques, but torque=0 does not use them"),
                              ("too long", ["delay=4", "torque=1"], r".*f.csv: no recording is longer than the delay of 4 s")):
        code, out, err = run("train", path, *words, f"out={DIR}/o")
        check(f"delay, {what}", code == 1 and re.match(want, err) and "\nhint: " in err, f"ended with {code}: {out[:400]}{err}")


# ---- refusals ----

def refusals():
    times = [0.01 * i for i in range(100)]
    path = write(table(times))
    bare = write(table(times, head=""), "bare.csv")
    coarse = write(table(times, ["%.1f" % (t + 0.04 * math.sin(1e5 * t)) for t in times]), "coarse.csv")
    coarse_map = ["t=1", "q=2:3"]
    for what, words, want in (
            ("too few columns", [bare, "t=1", "q=2"], r".*bare.csv:1: q=2 is 1 columns, but the model has 2 joints"),
            ("too many columns", [bare, "t=1", "q=2:4"], r".*q=2:4 is 3 columns, but the model has 2 joints"),
            ("a column that is not there", [bare, "t=1", "q=7:8"], r".*bare.csv:1: 7 columns, but q=7:8 asks for column 8"),
            ("a range that goes down", [bare, "t=1", "q=3:2"], r'q=3:2: "3:2" is no range of columns'),
            ("column 0", [bare, "t=1", "q=0,2"], r'q=0,2: "0" is no range of columns'),
            ("a pattern of too many", [path, "q=q*"],
             r".*f.csv:2: q=q\* is 4 columns: q1, q2, qd1, qd2, but the model has 2 joints"),
            ("no such name", [path, "q=pos*"], r'.*f.csv:1: no column is called "pos\*", which q=pos\* asks for'),
            ("a name without header", [bare, "t=1", "q=pos*"],
             r'q=pos\*: "pos\*" is a name or an unknown unit, but the file has no header'),
            ("an unknown unit", [bare, "t=1", "q=2:3,grad"], r'q=2:3,grad: "grad" is a name or an unknown unit'),
            ("a unit of something else", [bare, "t=1", "q=2:3,Nm"], r'q=2:3,Nm: "Nm" is a name or an unknown unit'),
            ("counts of what", [bare, "t=1", "q=2:3,counts"], r'q=2:3,counts: "counts" needs the counts per turn'),
            ("a gain that is none", [bare, "t=1", "q=2:3", "tau=6:7,A*x"], r'tau=6:7,A\*x: "x" is no gain'),
            ("three gains", [bare, "t=1", "q=2:3", "tau=6:7,A*1,2,3"], r"tau=6:7,A\*1,2,3: 3 gains for 2 columns"),
            ("columns behind the unit", [bare, "t=1", "q=2,rad,3"], r'q=2,rad,3: "3" stands behind the unit'),
            ("a column twice", [bare, "t=1", "q=2:3", "qd=3:4"], r".*bare.csv:1: column 3 is used twice, by q=2:3 and qd=3:4"),
            ("a separator inside text", [write(table(times, head="text," + PLAIN).replace(b"\n0", b"\n,0").replace(b"\n,0.5,",
                b"\nwarn, 1.0,0.5,"), "w.csv"), *MAP], r".*w.csv:52: 9 columns, the header has 8\nhint: .* in quotes"),
            ("another header with a word that is a unit", [write(b"".join(
                head + table(times, head="").replace(b"\n", b",1\n") for head in (
                    b"t,q1,q2,qd1,qd2,tau1,tau2,counts\n", b"t,q2,q1,qd2,qd1,tau2,tau1,counts\n")), "h.csv"), *MAP],
             r'.*h.csv:102: expected numbers, found "t,q2,q1,.*\nhint: another header'),
            *[(f"{what}, {'a map' if words else 'no map'}", [write("".join(
                PLAIN + units + table(times, head="").decode() for units in (first, second)), f"u{at}.csv"), *words],
               rf'.*u{at}.csv:{line}: units unlike those below line 1\nhint: the same row of units')
              for words in (MAP, []) for at, (what, first, second, line) in enumerate((
                  ("two rows of units, Nm and mNm", "s,rad,rad,rad/s,rad/s,Nm,Nm\n", "s,rad,rad,rad/s,rad/s,mNm,mNm\n", 104),
                  ("two rows of units, s and ms", "s,rad,rad,rad/s,rad/s,Nm,Nm\n", "ms,rad,rad,rad/s,rad/s,Nm,Nm\n", 104),
                  ("a row of units below the second header alone", "", "s,rad,rad,deg/s,deg/s,Nm,Nm\n", 103),
                  ("a row of units below the first header alone", "s,rad,rad,rad/s,rad/s,Nm,Nm\n", "", 104)))],
            ("a row of units between samples", [
                write(table(times).replace(b"\n0.5,", b"\ns,rad,rad,rad/s,rad/s,Nm,Nm\n0.5,"), "u.csv"), *MAP],
             r'.*u.csv:52: expected numbers, found "s,rad'),
            ("which is the time", [bare, "q=2:3"], r".*bare.csv:1: no column is called a time\nhint: name it: t=1, say"),
            ("two times", [write(table(times, head=PLAIN[:-1] + ",t_motor\n").replace(b"\n", b",31\n").replace(
                b"t_motor,31", b"t_motor"), "t.csv"), *MAP],
             r'.*t.csv:1: columns 1 and 8, "t" and "t_motor", are both called a time\nhint: name the one that counts: t=1'),
            ("units behind blanks in the header", [write(table(times, head="Time q1 [rad] q2 [rad] qd1 qd2 tau1 tau2\n").replace(
                b",", b" "), "n.csv"), *MAP], r".*n.csv:1: 9 names, but 7 columns in line 2\nhint: one name a column"),
            ("a map without q", [bare, "qd=4:5"], r".*bare.csv: a column map needs q="),
            ("no torques", [path, "q=q?", "qd=qd?", "torque=1"], r".*f.csv:2: torque=1 needs tau="),
            ("text", [write(table(times).replace(b"\n0.5,", b"\n0.5,x"), "x.csv"), *MAP],
             r'.*x.csv:52: column 2: expected a number, found'),
            ("a second file of fewer columns", [path, bare, "t=1", "q=2:3", "tau=8:9"],
             r".*f.csv:2: 7 columns, but tau=8:9 asks for column 8"),
            ("a dt far too short", [path, *MAP, "dt=0.001"], r".*f.csv: dt=0.001, but samples are 0.01 s apart"),
            ("a filter beyond the samples", [path, *MAP, "filter=40"],
             r".*f.csv: filter=40, but samples every 0.01 s allow 25.9 Hz"),
            ("a filter longer than the recording", [path, *MAP, "filter=0.5"], r".*f.csv: no recording is longer than the filter"),
            ("a filter and smooth=", [path, *MAP, "filter=5", "smooth=3"], r".*f.csv: smooth=3 and filter=5"),
            ("a filter of letters", [path, *MAP, "filter=low"], r"filter=low: expected a frequency in Hz, off or auto"),
            ("stamps that are too coarse", [coarse, *coarse_map],
             r".*coarse.csv: \d+ of \d+ steps of t are 0; possible cause: too few digits of t|"
             r".*coarse.csv:\d+: t goes back")):
        code, out, err = run("recording", *words, "N=2")
        check(what, code == 1 and re.match(want, err) and "\nhint: " in err, f"ended with {code}: {out[:400]}{err}")


def main():
    os.chdir(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
    os.makedirs(DIR, exist_ok=True)
    with open(f"{DIR}/two.h", "w") as f:
        f.write('#define ROLN_NAME two\n#define ROLN_AE 2\n#define ROLN_MLP 4\n#include "roln.h"\n')
    with open(f"{DIR}/one.h", "w") as f:
        f.write('#define ROLN_NAME one\n#define ROLN_AE 2, 1\n#define ROLN_MLP 4\n#include "roln.h"\n')
    for source, out, more in ((f"tests/user/recording.c", "recording", CHECKED), ("examples/train.c", "train", ["-DMODEL=two"]),
                              ("examples/train.c", "train1", ["-DMODEL=one"]),
                              ("examples/range.c", "range", ["-DMODEL=two"])):
        subprocess.run(["gcc", *FLAGS, *more, source, "-o", f"{DIR}/{out}", "-lpthread", "-lm"], check=True)
    os.environ["ASAN_OPTIONS"] = "detect_leaks=0"       # a program that ends does not give back
    clocks()
    noise()
    columns()
    several()
    units_of_files()
    delays()
    refusals()
    print(f"{passed} passed, {failed} failed")
    return failed > 0


sys.exit(main())
