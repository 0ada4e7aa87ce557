"""Errors that act in a part of the travel, in a sector, above a temperature or in a range of speed only, and nowhere else.

Scored: which readings lie where the error acts, F1 of the truth against what the answer says. Beside the program stands LISDD (arXiv
2606.23215) as far as its public description (the abstract) goes: the known physics fitted to the regime that is clean; parts of each variable
flagged by the energy of their residuals, at a level that is corrected for their number; one missing term of the flagged readings, chosen from
a library by what it predicts of readings held out; an F test of that term on the half of them that the choice has not seen. Its control of several
regions is not here: there is one. The numbers of parts, the levels and the library are ours.
"""

import math

import numpy as np

from . import machines, physics
from .campaigns import UNIT, Campaign, core, travel
from .cases import Case, drawn_effect, generator_of, measured_values
from .chain import readings
from .oracle import Oracle, orthonormal, rescaled
from .statistics import chi2_tail, f_tail
from .trial import diagnosed

KINDS = ("travel", "sector", "warm", "speed")
LAMBDAS = (150.0, 400.0)
GOAL = 0.9
BINS = 12  # of each variable, with as many readings in each
LEVEL = 0.05
ALIKE = 0.99  # cosine of two terms of LISDD's library that are as good as one
SHARE = (0.2, 0.42)  # of the range, that the error acts in


def drawn(kind, rng):
    """Machine, campaign, (variable, from, to), twists of size 1."""
    machine = machines.MACHINES[rng.integers(len(machines.MACHINES))]()
    sigma = float(np.exp(rng.uniform(math.log(0.4), math.log(1.0))))
    c = Campaign(machine, rng, sigma_um=sigma, sigma_urad=2 * sigma)
    core(c, small=True)
    axis = str(rng.choice(["X", "Y", "Z"]))
    if kind == "travel":
        c.laser("long_a", axis, 36)
        c.laser("long_b", axis, 30)
    if kind == "sector":
        axis = "C"
        for name in ("turn_a", "turn_b"):
            c.ball(name, 3, 24, tool=c.tool())
    if kind == "warm":
        axis = "ambient"
        for name in ("day_a", "day_b"):
            c.warm_up(name, 150, 40, (0,))
    if kind == "speed":
        feeds = (300, 800, 1500, 2500, 4000, 6000)
        c.moving_laser("moving_a", axis, feeds, 6)
        c.moving_laser("moving_b", axis, feeds, 5)
    rows = c.rows()
    values = variable(rows, kind, axis)
    if kind == "sector":
        values = np.mod(values, 2 * math.pi)
    low, high = (0.0, 2 * math.pi) if kind == "sector" else (values.min(), values.max())
    if kind == "warm":
        begin, end = float(np.quantile(values, rng.uniform(0.6, 0.78))), math.inf
    elif kind == "speed":
        speeds = np.unique(values[values > 0])
        k = int(rng.integers(1, len(speeds) - 1))
        begin, end = 0.5 * (speeds[k - 1] + speeds[k]), 0.5 * (speeds[min(k + 1, len(speeds) - 2)] + speeds[min(k + 2, len(speeds) - 1)])
    else:
        length = rng.uniform(*SHARE) * (high - low)
        begin = rng.uniform(low + 0.08 * (high - low), high - 0.08 * (high - low) - length)
        end = begin + length
    inside = (values > begin) & (values < end)
    joint = axis if axis in "XYZC" else "S"
    across = str(rng.choice([w for w in "XYZ" if w != axis])) if kind != "speed" else axis
    form = rng.choice(["offset", "sense"]) if kind in ("travel", "speed") else "offset"
    shape = rows.direction[axis] if form == "sense" else np.ones(len(rows))
    term = f"E{across}{joint} {'sense' if form == 'sense' else '1'}"
    return machine, rows, inside, (kind, axis, term), {joint: physics.component_twist(len(rows), across, 1e-3 * inside * shape)}


