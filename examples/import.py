# SPDX-License-Identifier: MIT
"""import.py - a model trained in Python becomes a config header, weights and a .roln for roln. Python 3.8, nothing else.

    python3 examples/import.py model.pt NAME alpha=pi/10 [key=value ..]
    python3 examples/import.py old.roln new.roln        a .roln of roln 0.3, format 2, becomes one of today

model.pt: the state_dict of the RO-LNN of Friedl et al. (ICLR 2025) or of its Lagrangian network alone, as torch.save writes it: a
zip with a pickle of tensors. The pickle is read without executing anything. Written: NAME.h, NAME_weights.h, NAME.roln.

    alpha=      angle of the activation: a number or pi/k, between 0 and pi/4 (the authors' default: pi/10); the slope of roln is
                tan(pi/4 - alpha). Needed where there is an autoencoder, for a state_dict does not hold it
    step=rk4    integrator: euler, leapfrog, rk4 or midpoint
    dt=0        time step in s that roll-outs and controllers take by default
    repair=0    1: where Psi^T Phi is not I, Phi becomes Phi (Psi^T Phi)^-1, which leaves the encoder as it is
    activation=SoftPlus    of the networks; roln has no other
    out=        directory to write to

A state_dict does not hold the range of z and zd, without which a guard calls every state unknown (ROLN_FAULT_RANGE):
examples/range.c takes it from the recordings of the training.

Exit code 0: done; 1: what cannot be read or represented, said in the last line.
"""
import math
import os
import pickle
import re
import struct
import sys
import zipfile
from collections import OrderedDict, namedtuple
from operator import mul

FORMAT = 3                  # ROLN_FORMAT
LAYERS, WIDTHS = 8, 5       # of ROLN_AE and ROLN_MLP at most
SCHEMES = ("", "euler", "rk4", "midpoint", "leapfrog")
OFF = 1e-3                  # norm of Psi^T Phi - I that is rounding, and a little more

Tensor = namedtuple("Tensor", "shape data")     # data by rows


def fail(text):
    sys.exit("import.py: " + "".join(c if c.isprintable() else "?" for c in text))


# ---- a checkpoint ----

def reader(archive, folder):
    """An unpickler that makes tensors and nothing else: the one in Python, whose memo does not grow with an index in the file."""
    kinds = {"FloatStorage": "f", "DoubleStorage": "d"}

    def number_order():
        try:
            return {b"little": "<", b"big": ">"}[archive.read(folder + "byteorder")]
        except KeyError:
            return "<"

    def tensor(storage, offset, shape, stride, *rest):
        if not all(type(n) is int and n >= 0 for n in (offset, *shape, *stride)) or len(shape) != len(stride):
            fail("a tensor of impossible shape")
        if math.prod(shape) > len(storage):
            fail("a tensor is longer than its numbers")
        at = [offset]
        for size, step in zip(shape, stride):
            at = [a + i * step for a in at for i in range(size)]
        if at and max(at) >= len(storage):
            fail("a tensor is longer than its numbers")
        return Tensor(tuple(shape), [storage[a] for a in at])

    class Reader(pickle._Unpickler):
        def find_class(self, module, name):
            if module == "torch" and name.endswith("Storage"):
                return name
            allowed = {("collections", "OrderedDict"): OrderedDict, ("torch._utils", "_rebuild_tensor_v2"): tensor,
                       ("torch._utils", "_rebuild_parameter"): lambda data, *rest: data}
            if (module, name) not in allowed:
                fail(f"the file asks for {module}.{name}; only tensors are read: torch.save(model.state_dict(), ..)")
            return allowed[module, name]

        def persistent_load(self, key):
            kind, name, place, count = key[1], str(key[2]), key[3], key[4]
            if kind not in kinds:
                fail(f"numbers of type {str(kind).replace('Storage', '')}: roln takes Float and Double")
            numbers = archive.read(f"{folder}data/{name}")
            size = struct.calcsize(kinds[kind])
            if len(numbers) < count * size:
                fail(f"data/{name} has {len(numbers)} bytes, not {count * size}")
            return struct.unpack(f"{number_order()}{count}{kinds[kind]}", numbers[:count * size])

    return Reader


