# SPDX-License-Identifier: MIT
"""loops.py - every loop of the headers ends: it counts, or it stands in the list below with its bound.

A loop counts if it compares a variable v with something, moves v by a step, a number that is not 0, in one direction towards it,
and neither v nor what it is compared with is written in its body: by name, behind a pointer, by a macro, or by a function that gets
the object and may write there. Last line: N passed, N failed.
"""
import re
import sys

from headers import named, without_words

# Loops that do not count, by function: the text in their brackets, and their bound. Another text is another loop.
BOUNDED = {
    "rolni_eig_iterate": [
        ("i = 0; i < n;", "a pass moves i on by one or two, or takes one of ROLNI_EIG_MOST(n) sweeps"),
    ],
    "rolni_policies": [
        ("*first = 1;; last = moved", "moved halves from pass to pass, from 2, and leaves below the root of eps: 29 passes"),
    ],
    "roln_ae_init_pod": [
        ("known = keeps; known < N1;", "the loop inside takes at least one direction, i = N - 1"),
        ("i = N - 1; known < N1 && (i == N - 1 || !(eval[i] < least)); i--, known++", "known rises to N1, at most N"),
    ],
    "roln_lnn_stick": [
        ("r = 0; r < m; r += n", "n is at least 1"),
    ],
    "NAME_i_actuate": [
        ("r = j; r < m; r += N", "N is at least 1"),
    ],
    "NAME_i_actuate_bwd": [
        ("r = j; r < m; r += N", "N is at least 1"),
    ],
    "NAME_allocate": [
        ("pass = 0; pass <= last; pass++", "last is 4, and may fall to 2"),
    ],
    "rolni_midpoint": [
        ("it = 0;; it++", "left at it == ROLN_MIDPOINT_ITERS"),
    ],
    "rolni_midpoint_bwd": [
        ("it = 0;; it++", "left at it == ROLN_MIDPOINT_ITERS"),
    ],
    "NAME_i_plan_better": [
        ("part = 1; part > ROLN_C(0.2); part /= 2", "part = 1, 1/2, 1/4: three passes"),
    ],
    "rolni_ocp_factor": [
        ("k = o->steps - 1;; k--", "left at k == 0"),
    ],
    "rolni_dot2": [
        ("--p > 0", "p falls by one from n / 8"),
    ],
    "ROLNI_SUM4": [
        ("do while (0)", "do .. while (0)"),
        ("0", "its while"),
    ],
    "rolni_mm": [
        ("; i < m; i += rows, A += ROLNI_AS(size_t, rows) * si, C += ROLNI_AS(size_t, rows) * ldb", "rows is 1 to 4"),
    ],
    "rolni_chart_polish": [
        ("j = 0; j < m; j = j == 0 ? n + 1 : j + 1", "j rises"),
    ],
    "rolni_lbfgs_search": [
        (";;", "at most two passes: the second has no pairs, and returns"),
    ],
    "NAME_grad_acc": [
        ("; part.w0 < b->count && st == ROLN_OK; part.w0 += part.nb",
         "part.nb is ROLN_BLOCK, at least 1, or what is left"),
    ],
    "NAME_grad": [
        ("; part.w0 < b->count && st == ROLN_OK; part.w0 += part.nb",
         "part.nb is ROLN_BLOCK, at least 1, or what is left"),
    ],
    "roln_mlp_hessian": [
        ("j = 0; j < m * no && along; j += no", "no is a layer's width, at least 1 in a config that compiles"),
        ("j = 0; j < m * no && (y || l + 2 < f->layers); j += no", "no is a layer's width, at least 1 in a config that compiles"),
    ],
    "NAME_fit_noise": [
        ("k = 0; sum[k] < sum[best] - 2; k++", "k stops at best, below ROLNI_HALVINGS"),
    ],
    "NAME_fit_outlook": [
        ("h = 0; h < b->steps && st == ROLN_OK;", "h rises by one"),
        ("k = 0; w->cost[k] > least + 4 * 4; k++", "k stops at the likeliest time, below ROLNI_TIMES"),
    ],
    "NAME_i_encoder_fit": [
        ("k = 0; k < f->batch->count; k += now", "now is ROLN_CHART_BLOCK or what is left of a batch that is constant"),
    ],
    "NAME_i_encoder_value": [
        ("k = 0; k < f->batch->count; k += now", "the same"),
    ],
    "rolni_write_integer": [
        ("(x /= 10) != 0", "x falls to a tenth: 20 passes"),
    ],
    "rolni_write_real": [
        ("; m != 0 && !(m & 1); e++", "m loses a bit a pass"),
        ("m != 0 && e != 0", "e moves towards 0 by min(|e|, 60)"),
    ],
    "rolni_write_need": [
        ("; said > 1 && value[said - 1] == 0;", "said falls by one"),
    ],
    "rolni_next_powers": [
        ("i < n - 1 && a[i] == 0", "i rises by one"),
    ],
    "NAME_evidence_add": [
        ("k = 0; k < b->count; k++", "the count that the body changes is that of e"),
    ],
    "NAME_errors": [
        ("from = 0; from < b->count; from += now", "now is ROLN_BLOCK, at least 1, or what is left"),
    ],
    "roln_chart_add": [
        ("; count > 0; count -= now, x += now * N", "now is ROLN_CHART_BLOCK or what is left"),
    ],
    "rolni_newton_back": [
        ("k = 0; k < R; k += now", "now is a block of rows, or what is left"),
    ],
    "rolni_sym_sums": [
        ("i = from; i < to; i += m, left--", "m is a multiple of w, or what is left"),
    ],
    "roln_sym_chol": [
        ("i0 = 0; i0 < n; i0 += m", "m is ROLNI_SYM_M of what is left, at least 1"),
        ("j0 = i0; j0 < n; j0 += n_j", "n_j is ROLNI_SYM_N or what is left"),
    ],
}

