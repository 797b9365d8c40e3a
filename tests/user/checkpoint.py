# SPDX-License-Identifier: MIT
"""checkpoint.py - a checkpoint as PyTorch writes it of the authors' RO-LNN, and what the model in it computes, in double.

    checkpoint.py KIND FILE [PROBE CSV]

KIND: ae, an autoencoder 6, 4, 2 and networks 8, 8; lnn, three joints, networks 5, a base point; or one of them with something
wrong. PROBE: a C header with states and what import.sh demands of them; CSV: the states as a recording. Twin of roln: the
activation as it is published, matrix exponentials as power series, derivatives of energies and of the decoder as differences.
"""
import io
import math
import pickle
import random
import struct
import sys
import types
import zipfile
from collections import OrderedDict

ALPHA = math.pi / 10


# ---- tensors, and a zip with a pickle of them ----

class Storage:
    def __init__(self, kind, key, data):
        self.kind, self.key, self.data = kind, key, data


def fake(module, name, value):
    """A name that the pickle then asks for."""
    value.__module__, value.__qualname__ = module, name
    sys.modules.setdefault(module, types.ModuleType(module))
    setattr(sys.modules[module], name, value)
    return value


def named(name):
    return fake("torch", name, type(name, (), {}))


KINDS = {named("FloatStorage"): "f", named("DoubleStorage"): "d", named("HalfStorage"): "e"}
FLOAT, DOUBLE, HALF = KINDS
REBUILD = fake("torch._utils", "_rebuild_tensor_v2", lambda *args: None)
PARAMETER = fake("torch._utils", "_rebuild_parameter", lambda *args: None)


class Tensor:
    def __init__(self, shape, rows, kind=FLOAT, turned=False, parameter=False):
        self.shape, self.rows, self.kind, self.turned, self.parameter = shape, rows, kind, turned, parameter

    def __reduce__(self):
        """Behind two numbers that are of no tensor; turned: lies in memory by columns."""
        flat = self.rows
        stride = tuple(math.prod(self.shape[i + 1:]) for i in range(len(self.shape)))
        if self.turned:
            flat = [flat[r * self.shape[1] + c] for c in range(self.shape[1]) for r in range(self.shape[0])]
            stride = (1, self.shape[0])
        if not hasattr(self, "storage"):
            self.storage = Storage(self.kind, str(id(self)), [7.0, 7.0] + flat)
        parts = (REBUILD, (self.storage, 2, self.shape, stride, False, OrderedDict()))
        return (PARAMETER, (Plain(parts), True, OrderedDict())) if self.parameter else parts


class Plain:
    def __init__(self, parts):
        self.parts = parts

    def __reduce__(self):
        return self.parts


def write(path, state, order="little", cut=0):
    storages = []

    class Pickler(pickle.Pickler):
        def persistent_id(self, x):
            if not isinstance(x, Storage):
                return None
            if x not in storages:
                storages.append(x)
            return ("storage", x.kind, str(storages.index(x)), "cpu", len(x.data))

    text = io.BytesIO()
    Pickler(text, 2).dump(state)
    with zipfile.ZipFile(path, "w") as archive:
        archive.writestr("model/data.pkl", text.getvalue()[:-cut or None])
        archive.writestr("model/byteorder", order)
        for i, s in enumerate(storages):
            sign = "<" if order == "little" else ">"
            archive.writestr(f"model/data/{i}", struct.pack(f"{sign}{len(s.data)}{KINDS[s.kind]}", *s.data))
        archive.writestr("model/version", "3\n")


# ---- models ----

def single(x):
    return struct.unpack("<f", struct.pack("<f", x))[0]


def draw(rng, count, size):
    return [single(rng.gauss(0, size)) for _ in range(count)]