def read_checkpoint(path):
    """Names and tensors."""
    if not os.path.isfile(path):
        fail(f"cannot read {path}")
    try:
        if not zipfile.is_zipfile(path):
            fail(f"{path} is no zip, as torch.save of PyTorch 1.6 and later writes it")
        with zipfile.ZipFile(path) as archive:
            pickles = [n for n in archive.namelist() if n.endswith("data.pkl")]
            if len(pickles) != 1:
                fail(f"{path} has {len(pickles)} data.pkl, not one")
            with archive.open(pickles[0]) as f:
                found = reader(archive, pickles[0][:-len("data.pkl")])(f).load()
    except Exception as e:      # zipfile, zlib and pickle raise nearly every kind, as the bytes are
        fail(f"{path} is damaged: {type(e).__name__}: {e}")
    if not isinstance(found, dict) or not all(isinstance(k, str) and isinstance(x, Tensor) for k, x in found.items()):
        fail(f"{path} is no state_dict: names and tensors")
    for name, x in found.items():
        if not all(map(math.isfinite, x.data)):
            fail(f"{name} has numbers that are not finite")
    return found


# ---- its tensors ----

Model = namedtuple("Model", "sizes hidden base layers mass potential")


def shaped(tensors, name, shape):
    """Takes a tensor out of those that are left."""
    if name not in tensors:
        fail(f"{name} is missing")
    if tensors[name].shape != shape:
        fail(f"{name} is {list(tensors[name].shape)}, not {list(shape)}")
    return tensors.pop(name).data


def count_of(tensors, pattern):
    return len({m[1] for m in map(re.compile(pattern).fullmatch, tensors) if m})


def side(tensors, name, axis):
    """A size that only this tensor tells."""
    if name not in tensors:
        fail(f"{name} is missing")
    if len(tensors[name].shape) != 2:
        fail(f"{name} is {list(tensors[name].shape)}, not a matrix")
    return tensors[name].shape[axis]


def autoencoder(tensors):
    """Sizes, and Phi, Psi, b of each layer; matrices by rows of length n."""
    sizes, layers = [], []
    for i in range(count_of(tensors, r"autoencoder\.layers\.(\d+)\..*")):
        name = f"autoencoder.layers.{i}."
        twice, n = side(tensors, name + "weight", 0), side(tensors, name + "weight", 1)
        N = sizes[-1] if sizes else twice // 2
        weight = shaped(tensors, name + "weight", (2 * N, n))
        if n > N or n < 1:
            fail(f"layer {i} of the autoencoder goes from {N} to {n}: sizes must not grow")
        rows = [weight[r * n:r * n + n] for r in range(2 * N)]
        layers.append((rows[:N], rows[N:], shaped(tensors, name + "bias", (N,))))
        sizes += [n] if sizes else [N, n]
        for alias in ("weight", "bias"):    # the network holds the autoencoder, too
            twin = tensors.pop(f"lagrangianNN.ae.layers.{i}.{alias}", None)
            if twin and twin.data != (weight if alias == "weight" else layers[-1][2]):
                fail(f"lagrangianNN.ae.layers.{i}.{alias} is not {name}{alias}")
    if len(layers) > LAYERS:
        fail(f"{len(layers)} layers of the autoencoder: roln has {LAYERS} at most")
    return sizes, layers


def network(tensors, name, n, outputs):
    """Hidden sizes, and the weights in the order of roln: hidden matrices [in][out], the output's [out][in]."""
    depth, theta, widths, before = count_of(tensors, re.escape(name) + r"\.(\d+)\.weight") - 1, [], [], n
    for i in range(depth + 1):
        after = outputs if i == depth else side(tensors, f"{name}.{i}.weight", 0)
        weight = shaped(tensors, f"{name}.{i}.weight", (after, before))
        if i < depth:
            weight = [weight[r * before + c] for c in range(before) for r in range(after)]
            widths.append(after)
        theta += weight + shaped(tensors, f"{name}.{i}.bias", (after,))
        before = after
    return widths, theta


