"""The library's effects, written from their published definition, as twists of joints (mm, rad).

`twists(name, parameters, choice, machine, rows)` gives {joint: (N, 6)}. Parameter keys and units are those of model files.
"""

import numpy as np
from numpy.polynomial import legendre

COMPONENTS = {"X": 0, "Y": 1, "Z": 2, "A": 3, "B": 4, "C": 5}
TAU_RANGE = (300.0, 15000.0)


def unit_direction(axis):
    return np.asarray(axis.direction, float)


def scaled(axis, x):
    return (2.0 * x - axis.low - axis.high) / (axis.high - axis.low)


def polynomial(axis, x, degree):
    return legendre.legval(scaled(axis, x), [0.0] * degree + [1.0])


def component_twist(count, component, values):
    """One of the six columns; a rotation in rad, a translation in mm."""
    out = np.zeros((count, 6))
    out[:, COMPONENTS[component]] = values
    return out


def along(axis, values):
    """Along the axis' own positive sense: a shift of a slide, a turn about +n of a table."""
    out = np.zeros((len(values), 6))
    columns = slice(0, 3) if axis.kind == "linear" else slice(3, 6)
    out[:, columns] = values[:, None] * unit_direction(axis)
    return out


def lagged(rows, signal, tau, settled):
    """First-order lag within each run; a value holds from its row to the next."""
    key = (hash(signal.tobytes()), tau, settled)
    if key in rows.lags:
        return rows.lags[key]
    out = np.empty(len(rows))
    for run in rows.run_names:
        index = np.flatnonzero(rows.run == run)
        index = index[np.argsort(rows.time[index], kind="stable")]
        level = signal[index[0]] if settled else 0.0
        out[index[0]] = level
        for before, here in zip(index[:-1], index[1:]):
            level += (signal[before] - level) * -np.expm1(-(rows.time[here] - rows.time[before]) / tau)
            out[here] = level
    rows.lags[key] = out
    return out


def above_reference(machine, rows, sensor):
    if sensor not in rows.temperature:
        return np.zeros(len(rows))
    return rows.temperature[sensor] - machine.reference_degC


def unit_factor(component):
    """um -> mm, urad -> rad."""
    return 1e-3 if component in "XYZ" else 1e-6


def component_keys(machine, joint, component):
    unit = "um" if component in "XYZ" else "urad"
    linear = machine.axis(joint).kind == "linear"
    return [f"{k}_{unit}" for k in (("P1", "P2", "P3", "P4") if linear else ("cos1", "sin1", "cos2", "sin2"))]


def component(machine, rows, subject, p, _):
    which, joint = subject[1], subject[2]
    axis, x = machine.axis(joint), rows.q[joint]
    if axis.kind == "linear":
        shapes = [polynomial(axis, x, k) for k in (1, 2, 3, 4)]
    else:
        shapes = [np.cos(x), np.sin(x), np.cos(2 * x), np.sin(2 * x)]
    keys = component_keys(machine, joint, which)
    values = sum(p.get(k, 0.0) * s for k, s in zip(keys, shapes)) * unit_factor(which)
    return {joint: component_twist(len(rows), which, values)}


def periodic(machine, rows, subject, p, _):
    phase = 2.0 * np.pi * rows.q[subject] / p["p_mm"]
    values = (p.get("sin_um", 0.0) * np.sin(phase) + p.get("cos_um", 0.0) * np.cos(phase)) * 1e-3
    return {subject: along(machine.axis(subject), values)}


def worm(machine, rows, subject, p, _):
    phase = p["n"] * rows.q[subject]
    values = (p.get("sin_urad", 0.0) * np.sin(phase) + p.get("cos_urad", 0.0) * np.cos(phase)) * 1e-6
    return {subject: along(machine.axis(subject), values)}


SQUARENESS = {"C0Y": ("Y", "X", -1.0), "B0Z": ("Z", "X", +1.0), "A0Z": ("Z", "Y", -1.0)}