# Loops that need not end, and must not count; behind them some that count. A macro and two functions for both.
HEADS = """#define MORE(x) (x)++
#define AGAIN n++
static void grow(roln_s *s) { s->n++; }
static int look(const roln_s *s, const int *p) { return s->n + *p; }
static void each(roln_s *s, const roln_s *c, int *p, int n) {
    int i, m[1];
"""
ENDLESS = """
for (i = 0; i < m[0]; i++) m[0]++;
for (i = 0; i < m[0]; i++) ++m[0];
for (i = 0; i < m[0]; i++) m[i - i] += 2;
for (i = 0; i < m[0]; i++) touch(m);
for (i = 0; i < *p; i++) (*p)++;
for (i = 0; i < *p; i++) *p += 1;
for (i = 0; i < *p; i++) p[0]++;
for (i = 0; i < *p; i++) touch(p);
for (i = 0; i < s->n; i++) s->n++;
for (i = 0; i < s->n; i++) s->n <<= 1;
for (i = 0; i < s->n; i++) grow(s);
for (i = 0; i < s->n; i++) touch(&s->n);
for (i = 0; i < s->n; i++) other->n++;
for (i = 0; i < s->m[1]; i++) s->m[1]--, grow(s);
for (i = 0; i < c->n; i++) touch(&c);
for (i = 0; i < n; i++) MORE(n);
for (i = 0; i < n; i++) MORE(i), i -= 2;
for (i = 0; i < n; i++) AGAIN;
for (i = 0; i < n; i++) (n)++;
for (i = 0; i < n; i++) touch(&n);
for (i = 0; i < n; i++) touch(&i);
for (i = 0; i < n; i++, n++) touch(i);
for (i = 0; i < n++; i++) touch(i);
for (i = 0; i < n; i++) i--;
for (i = 0; i < n; i--) touch(i);
for (i = n; i > 0; i++) touch(i);
for (i = 0; i < n; i += m[0]) touch(i);
for (i = 0; i < n; i += 0) touch(i);
"""
ENDING = """
for (i = 0; i < n; i++) touch(i), s->n++;
for (i = 0; i < s->n; i++) look(s, p), touch(s->n);
for (i = 0; i < c->n; i++) look(c, p), touch(c);
for (i = n - 1; i >= 0; i--) m[i]++;
for (i = 0; i < *p; i += 2) look(s, p), m[i] = *p;
"""

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


BRACKETS = r"(?:\s*\[(?:[^\[\]]|\[[^\[\]]*\])*\])"
WRITES = r"\s*(?:(?:[-+*/|&%^]|<<|>>)?=(?!=)|\+\+|--)"
KEYWORDS = ("if", "for", "while", "switch", "return", "sizeof", "do")


