# SPDX-License-Identifier: MIT
"""loops.py - every loop of the headers ends: it counts, or it stands in the list below with its bound.

A loop counts if it compares a variable v with something, moves v by a step, a number that is not 0, in one direction towards it,
and neither v nor what it is compared with is written in its body, by name or through a pointer that is not const. Last
line: N passed, N failed.
"""
import re
import sys

from headers import without_words

# Loops that do not count, by function: what stands in their brackets, and their bound.
BOUNDED = {
    "rolni_eig_iterate": [("i = 0; i < n;", "a pass moves i on by one or two, or takes one of ROLNI_EIG_MOST(n) sweeps")],
    "rolni_midpoint": [("it = 0;; it++", "left at it == ROLN_MIDPOINT_ITERS")],
    "rolni_midpoint_bwd": [("it = 0;; it++", "left at it == ROLN_MIDPOINT_ITERS")],
    "rolni_plan_better": [("part = 1; part > ROLN_C(0.2); part /= 2", "part = 1, 1/2, 1/4: three passes")],
    "rolni_ocp_factor": [("k = o->steps - 1;; k--", "left at k == 0")],
    "rolni_dot2": [("--p > 0", "p falls by one from n / 8")],
    "ROLNI_SUM4": [("do", "do .. while (0)"), ("0", "its while")],
    "roln_spd_mean_bwd": [
        ("stop = ROLN_EPS * ROLN_EPS * next; next > stop; left--", "left at left == 0, which falls by one from 100")],
    "rolni_chart_polish": [("j = 0; j < m; j = j == 0 ? n + 1 : j + 1", "j rises")],
    "rolni_lbfgs_search": [(";;", "at most two passes: the second has no pairs, and returns")],
    "roln_fit_inertia": [
        ("; ratio > 32; ratio /= 1024", "ratio < 1e18, by 1024: six passes"),
        ("; ratio < ROLN_C(0.03125); ratio *= 1024", "ratio > 1e-18: six passes")],
    "roln_grad_acc": [("w = 0; w < batch->count && st == ROLN_OK; w += nb", "nb < 1 is refused")],
    "roln_grad": [("w = 0; w < batch->count && st == ROLN_OK; w += nb", "nb < 1 is refused")],
    "roln_mlp_hessian": [
        ("j = 0; j < m * no && along; j += no", "no is a layer's width, at least 1 in a config that compiles"),
        ("j = 0; j < m * no && (y || l + 2 < f->layers); j += no", "no is a layer's width, at least 1 in a config that compiles")],
    "roln_fit_noise": [("k = 0; sum[k] < sum[best] - 2; k++", "k stops at best, below ROLNI_HALVINGS")],
    "rolni_write_integer": [("(x /= 10) != 0", "x falls to a tenth: 20 passes")],
    "rolni_write_real": [
        ("; m != 0 && !(m & 1); e++", "m loses a bit a pass"),
        ("m != 0 && e != 0", "e moves towards 0 by min(|e|, 60)")],
    "rolni_write_need": [("; said > 1 && value[said - 1] == 0;", "said falls by one")],
    "roln_errors": [("w = 0; w < b->count; w += now", "now is nb or what is left, at least 1: nb < 1 is refused")],
    "roln_chart_add": [("; count > 0; count -= now, x += now * N", "now is ROLN_CHART_BLOCK or what is left")],
    "rolni_newton_back": [("k = 0; k < R; k += now", "now is a block of rows, or what is left")],
    "rolni_sym_sums": [("i = from; i < to; i += m, left--", "m is a multiple of w, or what is left")],
    "roln_sym_chol": [
        ("i0 = 0; i0 < n; i0 += m", "m is ROLNI_SYM_M of what is left, at least 1"),
        ("j0 = i0; j0 < n; j0 += n_j", "n_j is ROLNI_SYM_N or what is left")],
    "roln_ocp_solve": [
        ("side = 0; side < b->sides; side++", "what it calls takes b as const"),
        ("side = 0; side < b->sides; side++", "what it calls takes b as const")],
    "rolni_encoder_fit": [("w = 0; w < f->batch->count; w += ROLN_CHART_BLOCK", "the batch is const")],
    "rolni_encoder_value": [("w = 0; w < f->batch->count; w += ROLN_CHART_BLOCK", "the batch is const")],
}

