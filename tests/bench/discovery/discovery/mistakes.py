"""Conventions that are the wrong way round in the files: what is true is known to the model, and a file says it wrongly."""

import copy
import math
from dataclasses import replace

import numpy as np

from . import machines
from .campaigns import Campaign, core
from .cases import Case, drawn_effect, generator_of, measured_values
from .oracle import Oracle
from .rows import write_rows
from .trial import diagnosed

KINDS = ("axis_sense", "run_sense", "all_sense", "swapped_axes", "swapped_n", "unit", "tool_length", "time_shift", "component_sense",
         "frame", "zero_linear", "zero_rotary")
NONE = "none"  # the same campaigns and models, nothing wrong
SEEN = 3.0  # chi-square per reading of the known effects beside the mistake: what is less does no harm that would be seen
BASE = ["location:A", "location:C", "squareness:C0Y", "squareness:B0Z", "squareness:A0Z", "component:EBX", "component:EAY",
        "component:ECZ"]


def drawn(kind, rng):
    """A campaign with all that the known effects need, and a machine that has them as large as usual."""
    machine = machines.MACHINES[rng.integers(len(machines.MACHINES))]()
    sigma = float(np.exp(rng.uniform(math.log(0.3), math.log(1.0))))
    campaign = Campaign(machine, rng, sigma_um=sigma, sigma_urad=2 * sigma)
    core(campaign, small=bool(rng.random() < 0.5))
    for axis in "XYZ":
        campaign.angle(f"angle_{axis.lower()}", axis)
    base = list(BASE)
    if kind == "time_shift":
        campaign.warm_up("warm_a", 90, 40)
        campaign.warm_up("warm_b", 120, 40)
        base += ["spindle_growth"]
    rows = campaign.rows()
    return machine, rows, [drawn_effect(name, machine, rows, rng) for name in base]


def wrong(kind, machine, rows, values, rng):
    """(machine file, rows, values, factor of the uncertainties) with the mistake, and the answer that is right."""
    rows = copy.copy(rows)
    factor = np.ones(len(rows))
    if kind == NONE:
        return machine, rows, values, factor, {"kind": NONE}
    if kind == "axis_sense":
        which = int(rng.integers(len(machine.axes)))
        a = machine.axes[which]
        turned = replace(a, direction=tuple(-d for d in a.direction))
        machine = replace(machine, axes=tuple(turned if b is a else b for b in machine.axes))
        return machine, rows, values, factor, {"kind": "axis_sense", "axis": a.name}
    if kind == "run_sense":
        run = str(rng.choice(rows.run_names))
        return machine, rows, np.where(rows.run == run, -values, values), factor, {"kind": "reading_sense", "run": run}
    if kind == "all_sense":
        return machine, rows, -values, factor, {"kind": "reading_sense"}
    if kind == "swapped_axes":
        a, b = [("X", "Y"), ("X", "Z"), ("Y", "Z"), ("A", "C")][rng.integers(4)]
        rows.q = dict(rows.q, **{a: rows.q[b], b: rows.q[a]})
        return machine, rows, values, factor, {"kind": "swapped_columns", "axes": [a, b]}
    if kind == "swapped_n":
        a, b = [(0, 1), (0, 2), (1, 2)][rng.integers(3)]
        order = [0, 1, 2]
        order[a], order[b] = b, a
        rows.n = rows.n[:, order]
        return machine, rows, values, factor, {"kind": "swapped_columns", "components": [f"n_{'xyz'[a]}", f"n_{'xyz'[b]}"]}
    if kind == "unit":
        quantity = str(rng.choice(["displacement", "rotation"]))
        times = float(rng.choice([1e3, 1e-3]))
        here = rows.quantity == quantity
        if rng.random() < 0.5:
            factor = np.where(here, 1 / times, 1.0)
        return machine, rows, np.where(here, values / times, values), factor, {"kind": "unit", "quantity": quantity, "factor": times}
    if kind == "tool_length":
        longer = float(rng.choice([-1, 1]) * np.exp(rng.uniform(math.log(2.0), math.log(60.0))))
        rows.tool = rows.tool + np.array([0.0, 0.0, longer])  # the file says it shorter by this: the truth is longer
        # The readings show the offset itself, along Z of the machine; its lever alone would hardly be seen.
        values = values - np.where(rows.is_rotation, 0.0, longer * 1e3 * rows.n[:, 2])
        return machine, rows, values, factor, {"kind": "tool_length", "by_mm": longer}
    if kind == "component_sense":
        k = int(rng.integers(3))
        rows.n = rows.n * np.where(np.arange(3) == k, -1.0, 1.0)
        return machine, rows, values, factor, {"kind": "component_sense", "components": [f"n_{'xyz'[k]}"]}
    if kind == "frame":
        rows.frame = np.where(rows.frame == "part", "machine", "part")
        return machine, rows, values, factor, {"kind": "frame"}
    if kind in ("zero_linear", "zero_rotary"):
        axis, largest = (str(rng.choice(["X", "Y"])), 200.0) if kind == "zero_linear" else ("A", math.radians(30.0))
        by = float(rng.choice([-1, 1]) * np.exp(rng.uniform(math.log(0.1 * largest), math.log(largest))))
        rows.q = dict(rows.q, **{axis: rows.q[axis] + by})
        return machine, rows, values, factor, {"kind": "position_offset", "axes": [axis],
                                               "by": {f"{axis}_mm": -by} if axis != "A" else {"A_deg": -math.degrees(by)}}
    by = float(rng.choice([-1, 1]) * np.exp(rng.uniform(math.log(300.0), math.log(1800.0))))
    for run in rows.run_names:
        here = np.flatnonzero(rows.run == run)
        at = np.clip(np.searchsorted(rows.time[here], rows.time[here] + by, side="right") - 1, 0, len(here) - 1)
        rows.rpm = rows.rpm.copy()
        rows.rpm[here] = rows.rpm[here][at]
        rows.temperature = {k: v.copy() for k, v in rows.temperature.items()}
        for v in rows.temperature.values():
            v[here] = np.interp(rows.time[here] + by, rows.time[here], v[here])
    rows.lags = {}
    return machine, rows, values, factor, {"kind": "time_shift", "by_s": -by}


