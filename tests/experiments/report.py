# SPDX-License-Identifier: MIT
"""report.py - RESULTS.md and its pictures, from the result files of the runs.

    report.py DIR OUTDIR

DIR holds runs.list (what `experiment list` prints), NAME-SEED.txt (lines `key argument value`), NAME-SEED.path of rope and cloth
(lines `path true|predicted ms x y z ..`), and speed.txt (lines `key system value`). OUTDIR/results.txt keeps what they say, one
run after the other: a run that DIR lacks is taken from there, one that neither has is left open. A run of DIR is of this machine,
unless it names another. The text is that of
RESULTS.in.md, beside this file: $name stands for a table of that name, and a line `![..](NAME.svg)` for a picture, which goes if
there is nothing to show.
"""
import io
import math
import re
import statistics
import string
import sys
from collections import namedtuple
from pathlib import Path

try:
    import matplotlib
except ImportError:
    sys.exit("report.py: matplotlib is missing. The results of the runs are kept; `make plotting-deps` installs it (Debian), "
             "`make report` then writes tables and pictures.")
matplotlib.use("svg")
import matplotlib.pyplot as plt
from matplotlib.patches import Circle, Patch, PathPatch
from matplotlib.path import Path as Outline
from matplotlib.ticker import FixedLocator, FuncFormatter, LogLocator, NullLocator

# ---- results ----

Stat = namedtuple("Stat", "count mean deviation median least most")   # over the seeds
Recipe = namedtuple("Recipe", "system trajectories seeds")
TRIVIAL = " trivial"  # what a run says of q + h qd stands under its recipe with this behind it, as E_q


def stat(values):
    """A value that is not finite counts as infinity. None: no values."""
    if not values:
        return None
    x = [v if math.isfinite(v) else math.inf for v in values]
    if min(x) == max(x):
        return Stat(len(x), x[0], 0, x[0], x[0], x[0])
    finite = math.isfinite(max(x))
    return Stat(len(x), statistics.fmean(x) if finite else math.inf, statistics.stdev(x) if finite else 0, statistics.median(x),
                min(x), max(x))


def read_lines(path):
    return path.read_text().splitlines() if path.exists() else []


def processor():
    cpu = Path("/proc/cpuinfo")
    name = re.search(r"^model name\s*: (.*)$", cpu.read_text(), re.M) if cpu.exists() else None
    return name[1] if name else "an unknown processor"


def with_machine(line):
    """The first line of a run, `run NAME day machine`."""
    return line if len(line.split(None, 3)) > 3 else f"{line} {processor()}"


class Results:
    """recipes: the run list; lines[run]: what it says; runs[recipe][seed]: {"key argument": value}."""

    def __init__(self, directory, kept):
        """kept: results.txt, in which a run begins with a line `run NAME-SEED day machine`."""
        self.recipes, self.runs, self.speed, self.lines = {}, {"speed": {}}, {}, {}
        if not (directory / "runs.list").exists():
            sys.exit(f"report.py: no {directory}/runs.list; `make experiments` makes it")
        for line in read_lines(kept):
            if line.startswith("run "):
                of_run = self.lines.setdefault(line.split()[1], [])
            of_run.append(line)
        for line in read_lines(directory / "runs.list"):
            run, trajectories, system = line.split(None, 2)
            name, seed = run.rsplit("-", 1)
            self.recipes[name] = Recipe(system, int(trajectories), int(seed))
            if new := read_lines(directory / f"{run}.txt"):
                self.lines[run] = [with_machine(new[0])] + new[1:] + read_lines(directory / f"{run}.path")
            if run in self.lines:
                self.read_run(name, int(seed), [line for line in self.lines[run] if not line.startswith("path ")])
        if new := read_lines(directory / "speed.txt"):
            self.lines["speed"] = [with_machine("run speed 0")] + new
        self.read_speed(self.lines.get("speed", [])[1:])

    def keep(self, kept):
        listed = [f"{name}-{seed}" for name, recipe in self.recipes.items() for seed in range(1, recipe.seeds + 1)]
        kept.write_text("".join(line + "\n" for run in listed + ["speed"] for line in self.lines.get(run, [])))

    def read_run(self, name, seed, lines):
        _, _, day, machine = lines[0].split(None, 3)
        run = self.runs.setdefault(name, {}).setdefault(seed, {"day": day, "machine": machine})
        trivial = self.runs.setdefault(name + TRIVIAL, {}).setdefault(seed, {})
        for key, argument, value in map(str.split, lines[1:]):
            if key == "trivial":
                trivial["E_q " + argument] = float(value)
            else:
                run[key + " " + argument] = float(value)
            if key == "E_q":  # failures are only written if there are some
                run.setdefault("failed " + argument, 0)

    def read_speed(self, lines):
        """self.speed[system][key]; how many times faster than MuJoCo a model is goes to the recipe `speed` for the goals."""
        for key, system, value in map(str.split, lines):
            self.speed.setdefault(system, {})[key] = value if key in ("weights", "missing", "integrator") else float(value)
        faster = {f"faster {system}": v["full_us"] / v["full_ms"] / v["model_stable_latent"]
                  for system, v in self.speed.items() if "missing" not in v}
        self.runs["speed"] = {1: faster} if faster else {}

    def seeds(self, recipe):
        return sorted(self.runs.get(recipe, {}))

    def machines(self, *recipes):
        """Those that recipes ran on: the first machine of all runs is A, the next one B."""
        names = list(dict.fromkeys(run["machine"] for name in self.recipes for run in self.runs.get(name, {}).values()))
        used = {run["machine"] for recipe in recipes for run in self.runs.get(recipe, {}).values() if "machine" in run}
        return {chr(ord("A") + k): name for k, name in enumerate(names) if name in used}

    def label(self, text, *recipes):
        """With the machines behind it, unless it is A."""
        used = ", ".join(self.machines(*recipes))
        return text if used in ("", "A") else f"{text} ({used})"

    def stat(self, recipe, quantity):
        return stat([run[quantity] for run in self.runs.get(recipe, {}).values() if quantity in run])