# Steps that are not 0: numbers, constants, w, which is ROLNI_LANES or ROLNI_COLS wherever it is a step.
STEP = r"([1-9]\d* \* )?([1-9]\d*|ROLNI?_[A-Z_]+|w|\(w\))"


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


WRITES = r"\s*([-+*/|&%]?=(?!=)|<<=|>>=|\+\+|--)"


def written(name, text):
    """Nonzero if the variable, an element of it or what it points to is written in the text."""
    name = re.escape(name)
    return (re.search(r"(?<![\w.>#])%s%s|(\+\+|--)\s*\(?\*?%s\b|&%s\b(?!->|\.|\[)" % (name, WRITES, name, name), text) or
            re.search(r"\(\*%s\)%s|(?<![\w.>#)\]] )(?<![\w.>#)\]])\*%s%s" % (name, WRITES, name, WRITES), text))


def element_written(name, text):
    """Nonzero if an element of an array is written in the text."""
    return re.search(r"(?<![\w.>#])%s\[[^\]]*\]%s" % (re.escape(name), WRITES), text)


def handed(name, text):
    """Nonzero if a call in the text gets the pointer."""
    return re.search(r"\w\([^;{}]*(?<![\w.>&*])%s\s*[,)]" % re.escape(name), text)


def counts(header, body, before):
    """Nonzero if the loop counts. before: the function up to it, which says what it cannot write through: pointers to const."""
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
        through = set(re.findall(r"(?<![\w.>])([A-Za-z_]\w*)(?=->|\[)", read) + re.findall(r"\*\s*([A-Za-z_]\w*)", read)
                      if "->" in read or "[" in read or re.search(r"(^|[(,<>=+-])\s*\*", read) else [])
        through = {x for x in through if not re.search(r"\bconst\b[^,;(){}=]*\*\s*(const\s+)?%s\b" % x, before)}
        if any(element_written(x, body) or handed(x, body) for x in through):
            continue
        if up == (sign == "+") and not any(written(x, body) for x in names):
            return True
    return False


def loops(text):
    """Function, line, header, body of each loop, and its function up to it."""
    bare = without_words(text).replace("\\\n", " \n")
    heads = [(m.start(), m.group(1) or m.group(2)) for m in re.finditer(
        r"^(?:ROLN|static)[^;{}#]*?\b(\w+)\([^;{}]*\)\s*\{|^#\s*define (?!ROLNI_X)(\w+)\(", bare, re.M)]
    for m in re.finditer(r"\b(for|while|do)\b\s*(?=[({])", bare):
        line = bare.count("\n", 0, m.start()) + 1
        start, function = [x for x in heads if x[0] <= m.start()][-1]
        if m.group(1) == "do":
            yield function, line, "do", bare[m.end(): statement(bare, m.end())] + bare[statement(bare, m.end()):][:40], ""
            continue
        end = closing(bare, m.end(), "(", ")")
        yield function, line, " ".join(bare[m.end() + 1: end - 1].split()), bare[end: statement(bare, end)], bare[start: m.start()]


def main():
    passed = failed = 0
    known = {function: list(why) for function, why in BOUNDED.items()}
    for path in sys.argv[1:]:
        with open(path, encoding="utf-8") as f:
            text = f.read()
        for function, line, header, body, before in loops(text):
            if counts(header, body, before):
                passed += 1
            elif known.get(function) and known[function][0][0] == header:
                passed += 1
                print(f"{function}: {known[function].pop(0)[1]}")
            else:
                failed += 1
                print(f"{path}:{line}: {function}: {header}")
    for function in (x for x in known if known[x]):
        failed += 1
        print(f"{function}: a loop of the list is gone")
    print(f"{passed} passed, {failed} failed")
    return failed != 0


if __name__ == "__main__":
    sys.exit(main())
