"""Campaigns of one to four runs, as a shop measures that looks for one thing, of effects as large as they usually are."""

import math

import numpy as np

from .campaigns import Campaign

DESIGNS = {
    "one ball": lambda c: c.ball("ball", 4, 6),
    "one ball, part frame": lambda c: c.ball("ball", 4, 8, frame="part"),
    "two balls": lambda c: (c.ball("ball_1", 4, 6), c.ball("ball_2", 5, 8, tool=c.tool(100.0))),
    "lasers": lambda c: [c.laser(f"laser_{a}", a, 12) for a in "XYZ"],
    "three circles": lambda c: [c.circle(f"circle_{p}", p, 1000.0, 30) for p in ("XY", "XZ", "YZ")],
    "one circle": lambda c: c.circle("circle", "XY", 2000.0, 60),
    "laser, ball, circle": lambda c: (c.laser("laser", "X", 10), c.ball("ball", 3, 5), c.circle("circle", "XY", 1500.0, 24)),
    "rotary, ball": lambda c: (c.rotary("rotary", "C", 36), c.ball("ball", 4, 6)),
    "diagonals": lambda c: [c.diagonal(f"diagonal_{i}", s, 12)
                            for i, s in enumerate(((1, 1, 1), (1, 1, -1), (1, -1, 1), (-1, 1, 1)))],
}
# These runs have no spindle cycle and no course of temperatures worth the name; a tilt of each run is no error of the machine.
LEFT_OUT = ("step", "setup_tilt", "spindle_growth", "thermal_location", "ambient_drift")
SIZES = (0.5, 1.0, 2.0, 4.0, 10.0)  # of the usual amplitudes


def campaign(which, machine, rng):
    sigma = float(np.exp(rng.uniform(math.log(0.3), math.log(1.5))))
    c = Campaign(machine, rng, sigma, 2 * sigma, float(rng.choice([0.0, 0.5, 1.0])))
    DESIGNS[which](c)
    return c.rows()


def shown(effect, rows):
    """A cross-talk of an axis that stands still is a component error of the other, and is to be named as that."""
    kind, _, pair = effect.partition(":")
    return kind != "crosstalk" or all(np.ptp(rows.q[a]) > 1e-9 for a in pair)
