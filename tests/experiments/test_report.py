# SPDX-License-Identifier: MIT
"""report.py on made-up results: statistics over seeds, missing runs, goals, and pictures. make plotting-test"""
import contextlib
import io
import re
import sys
import tempfile
import unittest
from pathlib import Path
from xml.dom import minidom

sys.dont_write_bytecode = True
import report

RUNS = [(recipe, seeds, system)
        for recipe, seeds, system in [("pend2-exp", 5, "pend2, torques"), ("pend2-chol", 3, "pend2, torques"),
                                      ("pend16-ro", 5, "pend16"), ("pend16-300-ro", 1, "pend16"),
                                      ("pend16-300-poly", 1, "pend16"), ("pend16-paper", 1, "pend16"),
                                      ("pend16-300-pod", 1, "pend16"), ("pend16-opinf", 1, "pend16"), ("rope-n10", 2, "rope"),
                                      ("cloth-n10", 1, "cloth"), ("chart-pend16-d3", 1, "pend16"),
                                      ("chart-pend16-pod", 1, "pend16")] +
        [(f"pend2-few{n}-exp", 2, "pend2, torques") for n in report.FEW[:3]]]


def write_run(directory, run, at_25, at_1000, whole, *more, where="20260131 quick 64"):
    lines = [f"run {run} {where}", "trajectories train 97", "parameters all 11935", "samples million 7.04", "seconds train 1800",
             f"E_q 25 {at_25}", f"E_q 1000 {at_1000}", f"E_q whole {whole}", "trivial 25 4", "seconds all 3600", *more]
    (directory / f"{run}.txt").write_text("\n".join(lines) + "\n")


def write_path(directory, run, shape):
    """shape(whose, instant): beads (x, y, z); of a run that says nothing else."""
    (directory / f"{run}.txt").write_text(f"run {run} 20260131 quick 64\n")
    lines = [f"path {whose} {62 * k} " + " ".join(str(x) for bead in shape(whose, k) for x in bead)
             for whose in ("true", "predicted") for k in range(5)]
    (directory / f"{run}.path").write_text("\n".join(lines) + "\n")


def write_speed(directory):
    times = {"full_ms": 1, "full_us": 30, "full_stable_ms": 10, "full_stable_us": 31, "full_stable_off": 4.25, "encode": .53,
             "decode": .48, "joints": 16, "coordinates": 4, "model_stable_off": .76}
    for model, ms, us in (("model", 1, 15), ("model_stable", 20, 2.5)):
        times.update({f"{model}_{key}": x for key, x in (("ms", ms), ("E_q_25", .37), ("E_q_whole", 6.2), ("latent", us),
                                                         ("decoded", us), ("block", us))})
    lines = [f"{key} pend16 {x}" for key, x in times.items()] + ["integrator pend16 RK4", "weights pend16 pend16-300-ro-1"]
    (directory / "speed.txt").write_text("\n".join(lines + ["missing rope rope-n10-1"]) + "\n")


