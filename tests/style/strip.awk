# SPDX-License-Identifier: MIT
# strip.awk - C without comments, strings and characters, line by line. Of a comment with "Long:" an @ is left, where it ends.
{
    rest = $0
    out = ""
    while (rest != "") {
        if (comment) {
            end = index(rest, "*/")
            part = end ? substr(rest, 1, end - 1) : rest
            if (index(part, "Long:")) reason = 1
            if (!end) break
            rest = substr(rest, end + 2)
            out = out (reason ? "@" : " ")
            comment = reason = 0
        } else if (match(rest, /\/\*|\/\/|"|'/)) {
            out = out substr(rest, 1, RSTART - 1)
            mark = substr(rest, RSTART, 2)
            rest = substr(rest, RSTART)
            if (mark == "/*") { comment = 1; rest = substr(rest, 3) }
            else if (mark == "//") rest = ""
            else if (match(rest, /^"([^"\\]|\\.)*"/) || match(rest, /^'([^'\\]|\\.)*'/)) {
                out = out "0"
                rest = substr(rest, RLENGTH + 1)
            } else { out = out substr(rest, 1, 1); rest = substr(rest, 2) }
        } else {
            out = out rest
            rest = ""
        }
    }
    sub(/[ \t]+$/, "", out)
    print out
}