def written(path, text):
    """Nonzero if a write of the variable, or of what lies in it or behind it, stands in the text."""
    p = re.escape(path)
    p = r"(?:(?<![\w.>#])%s(?!\w)|\(\s*%s\s*\))" % (p, p)
    behind = r"(?:\*\s*%s|\(\s*\*+\s*%s%s*\s*\))" % (p, p, BRACKETS)
    return re.search(r"(?:%s%s*|%s)%s|(?:\+\+|--)\s*\(?\s*\**\s*%s(?!->|\.)" % (p, BRACKETS, behind, WRITES, p), text)


def addressed(path, text):
    """Nonzero if its address is taken in the text."""
    return re.search(r"(?<![&\w\])])\s*&\s*\(?\s*%s(?!\w|\s*(?:->|\.))" % re.escape(path), text)


def arguments(text):
    """Name and list of arguments of each call."""
    for m in re.finditer(r"\b([A-Za-z_]\w*)\s*\(", text):
        if m.group(1) in KEYWORDS:
            continue
        depth, parts = 0, [""]
        for c in text[m.end():closing(text, m.end() - 1, "(", ")") - 1]:
            depth += (c in "([{") - (c in ")]}")
            if c == "," and not depth:
                parts.append("")
            else:
                parts[-1] += c
        yield m.group(1), parts


class Known:
    """Functions and macros of all headers."""
    def __init__(self, text=""):
        self.functions, self.macros = functions_of(text), macros_of(text)


def functions_of(text):
    """Parameters of each function."""
    return {m.group(1): re.split(r"\s*,\s*", m.group(2)) for m in re.finditer(
        r"^(?:ROLN|static)[^;{}#()]*?\b(\w+)\(([^;{}]*?)\)\s*\{", without_words(text), re.M)}


def macros_of(text):
    """Parameters, if any, and text of each macro."""
    return {m.group(1): (re.split(r"\s*,\s*", (m.group(2) or "").strip()), m.group(3)) for m in re.finditer(
        r"^#\s*define (\w+)(?:\(([^)]*)\))?((?:\\\n|.)*)", without_words(text), re.M)}


def expanded(text, macros, depth=3):
    """And what the macros in it become, behind it."""
    more = ""
    for name, given in list(arguments(text)) + [(x, []) for x in re.findall(r"\b[A-Z]\w+\b(?!\s*\()", text)]:
        if name in macros:
            names, became = macros[name]
            for x, y in zip(names, given):
                became = re.sub(r"(?<!\w)%s(?!\w)" % re.escape(x), lambda m, y=y: y.strip(), became) if x else became
            more += " ;" + became.replace("\\\n", " ")
    return text + (expanded(more, macros, depth - 1) if more and depth else more)


def constant(name, before):
    """Nonzero if it is declared as a pointer to what is constant, or as a constant, in what stands before."""
    return re.search(r"\bconst\s+\w+(?:\s*\*\s*(?:const\s+)?|\s+)(?:\w+[^;(){}]*,\s*\*?\s*)?%s\b" % name, before)


def given(paths, body, known):
    """Nonzero if a call in the body gets the object itself, and not as a constant."""
    for name, parts in arguments(body):
        if name in known.macros:
            continue
        wanted = known.functions.get(name, [])
        for i, part in enumerate(parts):
            if i < len(wanted) and wanted[i].startswith("const ") and len(re.findall(r"[*\[]", wanted[i])) == 1:
                continue
            if any(re.search(r"(?<![\w.>])%s(?!\w|\s*(?:->|\.|\[|\())" % re.escape(p), part) for p in paths):
                return True
    return False


