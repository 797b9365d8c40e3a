#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""status.py - statuses of public functions: each that a function can return stands in its comment, or in the comment of a function
whose statuses it names ("status of roln_..", "as roln_..", of a function of a model also "(roln_..)"). A call whose failure is
turned into another status does not count.
roln_status_text and roln_fault_text say of each name what its comment says. Prints what is missing."""
import re
import sys

sys.path.insert(0, "tests/safety")
from headers import HEADERS, named

FUNCTION = re.compile(r"\nROLNI?_\w+ roln_status\s+((?:rolni?|NAME)_\w+)\([^;{]*?\)\s*\n\{(.*?)\n\}", re.S)
FOREIGN = "if (NAME_params_mismatch(p)) return ROLN_E_SHAPE;"  # the top of roln.h says so of all
TURNED = re.compile(r"if \(\w+\([^;]*?\) != ROLN_OK\)\s+(?:st = |return )[^;]*ROLN_E_\w+[^;]*;")
body, says = {}, {}
for header in HEADERS:
    text, last = named(open(header).read()), ""
    for m in FUNCTION.finditer(text):
        before = text[: m.start()]
        body[m[1]] = re.sub(r"/\*.*?\*/", "", m[2], flags=re.S).replace(FOREIGN, "")
        above = re.findall(r"/\*.*?\*/", before[before.rfind("\n}") + 1 :], re.S)
        last = " ".join(c for c in above if len(c) > 60) or last  # a helper may stand between a comment and its function
        says[m[1]] = last
if len(body) < 100:
    print(f"only {len(body)} functions are seen")


def returned(name, on_way=()):
    if name in on_way:
        return set()
    found = set(re.findall(r"(?<![=!]= )\b(ROLN_E_\w+)", body[name]))
    for call in re.findall(r"\b((?:rolni?|NAME)_\w+)\(", TURNED.sub("", body[name])):
        if call in body and call != name:
            found |= returned(call, on_way + (name,))
    return found


def told(name, on_way=()):
    if name in on_way:
        return set()
    found = set(re.findall(r"ROLN_E_\w+", says[name]))
    for inside in re.findall(r"\(([^()]*)\)", says[name]):  # what it is of a kernel
        for other in re.findall(r"\broln_\w+", inside):
            if name.startswith("NAME_") and other in says:
                found |= told(other, on_way + (name,))
    for part in re.findall(r"\b(?:[Ss]tatus(?:es)?|as)\b[^.;]*", says[name]):
        for other in re.findall(r"\b(?:roln|NAME)_\w+", part):
            if other in says:
                found |= told(other, on_way + (name,))
    return found


for name in body:
    if not name.startswith(("rolni_", "NAME_i_")):
        for status in sorted(returned(name) - told(name)):
            print(f"{name}: its comment does not tell {status}")

for header in ("roln_spd.h", "roln.h"):
    text = open(header).read()
    comments = re.findall(r"    (ROLN_(?:OK|E_\w+)) = -?\d+,? +/\* (.*?) \*/", text)
    comments += re.findall(r"#define (ROLN_(?:FAULT_\w+|FILTER_\w+|CLIPPED)) \d+u +/\* (.*?) \*/", text)
    if len(comments) < 11:
        print(f"{header}: only {len(comments)} statuses or faults are seen")
    for name, comment in comments:
        if f'"{name}: {comment}"' not in text:
            print(f"{header}: the text of {name} is not its comment")
