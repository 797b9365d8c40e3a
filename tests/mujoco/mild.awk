# SPDX-License-Identifier: MIT
# Leaves out the wild trajectories of a pend16 CSV, in which the last block whips round (|q12| >= 2.1 rad): awk -F, -f mild.awk
function flush() { if (text != "" && !wild) { printf "%s%s", gap, text; gap = "\n" } text = ""; wild = 0 }
NR == 1 { print; next }
/^$/ { flush(); next }
{ text = text $0 "\n"; if ($14 >= 2.1 || $14 <= -2.1) wild = 1 }
END { flush() }
