"""Physics and campaigns that nobody had in mind when the diagnosis was written: made after it, to see what it says of them."""

import math

import numpy as np

from . import physics

UM, URAD = 1e-3, 1e-6


def turning_points(rows, axis):
    """For every row: time since the axis last turned round, and its last step, within the run."""
    since, step = np.zeros(len(rows)), np.zeros(len(rows))
    for run in rows.run_names:
        index = np.flatnonzero(rows.run == run)
        turned, last_sign, last_step, last_q, last_time = 0.0, 0.0, 0.0, None, None
        for i in index:
            if last_q is not None and rows.time[i] != last_time:
                move = rows.q[axis][i] - last_q
                if move != 0.0:
                    last_step = move
                    if np.sign(move) != last_sign:
                        turned, last_sign = last_time, np.sign(move)
            if last_time is None or rows.time[i] != last_time:
                last_q, last_time = rows.q[axis][i], rows.time[i]
            since[i], step[i] = rows.time[i] - turned, last_step
    return since, step


def table_in_field(machine, rows, rng):
    """A product of X and C: the table's imbalance bends a bed that gives way more in the middle."""
    x = physics.scaled(machine.axis("X"), rows.q["X"])
    values = np.cos(0.5 * math.pi * x) * np.cos(rows.q["C"] + rng.uniform(0, 6))
    out = physics.component_twist(len(rows), "Y", 5 * UM * values)
    out[:, 2] = 4 * UM * values
    return {"X": out}


def resting_play(machine, rows, rng):
    """Lost motion that creeps away: a dead zone after reversal that depends on how long ago the axis turned round."""
    a = rng.choice(["X", "Y", "Z"])
    since, _ = turning_points(rows, a)
    values = -0.5 * 5 * UM * rows.direction[a] * np.exp(-since / rng.uniform(15, 40))
    return {a: physics.along(machine.axis(a), values)}


def growing_interpolation(machine, rows, rng):
    """A scale's interpolation error whose amplitude grows along the travel, at no known pitch."""
    a = rng.choice(["X", "Y", "Z"])
    axis = machine.axis(a)
    grows = np.exp(2.0 * physics.scaled(axis, rows.q[a]))
    return {a: physics.along(axis, UM * grows * np.sin(2 * math.pi * rows.q[a] / rng.uniform(55, 75)))}


def settling(machine, rows, rng):
    """Read before the slide stands: what is left of the last step, in its direction and proportional to it."""
    a = rng.choice(["X", "Y", "Z"])
    _, step = turning_points(rows, a)
    return {a: physics.along(machine.axis(a), -3e-5 * np.sign(step) * np.abs(step) ** 1.5 / 10.0)}


def warm_product(machine, rows, rng):
    """Two temperatures multiply: a column between a warm screw and a warm room."""
    t = [physics.above_reference(machine, rows, s) for s in ("ambient", machine.axis_sensors[rng.choice(["X", "Y", "Z"])])]
    out = physics.component_twist(len(rows), "Z", 1.0 * UM * t[0] * t[1])
    out[:, 1] = 0.6 * UM * t[0] * t[1]
    return {"S": out}


def warm_bend(machine, rows, rng):
    """The beam bends with its screw's temperature: a straightness error that grows as the machine warms."""
    a = rng.choice(["X", "Y"])
    t = physics.above_reference(machine, rows, machine.axis_sensors[a])
    x = physics.scaled(machine.axis(a), rows.q[a])
    return {a: physics.component_twist(len(rows), "Z", 2 * UM * t * x * x)}


def coolant(machine, rows, rng):
    """Coolant on and off, recorded as a state: the table lifts and tilts."""
    on = rows.state["coolant"]
    out = physics.component_twist(len(rows), "Z", 4 * UM * on)
    out[:, 3] = 15 * URAD * on
    return {"A": out}