def model_of(tensors):
    """All that the tensors say; every one of them is used."""
    tensors = dict(tensors)
    sizes, layers = autoencoder(tensors)
    name = "lagrangianNN.layers_" if layers else "layers_"
    n = side(tensors, name + "M.0.weight", 1)
    if layers and n != sizes[-1]:
        fail(f"{name}M.0.weight takes {n} numbers, the autoencoder gives {sizes[-1]}")
    widths, mass = network(tensors, name + "M", n, n * (n + 1) // 2)
    others, potential = network(tensors, name + "V", n, 1)
    if widths != others:
        fail(f"the networks of M and V have hidden sizes {widths} and {others}: roln has one ROLN_MLP for both")
    if not 1 <= len(widths) <= WIDTHS:
        fail(f"{len(widths)} hidden layers: roln has 1 to {WIDTHS}")
    base = f"{name}M.{len(widths) + 1}.exp_point"
    base = shaped(tensors, base, (n, n)) if base in tensors else []
    if tensors:
        fail(f"{sorted(tensors)[0]}: unknown to roln")
    if not all(1 <= size <= 65535 for size in sizes + [n] + widths):
        fail("sizes below 1 or above 65535")
    return Model(sizes or [n], widths, base, layers, mass, potential)


def check_base(P, n):
    """Symmetric and positive definite, by Cholesky."""
    a = [P[i * n:i * n + n] for i in range(n)]
    if any(a[i][i] <= 0 for i in range(n)):
        fail("exp_point is not positive definite")
    if any(abs(a[i][j] - a[j][i]) > 1e-5 * math.sqrt(abs(a[i][i] * a[j][j])) for i in range(n) for j in range(i)):
        fail("exp_point is not symmetric")
    L = []
    for i in range(n):
        L.append([])
        for j in range(i):
            L[i].append((a[i][j] - sum(map(mul, L[i], L[j]))) / L[j][j])
        square = a[i][i] - sum(x * x for x in L[i])
        if square <= 0:
            fail("exp_point is not positive definite")
        L[i].append(math.sqrt(square))
    return [(a[i][j] + a[j][i]) / 2 for i in range(n) for j in range(n)]


def transposed(A):
    return [list(column) for column in zip(*A)]


def inverse(A):
    """By elimination, with the largest pivot; None: there is none to working precision."""
    n = len(A)
    A = [row + [float(i == j) for j in range(n)] for i, row in enumerate(A)]
    for k in range(n):
        p = max(range(k, n), key=lambda i: abs(A[i][k]))
        if abs(A[p][k]) < 1e-6:
            return None
        A[k], A[p] = A[p], A[k]
        A[k] = [x / A[k][k] for x in A[k]]
        for i in range(n):
            if i != k and A[i][k] != 0:
                A[i] = [x - A[i][k] * y for x, y in zip(A[i], A[k])]
    return [row[n:] for row in A]


def left_inverse(l, phi, psi, repair):
    """Phi^T with Psi^T Phi = I, which repair= may restore."""
    phi, psi = transposed(phi), transposed(psi)
    product = [[sum(map(mul, a, b)) for b in phi] for a in psi]
    off = math.sqrt(sum((x - (i == j)) * (x - (i == j)) for i, row in enumerate(product) for j, x in enumerate(row)))
    print(f"layer {l}: |Psi^T Phi - I| = {off:.1e}")
    if off <= OFF:
        return phi
    if not repair:
        fail(f"layer {l}: Psi^T Phi is not I; repair=1 mends Phi")
    right = inverse(product)
    if right is None:
        fail(f"layer {l}: Psi^T Phi has no inverse")
    rows = transposed(phi)
    return [[sum(map(mul, row, column)) for row in rows] for column in transposed(right)]


# ---- what roln reads ----

def single(x):
    """The float next to x."""
    if not math.isfinite(x):
        fail(f"a number that is not finite, {x}, comes of these weights")
    try:
        return struct.unpack("<f", struct.pack("<f", x))[0]
    except OverflowError:
        fail(f"{x:g} is too large for a float")


def numbers_of(model, slope, least, dt, repair):
    """Those of NAME_params: slope, least, scales of q, t and M, dt, no range of z and zd, theta."""
    n = model.sizes[-1]
    theta = []
    for l, (phi, psi, b) in enumerate(model.layers):
        for row in left_inverse(l, phi, psi, repair) + transposed(psi):
            theta += row
        theta += b
    theta += model.mass + model.potential + (check_base(model.base, n) if model.base else [])
    return list(map(single, [slope, least, 1, 1, 1, dt] + [0] * (3 * n) + theta))


def packed(model, scheme, numbers):
    """The bytes of NAME_pack: roln.h, 7 packed parameters."""
    n, L, H = model.sizes[-1], len(model.layers), len(model.hidden)
    head = [scheme, 0, 2 * bool(model.base), L, H + 1, 0, n] + model.sizes + model.hidden + [n]
    data = b"ROLN" + struct.pack("<HBB", FORMAT, 4, len(head)) + struct.pack(f"<{len(head)}H", *head)
    data += struct.pack(f"<{len(numbers)}f", *numbers)
    return data + checksum(data)


def checksum(data):
    """FNV-1a, 64 bit."""
    h = 0xcbf29ce484222325
    for byte in data:
        h = (h ^ byte) * 0x100000001b3 & 0xffffffffffffffff
    return struct.pack("<Q", h)


def renew(path, to):
    """Format 2 becomes 3: behind slope, least and the scales of q and t stands that of M, 1."""
    try:
        with open(path, "rb") as f:
            data = f.read()
    except OSError as e:
        fail(f"cannot read {path}: {e.strerror}")
    if len(data) < 32 or data[:6] != b"ROLN\2\0" or data[6] not in (4, 8):
        fail(f"{path} is not of format 2")
    if data[-8:] != checksum(data[:-8]):
        fail(f"{path} is damaged")
    at = 8 + 2 * data[7] + 4 * data[6]
    if at > len(data) - 8:
        fail(f"{path} is damaged")
    data = b"ROLN\3\0" + data[6:at] + struct.pack("<f" if data[6] == 4 else "<d", 1) + data[at:-8]
    try:
        with open(to, "wb") as f:
            f.write(data + checksum(data))
    except OSError as e:
        fail(f"cannot write {to}: {e.strerror}")
    print(f"wrote {to}: {len(data) + 8} bytes")


def literal(x):
    """A float exactly, as an integer over a power of two."""
    bits = struct.unpack("<I", struct.pack("<f", x))[0]
    e, m = bits >> 23 & 255, bits & 0x7fffff
    m, e = m | (e > 0) << 23, max(e, 1) - 150
    while m and not m & 1:
        m, e = m >> 1, e + 1
    text = ("-" if bits >> 31 else "") + f"{m}.f"
    while m and e:
        k = min(abs(e), 60)
        text += f"{'*' if e > 0 else '/'}{1 << k}.f"
        e += -k if e > 0 else k
    return text


def listed(numbers):
    rows = [", ".join(map(literal, numbers[i:i + 8])) for i in range(0, len(numbers), 8)]
    return ",\n    ".join(rows)


def needs(name, model, scheme):
    """One type for every option that C can compare: the weights compile with their config only."""
    def filled(names, values):
        return list(zip(names.split(), values + [0] * LAYERS))

    base = int(bool(model.base))
    options = [("AE_" + "_".join(map(str, model.sizes)), filled("N N1 N2 N3 N4 N5 N6 N7 N8", model.sizes)),
               ("MLP_" + "_".join(map(str, model.hidden)), filled("H1 H2 H3 H4 H5", model.hidden)),
               ("INTEGRATOR_" + SCHEMES[scheme], [("scheme", scheme)]),
               ("CHART_none_0", [("degree", 0)]), ("MASS_exponential", [("cholesky", 0)]), (f"BASE_{base}", [("base", base)]),
               ("LAYERS_0", filled("L0 L1 L2 L3", [])), ("DAMPING_0", [("damping", 0)]), ("FRICTION_0", [("friction", 0)]),
               ("ANGLES_0", [("angles", 0)]), ("SCALE_common", [("own", 0)]),
               ("INPUTS_0", [("inputs", 0)]), ("QUANTISE_full", [("stored", 0)]), ("DOUBLE_not_defined_0", [("twice", 0)]),
               (f"FORMAT_{FORMAT}", [("format", FORMAT)])]
    return "".join(f"typedef char {name}_weights_are_of_ROLN_{option}["
                   + " && ".join(f"{name}_{size} == {x}" for size, x in sizes) + " ? 1 : -1];\n" for option, sizes in options)


def weights(name, model, scheme, numbers):
    """The text of NAME_write."""
    n, var = model.sizes[-1], f"const {name}_params {name}_weights"
    cuts = [6, 6 + n, 6 + 2 * n, 6 + 3 * n, len(numbers)]
    low, high, fast, theta = (listed(numbers[a:b]) for a, b in zip(cuts, cuts[1:]))
    own, scale = listed(numbers[:2]), listed(numbers[2:5])
    return (f"/* Include it behind the header of the config. With ROLN_WEIGHTS_EXTERN defined {name}_weights "
            "is only declared here;\n"
            "   the one file of the program that defines ROLN_WEIGHTS_HERE, too, has it. */\n"
            f'#ifndef ROLN_H\n#error "include the header of the config, {name}.h, first"\n#endif\n'
            f"#ifndef {name}_weights_h\n#define {name}_weights_h\n{needs(name, model, scheme)}"
            f"#ifndef ROLN_WEIGHTS_EXTERN\nROLN_FLASH static {var} =\n#else\nROLN_FLASH extern {var};\n"
            f"#ifdef ROLN_WEIGHTS_HERE\nROLN_FLASH {var} =\n#endif\n#endif\n"
            "#if !defined ROLN_WEIGHTS_EXTERN || defined ROLN_WEIGHTS_HERE\n"
            f"    {{{own},\n    {{{scale}}},\n    {literal(numbers[5])},\n    {{{low}}},\n    {{{high}}},\n    {{{fast}}},\n"
            f"    {{{theta}}}}};\n#endif\n#endif\n")


def config(name, path, model, scheme, slope):
    """The header of the model."""
    guard = name.upper() + "_H"
    source = os.path.basename(path).replace("*/", "")
    lines = [f"/* {name}.h - written by examples/import.py from {source} */", f"#ifndef {guard}", f"#define {guard}", "",
             f"#define ROLN_NAME {name}", "#define ROLN_AE " + ", ".join(map(str, model.sizes)),
             "#define ROLN_MLP " + ", ".join(map(str, model.hidden)), f"#define ROLN_INTEGRATOR {SCHEMES[scheme]}"]
    lines += [f"#define ROLN_SLOPE {slope:.9g}"] if model.layers else []
    lines += ["#define ROLN_BASE 1"] if model.base else []
    return "\n".join(lines + ['#include "roln.h"', "", "#endif", ""])


# ---- settings ----

def number(key, text):
    m = re.fullmatch(r"pi/(\d+(?:\.\d*)?)", text)
    try:
        x = math.pi / float(m[1]) if m else float(text)
    except (ValueError, ZeroDivisionError):
        x = math.nan
    if not math.isfinite(x):
        fail(f"{key}={text}: not a number")
    return x


def settings(words):
    found = {"alpha": "", "step": "rk4", "dt": "0", "repair": "0", "activation": "SoftPlus", "out": "."}
    for word in words:
        key, eq, value = word.partition("=")
        if not eq or key not in found:
            fail(f"{word}: not one of " + ", ".join(k + "=" for k in found))
        found[key] = value
    if found["activation"] != "SoftPlus":
        fail(f"activation={found['activation']}: the networks of roln have SoftPlus")
    if found["step"] not in SCHEMES[1:]:
        fail(f"step={found['step']}: euler, leapfrog, rk4 or midpoint")
    if found["repair"] not in ("0", "1"):
        fail(f"repair={found['repair']}: 0 or 1")
    if number("dt", found["dt"]) < 0:
        fail(f"dt={found['dt']}: a time step is not negative")
    return found


def main(argv):
    if len(argv) < 3:
        fail("usage: import.py model.pt NAME alpha=pi/10 [step=rk4] [dt=0] [repair=0] [activation=SoftPlus] [out=.]")
    path, name = argv[1:3]
    if len(argv) == 3 and path.endswith(".roln"):
        return renew(path, name)
    if not re.fullmatch("[A-Za-z_][A-Za-z0-9_]*", name):
        fail(f"{name}: no name in C")
    had = settings(argv[3:])
    model = model_of(read_checkpoint(path))
    slope = 0.41421356      # the default of roln; without layers nothing reads it
    if model.layers:
        if not had["alpha"]:
            fail("alpha= is missing: the angle of the activation of the autoencoder, pi/10 where nobody chose another")
        alpha = number("alpha", had["alpha"])
        if not 0 < alpha < math.pi / 4:
            fail(f"alpha={had['alpha']}: between 0 and pi/4")
        slope = float(f"{math.tan(math.pi / 4 - alpha):.9g}")
    scheme = SCHEMES.index(had["step"])
    numbers = numbers_of(model, slope, 1e-4, number("dt", had["dt"]), had["repair"] == "1")
    files = {f"{name}.h": config(name, path, model, scheme, slope).encode(),
             f"{name}_weights.h": weights(name, model, scheme, numbers).encode(), f"{name}.roln": packed(model, scheme, numbers)}
    for file, data in files.items():
        try:
            with open(os.path.join(had["out"], file), "wb") as f:
                f.write(data)
        except OSError as e:
            fail(f"cannot write {file}: {e.strerror}")
    print(f"wrote {', '.join(files)}: {len(numbers)} numbers, {len(files[name + '.roln'])} bytes, no range of z (examples/range.c)")


if __name__ == "__main__":
    main(sys.argv)
