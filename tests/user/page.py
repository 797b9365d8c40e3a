#!/usr/bin/env python3
# SPDX-License-Identifier: MIT
"""page.py - OUT_report.html as a reader finds it: page.py REPORT ERRORS_CSV [WORDS ..]

Every element is closed, every section is there and is linked, nothing is loaded from elsewhere, every number of a picture is
finite, the tables of errors have the numbers of ERRORS_CSV, and WORDS stand in the text. Exit code 0, or 1 and what is wrong."""
import csv
import re
import sys
from html.parser import HTMLParser

SECTIONS = "read training curve errors motion torques inertia friction unknown noise limits".split()
VOID = {"meta"}


class Page(HTMLParser):
    def __init__(self):
        super().__init__()
        self.open, self.sections, self.links, self.wrong, self.text = [], [], [], [], {}
        self.tables, self.title, self.pictures = [], "", {}

    def handle_starttag(self, tag, attributes):
        attributes = dict(attributes)
        if tag not in VOID:
            self.open.append(tag)
        if tag == "section":
            self.sections.append(attributes.get("id"))
        here = self.sections[-1] if self.sections else ""
        if tag == "svg":
            self.pictures[here] = self.pictures.get(here, 0) + 1
        if tag in ("script", "link", "img", "iframe", "object", "image", "use"):
            self.wrong.append(f"<{tag}>")
        for key, value in attributes.items():
            if key in ("src", "xlink:href", "srcset") or (key == "href" and not value.startswith("#")):
                self.wrong.append(f"{key}={value}")
            if key in ("d", "x", "y") and re.search("nan|inf", value):
                self.wrong.append(f"{tag} {key} that is not finite")
        if tag == "a":
            self.links.append(attributes["href"][1:])
        if tag == "h3":
            self.title = ""
        if tag == "table":
            self.tables.append((here, self.title, []))
        if tag == "tr":
            self.tables[-1][2].append([])
        if tag in ("td", "th"):
            self.tables[-1][2][-1].append("")
            self.text[here] = self.text.get(here, "") + " "

    def handle_startendtag(self, tag, attributes):
        self.handle_starttag(tag, attributes)
        self.handle_endtag(tag)

    def handle_endtag(self, tag):
        if tag in VOID:
            return
        if not self.open or self.open.pop() != tag:
            self.wrong.append(f"</{tag}> closes another element")

    def handle_data(self, data):
        here = self.sections[-1] if self.sections else ""
        self.text[here] = self.text.get(here, "") + data
        if self.open and self.open[-1] == "h3":
            self.title += data
        if self.open and self.open[-1] in ("td", "th"):
            self.tables[-1][2][-1][-1] += data


def same(cell, number):
    """The page has - where the CSV has nan."""
    return cell == "-" if number in ("nan", "-nan", "inf") else float(cell) == float(number)


def compare(page, path):
    """Tables of errors against the CSV. Returns what differs."""
    with open(path, encoding="utf-8") as f:
        rows = list(csv.DictReader(f))
    wrong = []
    for name in {row["recordings"] for row in rows}:
        tables = [t[2] for t in page.tables if t[0] == "errors" and t[1] == name]
        want = [row for row in rows if row["recordings"] == name]
        if len(tables) != 2 or any(len(t) != len(want) + 1 for t in tables):
            wrong.append(f"{name}: {len(tables)} tables of {[len(t) for t in tables]} rows, not 2 of {len(want) + 1}")
            continue
        for row, cells, joints in zip(want, tables[0][1:], tables[1][1:]):
            keys = ["ms", "E_q_percent", "E_q_error", "E_q_median_percent", "E_q_90_percent", "constant_velocity_percent", None,
                    "E_qd_percent", "E_qd_error", "worst_joint", None, None, "failed", "windows"]
            pairs = [(c, row[k]) for c, k in zip(cells, keys) if k]
            numbers = [k for k in row if re.match("E_q[0-9]|rms_q", k)]
            pairs += list(zip(joints, [row["ms"]] + [row[k] for k in numbers]))
            if len(joints) != 1 + len(numbers):
                wrong.append(f"{name}: {len(joints)} columns of joints")
            wrong += [f"{name}, {row['ms']} ms: {c}, not {x}" for c, x in pairs if not same(c, x)]
    return wrong if rows else ["no errors in the CSV"]


def main():
    page = Page()
    with open(sys.argv[1], encoding="utf-8") as f:
        source = f.read()
    page.feed(source)
    page.close()
    wrong = page.wrong + compare(page, sys.argv[2])
    if page.open:
        wrong.append(f"open at the end: {page.open}")
    if page.sections != SECTIONS or page.links != SECTIONS:
        wrong.append(f"sections {page.sections}, links {page.links}")
    if re.search("https?:|src=|url[(]|@import", source):
        wrong.append("a reference to elsewhere")
    for section in SECTIONS:
        if len(page.text.get(section, "").split()) < 5:
            wrong.append(f"section {section} says nothing")
    for section in ("curve", "motion", "inertia"):
        if page.pictures.get(section) != 1:
            wrong.append(f"section {section} has no picture")
    whole = " ".join(" ".join(page.text.values()).split())
    wrong += [f'"{words}" is not said' for words in sys.argv[3:] if words not in whole]
    print("\n".join(wrong))
    return 1 if wrong else 0


sys.exit(main())
