"""What a perfect statistician could know of a case: signal strength, the nearest rival, the truth's own covariance.

First-order columns are taken numerically from the exact chain (one small twist of each joint at a time); they serve to choose
amplitudes and to sort cases, never to make data.
"""

import math

import numpy as np

from . import physics
from .chain import readings

TINY = {"translation": 1e-2, "rotation": 1e-4}  # mm, rad: rounding is 1e-11 of what they do, the third order 1e-9
ROUNDING = 1e-8  # of the largest of its column: smaller numbers are zeros that were not worked out exactly
INVISIBLE = 1e-6  # standard deviations, all readings together, that one um or urad moves: below is what rounding leaves of a projection
# Of two spans, a direction that is new. It must be far above what rounding makes of one that both have: else a random direction comes in,
# another on every processor.
NEW = 1e-3


def joint_columns(machine, rows):
    """d(reading in um or urad)/d(twist component in mm or rad) for every joint: (N, 6) each."""
    out = {}
    for joint in machine.joints:
        columns = np.empty((len(rows), 6))
        for k in range(6):
            size = TINY["translation"] if k < 3 else TINY["rotation"]
            twist = np.zeros((len(rows), 6))
            twist[:, k] = size
            columns[:, k] = (readings(machine, rows, {joint: twist}) - readings(machine, rows, {joint: -twist})) / (2 * size)
        columns[np.abs(columns) < ROUNDING * np.abs(columns).max(axis=0)] = 0.0
        out[joint] = columns * rows.per_unit[:, None]
    return out


def orthonormal(matrix, relative=1e-7):
    """Basis of the columns' span."""
    if matrix.shape[1] == 0:
        return matrix
    scale = np.linalg.norm(matrix, axis=0)
    keep = scale > 0
    u, s, _ = np.linalg.svd(matrix[:, keep] / scale[keep], full_matrices=False)
    return u[:, s > relative * s[0]] if s.size and s[0] > 0 else u[:, :0]


def small_basis(columns):
    """Basis of a few columns, from their Gram matrix: quick; directions that these runs excite 1e4 times less are left out."""
    scale = np.linalg.norm(columns, axis=0)
    keep = scale > INVISIBLE
    unit = columns[:, keep] / scale[keep]
    values, vectors = np.linalg.eigh(unit.T @ unit)
    good = values > 1e-8
    return unit @ (vectors[:, good] / np.sqrt(values[good]))