def networks(rng, prefix, n, widths, state):
    for which, outputs in ("M", n * (n + 1) // 2), ("V", 1):
        before = n
        for i, after in enumerate(widths + [outputs]):
            state[f"{prefix}_{which}.{i}.weight"] = Tensor((after, before), draw(rng, after * before, .6 / math.sqrt(before)),
                                                           turned=i == 1, parameter=i == 0)
            state[f"{prefix}_{which}.{i}.bias"] = Tensor((after,), draw(rng, after, .3), DOUBLE if i == 0 else FLOAT)
            before = after


def autoencoder(rng, sizes, state):
    """Psi random, Phi = A (Psi^T A)^-1, A near Psi."""
    for i, (N, n) in enumerate(zip(sizes, sizes[1:])):
        psi = [draw(rng, n, 1 / math.sqrt(N)) for _ in range(N)]
        a = [[x + y for x, y in zip(row, draw(rng, n, .1))] for row in psi]
        right = solve(product(columns(psi), a))
        phi = product(a, right)
        state[f"autoencoder.layers.{i}.weight"] = Tensor((2 * N, n), [single(x) for row in phi + psi for x in row])
        state[f"autoencoder.layers.{i}.bias"] = Tensor((N,), draw(rng, N, .2))


def model(kind):
    rng, state = random.Random(5), OrderedDict()
    state._metadata = OrderedDict([("", {"version": 1})])
    if kind.startswith("lnn"):
        networks(rng, "layers", 3, [5], state)
        state["layers_M.2.exp_point"] = Tensor((3, 3), [2, .5, -.25, .5, 1, .125, -.25, .125, .75])
    else:
        autoencoder(rng, [6, 4, 2], state)
        networks(rng, "lagrangianNN.layers", 2, [8, 8], state)
        for i in range(2):      # once a model has predicted, its network holds the autoencoder, too
            for what in "weight", "bias":
                state[f"lagrangianNN.ae.layers.{i}.{what}"] = state[f"autoencoder.layers.{i}.{what}"]
    return state


# ---- what it computes ----

def columns(A):
    return [list(c) for c in zip(*A)]


def product(A, B):
    return [[math.fsum(x * y for x, y in zip(row, column)) for column in zip(*B)] for row in A]


def apply(A, x):
    return [math.fsum(a * b for a, b in zip(row, x)) for row in A]


def solve(A, b=None):
    """A^-1 or A^-1 b by Cramer's rule: tiny matrices."""
    def det(M):
        return M[0][0] if len(M) == 1 else sum((-1) ** j * M[0][j] * det([r[:j] + r[j + 1:] for r in M[1:]]) for j in range(len(M)))
    n, d = len(A), det(A)
    if b is None:
        return columns([solve(A, [float(i == j) for i in range(n)]) for j in range(n)])
    return [det([r[:j] + [y] + r[j + 1:] for r, y in zip(A, b)]) / d for j in range(n)]


def power_series(A):
    n, k = len(A), 5
    A = [[x / 2 ** k for x in row] for row in A]
    total = [[float(i == j) for j in range(n)] for i in range(n)]
    term = total
    for p in range(1, 20):
        term = [[x / p for x in row] for row in product(term, A)]
        total = [[x + y for x, y in zip(r, s)] for r, s in zip(total, term)]
    for _ in range(k):
        total = product(total, total)
    return total


class Twin:
    def __init__(self, state, repair):
        self.state, self.repair = state, repair
        self.full = "layers_M.0.weight" in state
        self.prefix = "layers_" if self.full else "lagrangianNN.layers_"
        self.n = state[self.prefix + "M.0.weight"].shape[1]
        self.N = self.n if self.full else state["autoencoder.layers.0.weight"].shape[0] // 2
        self.layers = [] if self.full else [self.layer(i) for i in range(2)]
        s, c = math.sin(ALPHA), math.cos(ALPHA)
        a, b = 1 / s ** 2 - 1 / c ** 2, 1 / s ** 2 + 1 / c ** 2
        self.t = b / a, math.sqrt(2) / (a * s), 1 / a, 2 / (s * c), math.sqrt(2) / c, 2 * a

    def layer(self, i):
        x = self.state[f"autoencoder.layers.{i}.weight"]
        rows = [x.rows[r * x.shape[1]:(r + 1) * x.shape[1]] for r in range(x.shape[0])]
        phi, psi = rows[:len(rows) // 2], rows[len(rows) // 2:]
        if self.repair:
            phi = product(phi, solve(product(columns(psi), phi)))
        return phi, psi, self.state[f"autoencoder.layers.{i}.bias"].rows

    def encode(self, q):
        t1, t2, t3, t4, t5, t6 = self.t
        for _, psi, b in self.layers:
            q = apply(columns(psi), [x - y for x, y in zip(q, b)])
            q = [t1 * x + t2 - t3 * math.sqrt((t4 * x + t5) ** 2 + t6) for x in q]
        return q

    def decode(self, z):
        t1, t2, t3, t4, t5, t6 = self.t
        for phi, _, b in reversed(self.layers):
            z = [t1 * x - t2 + t3 * math.sqrt((t4 * x - t5) ** 2 + t6) for x in z]
            z = [x + y for x, y in zip(apply(phi, z), b)]
        return z

    def network(self, which, x):
        i = 0
        while True:
            w, b = (self.state[f"{self.prefix}{which}.{i}.{what}"] for what in ("weight", "bias"))
            x = [y + b.rows[r] for r, y in enumerate(apply([w.rows[r * len(x):(r + 1) * len(x)] for r in range(w.shape[0])], x))]
            i += 1
            if f"{self.prefix}{which}.{i}.weight" not in self.state:
                return x
            x = [math.log1p(math.exp(y)) for y in x]

    def mass(self, z):
        u, n = self.network("M", z), self.n
        U, k = [[0.0] * n for _ in range(n)], n
        for i in range(n):
            U[i][i] = u[i]
            for j in range(i):
                U[i][j] = U[j][i] = u[k]
                k += 1
        base = self.state.get(f"{self.prefix}M.2.exp_point")
        if not base:
            return power_series(U)
        P = [base.rows[i * n:(i + 1) * n] for i in range(n)]
        return product(P, power_series(product(solve(P), U)))

    def kinetic(self, z, zd):
        return sum(x * y for x, y in zip(zd, apply(self.mass(z), zd))) / 2

    def along(self, f, x, d, h=1e-3):
        """Derivative of f at x along d, of order 4."""
        a, b, c, e = (f([y + k * h * v for y, v in zip(x, d)]) for k in (1, -1, 2, -2))
        return [(8 * (p - q) - (r - s)) / (12 * h) for p, q, r, s in zip(a, b, c, e)]

    def gradient(self, f, x):
        unit = [[float(i == j) for j in range(len(x))] for i in range(len(x))]
        return [self.along(lambda y: [f(y)], x, e)[0] for e in unit]

    def terms(self, z, zd):
        Md = self.along(lambda y: apply(self.mass(y), zd), z, zd)
        c = [a - b for a, b in zip(Md, self.gradient(lambda y: self.kinetic(y, zd), z))]
        return c, self.gradient(lambda y: self.network("V", y)[0], z)

    def reduce(self, z, tau):
        return self.gradient(lambda y: sum(a * b for a, b in zip(self.decode(y), tau)), z)

    def acceleration(self, z, zd, tau):
        c, g = self.terms(z, zd)
        return solve(self.mass(z), [a - b - d for a, b, d in zip(self.reduce(z, tau), c, g)])

    def step(self, z, zd, tau, h, scheme):
        def at(k, f):
            return [x + f * h * y for x, y in zip(z, k[0])], [x + f * h * y for x, y in zip(zd, k[1])]

        def slope(a, b):
            return b, self.acceleration(a, b, tau)
        k1 = slope(z, zd)
        if scheme == "euler":
            return at(k1, 1)
        k2 = slope(*at(k1, .5))
        k3 = slope(*at(k2, .5))
        k4 = slope(*at(k3, 1))
        return at([[(a + 2 * b + 2 * c + d) / 6 for a, b, c, d in zip(*p)] for p in zip(k1, k2, k3, k4)], 1)


def probe(path, csv, twin, scheme):
    rng, rows = random.Random(9), []
    for _ in range(4):
        q, qd, tau = draw(rng, twin.N, .5), draw(rng, twin.N, .5), draw(rng, twin.N, .5)
        z, zd = twin.encode(q), twin.along(twin.encode, q, qd)
        c, g = twin.terms(z, zd)
        after = twin.step(z, zd, tau, .01, scheme)
        rows.append([q, qd, tau, z, zd, twin.decode(z), twin.along(twin.decode, z, zd), sum(twin.mass(z), []), c, g,
                     [twin.kinetic(z, zd)], [twin.network("V", z)[0]], twin.reduce(z, tau), *after])
    with open(csv, "w") as f:
        f.write("".join(", ".join(map(repr, [.01 * i] + r[0] + r[1])) + "\n" for i, r in enumerate(rows)))
    with open(path, "w") as f:
        f.write("static const double probes[][14][64] = {\n")
        for row in rows:
            f.write("{" + ",\n".join("{" + ", ".join(map(repr, x)) + "}" for x in row[:13]) + ",\n{"
                    + ", ".join(map(repr, row[13] + row[14])) + "}},\n")
        f.write("};\n")


# ---- what may be wrong ----

class Evil:
    def __reduce__(self):
        import os
        return os.system, ("touch build/import/evil",)


def spoil(kind, state):
    first, weight = "autoencoder.layers.0.weight", state.get("autoencoder.layers.1.weight")
    M, V = "lagrangianNN.layers_M", "lagrangianNN.layers_V"
    if kind == "ae-off":
        weight.rows[3] += .25
    elif kind == "ae-singular":
        weight.rows[:8] = [0.0] * 8
    elif kind == "ae-evil":
        state["x"] = Evil()
    elif kind == "ae-half":
        state[first].kind = HALF
    elif kind == "ae-unknown":
        state["lagrangianNN.layers_D.0.weight"] = Tensor((1, 1), [1.0])
    elif kind == "ae-missing":
        del state[M + ".1.bias"]
    elif kind == "ae-hole":
        for what in "weight", "bias":
            del state[f"autoencoder.layers.0.{what}"]
    elif kind == "ae-shape":
        state[M + ".1.weight"] = Tensor((8, 7), [0.0] * 56)
    elif kind == "ae-matrix":
        state[first] = Tensor((48,), [0.0] * 48)
    elif kind == "ae-grows":
        state["autoencoder.layers.1.weight"] = Tensor((8, 5), [0.0] * 40)
    elif kind == "ae-latent":
        networks(random.Random(1), "lagrangianNN.layers", 3, [8, 8], state)
    elif kind == "ae-widths":
        networks(random.Random(1), "lagrangianNN.layers", 2, [8, 8], state)
        state[V + ".1.weight"], state[V + ".1.bias"] = Tensor((6, 8), [0.0] * 48), Tensor((6,), [0.0] * 6)
        state[V + ".2.weight"] = Tensor((1, 6), [0.0] * 6)
    elif kind == "ae-deep":
        networks(random.Random(1), "lagrangianNN.layers", 2, [8] * 6, state)
    elif kind == "ae-layers":
        for i in range(9):
            state[f"autoencoder.layers.{i}.weight"] = Tensor((4, 2), [1.0, 0, 0, 1] * 2)
            state[f"autoencoder.layers.{i}.bias"] = Tensor((2,), [0.0] * 2)
            for what in "weight", "bias":
                state.pop(f"lagrangianNN.ae.layers.{i}.{what}", None)
    elif kind == "ae-alias":
        state["lagrangianNN.ae.layers.0.bias"] = Tensor((6,), [0.0] * 6)
    elif kind == "ae-nan":
        weight.rows[0] = math.nan
    elif kind == "ae-large":
        state[V + ".0.bias"].rows[0] = 1e300
    elif kind == "ae-number":
        state["epoch"] = 7
    elif kind == "lnn-indefinite":
        state["layers_M.2.exp_point"].rows[8] = -1.0
    elif kind == "lnn-askew":
        state["layers_M.2.exp_point"].rows[1] = 0.0


def main(kind, path, *header):
    state = model(kind)
    spoil(kind, state)
    write(path, state, "big" if kind.startswith("lnn") else "little", cut=40 if kind == "ae-cut" else 0)
    if header:
        probe(*header, Twin(state, kind == "ae-off"), "euler" if kind == "lnn" else "rk4")


main(*sys.argv[1:])