def squareness(machine, rows, subject, p, _):
    joint, which, sign = SQUARENESS[subject]
    values = sign * p[f"{subject}_urad"] * 1e-6 * rows.q[joint]
    return {joint: component_twist(len(rows), which, values)}


LOCATION = {"A": ("Y", "Z", "B", "C"), "C": ("X", "Y", "A", "B")}


def location_keys(subject):
    return [f"{w}0{subject}_{'um' if w in 'XYZ' else 'urad'}" for w in LOCATION[subject]]


def location(machine, rows, subject, p, _):
    out = np.zeros((len(rows), 6))
    for which, key in zip(LOCATION[subject], location_keys(subject)):
        out[:, COMPONENTS[which]] = p.get(key, 0.0) * unit_factor(which)
    return {subject: out}


def backlash(machine, rows, subject, p, _):
    axis = machine.axis(subject)
    size = p["b_um"] * 1e-3 if axis.kind == "linear" else p["b_urad"] * 1e-6
    return {subject: along(axis, -0.5 * size * rows.direction[subject])}


def crosstalk_keys(which):
    return [f"P{i}{k}_{'um' if which in 'XYZ' else 'urad'}" for i in (1, 2) for k in (1, 2)]


def crosstalk(machine, rows, subject, p, choice):
    first, second = machine.axis(subject[0]), machine.axis(subject[1])
    which, joint = choice["component"][1], choice["component"][2]
    shapes = [polynomial(first, rows.q[first.name], i) * polynomial(second, rows.q[second.name], k)
              for i in (1, 2) for k in (1, 2)]
    values = sum(p.get(k, 0.0) * s for k, s in zip(crosstalk_keys(which), shapes)) * unit_factor(which)
    return {joint: component_twist(len(rows), which, values)}


def sag(machine, rows, subject, p, _):
    tilt = rows.q[subject]
    out = component_twist(len(rows), "A", p.get("A_sin_urad", 0.0) * 1e-6 * np.sin(tilt))
    out[:, 1] = p.get("Y_sin_um", 0.0) * 1e-3 * np.sin(tilt)
    out[:, 2] = p.get("Z_cos_um", 0.0) * 1e-3 * np.cos(tilt)
    return {subject: out}


def overhang(machine, rows, subject, p, _):
    out_of_guide = (machine.axis(subject).high - rows.q[subject]) * 1e-3  # m
    out = component_twist(len(rows), "A", p.get("A_urad_per_m", 0.0) * 1e-6 * out_of_guide)
    out[:, 4] = p.get("B_urad_per_m", 0.0) * 1e-6 * out_of_guide
    return {subject: out}


def spindle_growth(machine, rows, _subject, p, _):
    level = lagged(rows, rows.rpm * 1e-3, p["tau_s"], settled=False)
    out = component_twist(len(rows), "Z", p.get("Z_um_per_krpm", 0.0) * 1e-3 * level)
    out[:, 1] = p.get("Y_um_per_krpm", 0.0) * 1e-3 * level
    return {"S": out}


def screw_heating(machine, rows, subject, p, _):
    warm = above_reference(machine, rows, machine.axis_sensors.get(subject, f"screw_{subject}"))
    values = warm * (p.get("alpha_um_per_m_K", 0.0) * 1e-6 * rows.q[subject] + p.get("offset_um_per_K", 0.0) * 1e-3)
    return {subject: along(machine.axis(subject), values)}


def thermal_location(machine, rows, subject, p, choice):
    level = lagged(rows, above_reference(machine, rows, choice["sensor"]), p["tau_s"], settled=True)
    out = np.zeros((len(rows), 6))
    for which in ("Y", "Z") if subject == "A" else ("X", "Y"):
        out[:, COMPONENTS[which]] = p.get(f"{which}_um_per_K", 0.0) * 1e-3 * level
    return {subject: out}


def ambient_drift(machine, rows, _subject, p, _):
    level = lagged(rows, above_reference(machine, rows, machine.ambient_sensor), p["tau_s"], settled=True)
    out = np.zeros((len(rows), 6))
    for which in "XYZ":
        out[:, COMPONENTS[which]] = p.get(f"{which}_um_per_K", 0.0) * 1e-3 * level
    return {"S": out}