class Oracle:
    """The measured rows whitened by their true covariance, with set-up and base model projected out."""

    def __init__(self, machine, rows, base=()):
        self.machine, self.rows = machine, rows
        self.lags = list(np.geomspace(*physics.TAU_RANGE, 7))
        self.use = np.flatnonzero(rows.measured)
        self.joint = {j: c[self.use] for j, c in joint_columns(machine, rows).items()}
        groups = rows.offset_groups()[self.use]
        common = rows.u_common[self.use]
        covariance = np.diag(rows.u_random[self.use] ** 2)
        covariance += np.where(groups[:, None] == groups[None, :], common[:, None] * common[None, :], 0.0)
        self.factor = np.linalg.cholesky(covariance)
        self.inverse = np.linalg.inv(self.factor)
        columns = [self.setup_columns()]
        for name, parameters, choice in base:
            columns.append(self.raw_columns(name, parameters, choice))
        self.base = orthonormal(self.inverse @ np.concatenate(columns, axis=1))

    def setup_columns(self):
        """A free translation of the part in each run, of displacements only."""
        rows, columns = self.rows, []
        shift = self.joint["P"][:, :3] * ~rows.is_rotation[self.use][:, None]
        for run in rows.run_names:
            columns.append(shift * (rows.run[self.use] == run)[:, None])
        return np.concatenate(columns, axis=1)

    def first_order(self, twists):
        """Readings (um, urad) of twists that may be large: only to build columns."""
        return sum(np.einsum("nk,nk->n", self.joint[j], t[self.use]) for j, t in twists.items())

    def raw_columns(self, name, parameters, choice):
        shape = {k: v for k, v in parameters.items() if k in ("p_mm", "n", "tau_s", "t_s")}
        columns = []
        for key in physics.linear_keys(name, self.machine, self.rows, choice):
            one = dict.fromkeys(physics.linear_keys(name, self.machine, self.rows, choice), 0.0)
            one.update(shape)
            one[key] = 1.0
            columns.append(self.first_order(physics.twists(name, one, choice, self.machine, self.rows)))
        return np.stack(columns, axis=1)

    def project(self, raw):
        """Whitened and cleared of the base."""
        white = self.inverse @ raw
        return white - self.base @ (self.base.T @ white)

    def exact_signal(self, twists_with, twists_without):
        """Whitened, projected difference of two exact machines."""
        rows = self.rows
        full = (readings(self.machine, rows, twists_with) - readings(self.machine, rows, twists_without)) * rows.per_unit
        return self.project(full[self.use])

    def library(self, setup_tilt=True):
        """(effect, shape, choice) of everything that the library could name, shapes on a grid."""
        machine, rows = self.machine, self.rows
        plan = [(f"component:E{w}{j}", {}, None) for j in "XYZAC" for w in "XYZABC"]
        for axis in "XYZ":
            pitch = machine.axis(axis).pitch
            periods = {pitch / k for k in (1, 2, 3, 4)} if pitch else set()
            periods |= set(np.geomspace(1.0, 50.0, 60))
            plan += [(f"periodic:{axis}", {"p_mm": p}, None) for p in sorted(periods)]
            plan += [(f"screw_heating:{axis}", {}, None), (f"servo_lag:{axis}", {}, None)]
        plan += [(f"worm:{a}", {"n": float(n)}, None) for a in "AC" for n in range(8, 181)]
        plan += [(f"squareness:{s}", {}, None) for s in ("C0Y", "B0Z", "A0Z")]
        plan += [(f"location:{a}", {}, None) for a in "AC"] + [(f"backlash:{a}", {}, None) for a in "XYZAC"]
        for pair in ("XY", "XZ", "YZ"):
            which = [f"E{w}{pair[0]}" for w in "XYZ"] + [f"E{w}{j}" for w in "ABC" for j in pair]
            plan += [(f"crosstalk:{pair}", {}, {"component": c}) for c in which]
        plan += [("sag:A", {}, None), ("overhang:Z", {}, None), ("time_drift", {}, None)]
        plan += [("spindle_tilt", {}, None), ("tool_length", {}, None)]
        plan += [("setup_tilt", {}, None)] if setup_tilt else []
        for tau in self.lags:
            plan += [("spindle_growth", {"tau_s": tau}, None), ("ambient_drift", {"tau_s": tau}, None)]
            plan += [(f"thermal_location:{a}", {"tau_s": tau}, {"sensor": s}) for a in "AC" for s in rows.temperature]
        for run in rows.run_names:
            times = np.unique(rows.time[self.use][rows.run[self.use] == run])
            for t in times[1:: max(1, len(times) // 12)]:
                plan.append(("step", {"t_s": t}, {"run": run}))
        return plan

    def bases(self):
        """Orthonormal bases of the library, kept: every question below asks all of them."""
        if not hasattr(self, "_bases"):
            plan = self.library()
            raw = [self.raw_columns(*entry) for entry in plan]
            every = self.project(np.concatenate(raw, axis=1))
            ends = np.cumsum([r.shape[1] for r in raw])
            parts = [(plan[k][0], plan[k][2], small_basis(every[:, end - raw[k].shape[1] : end])) for k, end in enumerate(ends)]
            self._bases = [part for part in parts if part[2].shape[1]]
        return self._bases

    def rivals(self, signal, truth, truth_columns, hidden=None):
        """{effect: share of the true signal that it imitates}, best first. A family that contains the truth is no rival."""
        if hidden and "tau_s" in hidden[1]:
            self.lags = sorted(set(self.lags) | {hidden[1]["tau_s"]})
        size = np.linalg.norm(signal)
        own = small_basis(truth_columns)
        best = {}
        for name, _, basis in self.bases():
            if name in truth:
                continue
            # Larger, and every direction of the truth imitated to 0.99: the smaller family that suffices is to be named.
            if basis.shape[1] > own.shape[1] and np.linalg.svd(basis.T @ own, compute_uv=False)[-1] > 0.99:
                continue
            best[name] = max(best.get(name, 0.0), float(np.linalg.norm(basis.T @ signal) / size))
        return dict(sorted(best.items(), key=lambda item: -item[1]))

    def leftover(self, signal, depth):
        """Signal (chi-square) that is left after the best `depth` library effects, chosen greedily."""
        rest, chosen = signal, []
        spanned = np.zeros((len(signal), 0))
        for _ in range(depth):
            gains = [(np.linalg.norm(basis.T @ rest), name, basis) for name, _, basis in self.bases()]
            _, name, basis = max(gains, key=lambda g: g[0])
            chosen.append(name)
            spanned = orthonormal(np.concatenate([spanned, basis], axis=1), NEW)
            rest = signal - spanned @ (spanned.T @ signal)
        return float(rest @ rest), chosen


def strength(signal):
    return float(signal @ signal)


def rescaled(value, wanted):
    """Factor on an amplitude so that its chi-square becomes the wanted one, to four digits: the same on every processor."""
    return four_digits(math.sqrt(wanted / value))


def four_digits(value):
    return float(f"{value:.4g}")