def unbalanced_fixture(machine, rows, rng):
    """The weight of a fixture off the table's axis: sag of the tilted table in step with one turn of C."""
    values = np.sin(rows.q["A"]) * np.sin(rows.q["C"] + rng.uniform(0, 6))
    out = physics.component_twist(len(rows), "A", 20 * URAD * values)
    out[:, 1] = 4 * UM * values
    return {"A": out}


def square_of_speed(machine, rows, rng):
    """Elastic slides: an error with the square of the feed, in its direction."""
    a = rng.choice(["X", "Y", "Z"])
    v = rows.velocity[a]
    return {a: physics.along(machine.axis(a), 1e-6 * v * np.abs(v))}


def wandering(machine, rows, rng):
    """The part creeps in its clamps: a slow random walk within each run."""
    out = np.zeros((len(rows), 6))
    for run in rows.run_names:
        index = np.flatnonzero(rows.run == run)
        times, place = np.unique(rows.time[index], return_inverse=True)
        walk = np.cumsum(rng.normal(size=(len(times), 3)), axis=0) / math.sqrt(len(times))
        out[index, :3] = 6 * UM * walk[place]
    return {"P": out}


def cusp(machine, rows, rng):
    """A rail in two halves that meet at an angle: straightness with a kink."""
    a = rng.choice(["X", "Y", "Z"])
    axis = machine.axis(a)
    at = axis.low + rng.uniform(0.35, 0.65) * (axis.high - axis.low)
    across = "YZX"["XYZ".index(a)]
    return {a: physics.component_twist(len(rows), across, 0.05 * UM * np.abs(rows.q[a] - at))}


def five_lobes(machine, rows, rng):
    """Five lobes of a rotary bearing: radial motion and tilt."""
    a = rng.choice(["A", "C"])
    phase = rng.uniform(0, 6)
    out = physics.component_twist(len(rows), "X" if a == "C" else "Y", 4 * UM * np.cos(5 * rows.q[a] + phase))
    out[:, 2] = 3 * UM * np.sin(5 * rows.q[a] + phase)
    return {a: out}


def probe_lobes(machine, rows, rng):
    """The instrument's own error: three lobes in its direction of sensitivity about Z."""
    angle = np.arctan2(rows.n[:, 1], rows.n[:, 0])
    out = np.zeros((len(rows), 6))
    out[:, :3] = 4 * UM * np.cos(3 * angle + rng.uniform(0, 6))[:, None] * rows.n
    return {"S": out}


def resonance(machine, rows, rng):
    """A spindle that vibrates near one speed: its axis stands off there and nowhere else."""
    out = physics.component_twist(len(rows), "X", 5 * UM * np.exp(-0.5 * ((rows.rpm - 8000.0) / 1500.0) ** 2))
    out[:, 4] = 10 * URAD * np.exp(-0.5 * ((rows.rpm - 8000.0) / 1500.0) ** 2)
    return {"S": out}


def growing_play(machine, rows, rng):
    """A screw worn at one end: lost motion that grows along the travel."""
    a = rng.choice(["X", "Y", "Z"])
    axis = machine.axis(a)
    share = 0.5 * (1.0 + physics.scaled(axis, rows.q[a]))
    return {a: physics.along(axis, -0.5 * 6 * UM * rows.direction[a] * share**3)}


def triple_product(machine, rows, rng):
    """A ram that gives way with all three slides out: X times Y times Z."""
    x, y, z = (physics.scaled(machine.axis(a), rows.q[a]) for a in "XYZ")
    out = physics.component_twist(len(rows), "Z", 10 * UM * x * y * z)
    out[:, 0] = 6 * UM * x * y * z
    return {"S": out}


EFFECTS = {f.__name__: f for f in (table_in_field, resting_play, growing_interpolation, settling, warm_product, warm_bend, coolant,
                                   unbalanced_fixture, square_of_speed, wandering, cusp, five_lobes, probe_lobes, resonance,
                                   growing_play, triple_product)}