# ---- numbers ----


def number(x, digits):
    """So many significant digits, no exponent between .001 and a million."""
    if not math.isfinite(x):
        return "inf"
    if x == 0:
        return "0"
    mantissa, _, exponent = f"{x:.{digits - 1}e}".partition("e")
    power = int(exponent)
    return f"{mantissa}e{power}" if not -3 <= power <= 5 else f"{x:.{max(0, digits - 1 - power)}f}"


def cell(s, digits=2):
    """mean ± standard deviation (median); one value if there is but one."""
    if not s:
        return "-"
    if not math.isfinite(s.mean):
        return f"inf ({number(s.median, digits)})" if s.count > 1 else "inf"
    if s.deviation == 0:
        return number(s.mean, digits)
    return f"{number(s.mean, digits)} ± {number(s.deviation, 2)} ({number(s.median, digits)})"


# ---- tables: rows of (label, recipe), columns of (heading, quantity[, digits]) ----


def markdown(heading, rows):
    lines = [heading, ["---"] * len(heading)] + rows
    return "\n".join("|" + "".join(f" {c} |" if c != "---" else "---|" for c in line) for line in lines).replace("|  |", "| |")


def windows_cell(results, recipe, quantity):
    """median / 90 % window, each the mean over the seeds."""
    both = [results.stat(recipe, quantity.replace("E_q", name)) for name in ("E_q_median", "E_q_90")]
    return " / ".join(number(s.mean, 2) if s else "-" for s in both) if any(both) else "-"


def table(results, rows, columns):
    """A column that no run has is left out; of a table without results none. Behind a table with E_q: that of its windows."""
    shown = [c for c in columns if any(results.stat(recipe, c[1]) for _, recipe in rows)] or columns
    text = markdown([""] + [c[0] for c in shown],
                    [[results.label(*row)] + [cell(results.stat(row[1], quantity), *digits) for _, quantity, *digits in shown]
                     for row in rows])
    cells = [(c[0], [windows_cell(results, recipe, c[1]) for _, recipe in rows]) for c in shown if c[1].startswith("E_q ")]
    cells = [c for c in cells if any(x != "-" for x in c[1])]
    if not cells:
        return text
    return text + "\n\nMedian / 90 % window:\n\n" + markdown(
        [""] + [heading for heading, _ in cells],
        [[results.label(*row), *texts] for row, texts in zip(rows, zip(*(column for _, column in cells)))
         if any(x != "-" for x in texts)])


FEW = (5, 10, 20, 40)  # trajectories of training, for the * of recipes


def few_recipe(results, recipe, n):
    """A recipe of so many trajectories; or the one that has that many anyway."""
    name, other = recipe.replace("*", str(n)), recipe.replace("few*-", "")
    return other if other in results.recipes and results.recipes[other].trajectories == n else name


def few_table(results, rows, when):
    return markdown([""] + [str(n) for n in FEW],
                    [[results.label(f"{label}, {text}", *recipes)] + [cell(results.stat(recipe, quantity)) for recipe in recipes]
                     for text, quantity in when for label, recipe in rows
                     for recipes in [[few_recipe(results, recipe, n) for n in FEW]]])


PEND2 = [("exponential map", "pend2-exp"), ("angles", "pend2-angles"), ("polynomials, angles", "pend2-poly"),
         ("at a learned P", "pend2-base"), ("gyro", "pend2-gyro"), ("P + gyro", "pend2-basegyro"),
         ("Cholesky (DeLaN)", "pend2-chol"), ("dissipative SymODEN", "pend2-symoden"), ("HNN", "pend2-hnn"),
         ("MLP, no structure", "pend2-mlp")]
TURNING = [("exponential map", "pend2-turning-exp"), ("angles", "pend2-turning-angles"),
           ("polynomials, angles", "pend2-turning-poly")]
RELATIVES = [("dissipative SymODEN", "-symoden"), ("HNN", "-hnn"), ("dissipative HNN", "-dhnn"), ("COMET", "-comet"),
             ("MLP, no structure", "-mlp")]


def sixteen(system, longest=()):
    """Rivals on 16 joints, by the seconds of their training."""
    rows = [("RO-LNN", "-ro"), ("RO-LNN, polynomials", "-poly"), ("RO-LNN, Cholesky", "-chol"), ("POD + LNN", "-pod"),
            ("POD + polynomials", "-podpoly"), ("LNN, n = 16", "-full"), ("layered autoencoder, Adam", "-paper")]
    short = [row for row in rows if row[1] != "-podpoly"] + [("LNN, n = 16, Cholesky (DeLaN)", "-fullchol")]
    short += RELATIVES if system == "pend16" else [row for row in RELATIVES if row[1] not in ("-dhnn", "-comet")]
    return ([(f"1200 s: {label}", f"{system}-1200{name}") for label, name in longest] +
            [(f"300 s: {label}", f"{system}-300{name}") for label, name in rows] +
            [(f"60 s: {label}", system + name) for label, name in short] +
            [("L-OpInf", system + "-opinf"), ("L-OpInf, affine", system + "-opinfaffine")])


