# SPDX-License-Identifier: MIT
"""fuzz_files.py - files that programs read which are not in the fuzzers of C: checkpoints (examples/import.py) and HDF5
(build/convert), damaged by single bits, bytes, cuts and copies. Each program ends with 0, or with 1 and its own last line.

    fuzz_files.py import|convert COUNT [SEED]     COUNT damaged files of this kind
    fuzz_files.py SECONDS                         both kinds for so long each, seeded by the clock

What breaks is kept in build/fuzz/found. Last line: N passed, N failed.
"""
import contextlib
import importlib.util
import io
import os
import random
import subprocess
import sys
import time

os.chdir(os.path.join(os.path.dirname(os.path.abspath(__file__)), "../.."))
sys.dont_write_bytecode = True
DIR, FOUND = "build/fuzz/files", "build/fuzz/found"
CASES = "plain", "packed", "links", "attributes"


def seeds_of(kind):
    """Whole files of that kind, with what a program needs beside them."""
    os.makedirs(DIR, exist_ok=True)
    os.makedirs(FOUND, exist_ok=True)
    if kind == "import":
        names = [f"{DIR}/{k}.pt" for k in ("ae", "lnn")]
        for name in names:
            subprocess.run([sys.executable, "-B", "tests/user/checkpoint.py", os.path.basename(name)[:-3], name], check=True)
    else:
        names = [f"{DIR}/{case}.h5" for case in CASES]
        for case, name in zip(CASES, names):
            subprocess.run(["build/h5_cases", case, name], check=True)
    data = []
    for name in names:
        with open(name, "rb") as f:
            data.append(f.read())
    return data


def damaged(rng, data):
    data = bytearray(data)
    for _ in range(1 if rng.random() < .7 else rng.randrange(2, 6)):
        kind, at = rng.randrange(6), rng.randrange(len(data) or 1)
        if kind == 0:
            data[at:at + 1] = bytes([data[at] ^ 1 << rng.randrange(8)] if data else [])
        elif kind == 1:     # directories lie at the ends
            at = rng.randrange(min(600, len(data) or 1))
            at = at if rng.random() < .5 else max(len(data) - 1 - at, 0)
            data[at:at + 1] = bytes([rng.randrange(256)])
        elif kind == 2:
            del data[at:]
        elif kind == 3:
            data[at:at + rng.randrange(1, 40)] = bytes(rng.randrange(256) for _ in range(8))
        elif kind == 4:
            n = rng.choice((1, 2, 4, 8))
            data[at:at + n] = rng.choice((b"\xff", b"\0", b"\x80", b"\x7f")) * n
        else:
            data[at:at] = data[at:at + rng.randrange(64)]
    return bytes(data)


def importer():
    spec = importlib.util.spec_from_file_location("importer", "examples/import.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def run_import(module, path):
    """None, or what went wrong."""
    try:
        with contextlib.redirect_stdout(io.StringIO()):
            module.main(["import.py", path, "m", "alpha=pi/10", f"out={DIR}", "repair=1"])
    except SystemExit as e:
        text = str(e.code)
        return None if text.startswith("import.py: ") and "\n" not in text else text
    except Exception as e:
        return f"{type(e).__name__}: {e}"
    return None


def run_convert(path):
    try:
        done = subprocess.run(["build/convert", path, f"{DIR}/out.csv"], stdout=subprocess.PIPE, stderr=subprocess.PIPE, timeout=60)
    except subprocess.TimeoutExpired:
        return "no end in 60 s"
    lines = done.stderr.decode(errors="replace").split("\n")
    fine = done.returncode == 0 and not done.stderr or done.returncode == 1 and len(lines) > 2 and lines[-2].startswith("hint: ")
    return None if fine else f"ended with {done.returncode}: {lines[-3:]}"


def fuzz(kind, more, seed):
    """As long as more(count) says so. Returns how many files were fine, and how many were not."""
    rng, seeds, count, bad = random.Random(seed), seeds_of(kind), 0, 0
    module = importer() if kind == "import" else None
    path = f"{DIR}/damaged.{kind}"
    while more(count):
        count += 1
        with open(path, "wb") as f:
            f.write(damaged(rng, rng.choice(seeds)))
        wrong = run_import(module, path) if kind == "import" else run_convert(path)
        if wrong:
            bad += 1
            os.replace(path, f"{FOUND}/{kind}-{seed}-{count}")
            print(f"{FOUND}/{kind}-{seed}-{count}: {wrong[:500]}")
    return count - bad, bad


def main(argv):
    if len(argv) > 1 and argv[1] in ("import", "convert"):
        results = [fuzz(argv[1], lambda n: n < int(argv[2]), int(argv[3]) if len(argv) > 3 else 1)]
    else:
        results = []
        for kind in "import", "convert":
            end = time.time() + float(argv[1])
            results.append(fuzz(kind, lambda n: time.time() < end, int(time.time())))
            print(f"{kind}: {sum(results[-1])} damaged files")
    passed, failed = map(sum, zip(*results))
    print(f"{passed} passed, {failed} failed")
    return failed > 0 or passed == 0


sys.exit(main(sys.argv))