def variable(rows, kind, of):
    if kind == "warm":
        return rows.temperature[of]
    if kind == "speed":
        return np.abs(rows.velocity[of])
    return rows.q[of]


def case(name):
    """G-<kind>-0007."""
    rng = generator_of(name)
    machine, rows, inside, where, unit = drawn(name.split("-")[1], rng)
    base = [drawn_effect(n, machine, rows, rng) for n in ("location:A", "location:C")]
    oracle = Oracle(machine, rows, base)
    seen = oracle.project((readings(machine, rows, unit) * rows.per_unit)[oracle.use])
    size = rescaled(float(seen @ seen), float(rng.choice(LAMBDAS)))
    outside = {joint: size * twist for joint, twist in unit.items()}
    made = Case(name, machine, rows, base, [], None, rows.u_random, rows.u_common.copy(), outside, {"stratum": "G", "term": where[2]}, rng)
    made.values = measured_values(made, rows, rng)
    return made, inside, oracle


def f1(truth, said):
    both = float(np.sum(truth & said))
    return 2 * both / (np.sum(truth) + np.sum(said)) if both else 0.0


def said_inside(rows, ranges):
    """The readings that lie where the program says; none when it names no part."""
    if not ranges:
        return np.zeros(len(rows), bool)
    out = np.ones(len(rows), bool)
    for r in ranges:
        of, here = r["of"], None
        if of in rows.q:
            here = np.degrees(rows.q[of]) if r["unit"] == "deg" else rows.q[of]
        elif of.startswith("speed of "):
            here = 60.0 * np.abs(rows.velocity[of[-1]]) * (180 / math.pi if r["unit"] == "deg/min" else 1.0)
        elif of.startswith("T_"):
            here = rows.temperature[of[2:]]
        elif of.startswith("vel_"):
            here = 60.0 * rows.velocity[of[-1]] * (180 / math.pi if r["unit"] == "deg/min" else 1.0)
        elif of.startswith("dir_"):
            here = rows.direction[of[-1]]
        if here is None:
            return np.zeros(len(rows), bool)
        part = np.ones(len(rows), bool)
        if r["from"] is not None:
            part &= here > r["from"]
        if r["to"] is not None:
            part &= here < r["to"]
        out &= part
    return out


