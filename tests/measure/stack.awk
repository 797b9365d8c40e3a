# SPDX-License-Identifier: MIT
# stack.awk - worst-case stack below a call:  awk -v entries='tick ahead' -f stack.awk firmware.ci firmware.s image.dis
# Frames are gcc's (-fcallgraph-info=su); edges are its calls and every branch to a function in the assembly text. A call through a
# member of a struct, x->verb(..), reaches every function whose address is taken and whose name ends in _verb. mem*, which have no
# .ci: what their disassembly takes from sp, branches together. Prints bytes of each entry; exit code 1 and a line for recursion,
# a frame without bound, a call or an address that is not understood.
# verbs: of manifolds, forces, storages, bends
BEGIN { verbs = "size|work|tangent|inner|retract|eval|bwd|mm|mm_bt|column|decode|jac|jac_zd" }

function bad(text) { if (!(text in said)) print "stack: " text; said[text] = failed = 1 }
function last(title) { sub(/.*:/, "", title); return title }
function calls(from, to) { if (!((from, to) in edge)) { edge[from, to] = 1; callees[from] = callees[from] " " to } }

# ---- firmware.ci

FILENAME ~ /ci$/ && /^node:/ && !/shape : ellipse/ {
    split($0, q, "\"")
    name = last(q[2])
    if (name in frame) bad("two functions " name)
    if (!match(q[4], /[0-9]+ bytes \((static|dynamic,bounded)\)/)) bad("frame of " q[4])
    frame[name] = substr(q[4], RSTART) + 0
}
FILENAME ~ /ci$/ && /^edge:/ {
    split($0, q, "\"")
    if (q[4] == "__indirect_call") indirect(last(q[2]), q[6])
    else calls(last(q[2]), last(q[4]))
}

# The verbs called in a line of the source.
function indirect(from, place,   p, text, i, v, found) {
    split(place, p, ":")
    for (i = 1; i <= p[2]; i++) if ((getline text < p[1]) <= 0) bad("no line " place)
    close(p[1])
    while (match(text, /->[a-z_]+\(/)) {
        v = substr(text, RSTART + 2, RLENGTH - 3)
        text = substr(text, RSTART + RLENGTH)
        if (v ~ "^(" verbs ")$") found = may[from] = may[from] " " v
    }
    if (!found) bad("indirect call of " from ", " place)
}

# ---- firmware.s: branches to functions; any other mention of a function is its address

FILENAME ~ /\.s$/ && $1 == ".type" && $NF ~ /function/ { sub(/,.*/, "", $2); here = $2; next }
FILENAME ~ /\.s$/ && $1 == ".size" { here = ""; next }
FILENAME ~ /\.s$/ && ($1 ~ /^\.(section|globl|global|file|ident|string|ascii)$/ || $1 ~ /:$/ || /^[@#]/) { next }
FILENAME ~ /\.s$/ && $1 ~ /^(bl?|b(eq|ne|cs|hs|cc|lo|mi|pl|hi|ls|ge|lt|gt|le)|call|tail|j|jal)$/ {
    sub(/.*,/, "", $NF)
    if (here != "" && $NF !~ /^\./) calls(here, $NF)
    next
}
FILENAME ~ /\.s$/ {
    k = split($0, f, /[^A-Za-z0-9_.$]+/)
    for (i = 1; i <= k; i++) if (f[i] in frame) taken[f[i]] = 1
}

# ---- image.dis: functions without a .ci

FILENAME ~ /dis$/ && /^[0-9a-f]+ <.*>:$/ { here = substr($2, 2, length($2) - 3); next }
FILENAME ~ /dis$/ && !(here in frame) && /^ *[0-9a-f]+:\t/ {
    split($0, q, "\t")
    op = q[2]
    arg = q[3]
    sub(/\.w$/, "", op)
    if (!(here in library)) library[here] = 0
    if (op ~ /^(push|vpush|stmdb|vstmdb)$/ && (op ~ /push/ || arg ~ /^sp!/)) library[here] += 4 * registers(arg)
    else if (op ~ /^(sub|addi?|c\.addi16sp)$/ && arg ~ /^sp,/) {
        k = arg
        sub(/.*[#,]/, "", k)
        if (k !~ /^-?[0-9]+/) odd[here] = $0
        else if (op == "sub") library[here] += k
        else if (k + 0 < 0) library[here] -= k
    } else if (arg ~ /\[sp, #-[0-9]+\]!/) { match(arg, /#-[0-9]+/); library[here] += substr(arg, RSTART + 2, RLENGTH - 2) }
    else if (op ~ /^(mov|mv|and|li)$/ && arg ~ /^sp,/ || op ~ /^(blx|jalr)$/ || op == "jr" && arg !~ /^ra/) odd[here] = $0
    else if (arg ~ /<[^+>]*>/ && op ~ /^(b|bl|j|jal|call|tail|b[a-z][a-z])/) {
        match(arg, /<[^>]*>/)
        calls_library[here] = calls_library[here] " " substr(arg, RSTART + 1, RLENGTH - 2)
    }
}
function registers(list,   k, i, f, n, r) {
    gsub(/.*{|}.*/, "", list)
    k = split(list, f, /, */)
    for (i = 1; i <= k; i++) {
        n += f[i] ~ /d/ ? 2 : 1
        if (split(f[i], r, "-") == 2) n += (substr(r[2], 2) - substr(r[1], 2)) * (f[i] ~ /d/ ? 2 : 1)
    }
    return n
}

# ---- the longest path

function depth(f,   k, i, to, v, d, most, list) {
    if (f in done) return done[f]
    if (f in open) { bad("recursion through " f); return 0 }
    if (f in odd) bad("not understood in " f ": " odd[f])
    if (!(f in frame) && !(f in library)) { bad("no frame of " f); return 0 }
    open[f] = 1
    list = (f in frame) ? callees[f] : calls_library[f]
    k = split(list, to)
    for (i = 1; i <= k; i++) if (to[i] != f || f in frame) { d = depth(to[i]); if (d > most) most = d }
    k = split(may[f], to)
    for (i = 1; i <= k; i++) for (v in taken) if (v ~ "_" to[i] "$") { d = depth(v); if (d > most) most = d }
    delete open[f]
    return done[f] = most + ((f in frame) ? frame[f] : library[f])
}
END {
    for (name in taken) if (name !~ "_(" verbs ")$") bad("address of " name ": a verb of what?")
    k = split(entries, e)
    for (i = 1; i <= k; i++) print e[i], depth(e[i])
    exit failed
}
