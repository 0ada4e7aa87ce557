"""Readings of a measurement file that was made of a trace, held against what the hidden servos make of them: how honest the stated uncertainties are."""
import csv

import numpy as np

import control

SPIKE_S = 0.015  # as control.behind_servos has it


def part_in_machine(chain, q):
    """Rotation of the part at each row."""
    out = np.tile(np.eye(3), (len(q), 1, 1))
    for name in reversed(chain.m.part_chain):
        axis, angle = np.array(chain.m.direction(name)), np.radians(q[:, control.AXES.index(name)])
        out = np.stack([control.Chain.turned(out[:, :, j], axis, angle) for j in range(3)], axis=2)
    return out


def rotation_vectors(r):
    sine = 0.5 * np.stack([r[:, 2, 1] - r[:, 1, 2], r[:, 0, 2] - r[:, 2, 0], r[:, 1, 0] - r[:, 0, 1]], axis=1)
    size = np.linalg.norm(sine, axis=1)
    return sine * np.where(size > 1e-9, np.arcsin(np.minimum(size, 1)) / np.maximum(size, 1e-12), 1.0)[:, None]


def axis_errors(rows, velocity, sense, lag_ms, spike):
    """What the servos leave of each axis: its delay behind the others, and spikes since its sense has changed within the run."""
    out = -(lag_ms - np.median(lag_ms)) / 1000.0 * velocity
    for i in np.flatnonzero(spike):
        begun, last = {}, {}
        for k, row in enumerate(rows):
            run, t = row["run_id"], float(row["time_s"])
            if last.get(run, 0) not in (0, sense[k, i]):
                begun[run] = t
            last[run] = sense[k, i]
            if run in begun:
                out[k, i] -= spike[i] * sense[k, i] * np.exp(-(t - begun[run]) / SPIKE_S)
    return out


def normalized(path, chain, length, lag_ms, spike):
    """(reading - what it should be) / stated uncertainty, of each reading."""
    with path.open() as file:
        rows = list(csv.DictReader(line for line in file if not line.startswith("#")))

    def columns(form, number=float):
        return np.array([[number(row[form.format(a + ("_deg" if a in "ABC" else "_mm"), a)] or 0) for a in control.AXES] for row in rows])

    q, velocity, sense = columns("{0}"), columns("vel_{0}_min") / 60, columns("dir_{1}")
    moved = q + axis_errors(rows, velocity, sense, lag_ms, spike)
    frame = part_in_machine(chain, q)
    n = np.array([[float(row[f"n_{c}"] or 0) for c in "xyz"] for row in rows])
    is_turn = np.array([row["quantity"] == "rotation" for row in rows])
    shift = np.einsum("kij,kj->ki", frame, chain.tool(moved, length)[0] - chain.tool(q, length)[0]) * 1e3
    turn = rotation_vectors(np.einsum("kij,klj->kil", frame, part_in_machine(chain, moved))) * 1e6
    expected = np.einsum("ki,ki->k", np.where(is_turn[:, None], turn, shift), n)
    read = np.array([bool(row["value"]) for row in rows])
    value, sigma = (np.array([float(row[c] or 1) for row in rows]) for c in ("value", "u_random"))
    return ((value - expected) / sigma)[read]
