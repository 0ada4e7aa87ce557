"""Two implementations of the same physics: every effect on every machine, the program against the second chain.

The rows are made here with random states; the values come from this chain without noise; the program evaluates them with the same
model. Its largest residual is the difference of the two, set-up translation switched off.
"""

import json
import math
import subprocess

import numpy as np

from . import campaigns, machines, physics
from .chain import readings
from .rows import read_rows, write_rows

AXES = "XYZ"
# Named runs and sensors of the campaign that the plan lacks.
NOT_IN_PLAN = ("setup_tilt", "step", "thermal_location", "ambient_drift", "screw_heating")


def cases(machine, rows, rng):
    """(effect, parameters, choice) for every effect of the library on this machine."""
    names = [f"component:E{w}{j}" for j in "XYZAC" for w in "XYZABC"]
    names += [f"{k}:{a}" for k in ("periodic", "screw_heating") for a in AXES]
    names += [f"{k}:{a}" for k in ("servo_lag", "reversal_spike") for a in "XYZAC"]
    names += ["worm:A", "worm:C", "squareness:C0Y", "squareness:B0Z", "squareness:A0Z", "location:A", "location:C"]
    names += [f"backlash:{a}" for a in "XYZAC"] + ["sag:A", "overhang:Z", "spindle_growth", "ambient_drift"]
    names += ["time_drift", "spindle_tilt", "tool_length", "setup_tilt"]
    names += ["zero_offset:A", "zero_offset:C", "tool_offset", "weight:AC"]
    plan = [(name, None) for name in names]
    plan += [("unbalance:AC", {"component": f"E{w}{j}"}) for j in "AC" for w in "XYZABC"]
    for pair in ("XY", "XZ", "YZ"):
        carried = [f"E{w}{pair[0]}" for w in "XYZ"] + [f"E{w}{j}" for w in "ABC" for j in pair]
        plan += [(f"crosstalk:{pair}", {"component": c}) for c in carried]
    plan += [(f"thermal_location:{a}", {"sensor": s}) for a in "AC" for s in ("ambient", "screw_y")]
    plan += [("step", {"run": rows.run_names[3]})]
    for name, choice in plan:
        keys = physics.linear_keys(name, machine, rows, choice)
        parameters = {k: size * rng.uniform(0.3, 1.0) * rng.choice([-1, 1]) for k, size in keys.items()}
        kind = name.partition(":")[0]
        if kind == "periodic":
            parameters["p_mm"] = rng.uniform(2, 40)
        if kind == "reversal_spike":
            parameters["decay_ms"] = math.exp(rng.uniform(math.log(4), math.log(60)))
        if kind == "worm":
            parameters["n"] = float(rng.integers(8, 181))
        if kind in ("spindle_growth", "thermal_location", "ambient_drift"):
            parameters["tau_s"] = math.exp(rng.uniform(math.log(300), math.log(15000)))
        if kind == "step":
            parameters["t_s"] = 0.4 * rows.time[rows.run == choice["run"]].max() + 0.123
        yield name, parameters, choice


def difference(program, folder, machine, rows, effects):
    """Largest difference in mm (or mm-sized: rotations count 1 urad as 0.001)."""
    twists = physics.add_twists(*(physics.twists(n, p, c, machine, rows) for n, p, c in effects))
    values = readings(machine, rows, twists) * rows.per_unit
    machines.write_machine(folder / "machine.toml", machine)
    machines.write_model(folder / "truth.toml", "truth", effects, setup_fixed=True)
    write_rows(folder / "data.csv", machine, rows, values)
    done = subprocess.run([program, "model", "evaluate", folder / "data.csv", "-m", folder / "machine.toml", "--model",
                           folder / "truth.toml", "--json", "-"], capture_output=True, text=True)
    if done.returncode != 0:
        return math.inf, done.stderr.strip(), 0.0
    result = json.loads(done.stdout)
    return result["max_um"] * 1e-3, "", np.abs(values).max() * 1e-3