PEND16, WAVE16 = sixteen("pend16", [("RO-LNN", "-ro"), ("RO-LNN, Cholesky", "-chol")]), sixteen("wave16")
MECHANICAL = ("-ro", "-poly", "-pod", "-podpoly", "-chol", "-paper")
SIZES = [("n = 10, 300 s", "-n10")] + [(f"n = {n}", f"-n{n}") for n in (4, 6, 14)] + [
    ("n = 10, POD + LNN", "-pod"), ("n = 10, layered autoencoder, Adam, 300 s", "-paper")]
ROPE = [("n = 10, polynomials, 300 s", "rope-poly")] + [(label, "rope" + n) for label, n in SIZES]
CLOTH = [(label, "cloth" + n) for label, n in SIZES] + [
    ("n = 10, 300 s, no forces given", "cloth-free-n10"), ("the same, layered autoencoder, Adam", "cloth-free-paper")]
WITHIN = [("RO-LNN", "pend16-ro")] + [(label, "pend16" + name) for label, name in RELATIVES if name not in ("-dhnn", "-comet")]
NARROW = [(label, recipe.replace("16-", "16-narrow-")) for label, recipe in WITHIN]
OPTIMISERS = [(f"{system}, {label}", f"{system}-opt-{name}") for system in ("pend2", "pend16")
              for label, name in (("Gauss-Newton", "newton"), ("L-BFGS", "lbfgs"), ("Adam", "adam"))]
CHARTS = [("pend16, n = 4", "pend16"), ("wave16, n = 4", "wave16"), ("rope, n = 4", "rope-n4"), ("rope, n = 10", "rope-n10"),
          ("cloth, n = 10", "cloth-n10")]
KINDS = [("POD", "-pod"), *[(f"degree {d}", f"-d{d}") for d in (2, 3, 4, 5, 6, 8)], ("layered, 60 s", "-layered")]


def charts_table(results):
    """What a chart leaves of q, and the seconds that it took."""
    def both(name):
        left, seconds = results.stat(name, "E_q 0"), results.stat(name, "seconds train")
        return f"{number(left.mean, 2)} ({number(seconds.mean, 2)} s)" if left and seconds else "-"
    return markdown([""] + [label for label, _ in KINDS],
                    [[label] + [both(f"chart-{system}{kind}") for _, kind in KINDS] for label, system in CHARTS])


def with_trivial(rows, recipe):
    return rows + [("q + h qd", recipe + TRIVIAL)]


def with_rivals(rows, system):
    return with_trivial(rows + [("L-OpInf, n = 10", system + "-opinf"), ("L-OpInf, affine, n = 10", system + "-opinfaffine")],
                        system + "-n10") + [("polynomial of the start", system + "-fit")]


def errors(key, *headings):
    """Columns of `key` at 0 ms, 25 ms, 1 s .. and over whole trajectories; the first one says which key."""
    ms = {"1 s": "1000", "2 s": "2000", "whole": "whole"}
    return [(h if i else f"{key} {h}", f"{key} {ms.get(h, h[:-3])}") for i, h in enumerate(headings)]


E_QDD, TRAINING, STEP = ("E_qdd", "E_qdd 0"), ("training, s", "seconds train"), ("ms per predicted second", "us step")  # of 1 ms
DRIFT = [("drift own", "drift own"), ("drift true", "drift true")]
GRID_Q = errors("E_q", "0 ms", "1 ms", "2 ms", "3 ms", "5 ms", "25 ms", "100 ms", "250 ms", "500 ms", "whole")
GRID_MORE = [E_QDD, *errors("E_qd", "0 ms", "2 ms", "3 ms", "25 ms", "whole"), *DRIFT, ("trajectories", "trajectories train", 1),
             TRAINING]
RANGE = [*errors("E_q", "0 ms", "25 ms", "400 ms", "2 s", "whole"), DRIFT[1], ("failed, 2 s", "failed 2000"),
         ("failed, whole", "failed whole")]
SIXTEEN_MORE = [E_QDD, *errors("E_qd", "25 ms", "1 s"), *DRIFT, ("parameters", "parameters all", 1), TRAINING, STEP]
TABLES = {
    "pend2_errors": (with_trivial(PEND2, "pend2-exp"),
                     [E_QDD, *errors("E_q", "25 ms", "1 s", "whole"), *errors("E_qd", "25 ms", "whole")]),
    "pend2_dynamics": (PEND2[:7], [("M", "error M"), ("c", "error c"), ("g", "error g"), *DRIFT, TRAINING]),
    "pend2_turning": (with_trivial(TURNING, "pend2-turning-exp"),
                      [E_QDD, *errors("E_q", "25 ms", "1 s", "whole"), ("M", "error M"), DRIFT[1]]),
    "pend16_q": (with_trivial(PEND16, "pend16-ro"), errors("E_q", "0 ms", "25 ms", "100 ms", "1 s", "whole")),
    "pend16_more": (PEND16, SIXTEEN_MORE),
    "pend16_dynamics": ([row for row in PEND16 if row[1].endswith(MECHANICAL)] +
                     [("60 s: RO-LNN, forces known (absolute)", "pend16-pd")],
                     [("M", "error M"), ("V", "error V")]),
    "wave16_q": (with_trivial(WAVE16, "wave16-ro"), errors("E_q", "0 ms", "25 ms", "100 ms", "1 s", "whole")),
    "wave16_more": (WAVE16, SIXTEEN_MORE),
    "wave16_dynamics": ([row for row in WAVE16 if row[1].endswith(MECHANICAL)], [("M", "error M"), ("V", "error V")]),
    "optimisers": (OPTIMISERS, [E_QDD, *errors("E_q", "25 ms", "1 s", "whole"), ("million samples", "samples million"), TRAINING]),
    "rope_q": (with_rivals(ROPE, "rope"), GRID_Q),
    "rope_more": (ROPE, GRID_MORE),
    "cloth_q": (with_rivals(CLOTH, "cloth"), GRID_Q),
    "cloth_more": (CLOTH, GRID_MORE),
    "within": (WITHIN, RANGE),
    "narrow": (NARROW, RANGE),
}
WHEN_25, WHEN_1000, WHEN_WHOLE = ("25 ms", "E_q 25"), ("1 s", "E_q 1000"), ("whole", "E_q whole")


