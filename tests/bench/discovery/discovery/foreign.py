"""Physics that the library does not have. Each gives twists for an amplitude of one; the case scales it."""

import math

import numpy as np

from . import physics

UM, URAD = 1e-3, 1e-6


def spread(axis, share):
    return axis.low + share * (axis.high - axis.low)


def play_with_feed(machine, rows, rng):
    """Hysteresis whose play fades with the feed: lubricant film."""
    a = rng.choice(["X", "Y", "Z"])
    speed = np.abs(rows.velocity[a])
    values = -0.5 * 4 * UM * rows.direction[a] * np.cos(np.minimum(speed / rng.uniform(15, 25), math.pi))
    return {a: physics.along(machine.axis(a), values)}


def gear_mesh(machine, rows, rng):
    """Two meshes at once that are no harmonics of the table's turn: a reducer with a fractional ratio."""
    a = rng.choice(["A", "C"])
    n = rng.integers(9, 30) + 0.5
    values = 15 * URAD * (np.sin(n * rows.q[a] + 1.0) + 0.8 * np.sin(2.37 * n * rows.q[a]))
    return {a: physics.along(machine.axis(a), values)}


def bent_rail(machine, rows, rng):
    """A dent in a guideway: a straightness error over a tenth of the travel."""
    a = rng.choice(["X", "Y", "Z"])
    axis = machine.axis(a)
    across = "YZX"["XYZ".index(a)]
    centre, width = spread(axis, rng.uniform(0.3, 0.7)), 0.045 * (axis.high - axis.low)
    return {a: physics.component_twist(len(rows), across, 5 * UM * np.exp(-0.5 * ((rows.q[a] - centre) / width) ** 2))}


def scale_joint(machine, rows, rng):
    """A linear scale of two pieces that do not meet: positions jump at one place."""
    a = rng.choice(["X", "Y", "Z"])
    axis = machine.axis(a)
    values = 5 * UM * (rows.q[a] > spread(axis, rng.uniform(0.35, 0.65)))
    return {a: physics.along(axis, values)}


def third_harmonic(machine, rows, rng):
    """Three lobes of the C table's axial and tilt motion: a three-jaw distortion."""
    phase = rng.uniform(0, 2 * math.pi)
    out = physics.component_twist(len(rows), "Z", 4 * UM * np.cos(3 * rows.q["C"] + phase))
    out[:, 3] = 15 * URAD * np.sin(3 * rows.q["C"] + phase)
    return {"C": out}


def tilt_times_turn(machine, rows, rng):
    """An unbalanced part: the tilted table gives way in step with the turn of C."""
    phase = rng.uniform(0, 2 * math.pi)
    values = np.sin(rows.q["A"]) * np.cos(2 * rows.q["C"] + phase)
    out = physics.component_twist(len(rows), "X", 5 * UM * values)
    out[:, 2] = 3 * UM * np.sin(rows.q["A"]) * np.sin(2 * rows.q["C"] + phase)
    return {"A": out}


def tool_pull_out(machine, rows, rng):
    """A long tool bends more: tilt of the spindle with the cube of the length, and with the slide's position."""
    length = np.abs(rows.tool[:, 2]) / machine.tool_length
    x = physics.scaled(machine.axis("X"), rows.q["X"])
    return {"S": physics.component_twist(len(rows), "B", 30 * URAD * (length**3 - 1.0) * np.cos(2.5 * math.pi * x))}


def thermostat(machine, rows, rng):
    """A cooler that switches on at a threshold: nothing, then a jump of the spindle, in step with its own clock."""
    period = rng.uniform(1200, 2000)  # the warm-ups are read every few minutes
    on = np.sin(2 * math.pi * rows.time / period) > 0.2
    out = physics.component_twist(len(rows), "Z", 4 * UM * on)
    out[:, 0] = 2 * UM * on
    return {"S": out}


def corner(machine, rows, rng):
    """A foundation bolt that is loose: a kink beyond one corner of the X-Y plane."""
    x = physics.scaled(machine.axis("X"), rows.q["X"])
    y = physics.scaled(machine.axis("Y"), rows.q["Y"])
    kink = np.maximum(0.0, rng.choice([-1, 1]) * x + rng.choice([-1, 1]) * y - 0.2)
    return {"Y": physics.component_twist(len(rows), "Z", 8 * UM * kink)}


def sawtooth(machine, rows, rng):
    """Stick-slip: the slide creeps and jumps every few centimetres, longer than any screw pitch."""
    a = rng.choice(["X", "Y"])
    period = rng.uniform(70, 110)
    values = 4 * UM * (np.mod(rows.q[a] / period + rng.random(), 1.0) - 0.5) * np.where(rows.direction[a] >= 0, 1, -1)
    return {a: physics.along(machine.axis(a), values)}


EFFECTS = {f.__name__: f for f in (play_with_feed, gear_mesh, bent_rail, scale_joint, third_harmonic, tilt_times_turn,
                                   tool_pull_out, thermostat, corner, sawtooth)}
NEEDS = {  # library effects whose runs show the foreign one
    "play_with_feed": ["servo_lag:X", "servo_lag:Y", "servo_lag:Z"], "gear_mesh": ["worm:A", "worm:C"],
    "bent_rail": ["periodic:X", "periodic:Y", "periodic:Z", "crosstalk:XY", "crosstalk:YZ"],
    "scale_joint": ["periodic:X", "periodic:Y", "periodic:Z"], "third_harmonic": ["location:C", "component:EZC"],
    "tilt_times_turn": ["location:C"], "tool_pull_out": ["crosstalk:XY", "component:EXX"],
    "thermostat": ["ambient_drift"], "corner": ["crosstalk:XY", "squareness:C0Y"], "sawtooth": ["periodic:X", "periodic:Y"],
}
