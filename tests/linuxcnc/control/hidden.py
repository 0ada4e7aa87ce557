"""The machine behind the control: what no machine file has. Its chain and its errors are written apart from the program's.

    truth = {"a_direction": .., "a_point": .., "c_direction": .., "c_point": .., "ball": .., "length": .., "reach": ..,
             "noise_mm": .., "errors": {"EZC": [cos, sin, cos 2, sin 2], ..}}

X, Y and Z carry the tool, A and on it C the part; vectors in machine axes, mm and degrees; `ball` is its centre with A and C at 0. Errors are those of ISO
230: of what the axis carries, in the axes of its fixed side, at its point; translations in mm, rotations in rad. Of a rotary axis four numbers: cosine and
sine of the angle and of its double; of a linear axis four: Legendre polynomials 1 to 4 over -500 to 500 (Z -400 to 700). Beside them "C0Y", "B0Z", "A0Z"
(rad), "sag" (rotation about X and translation along Y with sin A, translation along Z with cos A) and "screw_X", "screw_Y" (sine and cosine over 10 mm).
"""
import math
import random

TRAVEL = {"X": (-500.0, 500.0), "Y": (-500.0, 500.0), "Z": (-400.0, 700.0)}


def turned(v, n, degrees):
    c, s = math.cos(math.radians(degrees)), math.sin(math.radians(degrees))
    x = (n[1] * v[2] - n[2] * v[1], n[2] * v[0] - n[0] * v[2], n[0] * v[1] - n[1] * v[0])
    d = (n[0] * v[0] + n[1] * v[1] + n[2] * v[2]) * (1 - c)
    return [c * v[i] + s * x[i] + d * n[i] for i in range(3)]


def by_vector(v, r):
    """v turned by the rotation vector r, rad."""
    angle = math.sqrt(r[0] * r[0] + r[1] * r[1] + r[2] * r[2])
    return list(v) if angle == 0.0 else turned(v, [c / angle for c in r], math.degrees(angle))


def legendre(t):
    return t, (3 * t * t - 1) / 2, (5 * t ** 3 - 3 * t) / 2, (35 * t ** 4 - 30 * t * t + 3) / 8


class Hidden:
    def __init__(self, truth):
        self.truth = truth
        self.errors = truth.get("errors", {})

    def _of(self, axis, q):
        """Translation and rotation of what the axis carries."""
        out = [0.0] * 6
        for i, name in enumerate(f"E{letter}{axis}" for letter in "XYZABC"):
            if name not in self.errors:
                continue
            if axis in TRAVEL:
                low, high = TRAVEL[axis]
                shapes = legendre((2 * q[axis] - low - high) / (high - low))
            else:
                a = math.radians(q[axis])
                shapes = math.cos(a), math.sin(a), math.cos(2 * a), math.sin(2 * a)
            out[i] = sum(k * s for k, s in zip(self.errors[name], shapes))
        if axis == "A" and "sag" in self.errors:
            a = math.radians(q["A"])
            turn, y, z = self.errors["sag"]
            out[3] += turn * math.sin(a)
            out[1] += y * math.sin(a)
            out[2] += z * math.cos(a)
        return out[:3], out[3:]

    def part_to_machine(self, p, q):
        v = list(p)
        for axis in "CA":
            n, at = self.truth[f"{axis.lower()}_direction"], self.truth[f"{axis.lower()}_point"]
            d, r = self._of(axis, q)
            v = by_vector(turned([v[i] - at[i] for i in range(3)], n, q[axis]), r)
            v = [v[i] + at[i] + d[i] for i in range(3)]
        return v

    def machine_to_part(self, v, q):
        for axis in "AC":
            n, at = self.truth[f"{axis.lower()}_direction"], self.truth[f"{axis.lower()}_point"]
            d, r = self._of(axis, q)
            v = by_vector([v[i] - at[i] - d[i] for i in range(3)], [-c for c in r])
            v = turned(v, n, -q[axis])
            v = [v[i] + at[i] for i in range(3)]
        return v

    def tip(self, q, length):
        """Of the tool in the machine. X stands on the bed, Y on X, Z on Y."""
        e = self.errors
        v = [0.0, 0.0, -length]
        for axis, i in (("Z", 2), ("Y", 1), ("X", 0)):
            d, r = self._of(axis, q)
            v = by_vector(v, r)
            v[i] += q[axis]
            v = [v[k] + d[k] for k in range(3)]
            if f"screw_{axis}" in e:
                turn = 2 * math.pi * q[axis] / 10.0
                v[i] += e[f"screw_{axis}"][0] * math.sin(turn) + e[f"screw_{axis}"][1] * math.cos(turn)
            if axis == "Y":
                v[0] -= e.get("C0Y", 0.0) * q["Y"]
            if axis == "Z":
                v[0] += e.get("B0Z", 0.0) * q["Z"]
                v[1] -= e.get("A0Z", 0.0) * q["Z"]
        return v

    def tip_in_part(self, q, length):
        return self.machine_to_part(self.tip(q, length), q)

    def ball_at(self, q):
        return self.part_to_machine(self.truth["ball"], q)


class Probe:
    """A touch probe whose touches scatter: the distance at which it says so differs from touch to touch."""

    def __init__(self, truth, seed=1):
        self.reach = truth["reach"]
        self.noise = truth.get("noise_mm", 0.0)
        self.random = random.Random(seed)
        self.next()

    def next(self):
        self.now = self.reach + self.noise * self.random.gauss(0.0, 1.0)


def run_probing(text, hidden, seed=1, period_s=0.001):
    """What LinuxCNC logs of a probing program in absolute millimetres, G54 at 0; without LinuxCNC, in a moment."""
    truth, probe, later = hidden.truth, Probe(hidden.truth, seed), random.Random(seed + 1)
    at = {"X": 0.0, "Y": 0.0, "Z": 1e4, "A": 0.0, "C": 0.0}
    motion, feed, log = "G0", 0.0, []
    for line in text.splitlines():
        if line.startswith("G53"):
            at["Z"] = 1e4
            continue
        if not line or line[0] in "(T%":
            continue
        to = dict(at)
        for word in line.split():
            if word in ("G0", "G1", "G38.2"):
                motion = word
            elif word[0] == "F":
                feed = float(word[1:])
            elif word[0] in to:
                to[word[0]] = float(word[1:])
        if motion != "G38.2" or to == at:
            at = to
            continue
        way = math.dist([at[n] for n in "XYZ"], [to[n] for n in "XYZ"])

        def gap(t):
            q = {n: at[n] + t * (to[n] - at[n]) for n in at}
            q["Z"] += truth["length"]
            return math.dist(hidden.tip(q, truth["length"]), hidden.ball_at(q)) - probe.now

        # Down to where it is nearest, then back to where it begins to touch.
        steps = 64
        high = next((k / steps for k in range(steps + 1) if gap(k / steps) <= 0.0), None)
        assert high is not None and gap(0.0) > 0.0, f"nothing is touched: {line}"
        low = high - 1.0 / steps
        for _ in range(40):
            middle = 0.5 * (low + high)
            low, high = (middle, high) if gap(middle) > 0.0 else (low, middle)
        t = high + later.random() * period_s * feed / 60.0 / way
        at = {n: at[n] + t * (to[n] - at[n]) for n in at}
        log.append(" ".join(f"{v:.6f}" for v in (at["X"], at["Y"], at["Z"], at["A"], 0, at["C"], 0, 0, 0)))
        probe.next()
    return "\n".join(log) + "\n"
