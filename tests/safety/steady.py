# SPDX-License-Identifier: MIT
"""steady.py - which branches of a call depend on numbers: by gcov, of steady.c at -O0, over random states.

steady.py FOLDER STATES, FOLDER with the program steady and the notes of gcov. Prints, for tick, ahead, filter and observe, every
function of the headers in which a branch is taken more often in one state than in another: what, function.
"""
import gzip
import json
import os
import subprocess
import sys


def counts(folder, what, state):
    """Taken branches of one call: {(function, line, number): count}."""
    data = os.path.join(folder, "steady-firmware.gcda")
    if os.path.exists(data):
        os.remove(data)
    subprocess.run(["./steady", what, str(state)], cwd=folder, check=True)
    out = subprocess.run(["gcov", "-b", "-c", "--json-format", "--stdout", "steady-firmware.gcda"], cwd=folder, check=True,
                         stdout=subprocess.PIPE, stderr=subprocess.DEVNULL).stdout
    if out[:2] == b"\x1f\x8b":
        out = gzip.decompress(out)
    return {(line.get("function_name", f["file"]), line["line_number"], k): branch["count"]
            for f in json.loads(out)["files"] if os.path.basename(f["file"]).startswith("roln")
            for line in f["lines"] for k, branch in enumerate(line["branches"])}


def main():
    folder, states = sys.argv[1], int(sys.argv[2])
    for what in ("tick", "ahead", "filter", "observe"):
        seen = [counts(folder, what, state) for state in range(1, states + 1)]
        moved = {key[0] for key in set().union(*seen) if len({one.get(key, 0) for one in seen}) > 1}
        for function in sorted(moved):
            print(what, function)


if __name__ == "__main__":
    main()
