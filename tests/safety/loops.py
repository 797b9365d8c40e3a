# SPDX-License-Identifier: MIT
"""loops.py - every loop of the headers ends: it counts, or it stands in the list below with its bound.

A loop counts if it compares a variable v with something, moves v by a step, a number that is not 0, in one direction towards it,
and neither v nor a variable that it is compared with is written in its body. Last line: N passed, N failed.
"""
import re
import sys

from headers import without_words

# Loops that do not count, by function, with their bound.
BOUNDED = {
    "rolni_eig_iterate": ["a pass moves i on by one or two, or takes one of ROLNI_EIG_MOST(n) sweeps"],
    "rolni_midpoint": ["left at it == ROLN_MIDPOINT_ITERS"],
    "rolni_midpoint_bwd": ["left at it == ROLN_MIDPOINT_ITERS"],
    "rolni_plan_better": ["part = 1, 1/2, 1/4: three passes"],
    "rolni_ocp_factor": ["left at k == 0"],
    "rolni_dot2": ["p falls by one from n / 8"],
    "ROLNI_SUM4": ["do .. while (0)", "its while"],
    "roln_spd_mean_bwd": ["left at left == 0, which falls by one from 100"],
    "rolni_chart_polish": ["j rises"],
    "rolni_lbfgs_search": ["at most two passes: the second has no pairs, and returns"],
    "roln_fit_inertia": ["ratio < 1e18, by 1024: six passes", "ratio > 1e-18: six passes"],
    "roln_grad_acc": ["nb < 1 is refused"],
    "roln_grad": ["nb < 1 is refused"],
    "roln_mlp_hessian": ["no is a layer's width, at least 1 in a config that compiles"] * 2,
    "roln_fit_noise": ["k stops at best, below ROLNI_HALVINGS"],
    "rolni_write_integer": ["x falls to a tenth: 20 passes"],
    "rolni_write_real": ["m loses a bit a pass", "e moves towards 0 by min(|e|, 60)"],
    "rolni_write_need": ["said falls by one"],
    "roln_errors": ["now is nb or what is left, at least 1: nb < 1 is refused"],
    "roln_chart_add": ["now is ROLN_CHART_BLOCK or what is left"],
    "rolni_newton_back": ["now is a block of rows, or what is left"],
    "rolni_sym_sums": ["m is a multiple of w, or what is left"],
    "roln_sym_chol": ["m is ROLNI_SYM_M of what is left, at least 1", "n_j is ROLNI_SYM_N or what is left"],
}

# Steps that are not 0: numbers, constants, w, which is ROLNI_LANES or ROLNI_COLS wherever it is a step.
STEP = r"(\d+ \* )?(\d+|ROLNI?_[A-Z_]+|w|\(w\))"


def closing(text, at, opened, closed):
    """Index behind the bracket that closes the one at `at`."""
    depth = 0
    for i in range(at, len(text)):
        depth += (text[i] == opened) - (text[i] == closed)
        if depth == 0:
            return i + 1
    raise ValueError("unbalanced")


def statement(text, at):
    """Index behind the statement that begins at `at`."""
    while text[at].isspace():
        at += 1
    if text[at] == "{":
        return closing(text, at, "{", "}")
    keyword = re.match(r"(for|while|if|switch)\b\s*", text[at:])
    if keyword:
        at = statement(text, closing(text, at + keyword.end(), "(", ")"))
        other = re.match(r"\s*else\b", text[at:])
        return statement(text, at + other.end()) if other and keyword.group(1) == "if" else at
    depth = 0
    while text[at] != ";" or depth:
        depth += (text[at] in "({[") - (text[at] in ")}]")
        at += 1
    return at + 1


def written(name, text):
    """Nonzero if the variable is written in the text."""
    return re.search(
        r"(?<![\w.>#])%s\s*([-+*/|&%%]?=(?!=)|<<=|>>=|\+\+|--)|(\+\+|--)\s*%s\b|&%s\b(?!->|\.|\[)" % ((re.escape(name),) * 3), text)


def counts(header, body):
    """Nonzero if the loop counts."""
    parts = header.split(";")
    if len(parts) != 3:
        return False
    for v, op, bound in re.findall(r"(?<![\w.>\]])(\w+)(?: \+ [\w* ]+?)?\s*(<=?|>=?)(?!>)\s*([^&|]*)", parts[1]):
        up = op[0] == "<"
        step = re.search(r"(?<![\w.>])%s\s*(\+\+|--|[-+]=\s*[\w(])|(\+\+|--)%s\b" % (v, v), parts[2])
        if not step:
            continue
        sign = (step.group(1) or step.group(2))[0]
        by = re.search(r"(?<![\w.>])%s\s*[-+]=\s*([^,]*)" % v, parts[2])
        if by and not re.fullmatch(STEP, by.group(1).strip()):
            continue
        read = bound + " " + (by.group(1) if by else "")
        names = set(re.findall(r"(?<![\w.>])[A-Za-z_]\w*(?:(?:->|\.)\w+)*(?!\s*\()", read)) | {v}
        names |= {re.split(r"->|\.", x)[0] for x in names}
        if "||" in re.sub(r"\([^()]*\)", "", parts[1]):
            return False
        if up == (sign == "+") and not any(written(x, body) for x in names):
            return True
    return False


def loops(text):
    """Function, line, header, body of each loop."""
    bare = without_words(text).replace("\\\n", " \n")
    heads = [(m.start(), m.group(1) or m.group(2)) for m in re.finditer(
        r"^(?:ROLN|static)[^;{}#]*?\b(\w+)\([^;{}]*\)\s*\{|^#\s*define (?!ROLNI_X)(\w+)\(", bare, re.M)]
    for m in re.finditer(r"\b(for|while|do)\b\s*(?=[({])", bare):
        line = bare.count("\n", 0, m.start()) + 1
        function = [x for x in heads if x[0] <= m.start()][-1][1]
        if m.group(1) == "do":
            yield function, line, "do", bare[m.end(): statement(bare, m.end())] + bare[statement(bare, m.end()):][:40]
            continue
        end = closing(bare, m.end(), "(", ")")
        yield function, line, bare[m.end() + 1: end - 1], bare[end: statement(bare, end)]


def main():
    passed = failed = 0
    known = {function: list(why) for function, why in BOUNDED.items()}
    for path in sys.argv[1:]:
        with open(path, encoding="utf-8") as f:
            text = f.read()
        for function, line, header, body in loops(text):
            if counts(header, body):
                passed += 1
            elif known.get(function):
                passed += 1
                print(f"{function}: {known[function].pop(0)}")
            else:
                failed += 1
                print(f"{path}:{line}: {function}: {' '.join(header.split())}")
    for function in (x for x in known if known[x]):
        failed += 1
        print(f"{function}: a loop of the list is gone")
    print(f"{passed} passed, {failed} failed")
    return failed != 0


if __name__ == "__main__":
    sys.exit(main())