def counts(header, body, before="", known=Known()):
    """Nonzero if the loop counts; before: what stands of the function before it."""
    parts = header.split(";")
    if len(parts) != 3:
        return False
    body = expanded(body, known.macros)
    for v, op, bound in re.findall(r"(?<![\w.>\]])(\w+)(?: \+ [\w* ]+?)?\s*(<=?|>=?)(?!>)\s*([^&|]*)", parts[1]):
        up = op[0] == "<"
        step = re.search(r"(?<![\w.>])%s\s*(\+\+|--|[-+]=\s*[\w(])|(\+\+|--)%s\b" % (v, v), parts[2])
        if not step:
            continue
        sign = (step.group(1) or step.group(2))[0]
        by = re.search(r"(?<![\w.>])%s\s*[-+]=\s*([^,]*)" % v, parts[2])
        if by and not re.fullmatch(STEP, by.group(1).strip()):
            continue
        if "||" in re.sub(r"\([^()]*\)", "", parts[1]):
            return False
        if up != (sign == "+"):
            continue
        read = re.sub(r"\bsizeof\s*(\w+|\([^()]*\))", "", bound + " " + (by.group(1) if by else ""))
        rest = parts[2][:step.start()] + " " + parts[2][step.end() - (step.group(0)[-1] not in "+-"):]
        text = body + ";" + parts[1] + ";" + rest
        if written(v, text) or addressed(v, before + text):
            continue
        if not any(moves(*x, text, before, known) for x in re.findall(
                r"(\*?)\(*(?<![\w.>])([A-Za-z_]\w*(?:(?:->|\.)\w+)*)(?!\w|\s*\()(\s*\[)?", read)):
            return True
    return False


def moves(star, path, bracket, text, before, known):
    """Nonzero if a part of a bound may move in the text: star, bracket: it lies behind the path."""
    steps = re.split(r"(->|\.)", path)
    paths = ["".join(steps[:k]) for k in range(1, len(steps) + 1, 2)]
    root = paths[0]
    if any(written(p, text) for p in paths):
        return True
    if len(paths) > 1 and re.search(r"(?:->|\.)%s%s*%s" % (steps[-1], BRACKETS, WRITES), text):
        return True # of an object of that type by another name
    far = star or bracket or "->" in path
    if constant(root, before): # but a pointer itself may move
        return bool(far and re.search(r"(?<![&\w\])])\s*&\s*%s(?!\w|\s*(?:->|\.|\[))" % re.escape(root), before + text))
    if any(addressed(p, before + text) for p in paths):
        return True
    return far and given(paths if star or bracket else paths[:-1], text, known)


def loops(text):
    """Function, line, header, body of each loop, and what stands of the function before it."""
    bare = without_words(text).replace("\\\n", " \n")
    heads = [(m.start(), m.group(1) or m.group(2)) for m in re.finditer(
        r"^(?:ROLN|static)[^;{}#]*?\b(\w+)\([^;{}]*\)\s*\{|^#\s*define (?!ROLNI_X)(\w+)\(", bare, re.M)]
    for m in re.finditer(r"\b(for|while|do)\b\s*(?=[({])", bare):
        line = bare.count("\n", 0, m.start()) + 1
        begin, function = [x for x in heads if x[0] <= m.start()][-1]
        before = bare[begin: m.start()]
        if m.group(1) == "do":
            behind = statement(bare, m.end())
            last = bare.index("(", behind)
            yield function, line, "do while " + bare[last: closing(bare, last, "(", ")")], bare[m.end(): behind], before
            continue
        end = closing(bare, m.end(), "(", ")")
        yield function, line, bare[m.end() + 1: end - 1], bare[end: statement(bare, end)], before


def main():
    passed = failed = 0
    for text, good in ((ENDLESS, False), (ENDING, True)):
        for line in text.strip().split("\n"):
            whole = HEADS + line + "\n}\n"
            _, _, header, body, before = list(loops(whole))[-1]
            if counts(header, body, before, Known(whole)) == good:
                passed += 1
            else:
                failed += 1
                print(f"loops.py itself: {line}")
    known = {function: list(rows) for function, rows in BOUNDED.items()}
    texts = []
    for path in sys.argv[1:]:
        with open(path, encoding="utf-8") as f:
            texts.append(named(f.read()))
    every = Known("\n".join(texts))
    for path, text in zip(sys.argv[1:], texts):
        for function, line, header, body, before in loops(text):
            header = " ".join(header.split())
            row = next((x for x in known.get(function, []) if x[0] == header), None)
            if counts(header, body, before, every):
                passed += 1
            elif row:
                passed += 1
                known[function].remove(row)
                print(f"{function}: {row[1]}")
            else:
                failed += 1
                print(f"{path}:{line}: {function}: {header}")
    for function, header, _ in ((x, *row) for x, rows in known.items() for row in rows):
        failed += 1
        print(f"{function}: no such loop any more, or it counts: {header}")
    print(f"{passed} passed, {failed} failed")
    return failed != 0


if __name__ == "__main__":
    sys.exit(main())
