#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""Lines, branches and conditions (MC/DC) of the five headers that the unit tests run: 100 % of each, or a reason in unreached.txt.

Everything is compiled by clang 19 from the source, so that inlining and optimisation do not move what is counted, as float with
vector kernels and as double with plain ones (cov32 and cov64 of the Makefile); what one of the builds, test files or instances of
the typed shell runs has been run.
    line       run if everything that begins or goes on in it was run: of `if (a) return b;` also the return
    branch     a condition was true, and was false; one that is constant in every build is none
    condition  of a && or ||: a pair of runs shows that it alone changes the outcome (masking MC/DC), as clang finds it
A line in unreached.txt is exempt, and is an error where nothing is missing or where its function has not one such line. -v lists
these with what is missing.
Last line: N passed, N failed, a check for each measure of each header, one for its reasons, and one for how much they exempt."""

import json
import os
import re
import subprocess
import sys

import headers
from headers import HEADERS

EXEMPT = 68            # by reasons; another number is an error, so that none covers what came later on its line
CODE, EXPANSION = 0, 1  # kinds of regions
CONDITION = 6           # kind of a branch that belongs to a && or ||
MEASURES = ["lines", "branches", "conditions"]


def run(*command, **more):
    done = subprocess.run(command, **more)
    if done.returncode != 0:
        sys.exit("%s: exit code %d\n0 passed, 1 failed" % (" ".join(command), done.returncode))


def measure():
    """Build, run and export what was run, as a dict."""
    run("make", "-s", "build/test_cov")
    with open("build/test_cov.log", "w") as log:
        run("build/test_cov", "sample", stdout=log, env=dict(os.environ, LLVM_PROFILE_FILE="build/test_cov.profraw"))
    run("llvm-profdata-19", "merge", "-sparse", "build/test_cov.profraw", "-o", "build/test_cov.profdata")
    with open("build/test_cov.json", "w") as out:
        run("llvm-cov-19", "export", "build/test_cov", "-instr-profile", "build/test_cov.profdata", stdout=out)
    with open("build/test_cov.json") as text:
        return json.load(text)["data"][0]["functions"]


def inside(place, region):
    """Both (line, column, line, column)."""
    return region[:2] <= place[:2] and place[2:] <= region[2:]


class Function:
    """One function in one object: its parts, and where they are written; those of a macro stand where it is defined."""

    def __init__(self, record):
        self.files = [os.path.basename(f) for f in record["filenames"]]
        self.regions = [(tuple(r[:4]), r[4], r[5]) for r in record["regions"] if r[7] == CODE]
        self.site = {r[6]: (tuple(r[:4]), r[5]) for r in record["regions"] if r[7] == EXPANSION}
        self.branches = [(tuple(b[:4]), b[4], b[5], b[6], b[8]) for b in record["branches"]]
        self.decisions = [(tuple(m[:4]), m[-1]) for m in record["mcdc_records"]]

    def key(self, place, file):
        return self.files[file], place

    def conditions(self, decision):
        """The keys of the conditions of a decision and of itself; constants have no branch, the record names no file."""
        for file in range(len(self.files)):
            found = [b for b in self.branches if b[4] == CONDITION and
                     any(f == file and inside(p, decision) for p, f in self.around(b[0], b[3]))]
            if found:
                return [self.key(b[0], b[3]) for b in found], self.key(decision, file)
        return [], None

    def around(self, place, file):
        yield place, file
        while file in self.site:
            place, file = self.site[file]
            yield place, file


def union(functions):
    """What there is, and what was run, over all objects: {key: flags} of regions, [run], of branches, [was true, was false], and of
    decisions, [pairs shown], the places of those that are constant; and the conditions that are none, {decision: their keys}."""
    seen = {"regions": {}, "branches": {}, "decisions": {}, "constant": set()}
    varying = {}

    def add(kind, key, flags):
        old = seen[kind].setdefault(key, [False] * len(flags))
        seen[kind][key] = [a or b for a, b in zip(old, flags)]

    for record in functions:
        if os.path.basename(record["filenames"][0]) not in HEADERS:
            continue
        f = Function(record)
        for place, count, file in f.regions:
            if place[:2] != place[2:]:
                add("regions", f.key(place, file), [count > 0])
        if record["count"] == 0:
            continue  # not called here; what was never called is a region that was not run
        for place, yes, no, file, _ in f.branches:
            add("branches", f.key(place, file), [yes > 0, no > 0])
        for place, shown in f.decisions:
            conditions, key = f.conditions(place)
            if not conditions:
                seen["constant"].update((file, place) for file in f.files)
            else:
                varying.setdefault(key, set()).update(conditions)
                add("decisions", key, shown)
    return seen, varying


def code_lines(text):
    """Numbers of the lines with code in them, not only comments and braces."""
    lines = headers.without_comments(text).split("\n")
    return {i + 1 for i, line in enumerate(lines) if line.strip(" {}\t") and not line.startswith("#")}


def compiled(text, simd):
    """Numbers of the lines that are compiled without Helium, with vectors or without, as far as that decides."""
    def holds(condition):
        if set(re.findall(r"[A-Za-z_]\w*", condition)) <= {"ROLN_SIMD", "ROLNI_MVE"}:
            words = condition.replace("!", " not ").replace("&&", " and ").replace("||", " or ")
            return bool(eval(words, {"ROLN_SIMD": simd, "ROLNI_MVE": 0}))
        return None  # not known

    found, open_now = set(), []  # of each #if: whether this part is compiled, whether an earlier one was
    for i, line in enumerate(text.split("\n")):
        word = re.match(r"#\s*(if|ifdef|ifndef|elif|else|endif)\b(.*)", line)
        if word is None:
            if all(now for now, _ in open_now):
                found.add(i + 1)
        elif word[1] == "endif":
            open_now.pop()
        else:
            taken = open_now.pop()[1] if word[1] in ("elif", "else") else False
            is_so = holds(word[2]) if word[1] in ("if", "elif") else True if word[1] == "else" else None
            open_now.append((not taken and is_so is not False, taken or is_so is True))
    return found


def operators(text):
    """(line, column) of every && and || in the bodies of functions, which stand between braces in the first column; without what
    is compiled for Helium alone, which tests/firmware/bits.c runs in QEMU."""
    found, inside_body, here = [], False, compiled(text, 0) | compiled(text, 1)
    for i, line in enumerate(headers.code(text).split("\n")):
        inside_body = line.startswith("{") or inside_body and not line.startswith("}")
        if inside_body and i + 1 in here:
            found += [(i + 1, m.start() + 1) for m in re.finditer(r"&&|\|\|", line)]
    return found


def unreached():
    """The functions and lines of unreached.txt."""
    with open("tests/safety/unreached.txt") as table:
        return [tuple(line.split(": ", 1)) for line in table.read().split("\n") if line[:1] not in ("", "#", " ")]


def reasons_in(text):
    """Numbers of the lines that unreached.txt names by how they begin, and what it names that is not there once."""
    lines_of, function = {}, None
    for i, line in enumerate(headers.without_comments(text).split("\n")):
        start = re.match(r"(?:ROLN_FN|ROLNI_INLINE|ROLN_CODE)\b.*?(\w+)\(", headers.named(line))
        function = start[1] if start else function
        lines_of.setdefault(function, []).append((i + 1, line.strip()))
    mine = [entry for entry in unreached() if entry[0] in lines_of]
    found = [[i for i, line in lines_of[name] if line.startswith(begin)] for name, begin in mine]
    return {lines[0] for lines in found if len(lines) == 1}, [entry for entry, lines in zip(mine, found) if len(lines) != 1]


def gaps(header, seen, varying):
    """(measure, place, what) of every branch and condition of a header that was not shown, and the numbers of all of them."""
    found, total = [], [0, 0]
    for (file, place), flags in seen["branches"].items():
        if file == header:
            total[0] += 2
            found += [("branches", place, "never " + what) for flag, what in zip(flags, ("true", "false")) if not flag]
    for key, flags in seen["decisions"].items():
        if key[0] == header:
            number = len(varying[key])
            total[1] += number
            short = " or ".join(str(i + 1) for i, flag in enumerate(flags) if not flag)
            for i in range(number - sum(flags)):
                found.append(("conditions", key[1], "no pair for condition %s of %d" % (short, len(flags))))
    return sorted(found), total


def report(header, seen, varying, verbose):
    """Passed and failed checks of one header, the reasons in it."""
    with open(header) as source:
        text = source.read()
    lines = text.split("\n")
    reasons, lost = reasons_in(text)
    used = set()
    code = code_lines(text)

    def reason(place, region=False):
        """The line with a reason for this place: its first or its last, or of a region the one above."""
        above = {place[0] - 1} if region else set()
        return next((line for line in sorted({place[0], place[2]} | above) if line in reasons), None)

    total = dict.fromkeys(MEASURES, 0)
    missing = {m: [] for m in MEASURES}
    exempt = []
    body, idle = set(), set()
    for (file, place), flags in seen["regions"].items():
        if file != header:
            continue
        span = set(range(place[0], place[2] + 1)) & code
        body |= span
        if not flags[0]:
            if reason(place, True) is None:
                idle |= span
            else:
                used.add(reason(place, True))
                exempt.append((place, "not run"))
    idle -= {line for place, _ in exempt for line in range(place[0], place[2] + 1)}
    total["lines"] = len(body)
    missing["lines"] = [(line, "not run") for line in sorted(idle)]
    found, (total["branches"], total["conditions"]) = gaps(header, seen, varying)
    for measure, place, what in found:
        if reason(place) is None:
            missing[measure].append((place[0], what))
        else:
            used.add(reason(place))
            exempt.append((place, what))
    decisions = {place for file, place in list(seen["decisions"]) + list(seen["constant"]) if file == header}
    for at in operators(text):
        if not any(place[:2] <= at < place[2:] for place in decisions):
            missing["conditions"].append((at[0], "no decision of it was seen"))
    failed = 0
    for m in MEASURES:
        short = len(missing[m])
        failed += short > 0 or total[m] == 0
        print("%-12s %-10s %6.2f %% of %d" % (header, m, 100 * (1 - short / max(total[m], 1)), total[m]))
    for line in sorted({line for m in MEASURES for line, _ in missing[m]}):
        what = sorted({w for m in MEASURES for other, w in missing[m] if other == line})
        print("    %s:%d %s: %s" % (header, line, "; ".join(what), lines[line - 1].strip()))
    idle_reasons = reasons - used
    for line in sorted(idle_reasons):
        print("    %s:%d a reason, but nothing is missing: %s" % (header, line, lines[line - 1].strip()))
    if verbose:
        for place, what in sorted(exempt):
            print("    %s:%d exempt, %s: %s" % (header, place[0], what, lines[place[0] - 1].strip()))
    for function, line in lost:
        print("    %s: not once in %s of %s" % (line, function, header))
    failed += len(idle_reasons) + len(lost) > 0
    return len(MEASURES) + 1 - failed, failed, len(reasons), len(exempt)


def main():
    os.chdir(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
    again = "again" in sys.argv[1:]  # what was exported last time
    if again:
        with open("build/test_cov.json") as text:
            functions = json.load(text)["data"][0]["functions"]
    else:
        functions = measure()
    seen, varying = union(functions)
    results = [report(h, seen, varying, "-v" in sys.argv[1:]) for h in HEADERS]
    passed, failed, reasons, exempt = (sum(r[i] for r in results) for i in range(4))
    if exempt == EXEMPT and reasons == len(unreached()):
        passed += 1
    else:
        failed += 1
        print("%d exempt, not the %d of EXEMPT in tests/safety/coverage.py, or %d lines of unreached.txt are not found once" %
              (exempt, EXEMPT, len(unreached()) - reasons))
    print("figure: all run, but for %d lines, branches or conditions; %d lines say why" % (exempt, reasons))
    print("%d passed, %d failed" % (passed, failed))
    sys.exit(failed > 0)


main()