def few16(system):
    return ([("RO-LNN", system + "-few*-ro"), ("RO-LNN, polynomials", system + "-few*-poly"),
             ("LNN, n = 16", system + "-few*-full")],
            [WHEN_25, WHEN_1000, WHEN_WHOLE])


FEW_TABLES = {
    "pend2_few": ([("exponential", "pend2-few*-exp"), ("polynomials, angles", "pend2-few*-poly"),
                   ("Cholesky", "pend2-few*-chol"), ("unstructured", "pend2-few*-mlp")],
                  [WHEN_1000, WHEN_WHOLE]),
    "pend16_few": few16("pend16"),
    "wave16_few": few16("wave16"),
}

# ---- speed ----

SYSTEMS = {"pend2": "pend2", "pend16": "pend16", "pend16_paper": "pend16, layered autoencoder", "wave16": "wave16",
           "rope": "rope", "cloth_given": "cloth, contact forces given", "cloth": "cloth"}
REDUCED = [("us per simulated ms: latent", "{%s_latent}"), ("one encode, a decode every step", "{%s_decoded}"),
           ("latent, 16 roll-outs together, each", "{%s_block}")]
FASTER = [("**faster**, HOW: latent", "latent"), ("with encode and decode", "decoded"), ("latent, 16 together", "block")]
SPEED = [
    ("joints, latent coordinates", "{joints}, {coordinates}"),
    ("**MuJoCo**: integrator, its time step", "{integrator}, {full_ms} ms"),
    ("us per mj_step", "{full_us}"),
    ("us per simulated ms", "{full}"),
    ("largest stable step (E_q whole against its own step)", "{full_stable_ms} ms ({full_stable_off} %)"),
    ("us per simulated ms", "{full_stable}"),
    ("**reduced model**: weights", "{weights}"),
    ("us per RK4 step, encode, decode", "{model}, {encode}, {decode}"),
    ("steps of 1 ms: E_q 25 ms, whole", "{model_E_q_25} %, {model_E_q_whole} %"),
    *[(label, text % "model") for label, text in REDUCED],
    ("largest stable step (off its steps of 1 ms)", "{model_stable_ms} ms ({model_stable_off} %)"),
    ("E_q 25 ms, whole", "{model_stable_E_q_25} %, {model_stable_E_q_whole} %"),
    *[(label, text % "model_stable") for label, text in REDUCED],
] + [(label.replace("HOW", how), "{%s/%s_%s}" % (full, model, what))
     for how, full, model in (("each at its standard step", "full", "model"),
                              ("MuJoCo at its standard step, the model at its largest stable one", "full", "model_stable"),
                              ("each at its largest stable step", "full_stable", "model_stable"))
     for label, what in FASTER]


def speed_texts(v):
    """What stands in the braces of SPEED: microseconds and steps with three digits, the rest with two."""
    v = dict(v, full=v["full_us"] / v["full_ms"], full_stable=v["full_stable_us"] / v["full_stable_ms"],
             model=v["model_latent"] * v["model_ms"])
    text = {}
    for key, x in v.items():
        if isinstance(x, str):
            text[key] = x
        elif key in ("encode", "decode") or "E_q" in key or key.endswith("off"):
            text[key] = f"{x:.2g}"
        else:
            text[key] = f"{x:.3g}" if x < 100 else f"{x:.0f}"
    for full in ("full", "full_stable"):
        for model in (m for m in v if re.fullmatch("model(_stable)?_(latent|decoded|block)", m)):
            times = v[full] / v[model]
            text[f"{full}/{model}"] = f"**reduced**, {times:.3g} times" if times > 1 else f"**MuJoCo**, {1 / times:.3g} times"
    return text


def speed_table(results):
    known = {s: speed_texts(v) for s, v in results.speed.items() if "missing" not in v}
    text = markdown([""] + [SYSTEMS[s] for s in known], [[label] + [form.format_map(v) for v in known.values()]
                                                         for label, form in SPEED]) if known else ""
    where = [f"Machine: {results.lines['speed'][0].split(None, 3)[3]}."] if "speed" in results.lines else []
    return "\n\n".join(where + [text] * bool(known) + [f"No weights of {SYSTEMS[s]} ({v['missing']})."
                                               for s, v in results.speed.items() if s not in known])


# ---- goals ----

# at_most, at_least: a limit; times_below: so many times below the least of the others; none of these: the quotient is shown
Goal = namedtuple("Goal", "text recipe quantity at_most at_least times_below others", defaults=(None, None, None, ()))


def at_most(text, recipe, quantity, limit):
    return Goal(f"{text} at most {limit:g} %", recipe, quantity, at_most=limit)


MS_25, S_1, WHOLE, MEDIAN_1 = (("E_q 25 ms", "E_q 25"), ("E_q 1 s", "E_q 1000"), ("E_q whole", "E_q whole"),
                               ("E_q 1 s, median window", "E_q_median 1000"))
M, V = ("M", "error M"), ("V", "error V")


