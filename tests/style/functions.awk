# SPDX-License-Identifier: MIT
# functions.awk - of stripped C, with braces of functions in the first column: file, line, name, lines, parameters, and whether
# Long: stands in the comment above (0, 1).
#   awk -v file=NAME -f functions.awk

# parameters of `signature`, which ends with their parentheses; its name is left in `name`
function parameters(    depth, i, c, count, any) {
    for (i = length(signature); i > 0; i--) {
        c = substr(signature, i, 1)
        if (c == ")") depth++
        else if (c == "(") { if (--depth == 0) break }
        else if (c == "," && depth == 1) count++
        else if (depth && c != " ") any = 1
    }
    name = substr(signature, 1, i - 1)
    sub(/ +$/, "", name)
    if (name ~ /\)$/) sub(/.*[ *]/, "", name); else sub(/.*[^A-Za-z0-9_]/, "", name)
    return substr(signature, i) ~ /^\( *void *\)/ ? 0 : count + any
}
function found(last,    count) {
    sub(/ +$/, "", signature)
    if (signature ~ /\)$/) {
        count = parameters()
        print file, first, name, last - first + 1, count, long + 0
    }
}
function reset() { signature = ""; first = long = 0 }

inside { if (/^}/) { found(NR); reset(); inside = 0 } next }
directive || /^ *#/ { directive = /\\$/; signature = ""; first = 0; next }
/^[ @]*$/ { if (/@/) long = 1; else if (signature == "") long = 0; next }
/^[{]/ { inside = 1; next }
/\) *[{].*}$/ {
    if (!first) first = NR
    signature = signature " " $0
    sub(/ *[{].*/, "", signature)
    found(NR)
    reset()
    next
}
{
    if (!first) first = NR
    signature = signature " " $0
    if (/[;}]$/) reset()
}
