#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Mutants of the five headers: small faults, put in one at a time, that the unit tests have to find.

    mutants.py [COUNT] [SEED]   judges a sample of COUNT mutants, half of it from what must not fail: the guard and the tick,
                                limits, packed bytes. Its results stay in build/mutants/results.STATE, one for each state of
                                the headers: what was killed is not judged again, so that a call that was ended goes on, and
                                larger samples contain smaller ones. For a release, after tests were taken away: make clean.
    mutants.py quick            those of QUICK below, a minute or two; and the headers have every mutant of mutants.txt

A mutant is one token, condition or statement changed in the body of one function. It is killed if a test file fails, crashes or
takes ten times as long; those that cover its section as float, then as double, then under the address and undefined sanitizers of
the step sanitize-au; all others as float, then under these sanitizers. One that does not compile is none; one of which the compiler
makes the same object is equivalent, and so is one in mutants.txt, with the reason. Last line: N passed, N failed: of the quick ones
each; else two checks, all killed of what must not fail, and 97 % of all."""

import hashlib
import os
import random
import re
import shutil
import subprocess
import sys
import time

import headers
from headers import HEADERS

# test files of each section, those that find most first; what they let live is asked of all others
TESTS = {
    "roln.h": {1: "units roln pack", 2: "guard limits tick feedback", 3: "riccati", 4: "ocp", 5: "filter plan feedback",
               6: "gradient rows measures doubt", 7: "pack safety", 8: "pack units", 9: "scratch safety",
               10: "tick guard control feedback driven actuator doubt", 11: "control linear driven actuator doubt",
               12: "feedback filter observer delay", 13: "plan driven robust", 14: "measures",
               15: "limits filter doubt noise observer", 16: "gradient rows", 17: "measures roln chart_model", 18: "chart_model",
               19: "pack safety", 20: "scratch"},
    "roln_ae.h": {1: "ae ae_stored", 2: "ae", 3: "ae chart", 4: "ae chart", 5: "ae chart", 6: "ae chart", 7: "ae chart",
                  8: "ae_stored ae pack", 9: "ae", 10: "chart"},
    "roln_lnn.h": {i: "lnn lnn_edges lnn_motion stiction" for i in range(1, 6)},
    "roln_riem.h": {1: "riem lbfgs", 2: "riem", 3: "riem", 4: "riem", 5: "riem", 6: "newton dense", 7: "newton", 8: "lbfgs"},
    "roln_spd.h": {2: "elementary dense spd", 3: "dense", 4: "elementary", 5: "dense riccati", 6: "eig", 7: "spd", 8: "spd",
                   9: "chart sums dense"},
}
# what must not fail: sections of roln.h, and functions elsewhere in it
CRITICAL_SECTIONS = {2: "guard and tick", 7: "packed bytes", 10: "guard and tick", 19: "packed bytes"}
CRITICAL_FUNCTIONS = {"NAME_fit_limits": "limits", "NAME_i_fit_seen": "limits"}
QUICK = [ # function, what stands there, what takes its place
    ("rolni_clip", "want < low ? low", "want <= low ? high"),
    ("rolni_last", "ROLN_ABS(tau) <= rolni_most(limits, i)", "ROLN_ABS(tau) >= rolni_most(limits, i)"),
    ("rolni_safe", "safe < -top ? -top", "safe < -top ? top"),
    ("rolni_all_within", "bound > 0", "bound < 0"),
    ("rolni_unbalanced", "before + g->power", "before - g->power"),
    ("NAME_i_guard", "g->bad >= limits->hold", "g->bad > limits->hold"),
    ("NAME_tick", "st == ROLN_OK ? tau : NULL", "tau"),
    ("NAME_i_in_range", "x - p->z_max[i] <= room", "x - p->z_max[i] >= room"),
    ("roln_unpack", "return ROLN_E_CHECKSUM", "return ROLN_OK"),
]
GCC = "gcc -std=c99 -D_POSIX_C_SOURCE=200809L -ffp-contract=off -O1 -w".split()
SANITIZED = GCC + ["-fsanitize=address,undefined,bounds-strict,float-cast-overflow", "-fno-sanitize-recover=all"]
DIR = "build/mutants"
CONTROL = re.compile(r"(break|continue|return\b[^;]*);$")
DECLARES = re.compile(r"(const|static|roln\w*(?! *\()\b(?= +\*?\w)|int|double|float|size_t|u?int\d+_t|unsigned|enum|struct|"
                      r"ROLNI?_\w*(MEM|LAY)\b|ROLNI?_\(\w+\) \*?\w)")


class Function:
    """The body of a function: header, section, name, first and last line (counted from 0, within the braces)."""

    def __init__(self, header, section, name, first, last):
        self.header, self.section, self.name, self.first, self.last = header, section, name, first, last

    def kind(self):
        if self.header != "roln.h":
            return ""
        return CRITICAL_FUNCTIONS.get(self.name, CRITICAL_SECTIONS.get(self.section, ""))


class Mutant:
    def __init__(self, function, line, old, new):
        self.function, self.line, self.old, self.new = function, line, old, new
        text = "\n".join((function.header, function.name, old.strip(), new.strip()))
        self.id = hashlib.sha256(text.encode()).hexdigest()[:16]

    def __str__(self):
        return "%s %s\n- %s\n+ %s" % (self.function.header, self.function.name, self.old.strip(), self.new.strip())


def functions(header, text, bare):
    """Bodies between braces in the first column, below a line with the name."""
    found, section, signature, first = [], 0, "", None
    for i, (line, code) in enumerate(zip(text.split("\n"), bare.split("\n"))):
        heading = re.match(r"/\* ---- (\d+) ", line)
        if heading:
            section = int(heading.group(1))
        if code.startswith("{"):
            first = i + 1
        elif code.startswith("}") and first is not None:
            name = re.findall(r"(?:ROLN_FN|ROLNI?_INLINE)\b[^()]*?(\w+)\(", headers.named(signature))
            if name:
                found.append(Function(header, section, name[-1], first, i))
            first, signature = None, ""
        elif first is None:
            signature = signature + " " + code if code.strip() else ""
    return found


def changes(code, line):
    """Every line that this one may become; code is the line without comments."""
    def put(start, end, new):
        return line[:start] + new + line[end:]

    swaps = {" < ": " <= ", " <= ": " < ", " > ": " >= ", " >= ": " > ", " == ": " != ", " != ": " == ",
             " && ": " || ", " || ": " && ", " + ": " - ", " - ": " + ", " * ": " / ", " / ": " * ", " += ": " -= ", " -= ": " += ",
             " *= ": " /= ", " /= ": " *= ",
             " |= ": " &= ", " &= ": " |= ", " | ": " & ", " & ": " | ", "++": "--", " ^ ": " | ", " << ": " >> ", " >> ": " << "}
    for old, new in swaps.items():
        for m in re.finditer(re.escape(old), code):
            yield put(m.start(), m.end(), new)
    for m in re.finditer(r"(?<![\w.\"])(\d+)(?![\w.\"])", code):  # whole numbers
        value = int(m.group(1))
        for new in {value + 1, value - 1 if value > 0 else 1, 0} - {value}:
            yield put(m.start(), m.end(), str(new))
    for m in re.finditer(r"ROLN_C\(([\d.e+-]+)\)", code):
        yield put(m.start(), m.end(), "ROLN_C(0.0)")
        yield put(m.start(), m.end(), "(2 * %s)" % m.group())
    for m in re.finditer(r"\bif \(", code):
        depth, end = 1, m.end()
        while end < len(code) and depth:
            depth += {"(": 1, ")": -1}.get(code[end], 0)
            end += 1
        if depth == 0:
            yield put(m.end(), end - 1, "!(" + line[m.end():end - 1] + ")")
            rest = code[end:].strip()
            if CONTROL.fullmatch(rest):
                yield put(end, len(code.rstrip()), " {}")
    for m in re.finditer(r"(?<![\w.>])([nN])(?![\w(])", code):
        yield put(m.start(), m.end(), "nN"[m.group() == "n"])
    statement = code.strip()
    if statement.endswith(";") and not DECLARES.match(statement) and statement.count("(") == statement.count(")"):
        if re.match(r"(break|continue);", statement) or re.match(r"[\w*(]", statement) and not re.match(
                r"(if|for|while|else|return|switch|case|default|do)\b", statement):
            at = len(code) - len(code.lstrip())
            yield put(at, len(code.rstrip()), ";")


def everything():
    """All mutants, in the order of the headers."""
    found, seen = [], set()
    for header in HEADERS:
        with open(header) as source:
            text = source.read()
        bare = headers.code(text)
        lines, codes = text.split("\n"), bare.split("\n")
        for f in functions(header, text, bare):
            if f.section not in TESTS[header]:
                sys.exit("mutants.py: no tests for section %d of %s\n0 passed, 1 failed" % (f.section, header))
            for i in range(f.first, f.last):
                for new in changes(codes[i], lines[i]):
                    m = Mutant(f, i, lines[i], new)
                    if m.id not in seen:
                        seen.add(m.id)
                        found.append(m)
    return found


def run(command, limit=None):
    """Exit code, None if it took too long; nothing is printed."""
    try:
        return subprocess.run(command, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=limit).returncode
    except subprocess.TimeoutExpired:
        return None


class Bench:
    """Test files compiled and run, with the headers as they are or with a mutant among them."""

    def __init__(self):
        shutil.rmtree(DIR + "/include", ignore_errors=True)
        os.makedirs(DIR + "/include")
        for header in HEADERS:
            shutil.copy(header, DIR + "/include")
        with open(DIR + "/main.c", "w") as out:  # ends with the first check that fails
            out.write('#include <stdlib.h>\n#include "tests/unit/check.h"\n'
                      "long check_passed, check_failed;\nint check_sample = 1;\n"
                      "void TEST(void);\nint main(void) { TEST(); return check_passed == 0; }\n"
                      "static int ok(int is) { if (!is) exit(1); check_passed++; return 1; }\n"
                      "int check_that(int is, const char *w, const char *f, int l) { (void)w, (void)f, (void)l; return ok(is); }\n"
                      "int check_near(double a, double b, double t, const char *w, const char *f, int l)\n"
                      "{ (void)w, (void)f, (void)l; return ok(a - b <= t && b - a <= t); }\n"
                      "int check_below(double a, double b, const char *w, const char *f, int l)\n"
                      "{ (void)w, (void)f, (void)l; return ok(a <= b); }\n")
        self.seconds, self.texts = {}, {}

    def compile(self, test, bits, to, compiler=GCC):
        double = ["-DROLN_DOUBLE", "-DROLN_SIMD=0"] if bits == 64 else []  # as in coverage.py
        source = "tests/unit/test_%s.c" % test
        return run(compiler + double + ["-I" + DIR + "/include", "-I.", "-Iexamples", "-c", source, "-o", to]) == 0

    def clean(self, test, bits):
        """The object with the headers as they are."""
        path = "%s/%s%d.o" % (DIR, test, bits)
        newest = max(os.path.getmtime(f) for f in HEADERS + ["tests/unit/" + f for f in os.listdir("tests/unit")])
        if not os.path.exists(path) or os.path.getmtime(path) < newest:
            if not self.compile(test, bits, path):
                sys.exit("test_%s.c does not compile\n0 passed, 1 failed" % test)
        return path

    def judge(self, test, bits, path, limit, compiler=GCC):
        """Exit code of the program that an object makes with the clean one of the other type, which may hold its reference; "none"
        if they do not link."""
        program = "%s/%s%d" % (DIR, test, bits)
        other = self.clean(test, 96 - bits)
        test_is = "-DTEST=test_%s_f%d" % (test, bits)
        if run(compiler + ["-I.", test_is, path, other, DIR + "/main.c", "-o", program, "-lm"]) != 0:
            return "none"
        return run([program], limit)

    def limit(self, test, bits, compiler=GCC):
        """Ten times as long as without a mutant, which must pass."""
        key = test, bits, compiler == GCC
        if key not in self.seconds:
            path = self.clean(test, bits)
            if compiler != GCC:
                path = DIR + "/sanitized.o"
                if not self.compile(test, bits, path, compiler):
                    sys.exit("test_%s.c does not compile\n0 passed, 1 failed" % test)
            self.clean(test, 96 - bits)
            start = time.time()
            if self.judge(test, bits, path, None, compiler) != 0:
                sys.exit("test_%s fails without a mutant\n0 passed, 1 failed" % test)
            self.seconds[key] = time.time() - start
        return 10 * self.seconds[key] + 5

    def mutate(self, m):
        with open(m.function.header) as source:
            lines = source.read().split("\n")
        lines[m.line] = m.new
        with open(DIR + "/include/" + m.function.header, "w") as out:
            out.write("\n".join(lines))

    def restore(self, m):
        shutil.copy(m.function.header, DIR + "/include")

    def build(self, m, test, bits, compiler=GCC):
        """The object with a mutant, None if it does not compile."""
        path = DIR + "/mutant.o"
        self.mutate(m)
        compiled = self.compile(test, bits, path, compiler)
        self.restore(m)
        return path if compiled else None

    def preprocessed(self, test, bits):
        """The hash of a test file as the preprocessor leaves it."""
        path = DIR + "/mutant.i"
        self.compile(test, bits, path, GCC + ["-E", "-P"])
        with open(path, "rb") as text:
            return hashlib.sha256(text.read()).digest()

    def unseen(self, m, test, bits):
        """True if the preprocessor removes the mutant, as it does with code of other machines."""
        key = test, bits
        if key not in self.texts:
            self.texts[key] = self.preprocessed(test, bits)
        self.mutate(m)
        text = self.preprocessed(test, bits)
        self.restore(m)
        return text == self.texts[key]

    def result(self, m):
        """killed, survived, same (the same objects) or none (it does not compile or link), and by which file."""
        tests = TESTS[m.function.header][m.function.section].split()
        others = sorted(f[5:-2] for f in os.listdir("tests/unit") if f.startswith("test_") and f[5:-2] not in tests)
        asked = [(t, bits, GCC) for bits in (32, 64) for t in tests] + [(t, 32, SANITIZED) for t in tests]
        asked += [(t, 32, compiler) for compiler in (GCC, SANITIZED) for t in others]
        differs = set()
        for test, bits, compiler in asked:
            if compiler == SANITIZED and test not in differs:
                continue
            if compiler == GCC and self.unseen(m, test, bits):
                continue
            mutated = self.build(m, test, bits, compiler)
            if compiler == GCC and not mutated:
                return "none", ""
            if compiler == GCC:
                with open(mutated, "rb") as a, open(self.clean(test, bits), "rb") as b:
                    if a.read() == b.read():
                        continue
                differs.add(test)
            code = self.judge(test, bits, mutated, self.limit(test, bits, compiler), compiler) if mutated else 0
            if code == "none" and compiler == GCC:
                return "none", ""
            if code not in (0, "none"):
                return "killed", test + (str(bits) if compiler == GCC else " sanitized")
        return ("survived" if differs else "same"), ""


def equivalents():
    """{id: (mutant, reason)} of mutants.txt: header and function, - line, + line, reason."""
    found = {}
    with open("tests/safety/mutants.txt") as text:
        for block in text.read().split("\n\n"):
            lines = [line for line in block.split("\n") if line and not line.startswith("#")]
            if not lines:
                continue
            where, old, new = lines[:3]
            if old[:2] != "- " or new[:2] != "+ " or len(lines) < 4:
                sys.exit("mutants.txt: %s\n0 passed, 1 failed" % where)
            key = "\n".join(where.split() + [old[2:], new[2:]])
            found[hashlib.sha256(key.encode()).hexdigest()[:16]] = " ".join(lines[:3]), " ".join(lines[3:])
    return found


def stale(mutants):
    """How many mutants of mutants.txt the headers have no longer; each with a line."""
    there = {m.id for m in mutants}
    gone = [text for key, (text, _) in equivalents().items() if key not in there]
    for text in gone:
        print("mutants.txt: no such mutant: %s" % text)
    return len(gone)


def quick(bench, mutants):
    failed = stale(mutants)
    passed, killed = int(failed == 0), 0
    lines = {(m.function.name, m.old): m for m in mutants}
    for name, old, new in QUICK:
        at = [m for (f, text), m in lines.items() if f == name and text.count(old) == 1]
        if len(at) != 1:
            print("%s: %d lines with %s" % (name, len(at), old))
            failed += 1
            continue
        m = Mutant(at[0].function, at[0].line, at[0].old, at[0].old.replace(old, new))
        state, by = bench.result(m)
        print("%s: %s for %s: %s %s" % (name, new, old, state, by), flush=True)
        killed += state == "killed"
        failed += state != "killed"
    print("figure: %d of %d mutants killed" % (killed, len(QUICK)))
    return passed + killed, failed


def state_of_headers():
    """Of the headers: another one begins anew."""
    sums = hashlib.sha256()
    for path in HEADERS:
        with open(path, "rb") as text:
            sums.update(text.read())
    return sums.hexdigest()[:8]


def sample(bench, mutants, count, seed):
    known = {}
    path = "%s/results.%s" % (DIR, state_of_headers())
    if os.path.exists(path):
        with open(path) as text:
            known = {line.split()[0]: line.split()[1] for line in text if line.strip()}
    reasons = equivalents()
    groups = [[m for m in mutants if m.function.kind()], [m for m in mutants if not m.function.kind()]]
    chosen = []
    for group in groups:
        random.Random(seed).shuffle(group)
    for pair in zip(*groups):
        chosen += pair
    judged = []
    with open(path, "a") as out:
        for m in chosen:
            if len(judged) == count:
                break
            state = known.get(m.id)
            if m.id in reasons:
                state = "equivalent"
            elif state in (None, "survived"):
                state, by = bench.result(m)
                out.write("%s %s %s\n" % (m.id, state, by))
                out.flush()
                if state == "survived":
                    print("%s\nline %d, survived\n" % (m, m.line + 1), flush=True)
            if state != "none":
                judged.append((m, state))
    passed = 0
    for what, least, wanted in (("what must not fail", 1, lambda m: m.function.kind()),
                                ("the others", 0.97, lambda m: not m.function.kind())):
        states = [s for m, s in judged if wanted(m)]
        killed, survived = states.count("killed"), states.count("survived")
        print("%s: %d of %d killed, %.1f %%; equivalent: %d by the compiler, %d by a reason" %
              (what, killed, killed + survived, 100 * killed / max(1, killed + survived), states.count("same"),
               states.count("equivalent")))
        passed += killed > 0 and killed >= least * (killed + survived)
    for kind in sorted({m.function.kind() or m.function.header for m, _ in judged}):
        states = [s for m, s in judged if (m.function.kind() or m.function.header) == kind]
        print("    %-16s %d killed, %d survived" % (kind, states.count("killed"), states.count("survived")))
    return passed, 2 - passed + stale(mutants)


def main():
    os.chdir(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
    os.makedirs(DIR, exist_ok=True)
    mutants = everything()
    bench = Bench()
    if sys.argv[1:] == ["quick"]:
        passed, failed = quick(bench, mutants)
    else:
        count, seed = (int(a) for a in (sys.argv[1:] + ["100", "1"][len(sys.argv) - 1:]))
        print("%d mutants, %d of them of what must not fail" % (len(mutants), sum(bool(m.function.kind()) for m in mutants)))
        passed, failed = sample(bench, mutants, count, seed)
    print("%d passed, %d failed" % (passed, failed))
    sys.exit(failed > 0)


main()
