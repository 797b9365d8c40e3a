# SPDX-License-Identifier: MIT
"""headers.py - the five headers as text without what is no code, for the programs beside this file. What is taken out becomes
blanks, so that lines and columns stay."""
import re

HEADERS = ["roln.h", "roln_ae.h", "roln_lnn.h", "roln_riem.h", "roln_spd.h"]


def without(pattern, text, flags=0):
    return re.sub(pattern, lambda m: re.sub(r"[^\n]", " ", m.group()), text, flags=flags)


def without_comments(text):
    return without(r"/\*.*?\*/", text, re.S)


def without_words(text):
    """Nor strings and characters."""
    return without(r'"(\\.|[^"\\\n])*"|\'(\\.|[^\'\\\n])\'', without_comments(text))


def named(text):
    """Functions, types and constants of a model by the names that they have in one called NAME."""
    return re.sub(r"\bROLN(I?)_\((\w+)\)", lambda m: "NAME_" + ("i_" if m[1] else "") + m[2], text)


def code(text):
    """Nor directives."""
    return without(r"^#(\\\n|.)*", without_words(text), re.M)