def goals_of_heads(text, networks, polynomials, *limits):
    """The same limits for a recipe with networks and for one with polynomials."""
    return [at_most(f"{text}, {head}: {what}", recipe, quantity, limit)
            for head, recipe in (("networks", networks), ("polynomials", polynomials))
            for (what, quantity), limit in limits]


GOALS = [
    *goals_of_heads("pend16, 300 s", "pend16-300-ro", "pend16-300-poly", (MS_25, .03), (S_1, 2), (WHOLE, 3), (MEDIAN_1, .7)),
    *goals_of_heads("wave16, 300 s", "wave16-300-ro", "wave16-300-poly", (MS_25, .03), (S_1, 2), (WHOLE, 2.5)),
    *goals_of_heads("pend16, 20 trajectories, 60 s", "pend16-few20-ro", "pend16-few20-poly", (MS_25, .1), (S_1, 6)),
    *goals_of_heads("pend2, 30 s", "pend2-exp", "pend2-poly", (S_1, .05), (WHOLE, .08), (M, .03)),
    *goals_of_heads("pend2, joint 2 turns over, angles", "pend2-turning-angles", "pend2-turning-poly", (S_1, .5)),
    *goals_of_heads("rope, n = 10, 300 s", "rope-n10", "rope-poly", (MS_25, .2), (WHOLE, 1)),
    at_most("pend16, 300 s: E_q 0 ms", "pend16-300-ro", "E_q 0", .02),
    *[at_most(f"pend16, 1,200 s{head}: {what}", "pend16-1200" + name, quantity, limit)
      for head, name in (("", "-ro"), (", Cholesky", "-chol"))
      for (what, quantity), limit in ((S_1, 1), (WHOLE, 2), (M, 1), (V, 3))],
    at_most("pend2, 10 trajectories, 30 s: E_q 1 s", "pend2-few10-exp", "E_q 1000", 1),
    at_most("pend2, 10 trajectories, 30 s: E_q whole", "pend2-few10-exp", "E_q whole", 2),
    at_most("cloth, n = 10, 300 s: reconstruction", "cloth-n10", "E_q 0", .25),
    at_most("cloth, n = 10, 300 s: whole, forces not given", "cloth-free-n10", "E_q whole", .35),
    *[Goal(f"POD + {head} over RO-LNN{same}, 300 s, {when}: {times} times", "pend16-300" + ours, quantity, times_below=times,
           others=("pend16-300" + theirs,))
      for head, same, ours, theirs in (("LNN", "", "-ro", "-pod"), ("polynomials", ", polynomials", "-poly", "-podpoly"))
      for when, quantity, times in (("25 ms", "E_q 25", 200), ("1 s", "E_q 1000", 10), ("whole", "E_q whole", 10))],
    *[Goal(f"{system}: LNN, n = 16, compared, 300 s, {when}", f"{system}-300-ro", quantity, others=(f"{system}-300-full",))
      for system in ("pend16", "wave16")
      for when, quantity in (("25 ms", "E_q 25"), ("1 s", "E_q 1000"), ("whole", "E_q whole"))],
    *[Goal(f"pend16: at 25 ms, {n} trajectories", f"pend16-few{n}-ro", "E_q 25", others=(f"pend16-few{n}-full",)) for n in FEW],
    Goal("pend16: 10 times faster than mj_step, latent", "speed", "faster pend16", at_least=10),
    Goal("rope: 50 times faster than mj_step, latent", "speed", "faster rope", at_least=50),
    Goal("cloth: 50 times faster than mj_step, latent", "speed", "faster cloth", at_least=50),
    Goal("the same, contact forces given", "speed", "faster cloth_given", at_least=50),
    *[Goal(f"exponential map better than Cholesky in M, {text}", ours, "error M", times_below=1, others=(theirs,))
      for text, ours, theirs in (("pend2", "pend2-exp", "pend2-chol"), ("pend16", "pend16-ro", "pend16-chol"),
                                 ("wave16", "wave16-ro", "wave16-chol"))],
]


def verdict(met):
    return "-" if met is None else "met" if met else "**missed**"


def quotient(a, b):
    return a / b if b else math.inf


def goal_row(results, goal):
    run = [goal.recipe if goal.recipe != "speed" else "section 7"]
    recipe, seeds = results.recipes.get(goal.recipe), len(results.seeds(goal.recipe))
    if recipe and 0 < seeds < recipe.seeds:
        run.append(f"{seeds} of {recipe.seeds} seeds")
    if trained := results.stat(goal.recipe, "trajectories train"):
        run.append(f"{trained.mean:.0f} trajectories")
    s = results.stat(goal.recipe, goal.quantity)
    others = [(results.stat(name, goal.quantity), name) for name in goal.others]
    known = [other for other in others if other[0]]
    reached = cell(s) + (" times" if s and goal.at_least else "")
    met = None
    if known:
        least, name = min(known, key=lambda other: other[0].mean)
        reached += f", {'q + h qd' if name.endswith(TRIVIAL) else name} {cell(least)}"
        if s:
            reached += f": {number(quotient(least.mean, s.mean), 2)} times"
            if goal.times_below and len(known) == len(others):
                met = min(quotient(least.mean, s.mean), quotient(least.median, s.median)) >= goal.times_below
    elif s and goal.at_most:
        met = max(s.mean, s.median) <= goal.at_most
    elif s and goal.at_least:
        met = min(s.mean, s.median) >= goal.at_least
    return [goal.text, ", ".join(run), reached, verdict(met)]


# ---- the run list ----