def lisdd_parts(oracle, rows, values):
    """The parts that LISDD's first two steps flag, of the variable whose most striking part is the least likely; what the physics leaves."""
    white = oracle.inverse @ values[oracle.use]
    # `project` takes the base out of all readings; here its columns, to be fitted to the clean ones alone.
    columns = oracle.base
    variables = {a: q[oracle.use] for a, q in rows.q.items()}
    variables |= {f"T {s}": t[oracle.use] for s, t in rows.temperature.items()}
    variables |= {f"v {a}": np.abs(v[oracle.use]) for a, v in rows.velocity.items()}
    best = (1.0, np.zeros(len(white), bool), white)
    tests = BINS * len(variables)
    for x in variables.values():
        edges = np.unique(np.quantile(x, np.linspace(0, 1, BINS + 1)))
        if len(edges) < 3:
            continue
        part = np.clip(np.searchsorted(edges, x, side="right") - 1, 0, len(edges) - 2)
        clean = np.ones(len(white), bool)
        smallest = 1.0
        for _ in range(len(edges) // 2):
            basis = orthonormal(columns[clean])
            weights = np.linalg.lstsq(columns[clean], white[clean], rcond=None)[0]
            left = white - columns @ weights
            lost = basis.shape[1] / max(1, clean.sum())
            p = [chi2_tail(float(np.sum(left[part == k] ** 2)), max(1.0, float(np.sum(part == k)) * (1 - lost)))
                 if clean[part == k].any() else 1.0 for k in range(len(edges) - 1)]
            worst = int(np.argmin(p))
            if p[worst] * tests > LEVEL:
                break
            smallest = min(smallest, p[worst])
            clean[part == worst] = False
        if smallest < best[0]:
            weights = np.linalg.lstsq(columns[clean], white[clean], rcond=None)[0]
            best = (smallest, ~clean, white - columns @ weights)
    return best[1:]


def lisdd_terms(oracle, rows, flagged):
    """Its library: every component of every joint's twist in the flagged readings, constant, with the sense or with the position of an axis."""
    out = {}
    for joint, columns in oracle.joint.items():
        forms = {"1": np.ones(len(flagged))}
        if joint in rows.q:
            forms["sense"] = rows.direction[joint][oracle.use]
            forms["position"] = rows.q[joint][oracle.use]
        for k, component in enumerate("XYZABC"):
            for form, shape in forms.items():
                column = (oracle.inverse @ (columns[:, k] * shape * flagged))[flagged]
                if np.linalg.norm(column) > 1e-9:
                    out[f"E{component}{joint} {form}"] = column / np.linalg.norm(column)
    return out


def lisdd_test(terms, left):
    """The term that LISDD chooses, and the p-value of its F test; `left` of the flagged readings."""
    turn = np.arange(len(left)) % 4  # two quarters choose, the other half tests
    if len(left) < 16:
        return None, 1.0
    learn, held, test = turn == 0, turn == 2, turn % 2 == 1
    errors = {}
    for name, column in terms.items():
        seen = column[learn] @ column[learn]
        if seen > 1e-6:
            errors[name] = np.sum((left[held] - column[held] * (column[learn] @ left[learn] / seen)) ** 2)
    if not errors:
        return None, 1.0
    name = min(errors, key=errors.get)
    column, y = terms[name][test], left[test]
    gained = (column @ y) ** 2 / max(column @ column, 1e-12)
    rest, dof = y @ y - gained, len(y) - 1
    return name, f_tail(gained / (rest / dof), 1.0, dof)


def names(count):
    return [f"G-{kind}-{k:04d}" for k in range(count) for kind in KINDS]


def run(task):
    binary, name, folder = task
    made, inside, oracle = case(name)
    (folder / name).mkdir(parents=True, exist_ok=True)
    made.write(folder / name)
    said = diagnosed(binary, folder / name)
    formula = said.get("formula")
    ranges = formula["acts_in"] if formula else []
    use = made.rows.measured
    flagged, left = lisdd_parts(oracle, made.rows, made.values)
    terms = lisdd_terms(oracle, made.rows, flagged)
    term, p = lisdd_test(terms, left[flagged])
    sure = bool(p < LEVEL)
    # Right is what does the same at the flagged readings as the truth.
    alike = abs(terms[term] @ terms[made.about["term"]]) if sure and made.about["term"] in terms else 0.0
    return {"case": name, "kind": name.split("-")[1], "verdict": said["verdict"], "effects": said["effects"], "ranges": ranges,
            "formula": formula and formula["what"], "f1": f1(inside[use], said_inside(made.rows, ranges)[use]),
            "lisdd": f1(inside[oracle.use], flagged), "lisdd_term": term, "lisdd_sure": sure,
            "lisdd_right": bool(alike > ALIKE)}


def table(records):
    out = ["| kind | cases | F1, mean | median | cases with F1 0.9 or more | a library effect named alone | LISDD's parts: F1, mean | median "
           "| its test finds a term | the right one |", "|---|---|---|---|---|---|---|---|---|---|"]
    for kind in (*KINDS, "all"):
        those = [r for r in records if kind in ("all", r["kind"])]
        if those:
            ours, theirs = ([r[k] for r in those] for k in ("f1", "lisdd"))
            wrong = sum(r["verdict"] == "named" for r in those)
            out.append(f"| {kind} | {len(those)} | {np.mean(ours):.2f} | {np.median(ours):.2f} | {sum(f >= GOAL for f in ours)} | {wrong} "
                       f"| {np.mean(theirs):.2f} | {np.median(theirs):.2f} | {sum(r['lisdd_sure'] for r in those)} "
                       f"| {sum(r['lisdd_right'] for r in those)} |")
    return "\n".join(out)