class TestReport(unittest.TestCase):
    @classmethod
    def setUpClass(cls):
        cls.temporary = tempfile.TemporaryDirectory()
        cls.directory, cls.out = Path(cls.temporary.name), Path(cls.temporary.name) / "out"
        cls.out.mkdir()
        (cls.directory / "runs.list").write_text("".join(f"{recipe}-{seed} {40 if recipe == 'pend2-exp' else 97} {system}\n"
                                                         for recipe, seeds, system in RUNS for seed in range(1, seeds + 1)))
        write_run(cls.directory, "pend16-ro-1", 1, 20, 30)
        write_run(cls.directory, "pend16-ro-2", 3, 40, "nan", "failed whole 2", where="20260201 slow 32")
        write_run(cls.directory, "pend16-300-ro-1", .4, 5, 1e30)
        write_run(cls.directory, "pend16-300-poly-1", .02, 1, 2, "E_q_median 1000 .6")
        write_run(cls.directory, "pend16-300-pod-1", 20, 60, 70)
        write_run(cls.directory, "pend16-opinf-1", 23, 48, 80)
        for seed, error in (1, .1), (2, .9), (4, .2):
            write_run(cls.directory, f"pend2-exp-{seed}", error, 1, 1, "error M 2")
        for seed, error in (1, 1), (2, 1), (3, 4):
            write_run(cls.directory, f"pend2-chol-{seed}", 1, 1, 1, f"error M {error}")
        for name, left in ("d3", .25), ("pod", 12):
            write_run(cls.directory, f"chart-pend16-{name}-1", 1, 1, 1, f"E_q 0 {left}")
        for n in report.FEW[:3]:
            write_run(cls.directory, f"pend2-few{n}-exp-1", 1, 100 // n, 200 // n)
            write_run(cls.directory, f"pend2-few{n}-exp-2", 1, 150 // n, 300 // n)
        write_path(cls.directory, "rope-n10-1", lambda _, k: [(0, 0, 0), (50 - 10 * k, -10, -90), (100 - 10 * k, 20, -180)])
        write_path(cls.directory, "cloth-n10-1", lambda _, k: [(20 * (i // 10) - 190, 20 * (i % 10) - 90, 155 - 30 * k)
                                                               for i in range(200)])
        write_speed(cls.directory)
        report.report(cls.directory, cls.out)
        cls.text = (cls.out / "RESULTS.md").read_text()

    @classmethod
    def tearDownClass(cls):
        cls.temporary.cleanup()

    def has(self, *lines):
        for line in lines:
            self.assertIn(line, self.text)

    def test_cells(self):
        """mean ± standard deviation (median); a value that is not finite; one seed; none; `failed` that is not there is 0."""
        self.has("| 60 s: RO-LNN (A, B) | 2.0 ± 1.4 (2.0) | 30 ± 14 (30) | inf (inf) |",
                 "| exponential map | 0.40 ± 0.44 (0.20) | 1.0 | 1.0 |", "| 300 s: RO-LNN | 0.40 | 5.0 | 1.0e30 |",
                 "| 300 s: LNN, n = 16 | - | - | - |", "| q + h qd | 4.0 | - | - |", "| inf (inf) | 1.0 ± 1.4 (1.0) |",
                 "| exponential, 1 s | 25 ± 7.1 (25) | 12 ± 3.5 (12) | 6.0 ± 1.4 (6.0) | 1.0 |",
                 "| pend16, n = 4 | 12 (1800 s) | - | 0.25 (1800 s) |")

    def test_numbers(self):
        for x, digits, text in ((0, 2, "0"), (9.96, 2, "10"), (.00123, 2, "0.0012"), (.000996, 2, "0.0010"), (9.9e-4, 2, "9.9e-4"),
                                (999999, 2, "1.0e6"), (123456, 2, "123456"), (19.84, 3, "19.8"), (float("nan"), 2, "inf")):
            self.assertEqual(report.number(x, digits), text)

    def test_runs(self):
        self.has("| pend16-ro | pend16 | 97 | 2 of 5 | 11935 | 7.04 | 1800 | 3600 | A, B |",
                 "| pend16-opinf | pend16 | 97 | 1 | 11935 | 7.04 | 1800 | 3600 | A |",
                 "| rope-n10 | rope | 97 | 1 of 2 | - |", "| pend16-paper | pend16 | 97 | 0 of 1 | - | - | - | - | - |",
                 "Machine A: quick 64, 21 runs, 2026-01-31.", "Machine B: slow 32, 1 run, 2026-02-01.",
                 "22 of 29 runs: 20.00 core-hours; the longest run took 60 minutes.",
                 "Missing: pend2-exp-3 5, pend16-ro-3 4 5, pend16-paper, rope-n10-2.")

    def test_goals(self):
        """Met, missed, and open: no result, one rival missing; the median counts as the mean does."""
        self.has("| pend16, 300 s, networks: E_q 25 ms at most 0.03 % | pend16-300-ro, 97 trajectories | 0.40 | **missed** |",
                 "| pend16, 300 s, polynomials: E_q 25 ms at most 0.03 % | pend16-300-poly, 97 trajectories | 0.020 | met |",
                 "median window at most 0.7 % | pend16-300-poly, 97 trajectories | 0.60 | met |",
                 "| POD + LNN over RO-LNN, 300 s, 1 s: 10 times | pend16-300-ro, 97 trajectories | 5.0, pend16-300-pod 60: "
                 "12 times | met |",
                 "whole: 10 times | pend16-300-ro, 97 trajectories | 1.0e30, pend16-300-pod 70: 7.0e-29 times | **missed** |",
                 "pend2 | pend2-exp, 3 of 5 seeds, 97 trajectories | 2.0, pend2-chol 2.0 ± 1.7 (1.0): 1.0 times | "
                 "**missed** |",
                 "| pend2, 30 s, networks: M at most 0.03 % | pend2-exp, 3 of 5 seeds, 97 trajectories | 2.0 | **missed** |",
                 "| rope, n = 10, 300 s, networks: E_q whole at most 1 % | rope-n10, 1 of 2 seeds | - | - |",
                 "LNN, n = 16, compared, 300 s, 25 ms | pend16-300-ro, 97 trajectories | 0.40 | - |",
                 "| pend16: 10 times faster than mj_step, latent | section 7 | 12 times | met |",
                 "| cloth: 50 times faster than mj_step, latent | section 7 | - | - |", "| no run over 60 minutes | 22 of 29 | 60 ")

    def test_speed(self):
        self.has("| | pend16 |\n", "| us per simulated ms | 3.1 |", "| us per RK4 step, encode, decode | 15, 0.53, 0.48 |",
                 "| largest stable step (E_q whole against its own step) | 10 ms (4.2 %) |",
                 "the model at its largest stable one: latent | **reduced**, 12 times |",
                 "each at its largest stable step: latent | **reduced**, 1.24 times |", "No weights of rope (rope-n10-1).")

    def test_pictures(self):
        """Those that have data, and no other; well-formed, no number that is none, the same bytes again."""
        names = re.findall(r"^!\[.*\]\((.*)\)$", self.text, re.M)
        self.assertEqual(sorted(names), ["cloth.svg", "pend16.svg", "pend2_few.svg", "rope.svg", "structure.svg"])
        self.assertEqual(sorted(names), sorted(path.name for path in self.out.glob("*.svg")))
        before = {name: (self.out / name).read_text() for name in names}
        report.report(self.directory, self.out)
        for name in names:
            minidom.parseString(before[name])
            self.assertNotRegex(before[name], r"(?i)[^a-z](nan|inf)[^a-z]")
            self.assertEqual(before[name], (self.out / name).read_text())
            self.assertLess(len(before[name]), 150000)
        self.assertIn(">124 ms<", before["cloth.svg"])
        self.assertIn(">RO-LNN, 300 s<", before["pend16.svg"])

    def test_kept(self):
        """results.txt alone gives the same tables and pictures; a run of DIR counts before a kept one; a run off the list goes."""
        kept = (self.out / "results.txt").read_text()
        with tempfile.TemporaryDirectory() as name:
            again = Path(name)
            (again / "runs.list").write_text((self.directory / "runs.list").read_text())
            (again / "results.txt").write_text(kept + "run gone-1 20250101 quick 64\nE_q 25 1\n")
            report.report(again, again)
            for path in self.out.iterdir():
                self.assertEqual(path.read_text(), (again / path.name).read_text())
            write_run(again, "pend16-ro-1", 5, 20, 30, where="20260131")
            report.report(again, again)
            self.assertIn("| 60 s: RO-LNN (B, C) | 4.0 ± 1.4 (4.0) |", (again / "RESULTS.md").read_text())
            self.assertIn("E_q 25 5\n", (again / "results.txt").read_text())
            self.assertIn(f"run pend16-ro-1 20260131 {report.processor()}\n", (again / "results.txt").read_text())

    def test_nothing(self):
        """No run at all; no run list."""
        with tempfile.TemporaryDirectory() as name:
            empty, stderr = Path(name), io.StringIO()
            with contextlib.redirect_stderr(stderr), self.assertRaises(SystemExit):
                report.report(empty, empty)
            (empty / "runs.list").write_text("pend16-ro-1 200 pend16\n")
            report.report(empty, empty)
            self.assertEqual(sorted(path.name for path in empty.iterdir()), ["RESULTS.md", "results.txt", "runs.list"])
            self.assertIn("0 of 1 runs: 0.00 core-hours", (empty / "RESULTS.md").read_text())


if __name__ == "__main__":
    unittest.main()
