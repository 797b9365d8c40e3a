#!/bin/sh
# SPDX-License-Identifier: MIT
# lint.sh - looks for options in config headers that no header of roln reads, a misspelt ROLN_DAMPNG, say, which C takes in silence.
#
#   sh examples/lint.sh examples/arm.h [more.h ..]          or    make lint CONFIG=examples/arm.h
#
# Every #define of a name that no header asks for, but that looks like one that they ask for, is said with its file, its line and
# the option it resembles; so are options that come twice, options behind the last #include "roln.h", and models without a name or
# sizes. Ends with 1 if something was said. Values are the compiler's: it refuses those that make no sense.
[ $# -ge 1 ] || { sed -n '3,9s/^# \{0,1\}//p' "$0"; exit 1; }
for f; do [ -r "$f" ] || { echo "$f: cannot be read"; exit 1; }; done
top=$(dirname "$0")/..
awk '
# how many letters must be changed, added, left out or swapped with the next one to make b of a
function distance(a, b,    i, j, x, d) {
    for (i = 0; i <= length(a); i++) for (j = 0; j <= length(b); j++) {
        if (i == 0 || j == 0) { d[i, j] = i + j; continue }
        x = d[i - 1, j - 1] + (substr(a, i, 1) != substr(b, j, 1))
        if (d[i - 1, j] + 1 < x) x = d[i - 1, j] + 1
        if (d[i, j - 1] + 1 < x) x = d[i, j - 1] + 1
        if (i > 1 && j > 1 && substr(a, i, 1) == substr(b, j - 1, 1) && substr(a, i - 1, 1) == substr(b, j, 1) &&
            d[i - 2, j - 2] + 1 < x) x = d[i - 2, j - 2] + 1
        d[i, j] = x
    }
    return d[length(a), length(b)]
}
function say(line, text) { print name ":" line ": " text; said = 1 }
function end_of_file(    o) {
    for (o in at) if (at[o] && o in model) say(at[o], o ": behind the last #include \"roln.h\", where no model reads it")
    if (!models) say(count, "no #include \"roln.h\", so no model")
}
# what the headers ask for; and at the top of roln.h, the options of a model
FILENAME != name {
    if (configs) end_of_file()
    name = FILENAME
    configs = ++files > headers
    comment = models = 0
    split("", at)
}
!configs {
    if (/^ +#define ROLN_[A-Z_]+ /) model[$2] = 1
    if (/^#ifn?def ROLN_[A-Z_]+$/ && $2 !~ /_H$/) option[$2] = 1
    for (text = $0; match(text, /"#ifn?def ROLN_[A-Z_]+/); text = substr(text, RSTART + RLENGTH)) { # what written weights ask for
        split(substr(text, RSTART, RLENGTH), word, " ")
        option[word[2]] = 1
    }
    next
}
{
    count = FNR
    text = $0
    line = ""
    while (text != "") { # comments away
        if (comment) {
            i = index(text, "*/")
            comment = i == 0
            text = i ? substr(text, i + 2) : ""
        } else {
            i = index(text, "/*")
            comment = i > 0
            line = line (i ? substr(text, 1, i - 1) " " : text)
            text = i ? substr(text, i + 2) : ""
        }
    }
    sub(/\/\/.*/, "", line)
    if (line ~ /^[ \t]*#[ \t]*include[ \t]*["<](.*\/)?roln\.h[">]/) {
        models++
        if (at["ROLN_NAME"]) {
            if (!at["ROLN_AE"]) say(FNR, "a model without ROLN_AE")
            if (!at["ROLN_MLP"] && !at["ROLN_POLYNOMIALS"]) say(FNR, "a model without ROLN_MLP or ROLN_POLYNOMIALS")
        } else for (o in at) if (at[o] && o in model) say(at[o], o ": there is no ROLN_NAME, so no model reads it")
        for (o in at) if (o in model) at[o] = 0
        next
    }
    if (line !~ /^[ \t]*#[ \t]*define[ \t]/) next
    sub(/^[ \t]*#[ \t]*define[ \t]+/, "", line)
    match(line, /^[A-Za-z0-9_]*/)
    key = substr(line, 1, RLENGTH)
    if (key in option) {
        if (at[key]) say(FNR, key ": for the second time, the first is in line " at[key])
        at[key] = FNR
        next
    }
    best = ""
    least = 99
    for (o in option) {
        d = distance(toupper(key), o)
        if (d < least || (d == least && o < best)) { least = d; best = o }
    }
    if (toupper(key) ~ /^ROLN/ || least <= 2)
        say(FNR, key ": no header of roln reads it" (least <= 4 ? ". " best "?" : ""))
}
END { end_of_file(); exit said }
' headers=5 "$top/roln.h" "$top/roln_ae.h" "$top/roln_lnn.h" "$top/roln_riem.h" "$top/roln_spd.h" "$@"