def time_drift(machine, rows, _subject, p, _):
    out = np.zeros((len(rows), 6))
    for which in "XYZ":
        out[:, COMPONENTS[which]] = p.get(f"{which}_um_per_h", 0.0) * 1e-3 * rows.time / 3600.0
    return {"S": out}


def servo_lag(machine, rows, subject, p, _):
    return {subject: along(machine.axis(subject), -rows.velocity[subject] * p["tau_ms"] * 1e-3)}


def reversal_spike(machine, rows, subject, p, _):
    """What is left of the sense before the last reversal, while the axis moves: twice the size at the reversal itself."""
    axis, sense = machine.axis(subject), rows.direction[subject]
    size = p["h_um"] * 1e-3 if axis.kind == "linear" else p["h_urad"] * 1e-6
    left = 0.5 * (sense - lagged(rows, sense, p["decay_ms"] * 1e-3, settled=True))
    return {subject: along(axis, np.where(rows.velocity[subject] != 0, -size * left, 0.0))}


def spindle_tilt(machine, rows, _subject, p, _):
    out = np.zeros((len(rows), 6))
    out[:, 3], out[:, 4] = p.get("A0S_urad", 0.0) * 1e-6, p.get("B0S_urad", 0.0) * 1e-6
    return {"S": out}


def tool_length(machine, rows, _subject, p, _):
    return {"S": component_twist(len(rows), "Z", np.full(len(rows), p["Z0S_um"] * 1e-3))}


def setup_tilt(machine, rows, _subject, p, _):
    out = np.zeros((len(rows), 6))
    for which in "ABC":
        for run in rows.run_names:
            out[rows.run == run, COMPONENTS[which]] = p.get(f"{which}_{run}_urad", 0.0) * 1e-6
    return {"P": out}


def step(machine, rows, _subject, p, choice):
    after = (rows.run == choice["run"]) & (rows.time >= p["t_s"])
    out = np.zeros((len(rows), 6))
    for which in "XYZ":
        out[after, COMPONENTS[which]] = p.get(f"{which}_um", 0.0) * 1e-3
    return {"P": out}


def zero_offset(machine, rows, subject, p, _):
    return {subject: along(machine.axis(subject), np.full(len(rows), p[f"{subject}0{subject}_urad"] * 1e-6))}


def tool_offset(machine, rows, _subject, p, _):
    out = np.zeros((len(rows), 6))
    out[:, 0], out[:, 1] = p.get("X0S_um", 0.0) * 1e-3, p.get("Y0S_um", 0.0) * 1e-3
    return {"S": out}


def turned_weight(rows, subject):
    """sin a cos c, sin a sin c, cos a cos c, cos a sin c of a table that A tilts and C turns."""
    tilt, turn = rows.q[subject[0]], rows.q[subject[1]]
    return {"sin_cos": np.sin(tilt) * np.cos(turn), "sin_sin": np.sin(tilt) * np.sin(turn),
            "cos_cos": np.cos(tilt) * np.cos(turn), "cos_sin": np.cos(tilt) * np.sin(turn)}


WEIGHT = "AYZ"  # of A's joint: every machine here has C on A


def weight(_machine, rows, subject, p, _):
    out = np.zeros((len(rows), 6))
    functions = turned_weight(rows, subject)
    for which in WEIGHT:
        unit = "um" if which in "XYZ" else "urad"
        for f in ("sin_cos", "sin_sin"):
            out[:, COMPONENTS[which]] += p.get(f"{which}_{f}_{unit}", 0.0) * unit_factor(which) * functions[f]
    return {subject[0]: out}


def unbalance_keys(choice):
    which, joint = choice["component"][1], choice["component"][2]
    names = ["sin_cos", "sin_sin"] + (["cos_cos", "cos_sin"] if which == joint == "A" else [])
    return [f"{n}_{'um' if which in 'XYZ' else 'urad'}" for n in names]