def case(name):
    """B-<kind>-0007, written with the mistake."""
    return made(name, name.split("-")[1], generator_of(name))


def made(name, kind, rng):
    for _ in range(200):
        machine, rows, base = drawn(kind, rng)
        true = Case(name, machine, rows, base, [], None, rows.u_random, rows.u_common.copy(), {}, {"stratum": f"B {kind}"}, rng)
        values = measured_values(true, rows, rng)
        said, wrong_rows, wrong_values, factor, answer = wrong(kind, machine, rows, values, rng)
        if kind in (NONE, "all_sense", "unit", "tool_length") or harmful(said, wrong_rows, wrong_values, base):
            break
    # The values of an earlier calibration, or only what is known to be there.
    values_given = kind in ("all_sense", "unit") or (kind == NONE and rng.random() < 0.25)
    return Case(name, said, wrong_rows, base, [], wrong_values, rows.u_random * factor, rows.u_common * factor, {},
                {"stratum": f"B {kind}", "answer": answer, "values_given": values_given}, rng)


def harmful(machine, rows, values, base):
    """Whether the known effects, fitted, leave far more than noise: else nothing needs an explanation."""
    oracle = Oracle(machine, rows, base)
    left = oracle.project(values[oracle.use])
    return float(left @ left) > SEEN * len(left)


def write(case_, folder):
    folder.mkdir(parents=True, exist_ok=True)
    machines.write_machine(folder / "machine.toml", case_.machine)
    machines.write_model(folder / "known.toml", "known", case_.base, values=case_.about.get("values_given", False))
    write_rows(folder / "data.csv", case_.machine, case_.rows, case_.values, case_.stated_random, case_.stated_common)


def right(answer, said):
    """Whether the first of what the program says is the mistake that was made."""
    if not said:
        return False
    first = said[0]
    if first["kind"] != answer["kind"]:
        return False
    for key in ("axis", "run", "axes", "components"):
        if first.get(key) != answer.get(key):
            return False
    if answer["kind"] == "unit":
        return abs(math.log(first["factor"] / answer["factor"])) < 0.01 and first.get("quantity") in (answer["quantity"], None)
    if answer["kind"] == "tool_length":
        return abs(first["by_mm"] - answer["by_mm"]) < 0.2 * abs(answer["by_mm"]) + 0.5
    if answer["kind"] == "time_shift":
        return abs(first["by_s"] - answer["by_s"]) < 0.3 * abs(answer["by_s"]) + 60.0
    if answer["kind"] == "position_offset":
        return all(abs(first["by"][column] - by) < 0.01 for column, by in answer["by"].items())
    return True


def names(count):
    return [f"B-{kind}-{k:04d}" for k in range(count) for kind in (*KINDS, NONE)]


def run(task):
    binary, name, folder = task
    made = case(name)
    write(made, folder / name)
    said = diagnosed(binary, folder / name)
    answer = made.about["answer"]
    return {"case": name, "kind": name.split("-")[1], "answer": answer, "verdict": said["verdict"], "effects": said["effects"],
            "bookkeeping": [{k: v for k, v in b.items() if k != "what"} for b in said["bookkeeping"]],
            "right": said["verdict"] == "nothing_to_find" if answer["kind"] == NONE else
            said["verdict"] == "bookkeeping" and right(answer, said["bookkeeping"])}


def table(records):
    out = ["| kind | cases | right one named first | an effect named | nothing wrong said |", "|---|---|---|---|---|"]
    for kind in (*KINDS, "all", NONE):
        those = [r for r in records if kind == r["kind"] or (kind == "all" and r["kind"] != NONE)]
        named = sum(bool(r["effects"]) for r in those)
        silent = sum(r["verdict"] in ("nothing_to_find", "not_testable") for r in those)
        out.append(f"| {kind} | {len(those)} | {sum(r['right'] for r in those)} | {named} | {silent} |")
    return "\n".join(out)
