#!/usr/bin/env python3
"""offsets_check.py: the HAL component thermal_offsets without LinuxCNC: what it takes for an answer, and that its offset never moves faster than the slew limit,
holds and fades, whatever it hears and however irregularly it is run (2000 seeded histories)."""
import importlib.machinery
import importlib.util
import json
import math
import random
import sys
from pathlib import Path

path = Path(__file__).resolve().parents[3] / "postconfigs/linuxcnc/thermal_offsets.py"
sys.dont_write_bytecode = True  # the module's folder is the source tree
loader = importlib.machinery.SourceFileLoader("thermal_offsets", str(path))
module = importlib.util.module_from_spec(importlib.util.spec_from_loader("thermal_offsets", loader))
loader.exec_module(module)

GOOD = {"ok": True, "stale": False, "silent_s": 2.5, "correction_um": {"dx": 1.0, "dy": -2.0, "dz": 3.0}}


def taken(**changes):
    return module.correction_of(json.dumps(GOOD | changes), "xz", 200.0)


assert taken() == ({"x": 1.0, "z": 3.0}, 2.5)
for change in ({"ok": False}, {"stale": True}, {"stale": None}, {"silent_s": -1}, {"silent_s": None}, {"silent_s": math.nan}, {"correction_um": {"dx": 1.0}},
               {"correction_um": None}, {"correction_um": {"dx": math.nan, "dz": 0}}, {"correction_um": {"dx": math.inf, "dz": 0}},
               {"correction_um": {"dx": 201.0, "dz": 0}}, {"correction_um": {"dx": "a", "dz": 0}}):
    assert taken(**change) is None, change
for text in (b"", b"{", b"[]", b"null", b"\xff\xfe", b"7"):
    assert module.correction_of(text, "xz", 200.0) is None, text

rng = random.Random(5)
for case in range(2000):
    slew, hold = 10 ** rng.uniform(-1, 1), rng.uniform(0.5, 20)
    offsets = module.Offsets("xz", slew, hold)
    now, heard, wanted = rng.uniform(0, 1e6), -math.inf, None
    offsets.begin(now)
    for _ in range(rng.randrange(10, 200)):
        if rng.random() < 0.1:
            wanted, heard = {a: rng.uniform(-200, 200) for a in "xz"}, now - rng.choice([0, 0, rng.uniform(0, 30)])
            offsets.hear(wanted, heard)
        dt = rng.choice([0.05, 0.05, 0.05, 0.0, rng.uniform(0, 100)])  # at times the process was not run
        now += dt
        before = dict(offsets.at)
        offsets.step(now)
        target = wanted if wanted and now - heard <= hold else {"x": 0.0, "z": 0.0}
        for a in "xz":
            moved, way = offsets.at[a] - before[a], target[a] - before[a]
            assert abs(moved) <= slew * min(dt, module.PERIOD_S) + 1e-9, (case, moved)
            assert moved * way >= 0 and abs(moved) <= abs(way) + 1e-9, (case, moved, way)  # towards it, and not beyond
    # Nobody says anything any more: it stays while it is to be held, then goes to zero and stays there.
    for _ in range(int((hold + 200 / slew) / module.PERIOD_S) + 20):
        now += module.PERIOD_S
        offsets.step(now)
    assert offsets.at == {"x": 0.0, "z": 0.0}, (case, offsets.at)
print("answers judged, 2000 histories followed")
