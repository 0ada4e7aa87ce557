"""The machines of the benchmark, and machine and model files."""

import math
import tomllib

from .chain import Axis, Machine

CYCLIC = (-math.inf, math.inf)
SENSORS = {"X": "screw_x", "Y": "screw_y", "Z": "screw_z"}


def deg(*values):
    return tuple(math.radians(v) for v in values)


def offset_trunnion():
    """A', C' by ISO 841 (the table turns negatively), C beside and above A; travel not symmetric; pitch known."""
    return Machine(
        "offset trunnion",
        (
            Axis("X", "linear", (1, 0, 0), -420, 380, pitch=10),
            Axis("Y", "linear", (0, 1, 0), -350, 400, pitch=10),
            Axis("Z", "linear", (0, 0, 1), -300, 500, pitch=8),
            Axis("A", "rotary", (-1, 0, 0), *deg(-30, 120), point=(0, 0.4, -65)),
            Axis("C", "rotary", (0, 0, -1), *CYCLIC, point=(0.1, 0, -30)),
        ),
        ("X", "Y", "Z"), ("A", "C"), tool_length=150, axis_sensors=SENSORS)


def common_point():
    """Both rotary axes through one point, the table turns positively; the slides stacked Y, X, Z."""
    return Machine(
        "common point",
        (
            Axis("X", "linear", (1, 0, 0), -500, 500),
            Axis("Y", "linear", (0, 1, 0), -500, 500),
            Axis("Z", "linear", (0, 0, 1), -400, 700),
            Axis("A", "rotary", (1, 0, 0), *deg(-110, 110), point=(0, 0, -200)),
            Axis("C", "rotary", (0, 0, 1), *CYCLIC, point=(0, 0, -200)),
        ),
        ("Y", "X", "Z"), ("A", "C"), tool_length=180, axis_sensors=SENSORS)


def table_under_x():
    """An X slide under the trunnion, its positive command moves the part to -X; a longer spindle nose."""
    return Machine(
        "X under the table",
        (
            Axis("X", "linear", (-1, 0, 0), -300, 300, pitch=12),
            Axis("Y", "linear", (0, 1, 0), -260, 320, pitch=12),
            Axis("Z", "linear", (0, 0, 1), -350, 450, pitch=12),
            Axis("A", "rotary", (-1, 0, 0), *deg(-110, 30), point=(5.0, -12.0, -90)),
            Axis("C", "rotary", (0, 0, -1), *CYCLIC, point=(4.6, -11.5, -140)),
        ),
        ("Y", "Z"), ("X", "A", "C"), tool_length=220, part_zero=(5, -12, -60), axis_sensors=SENSORS)


def small_trunnion():
    """A small machine with a slanted A axis point and a reversed A; Y above X above Z."""
    return Machine(
        "small trunnion",
        (
            Axis("X", "linear", (1, 0, 0), -200, 200, pitch=5),
            Axis("Y", "linear", (0, 1, 0), -150, 180, pitch=5),
            Axis("Z", "linear", (0, 0, 1), -180, 260, pitch=5),
            Axis("A", "rotary", (1, 0, 0), *deg(-95, 95), point=(0, 20, 10)),
            Axis("C", "rotary", (0, 0, -1), *CYCLIC, point=(0.05, 0.02, -25)),
        ),
        ("X", "Y", "Z"), ("A", "C"), tool_length=110, axis_sensors=SENSORS)


MACHINES = (offset_trunnion, common_point, table_under_x, small_trunnion)


def numbers(values):
    return "[" + ", ".join(repr(float(v)) for v in values) + "]"


def write_machine(path, machine):
    out = ["[machine]", f'name = "{machine.name}"', "[tool]", f"length_mm = {float(machine.tool_length)!r}"]
    out += ["[part]", f"zero_mm = {numbers(machine.part_zero)}"]
    for a in machine.axes:
        out += ["[[axis]]", f'name = "{a.name}"', f'type = "{a.kind}"', f"direction = {numbers(a.direction)}"]
        if a.kind == "linear":
            out += [f"min_mm = {float(a.low)!r}", f"max_mm = {float(a.high)!r}", "rapid_mm_min = 30000"]
            if a.pitch:
                out.append(f"screw_pitch_mm = {float(a.pitch)!r}")
        else:
            out.append(f"point_mm = {numbers(a.point)}")
            if math.isinf(a.low):
                out.append("cyclic = true")
            else:
                out += [f"min_deg = {math.degrees(a.low)!r}", f"max_deg = {math.degrees(a.high)!r}"]
    out += ["[chain]", f"tool = {list(machine.tool_chain)!r}", f"part = {list(machine.part_chain)!r}"]
    sensors = ", ".join(f'{axis} = "{sensor}"' for axis, sensor in machine.axis_sensors.items())
    out += ["[thermal]", f"reference_degC = {float(machine.reference_degC)!r}"]
    out += [f"axis_sensors = {{ {sensors} }}", f'ambient_sensor = "{machine.ambient_sensor}"']
    path.write_text("\n".join(out).replace("'", '"') + "\n")


def write_model(path, name, effects, setup_fixed=False, values=True):
    """`effects`: (id, parameters, choice) each; without `values` only what is known to be there."""
    out = ["[model]", f'name = "{name}"']
    if setup_fixed:
        out += ["[setup]", 'translation = "fixed"']
    for effect, parameters, choice in effects:
        out += ["[[effect]]", f'id = "{effect}"']
        out += [f'{key} = "{value}"' for key, value in (choice or {}).items()]
        if values:
            out.append("[effect.parameters]")
            out += [f"{key} = {float(value)!r}" for key, value in parameters.items()]
    path.write_text("\n".join(out) + "\n")


def read_model(path):
    """(id, parameters, choice) of every effect of a model file."""
    with open(path, "rb") as file:
        table = tomllib.load(file)
    known = {"id", "parameters", "sigma", "prior", "fixed", "evidence"}
    out = []
    for entry in table.get("effect", []):
        choice = {k: v for k, v in entry.items() if k not in known and isinstance(v, str)}
        out.append((entry["id"], {k: float(v) for k, v in entry.get("parameters", {}).items()}, choice))
    return out