def cost(results):
    """Runs there are and runs there should be, hours of all, minutes of the longest."""
    runs = [run for name in results.recipes for run in results.runs.get(name, {}).values()]
    seconds = [run["seconds all"] for run in runs if "seconds all" in run]
    return (len(runs), sum(recipe.seeds for recipe in results.recipes.values()),
            sum(seconds) / 3600, max(seconds, default=0) / 60)


def goals_table(results):
    runs, wanted, hours, longest = cost(results)
    whole = [["no run over 60 minutes", f"{runs} of {wanted}", f"{longest:.0f} minutes", verdict(longest <= 60 if runs else None)],
             ["at most 8 core-hours", f"{runs} of {wanted}", f"{hours:.2f}", verdict(hours <= 8 if runs else None)]]
    return markdown(["goal", "run", "reached", ""], [goal_row(results, goal) for goal in GOALS] + whole)


def machine_line(results, letter, machine):
    runs = [run for name in results.recipes for run in results.runs.get(name, {}).values()]
    days = sorted(run["day"] for run in runs if run["machine"] == machine)
    when = " to ".join(f"{day[:4]}-{day[4:6]}-{day[6:]}" for day in dict.fromkeys([days[0], days[-1]]))
    return f"Machine {letter}: {machine}, {len(days)} run{'s' * (len(days) > 1)}, {when}."


def runs_table(results):
    rows, missing = [], []
    for name, recipe in results.recipes.items():
        seeds, trained = results.seeds(name), results.stat(name, "trajectories train")
        rows.append([name, recipe.system, f"{trained.mean if trained else recipe.trajectories:.0f}",
                     str(recipe.seeds) if len(seeds) == recipe.seeds else f"{len(seeds)} of {recipe.seeds}"])
        for quantity, digits in (("parameters all", 1), ("samples million", 3), ("seconds train", 3), ("seconds all", 3)):
            s = results.stat(name, quantity)
            rows[-1].append(number(s.mean, digits) if s else "-")
        rows[-1].append(", ".join(results.machines(name)) or "-")
        left = " ".join(str(seed) for seed in range(1, recipe.seeds + 1) if seed not in seeds)
        if left:
            missing.append(f"{name}-{left}" if seeds else name)
    runs, wanted, hours, longest = cost(results)
    heading = ["run", "system", "trajectories", "seeds", "parameters", "million samples", "training, s", "with its measurement, s",
               "machine"]
    return "\n\n".join([markdown(heading, rows)] + [machine_line(results, *m) for m in results.machines(*results.recipes).items()] +
                       [f"{runs} of {wanted} runs: {hours:.2f} core-hours; the longest run took {longest:.0f} minutes.",
                        f"Missing: {', '.join(missing)}." if missing else "No run is missing."])


# ---- pictures: of 760 px; each returns a figure, or None if there is nothing to show ----

plt.rcdefaults()
plt.rcParams.update({"svg.hashsalt": "roln", "svg.fonttype": "none", "font.sans-serif": ["DejaVu Sans", "Helvetica", "Arial"],
                     "font.size": 9, "axes.spines.top": False, "axes.spines.right": False, "axes.axisbelow": True,
                     "grid.color": "#e4e4e4", "legend.frameon": False})


def save(figure, path):
    """The same bytes on every run: no date. Coordinates in 1/100 point, no blanks that a path does without."""
    text = io.StringIO()
    figure.savefig(text, format="svg", metadata={"Date": None, "Creator": None})
    plt.close(figure)
    shorter = re.sub(r'(?<= d=")[^"]*', lambda outline: shorten(outline[0]), text.getvalue())
    path.write_text(re.sub(r"[ \t]+$", "", shorter, flags=re.M))


def shorten(outline):
    rounded = re.sub(r"-?\d+\.\d+", lambda x: f"{float(x[0]):.2f}".rstrip("0").rstrip("."), outline)
    return re.sub(r"\s*([A-Za-z])\s*", r"\1", rounded)


def new_figure(title, height, rows, columns, **place):
    figure, axes = plt.subplots(rows, columns, squeeze=False, figsize=(760 / 96, height / 96))
    figure.subplots_adjust(**place)
    figure.text(.026, 1 - 30 / height, title, size=12)
    return figure, list(axes.flat)


HORIZONS = (1, 5, 25, 100, 250, 400, 500, 1000, 2000)
Series = namedtuple("Series", "label recipe colour line", defaults=("-",))
Panel = namedtuple("Panel", "title quantity series")  # quantity E_q: against the horizon; E_q 25 ..: against FEW
PEND2_FEW = [Series("exponential", "pend2-few*-exp", "#08519c"), Series("polynomials", "pend2-few*-poly", "#6baed6"),
             Series("Cholesky", "pend2-few*-chol", "#e6550d"), Series("unstructured", "pend2-few*-mlp", "#555555", "--")]


def few_series(system):
    return [Series("RO-LNN", system + "-few*-ro", "#08519c"), Series("polynomials", system + "-few*-poly", "#6baed6"),
            Series("LNN, n = 16", system + "-few*-full", "#238b45")]


def curves(system):
    return [Series("polynomials, 300 s", system + "-300-poly", "#e7298a"), Series("RO-LNN, 300 s", system + "-300-ro", "#08306b"),
            Series("RO-LNN", system + "-ro", "#2171b5"), Series("RO, Cholesky", system + "-chol", "#807dba"),
            Series("layered, Adam", system + "-paper", "#6baed6"),
            Series("POD + LNN", system + "-pod", "#a63603"), Series("LNN, n = 16", system + "-full", "#006d2c"),
            Series("same, Cholesky", system + "-fullchol", "#74c476"),
            Series("L-OpInf, affine", system + "-opinfaffine", "#e6ab02", "--"),
            Series("diss. SymODEN", system + "-symoden", "#7a0177"), Series("chart + MLP", system + "-mlp", "#555555", "--")]