PLAN = """[simulation]
setup_um = 0
[[run]]
id = "ball"
minutes = 20
quantity = "displacement"
n = [[1, 0, 0], [0, 1, 0], [0.6, 0, 0.8]]
frame = "part"
u_random = 1e-9
grid = { A_deg = [-20, 5, 25], C_deg = [0, 50, 170, 290] }
ball_mm = [30, -20, 25]
[[run]]
id = "on_the_fly"
minutes = 5
quantity = "displacement"
n = [1, 0, 0]
u_random = 1e-9
both_directions = true
feed_mm_min = 3000
sweep = { axis = "X", from_mm = -120, to_mm = 130, points = 9 }
[[run]]
id = "angles"
minutes = 5
quantity = "rotation"
n = [[1, 0, 0], [0, 1, 0], [0, 0, 1]]
u_random = 1e-9
both_directions = true
tool_z_mm = -90
spindle_rpm = 6000
sweep = { axis = "Y", from_mm = -100, to_mm = 90, points = 6 }
"""


def simulated_difference(program, folder, machine, effects):
    """The same for `simulate`: the plan's rows as the program wrote them, its noise a thousandth of a nanometre."""
    machines.write_machine(folder / "machine.toml", machine)
    (folder / "plan.toml").write_text(PLAN)
    machines.write_model(folder / "truth.toml", "truth", effects, setup_fixed=True)
    done = subprocess.run([program, "simulate", folder / "plan.toml", "-m", folder / "machine.toml", "--truth",
                           folder / "truth.toml", "-o", folder / "data.csv", "--seed", "1"], capture_output=True, text=True)
    if done.returncode != 0:
        return math.inf, done.stderr.strip(), 0.0
    rows, values = read_rows(folder / "data.csv", machine)
    twists = physics.add_twists(*(physics.twists(n, p, c, machine, rows) for n, p, c in effects))
    own = readings(machine, rows, twists) * rows.per_unit
    return np.abs(own - values).max() * 1e-3, "", np.abs(values).max() * 1e-3


def run(program, folder, tolerance_mm=1e-6, every=1, out=print):
    """Number of disagreements; `every` > 1 takes every k-th effect of each machine (but all effects over the machines)."""
    bad = checked = 0
    for index, make in enumerate(machines.MACHINES):
        machine, rng = make(), np.random.default_rng(7100 + index)
        campaign = campaigns.Campaign(machine, rng)
        campaigns.core(campaign, small=True)
        for focus in campaigns.FOCUS.values():
            focus(campaign)
        rows = campaign.rows()
        # Readings in both frames, along slanted directions, with some rows that only record the state.
        slanted = rng.normal(size=rows.n.shape)
        rows.n = np.where(rng.random(len(rows))[:, None] < 0.3, slanted / np.linalg.norm(slanted, axis=1)[:, None], rows.n)
        rows.frame = np.where(rng.random(len(rows)) < 0.3, "part", rows.frame)
        rows.measured = rng.random(len(rows)) > 0.1
        # Rotary axes on the move, and rows that follow each other within milliseconds.
        for axis in "AC":
            rows.velocity[axis] = np.where(rng.random(len(rows)) < 0.5, rng.normal(size=len(rows)) * 0.1, 0.0)
        fast = rng.random(len(rows)) < 0.2
        rows.time = np.where(fast, 0.002 * rows.time, rows.time)
        # Clocks that do not start at 0, rows in any order.
        rows.time = rows.time + 137.0
        order = [rng.permutation(np.flatnonzero(rows.run == name)) for name in rows.run_names]
        rows = rows.taken(np.concatenate(order))
        everything = []
        for k, effect in enumerate(cases(machine, rows, rng)):
            everything.append(effect)
            if (k + index) % every:
                continue
            checked += 1
            error, message, size = difference(program, folder, machine, rows, [effect])
            if error > tolerance_mm or size < 1e-5:
                bad += 1
                out(f"DIFFERS {machine.name}: {effect[0]} {effect[2] or ''}: {error:.3g} mm of {size:.3g} mm {message}")
        chosen = {e[0]: e for e in everything}
        error, message, size = difference(program, folder, machine, rows, list(chosen.values()))
        checked += 1
        if error > tolerance_mm:
            bad += 1
            out(f"DIFFERS {machine.name}: all {len(chosen)} effects at once: {error:.3g} mm of {size:.3g} mm {message}")
        seen = [e for name, e in chosen.items() if name.partition(":")[0] not in NOT_IN_PLAN]
        error, message, size = simulated_difference(program, folder, machine, seen)
        checked += 1
        if error > tolerance_mm or size < 1e-5:
            bad += 1
            out(f"DIFFERS {machine.name}: simulate, {len(seen)} effects: {error:.3g} mm of {size:.3g} mm {message}")
    out(f"cross-check: {checked} comparisons on {len(machines.MACHINES)} machines, {bad} differ by more than {tolerance_mm:g} mm")
    return bad