def unbalance(_machine, rows, subject, p, choice):
    which, joint = choice["component"][1], choice["component"][2]
    functions = turned_weight(rows, subject)
    values = sum(p.get(k, 0.0) * functions[k.rpartition("_")[0]] for k in unbalance_keys(choice))
    return {joint: component_twist(len(rows), which, values * unit_factor(which))}


KINDS = {f.__name__: f for f in (
    zero_offset, tool_offset, weight, unbalance,
    component, periodic, worm, squareness, location, backlash, crosstalk, sag, overhang, spindle_growth, screw_heating,
    thermal_location, ambient_drift, time_drift, servo_lag, reversal_spike, spindle_tilt, tool_length, setup_tilt, step)}


def twists(name, parameters, choice, machine, rows):
    kind, _, subject = name.partition(":")
    return KINDS[kind](machine, rows, subject, parameters, choice or {})


def add_twists(*parts):
    """Twists at one joint add."""
    out = {}
    for part in parts:
        for joint, twist in part.items():
            out[joint] = out[joint] + twist if joint in out else twist
    return out


def linear_keys(name, machine, rows, choice=None):
    """Parameters in which the effect is linear, with their usual size: what amplitudes are drawn from."""
    kind, _, subject = name.partition(":")
    if kind == "component":
        size = 5.0 if subject[1] in "XYZ" else 20.0
        return {k: size for k in component_keys(machine, subject[2], subject[1])}
    if kind == "crosstalk":
        which = choice["component"][1]
        return {k: 4.0 if which in "XYZ" else 20.0 for k in crosstalk_keys(which)}
    if kind == "location":
        return {k: 20.0 if k.endswith("um") else 40.0 for k in location_keys(subject)}
    if kind == "backlash":
        return {"b_um": 5.0} if machine.axis(subject).kind == "linear" else {"b_urad": 20.0}
    if kind == "reversal_spike":
        return {"h_um": 5.0} if machine.axis(subject).kind == "linear" else {"h_urad": 50.0}
    if kind == "thermal_location":
        return {f"{w}_um_per_K": 3.0 for w in (("Y", "Z") if subject == "A" else ("X", "Y"))}
    if kind == "setup_tilt":
        return {f"{w}_{run}_urad": 50.0 for run in rows.run_names for w in "ABC"}
    if kind == "squareness":
        return {f"{subject}_urad": 30.0}
    if kind == "zero_offset":
        return {f"{subject}0{subject}_urad": 40.0}
    if kind == "weight":
        return {f"{w}_{f}_{'um' if w in 'XYZ' else 'urad'}": 5.0 if w in "XYZ" else 20.0 for w in WEIGHT for f in ("sin_cos", "sin_sin")}
    if kind == "unbalance":
        return {k: 5.0 if k.endswith("um") else 20.0 for k in unbalance_keys(choice)}
    return dict(FIXED_KEYS[kind])


FIXED_KEYS = {
    "tool_offset": {"X0S_um": 10.0, "Y0S_um": 10.0},
    "periodic": {"sin_um": 2.0, "cos_um": 2.0},
    "worm": {"sin_urad": 20.0, "cos_urad": 20.0},
    "sag": {"A_sin_urad": 20.0, "Y_sin_um": 8.0, "Z_cos_um": 8.0},
    "overhang": {"A_urad_per_m": 40.0, "B_urad_per_m": 40.0},
    "spindle_growth": {"Z_um_per_krpm": 2.0, "Y_um_per_krpm": 1.0},
    "screw_heating": {"alpha_um_per_m_K": 11.0, "offset_um_per_K": 2.0},
    "ambient_drift": {"X_um_per_K": 3.0, "Y_um_per_K": 3.0, "Z_um_per_K": 3.0},
    "time_drift": {"X_um_per_h": 5.0, "Y_um_per_h": 5.0, "Z_um_per_h": 5.0},
    "servo_lag": {"tau_ms": 0.1},
    "spindle_tilt": {"A0S_urad": 50.0, "B0S_urad": 50.0},
    "tool_length": {"Z0S_um": 10.0},
    "step": {"X_um": 10.0, "Y_um": 10.0, "Z_um": 10.0},
}