def optimiser_series(system):
    return [Series("Gauss-Newton", system + "-opt-newton", "#08519c"), Series("L-BFGS", system + "-opt-lbfgs", "#238b45"),
            Series("Adam", system + "-opt-adam", "#e6550d")]


NARROW_CURVES = [
    Series("RO-LNN", "pend16-narrow-ro", "#08519c"), Series("diss. SymODEN", "pend16-narrow-symoden", "#238b45"),
    Series("HNN", "pend16-narrow-hnn", "#e6550d"), Series("MLP", "pend16-narrow-mlp", "#555555", "--")]
STRUCTURE_CURVES = [s._replace(recipe=s.recipe.replace("narrow-", "")) for s in NARROW_CURVES]


def gather(results, panel, series):
    """Points (x, Stat) of a curve."""
    if " " in panel.quantity:
        points = [(n, results.stat(few_recipe(results, series.recipe, n), panel.quantity)) for n in FEW]
    else:
        points = [(ms, results.stat(series.recipe, f"{panel.quantity} {ms}")) for ms in HORIZONS]
    return [(x, s) for x, s in points if s]


def draw_panel(axes, panel, curves):
    """Medians over the seeds, with bars from the least to the largest. Curves leave the frame at its top."""
    few = " " in panel.quantity
    low = min(s.least if few else s.median for _, points in curves for _, s in points)
    high = max(s.most if few else s.median for _, points in curves for _, s in points)
    high = min(high, max(200, 5 * low))  # per cent
    low = max(min(low, high / 3), 1e-6)
    for i, (series, points) in enumerate(sorted(curves, key=lambda curve: -curve[1][-1][1].median)):
        aside = 1.02 ** (i - (len(curves) - 1) / 2) if few else 1
        least, y, most = ([min(max(getattr(s, name), 1e-9), 1e9) for _, s in points] for name in ("least", "median", "most"))
        x = [aside * p for p, _ in points]
        axes.plot(x, y, series.line, color=series.colour, label=series.label, marker="o", markersize=2.5, linewidth=1.5)
        axes.vlines(x, least, most, color=series.colour, linewidth=.8)
    axes.set(xscale="log", yscale="log", xlim=(4.5, 44) if few else (1, 2000), ylim=(low / 1.2, high * 1.2),
             xlabel="training trajectories" if few else "horizon")
    axes.set_title(panel.title, loc="left", size=9, weight="bold")
    axes.xaxis.set(major_locator=FixedLocator(FEW if few else (1, 10, 100, 1000)), minor_locator=NullLocator(),
                   major_formatter=FuncFormatter(lambda x, _: f"{x:g}" if few else f"{x:g} ms" if x < 1000 else "1 s"))
    axes.yaxis.set(major_locator=LogLocator(subs=(1, 2, 5) if high / low < 60 / 1.44 else (1,)), minor_locator=NullLocator(),
                   major_formatter=FuncFormatter(lambda y, _: f"{y:g}"))
    axes.grid(axis="y")
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1), labelcolor="linecolor", borderaxespad=0, handlelength=1.6,
                handletextpad=.5)


def draw_curves(results, title, height, panels):
    curves = [[(s, points) for s in panel.series if (points := gather(results, panel, s))] for panel in panels]
    if not any(curves):
        return None
    figure, axes = new_figure(title, height, 1, len(panels), left=.075, right=.815, top=1 - 76 / height,
                              bottom=50 / height, wspace=.85)
    for place, panel, drawn in zip(axes, panels, curves):
        if drawn:
            draw_panel(place, panel, drawn)
        else:
            place.axis("off")
    return figure


TRUE = dict(facecolor="#deebf7", edgecolor="#9ecae1")
PREDICTED = dict(facecolor="none", edgecolor="#08519c")


def read_shapes(results, run):
    """Instants (ms, true, predicted) of a run's path, each a list of (x, y, z) in mm."""
    shapes = {"true": [], "predicted": []}
    for _, whose, ms, *xyz in (line.split() for line in results.lines.get(run, []) if line.startswith("path ")):
        xyz = [float(x) for x in xyz]
        shapes[whose].append((int(ms), list(zip(xyz[::3], xyz[1::3], xyz[2::3]))))
    return [(ms, true, predicted) for (ms, true), (_, predicted) in zip(shapes["true"], shapes["predicted"])]


def draw_rope(results, title, run):
    """From the side, in the plane in which the rope starts, from where it starts on the left; each instant hangs a step right."""
    shapes = read_shapes(results, run)
    if not shapes:
        return None
    figure, (axes,) = new_figure(title, 496, 1, 1, left=.03, right=.97, top=.9, bottom=.02)
    x, y, _ = shapes[0][1][-1]
    length = -max(1, math.hypot(x, y))
    styles = (dict(color="#9ecae1", linewidth=4.5, solid_capstyle="round"), dict(color="#08519c", linewidth=1.2, linestyle="--"))
    heights = [z for _, true, _ in shapes for _, _, z in true]
    apart = .34 * (max(heights) - min(heights))
    for k, (ms, *ropes) in enumerate(shapes):
        for rope, style, label in zip(ropes, styles, ("true", "predicted")):
            axes.plot([k * apart + (x * p[0] + y * p[1]) / length for p in rope], [p[2] for p in rope],
                      label=label if k == 0 else None, **style)
        axes.plot(k * apart, 0, "o", color="#222222", markersize=5)
        axes.annotate(f"{ms} ms", (k * apart, 0), (0, 8), textcoords="offset points", ha="center")
    axes.set_aspect("equal")
    axes.axis("off")
    axes.legend(loc="lower right", bbox_to_anchor=(1, 1), ncol=2)
    return figure


