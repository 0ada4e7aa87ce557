"""Pairs that a campaign cannot tell apart, made so on purpose; the run that separates them is asked of the program."""

import numpy as np

from . import campaigns, machines
from .campaigns import UNIT
from .oracle import Oracle, four_digits


def one_feed(machine, rng):
    """Read on the fly at one feed only: lag and lost motion are the same."""
    axis = str(rng.choice(["X", "Y", "Z"]))
    campaign = start(machine, rng)
    campaign.moving_laser("moving_a", axis, (2000,), 14)
    campaign.moving_laser("moving_b", axis, (2000,), 14)
    rows = campaign.rows()
    moving = np.char.startswith(rows.run.astype(str), "moving")
    for a in rows.direction:
        rows.direction[a] = np.where(moving, rows.direction[a], 0)
    return rows, [f"servo_lag:{axis}", f"backlash:{axis}"]


def one_height(machine, rng):
    """Positions of one slide read on one line: its positioning error and its tilt with that lever arm are the same."""
    axis = str(rng.choice(["X", "Y"]))
    campaign = start(machine, rng)
    for name in ("line_a", "line_b"):
        values, signs = campaign.there_and_back(campaign.positions(machine.axis(axis), 16))
        poses = {a: np.full(len(values), 0.5 * sum(campaigns.travel(machine.axis(a)))) for a in "XYZ"}
        poses[axis] = values
        campaign.add(name, poses, [UNIT["XYZ".index(axis)]], tool=(0, 0, -machine.tool_length), directions={axis: signs})
    tilt = "B" if axis == "X" else "A"
    return campaign.rows(), [f"component:E{axis}{axis}", f"component:E{tilt}{axis}"]


def steady_room(machine, rng):
    """The room warms up steadily while the spindle stands: temperature is a clock."""
    campaign = start(machine, rng)
    campaign.warm_up("warm_a", 90, 30, (0,))
    campaign.warm_up("warm_b", 70, 24, (0,))
    rows = campaign.rows()
    rate = rng.uniform(0.8, 1.6)
    for run in rows.run_names:
        here = rows.run == run
        rows.temperature["ambient"][here] = machine.reference_degC + 0.4 + rate * rows.time[here] / 3600
        for sensor in machine.axis_sensors.values():
            rows.temperature[sensor][here] = machine.reference_degC + 0.4
    return rows, ["time_drift", "ambient_drift"]


def one_level(machine, rng):
    """Everything was measured with Z at one height: a tilted spindle and a tilting slide are the same."""
    campaign = start(machine, rng, ball=False)
    home = {a: 0.0 for a in "XYZ"}
    level = 0.5 * sum(campaigns.travel(machine.axis("Z")))
    for k, length in enumerate((0.7, 1.0, 1.5)):
        values, signs = campaign.there_and_back(campaign.positions(machine.axis("X"), 5))
        rotary = np.tile([0.0, 1.0], len(values))[: len(values)]
        poses = dict(home, X=values, Z=np.full(len(values), level), Y=np.zeros(len(values)))
        poses.update(A=0.35 * rotary * machine.axis("A").high, C=np.linspace(0, 6.0, len(values)))
        poses = {a: np.broadcast_to(v, values.shape) for a, v in poses.items()}
        campaign.add(f"level_{k}", poses, UNIT, tool=(0, 0, -length * machine.tool_length), directions={"X": signs})
        campaign.add(f"tram_{k}", poses, UNIT[:2], "rotation", tool=(0, 0, -length * machine.tool_length))
    return campaign.rows(), ["spindle_tilt", "overhang:Z"]


TEMPLATES = (one_feed, one_height, steady_room, one_level)


def start(machine, rng, ball=True):
    campaign = campaigns.Campaign(machine, rng, 0.5, 1.0)
    if ball:
        campaign.ball("ball1", 3, 5, tool=(0, 0, -machine.tool_length))
    return campaign


# A perfect statistician, told that it is one of the two, errs with chance Phi(-sqrt(lambda (1 - rho^2)) / 2): above 12 % here.
MOST_TELLING = 5.4


def pair(name, index, rng):
    from . import cases
    template = TEMPLATES[index % len(TEMPLATES)]
    while True:
        machine = machines.MACHINES[rng.integers(len(machines.MACHINES))]()
        rows, pair_names = template(machine, rng)
        truth = pair_names[(index // len(TEMPLATES)) % 2]
        other = next(n for n in pair_names if n != truth)
        drawn = cases.drawn_effect(truth, machine, rows, rng)
        oracle = Oracle(machine, rows, [])
        _, signal = cases.scaled_to(oracle, [], drawn, 100.0)
        rho = oracle.rivals(signal, {truth}, oracle.project(oracle.raw_columns(*drawn)), drawn).get(other, 0.0)
        wanted = min(float(rng.choice([100, 200, 400])), four_digits(MOST_TELLING / max(1.0 - rho**2, 1e-9)))
        if wanted >= 60:
            break
    hidden, signal = cases.scaled_to(oracle, [], drawn, wanted)
    columns = oracle.project(oracle.raw_columns(*hidden))
    rivals = oracle.rivals(signal, {truth}, columns, hidden)
    about = {"stratum": "C", "kind": template.__name__, "lambda": wanted, "rho": rho, "rivals": dict(list(rivals.items())[:6])}
    return cases.finished(name, machine, rows, [], [hidden], rng, about)
