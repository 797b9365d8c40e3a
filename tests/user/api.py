#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""api.py - what a config makes of roln.h, as Markdown: every public type and function of its model with plain types and sizes, and
a line of the comment that stands above it, by the sections of roln.h, which has the whole comment. Functions that an option of
OPTIONS would add follow in their section, with that option. Then the structs that a program fills, as they stand in roln.h.

    api.py examples/arm.h     or    make api CONFIG=examples/arm.h         wants Python and the compiler $CC, cc if there is none

Names NAME_i_x are left out: they promise nothing. Of scratch, NAME_x_work, the size in bytes is printed."""
import os
import re
import subprocess
import sys
import tempfile

ROOT = os.path.abspath(os.path.join(os.path.dirname(__file__), "..", ".."))
WIDTH = 116  # of comments and prototypes
# Options that add functions to a config that does not have them; N: a motor at each joint.
OPTIONS = [("ROLN_PLAN", "15, N"), ("ROLN_DELAY", "1"), ("ROLN_FRICTION", "1"), ("ROLN_FRICTION", "2"),
           ("ROLN_ACTUATOR", "current"), ("ROLN_GN_ROWS", "2000")]
FILLED = ["roln_limits", "roln_motors", "roln_noise", "roln_cost", "roln_goal", "roln_term", "roln_batch"]


def run(*command, text=None, refused=None):
    """What the command prints. refused: what is returned if the command fails; None: it must not."""
    done = subprocess.run(command, input=text, capture_output=True, text=True, check=False)
    if done.returncode != 0 and refused is not None:
        return refused
    if done.returncode != 0:
        sys.exit(f"api.py: {' '.join(command)}\n{done.stderr}")
    return done.stdout


def compiler(config, define=()):
    return [os.environ.get("CC", "cc"), "-std=c99", "-I" + ROOT, "-I" + os.path.dirname(os.path.abspath(config)), *define, "-xc"]


def name_of(config):
    """ROLN_NAME, of the last model in the config."""
    if not os.path.exists(config):
        sys.exit(f"{config}: no such file. hint: pass the header that defines a model, such as examples/arm.h")
    with open(config, encoding="utf-8") as f:
        names = re.findall(r"^\s*#\s*define\s+ROLN_NAME\s+(\w+)", f.read(), re.M)
    if not names:
        sys.exit(f"{config}: no ROLN_NAME. hint: pass the header that defines a model, such as examples/arm.h")
    return names[-1]


def preprocessed(config, define):
    """[(line, text)] of what roln.h becomes behind the preprocessor; nothing if an option is refused."""
    out = run(*compiler(config, define), "-E", config, refused="" if define else None)
    found, line, inside = [], 0, False
    for text in out.split("\n"):
        marker = re.match(r'# (\d+) "(.*?)"', text)
        if marker:
            line, inside = int(marker[1]), os.path.basename(marker[2]) == "roln.h"
            continue
        if inside:
            found.append((line, text))
        line += 1
    return found


def declarations(lines):
    """(line, text) of every declaration; of a function without its body."""
    text = "\n".join(code for _, code in lines)
    at = [line for line, code in lines for _ in code + "\n"]
    depth, start, body = 0, 0, False
    for m in re.finditer(r"[{};]", text):
        if m[0] == "{":
            if depth == 0 and text[start:m.start()].rstrip().endswith(")"):
                body = True
                yield at[start + len(text[start:]) - len(text[start:].lstrip())], " ".join(text[start:m.start()].split()) + ";"
            depth += 1
        elif m[0] == "}":
            depth -= 1
            if depth == 0 and body:
                start, body = m.end(), False
        elif depth == 0:
            yield at[start + len(text[start:]) - len(text[start:].lstrip())], " ".join(text[start:m.end()].split())
            start = m.end()


class Header:
    """The text of roln.h: sections, and the comment that ends above a line."""

    def __init__(self):
        with open(os.path.join(ROOT, "roln.h"), encoding="utf-8") as f:
            self.lines = f.read().split("\n")

    def section(self, line):
        for i in range(line - 1, -1, -1):
            m = re.match(r"/\* ---- (\d+ .*?) -+ \*/", self.lines[i])
            if m:
                return m[1]
        return ""

    def struct(self, name):
        """The lines of a struct and of the comment above it."""
        last = next(i for i, text in enumerate(self.lines) if re.match(rf"}} {name};", text))
        first = last
        while self.lines[first - 1]:
            first -= 1
        return self.lines[first:last + 1]

    def comment(self, line, name):
        """Its first sentence, up to a formula on lines of its own, as much as fits on a line."""
        last = line - 2  # counted from 0, the line above
        while self.lines[last].startswith("#"):
            last -= 1
        first = last
        while first > 0 and self.lines[first] and not self.lines[first].startswith("/*"):
            first -= 1
        text = "\n".join(self.lines[first:last + 1]).strip()
        if not text.startswith("/*") or not text.endswith("*/") or text.count("*/") > 1:
            text = "".join(re.findall(r"/\*.*\*/$", self.lines[line - 1]))  # behind it
        text = re.sub(r"^/\*|\*/$", "", text)
        text = " ".join(re.split(r"\n {7,}", text)[0].split())
        text = re.split(r"(?<=[^.][.])\s(?=[A-Z])", text)[0].replace("NAME", name)
        text = text.rstrip(",:")
        if len(text) <= WIDTH - 6:
            return text
        short = text[:WIDTH - 9]
        cuts = [short.rfind(mark) for mark in ("; ", ": ", ". ", ", ")]
        return short[:max(cuts[:3]) if max(cuts[:3]) > WIDTH // 3 else max(cuts)] + " .."


def constants(config, define, expressions):
    """{expression: value}, as the compiler has them."""
    order = sorted(set(expressions))
    body = "".join(f'    printf("%lld\\n", (long long)({e}));\n' for e in order)
    with tempfile.TemporaryDirectory() as folder:
        source, program = os.path.join(folder, "a.c"), os.path.join(folder, "a")
        with open(source, "w", encoding="utf-8") as f:
            f.write(f'#include <stdio.h>\n#include "{os.path.abspath(config)}"\nint main(void)\n{{\n{body}    return 0;\n}}\n')
        run(*compiler(config, define), source, "-o", program, "-lm")
        return dict(zip(order, run(program).split()))


def wrapped(text, indent):
    """At most WIDTH columns, broken behind commas and semicolons."""
    out, line = [], ""
    for word in re.split(r"(?<=[,;{]) ", text):
        if line and len(line) + 1 + len(word) > WIDTH:
            out.append(line)
            line = indent
            word = word.lstrip()
            line += word
        else:
            line = f"{line} {word}" if line else word
    return out + [line]


def brackets(text):
    """The sizes in a declaration."""
    return re.findall(r"\[((?:[^\[\]]|\[[^\]]*\])*)\]", text)


def public(config, name, define):
    """[(line, text, name)] of the types and of the functions of a model."""
    types, functions = [], []
    for line, text in declarations(preprocessed(config, define)):
        text = re.sub(r"\[static ", "[", re.sub(r"__attribute__\s*\(\(.*?\)\)\s*", "", text))
        m = re.match(r"(?:static |inline |__inline__ )*(.*?\b(\w+)\(.*\);)$", text)
        if m and not text.startswith("typedef") and m[2].startswith(name + "_") and not m[2].startswith(name + "_i_"):
            functions.append((line, m[1], m[2]))
        m = re.match(r"typedef (?:struct|union) .*\} (\w+);$", text)
        if m and m[1].startswith(name + "_") and not m[1].startswith(name + "_i_"):
            types.append((line, text, m[1]))
    return types, functions


def plain(config, define, entries, scratch):
    """The entries with numbers for sizes, and {type: bytes} of scratch."""
    sizes = [e for _, text, what in entries if what not in scratch for e in brackets(text) if e]
    known = constants(config, define, sizes + [f"sizeof({t})" for t in scratch])

    def number(m):
        return f"[{known[m[1]]}]"
    shown = [(line, re.sub(r"\[((?:[^\[\]]|\[[^\]]*\])+)\]", number, text), what) for line, text, what in entries
             if what not in scratch]
    return shown, {t: known[f"sizeof({t})"] for t in scratch}


def main():
    if len(sys.argv) != 2:
        sys.exit("api.py: no config. hint: make api CONFIG=examples/arm.h")
    config = sys.argv[1]
    name, header = name_of(config), Header()
    with open(config, encoding="utf-8") as f:
        own = f.read()
    seen, found, scratch = set(), [], {}  # found: (line, option, text, name)
    for option, value in [(None, None)] + OPTIONS:
        if option and re.search(rf"#\s*define\s+{option}\b", own):
            continue
        if option and "N" in value.split():
            value = value.replace("N", constants(config, (), [name + "_force_size"])[name + "_force_size"])
        define = (f"-D{option}={value}",) if option else ()
        types, functions = public(config, name, define)
        if not option and len(functions) < 20:
            sys.exit(f"{config}: only {len(functions)} functions of {name} are seen")
        new = [e for e in types + functions if e[2] not in seen]
        seen.update(e[2] for e in new)
        taken = {t for _, _, t in new if t.endswith("_work") or t in (f"{name}_{x}" for x in ("work", "train", "start"))}
        shown, sizes = plain(config, define, new, taken)
        found += [(line, f"{option} {value}" if option else "", text, what) for line, text, what in shown]
        scratch.update({t: (size, f"{option} {value}" if option else "") for t, size in sizes.items()})

    print(f"# Functions of the model `{name}`\n")
    print(f"`make api CONFIG={os.path.relpath(config)}` prints this page from `roln.h`, which has the whole comments.\n"
          "An editor with clangd 19 shows them, and the typed arguments, where the mouse is over a name;\n"
          "clangd 14 shows the arguments alone.\n\n"
          "`roln_real` is `float`, or `double` with `ROLN_DOUBLE`. `NAME_x_work` is the scratch of the function `NAME_x`.\n"
          "`NAME_work`, `NAME_train` and `NAME_start` are unions of such scratch: pass `&work.tick` to `NAME_tick`.\n"
          "To find the code of `NAME_tick` search `roln.h` for `ROLN_(tick)(`.\n"
          "Numbers are those of this config. It does not have functions with a comment such as `needs ROLN_DELAY 1`: write that\n"
          "option, with values of yours, into the config. A section that is not here has no function of this model; that of "
          "charts\nneeds ROLN_CHART.\n"
          .replace("NAME", name))
    section = None
    for line, option, text, what in sorted(found):
        if header.section(line) != section:
            section = header.section(line)
            print(f"## {section}\n")
        comment = header.comment(line, name)
        if option:
            print(f"    /* needs {option} */")
        if comment:
            print(f"    /* {comment} */")
        text = re.sub(r"^typedef (struct|union) \{ (.*) \} (\w+);$", r"typedef \1 { \2 } \3;", text)
        for part in wrapped(text, "    "):
            print("    " + part)
        print()
    print("## Structs that a program fills\n")
    print("These structs are the same for every model and stand in `roln.h`.\n")
    for struct in FILLED:
        for part in header.struct(struct):
            print(("    " + part).rstrip())
        print()
    print("## Scratch, bytes\n")
    print("| type | bytes | |\n|---|---|---|")
    for t in sorted(scratch):
        print(f"| `{t}` | {scratch[t][0]} | {scratch[t][1] and 'needs ' + scratch[t][1]} |")


if __name__ == "__main__":
    main()