def project(p):
    """Parallel projection, from above at the long side: to the right, up, away."""
    turned, lifted = .38, .5  # rad
    back = math.cos(turned) * p[1] - math.sin(turned) * p[0]
    return (math.cos(turned) * p[0] + math.sin(turned) * p[1], math.sin(lifted) * back + math.cos(lifted) * p[2],
            math.cos(lifted) * back - math.sin(lifted) * p[2])


def cells(cloth, front):
    """Outline of the cells in front of the middle of the sphere, or behind it, far ones first."""
    rows, beads = 10, [project(p) for p in cloth]
    quads = [(beads[i], beads[i + rows], beads[i + rows + 1], beads[i + 1]) for i in range(len(beads) - rows) if (i + 1) % rows]
    quads = sorted((q for q in quads if (sum(p[2] for p in q) < 0) == front), key=lambda q: -sum(p[2] for p in q))
    return Outline.make_compound_path(*[Outline([p[:2] for p in q] + [(0, 0)], closed=True) for q in quads]) if quads else None


def draw_cloth(results, title, run):
    shapes = read_shapes(results, run)
    if not shapes:
        return None
    figure, axes = new_figure(title, 484, 2, 3, left=.01, right=.99, top=.84, bottom=.01, wspace=.04, hspace=.12)
    for place, (ms, true, predicted) in zip(axes, shapes):
        for layer, front in ((1, False), (5, True)):
            for order, cloth, width, colours in ((0, true, 1.8, TRUE), (1, predicted, .5, PREDICTED)):
                outline = cells(cloth, front)
                if outline:
                    place.add_patch(PathPatch(outline, linewidth=width, zorder=layer + order, joinstyle="round", **colours))
        place.add_patch(Circle((0, 0), 100, facecolor="#eeeeee", edgecolor="#bbbbbb", zorder=3))
        place.set(xlim=(-225, 225), ylim=(-110, 220), aspect="equal", title=f"{ms} ms")
        place.title.set_size(9)
    for place in axes:
        place.axis("off")
    figure.legend(handles=[Patch(linewidth=1.8, label="true", **TRUE), Patch(linewidth=.5, label="predicted", **PREDICTED)],
                  loc="upper right", ncol=2)
    return figure


def few_picture(name, joints, series):
    return (draw_curves, f"{name}: error and number of training trajectories", 330,
            [Panel(f"E_q after {joints[0]}, %", joints[1], series), Panel(f"E_q {joints[2]}, %", joints[3], series)])


PICTURES = {
    "pend2_few": few_picture("2 joints", ("1 s", "E_q 1000", "of the whole 3 s", "E_q whole"), PEND2_FEW),
    "optimisers": (draw_curves, "Three optimisers, the same loss and seconds", 380,
                   [Panel("E_q, %, pend2, 30 s", "E_q", optimiser_series("pend2")),
                    Panel("E_q, %, pend16, 30 s", "E_q", optimiser_series("pend16"))]),
    "pend16": (draw_curves, "pend16, n = 4: error of q against the horizon", 470, [Panel("E_q, %", "E_q", curves("pend16"))]),
    "wave16": (draw_curves, "wave16, n = 4: error of q against the horizon", 470, [Panel("E_q, %", "E_q", curves("wave16"))]),
    "pend16_few": few_picture("pend16", ("25 ms", "E_q 25", "after 1 s", "E_q 1000"), few_series("pend16")),
    "wave16_few": few_picture("wave16", ("25 ms", "E_q 25", "after 1 s", "E_q 1000"), few_series("wave16")),
    "rope": (draw_rope, "Rope, 192 dof, n = 10: one unseen second", "rope-n10-1"),
    "cloth": (draw_cloth, "Cloth, 600 dof, n = 10: an unseen fall", "cloth-n10-1"),
    "cloth_free": (draw_cloth, "Cloth, 600 dof, n = 10, no contact forces given", "cloth-free-n10-1"),
    "structure": (draw_curves, "16 joints: with and without structure", 380,
                  [Panel("E_q, %, within the training range", "E_q", STRUCTURE_CURVES),
                   Panel("E_q, %, out of it", "E_q", NARROW_CURVES)]),
}

# ---- the document ----


def report(directory, out):
    kept = out / "results.txt"
    results, template = Results(directory, kept), (Path(__file__).parent / "RESULTS.in.md").read_text()
    results.keep(kept)
    text = {name: table(results, *spec) for name, spec in TABLES.items()}
    text.update({name: few_table(results, *spec) for name, spec in FEW_TABLES.items()})
    text.update(charts=charts_table(results), runs=runs_table(results), goals=goals_table(results), speed=speed_table(results))
    unused = [name for name in text if not re.search(rf"\${name}\b", template)]
    if unused:
        sys.exit(f"RESULTS.in.md: no ${', $'.join(unused)}")

    def picture(line):
        draw, *spec = PICTURES[line[1]]
        figure = draw(results, *spec)
        if figure:
            save(figure, out / f"{line[1]}.svg")
        return line[0] if figure else ""

    filled = re.sub(r"^!\[.*\]\((\w+)\.svg\)$", picture, string.Template(template).substitute(text), flags=re.M)
    (out / "RESULTS.md").write_text(re.sub(r"\n{3,}", "\n\n", filled))


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit("usage: report.py DIR OUTDIR")
    report(Path(sys.argv[1]), Path(sys.argv[2]))