NEEDS = {  # library effects whose runs show the unseen one
    "table_in_field": ["location:C", "crosstalk:XY"], "resting_play": ["servo_lag:X", "servo_lag:Y", "servo_lag:Z"],
    "growing_interpolation": ["periodic:X", "periodic:Y", "periodic:Z"],
    "settling": ["periodic:X", "periodic:Y", "periodic:Z", "servo_lag:X"], "warm_product": ["ambient_drift", "thermal_location:A"],
    "warm_bend": ["component:EXX", "component:EYY", "ambient_drift"], "coolant": ["ambient_drift", "location:C"],
    "unbalanced_fixture": ["location:C"], "square_of_speed": ["servo_lag:X", "servo_lag:Y", "servo_lag:Z"],
    "wandering": ["ambient_drift", "time_drift"], "cusp": ["crosstalk:XY", "crosstalk:YZ", "periodic:X"],
    "five_lobes": ["location:C", "component:EZC", "sag:A"], "probe_lobes": ["location:C", "servo_lag:X"],
    "resonance": ["spindle_growth"], "growing_play": ["periodic:X", "periodic:Y", "periodic:Z", "servo_lag:X"],
    "triple_product": ["crosstalk:XY", "crosstalk:XZ", "squareness:C0Y"],
}


# Campaigns -----------------------------------------------------------------------------------------------------------


def with_coolant(rows, rng):
    """Coolant as a recorded state: on for a part of every run."""
    on = np.zeros(len(rows))
    for run in rows.run_names:
        index = np.flatnonzero(rows.run == run)
        times = rows.time[index]
        start, length = rng.uniform(0, 0.5), rng.uniform(0.25, 0.5)
        share = times / max(times.max(), 1e-9)
        on[index] = (share >= start) & (share < start + length)
    rows.state["coolant"] = on
    return rows


def thirty_to_sixty(rows, rng):
    """A few dozen readings of the whole campaign."""
    return rows.taken(np.sort(rng.permutation(len(rows))[: rng.integers(30, 61)]))


def part_frame(rows, rng):
    """Every displacement in the axes of the part."""
    rows.frame = np.where(rows.is_rotation, rows.frame, "part")
    return rows


def slanted(rows, rng):
    """Directions of sensitivity that no axis has: a different one for each run and channel, the same within it."""
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    rows.n = rows.n @ turn.T
    return rows


def noisy_axis(rows, rng):
    """One direction five times as uncertain as the others, and stated so."""
    bad = np.abs(rows.n[:, rng.integers(3)]) > 0.9
    rows.u_random = np.where(bad, 5.0, 1.0) * rows.u_random
    return rows


def no_velocities(rows, rng):
    """The columns of velocities and directions were never written; everything that moved is left out."""
    moving = sum(np.abs(v) for v in rows.velocity.values()) > 0
    return rows.taken(np.flatnonzero(~moving))


def rotations_only(rows, rng):
    """Levels and autocollimators: every displacement read as a rotation about the same direction."""
    rows.u_random = np.where(rows.is_rotation, rows.u_random, 2 * rows.u_random)
    rows.u_common = np.where(rows.is_rotation, rows.u_common, 2 * rows.u_common)
    rows.quantity = np.full(len(rows), "rotation")
    return rows


def repeated(rows, rng):
    """Every pose of three runs read twice, a second time a minute later: true repeats."""
    from .rows import join
    chosen = rng.choice(rows.run_names, min(3, len(rows.run_names)), replace=False)
    again = rows.taken(np.flatnonzero(np.isin(rows.run, chosen)))
    again.time = again.time + 60.0 + rows.time.max()
    return join([rows, again])


DESIGNS = {f.__name__: f for f in (thirty_to_sixty, part_frame, slanted, noisy_axis, no_velocities, rotations_only, repeated,
                                   with_coolant)}
# What a file of this design does not say: columns that are left out.
SILENT = {"no_velocities": ("dir_", "vel_")}


def prepared(which, rows, rng):
    rows = DESIGNS[which](rows, rng)
    rows.lags.clear()
    return rows
