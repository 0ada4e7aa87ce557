"""Rows of a campaign: positions and state, written to and read from the measurement file."""

import csv
from dataclasses import dataclass, field

import numpy as np

QUANTITY_UNIT = {"displacement": "um", "rotation": "urad"}


@dataclass
class Rows:
    run: np.ndarray  # names
    time: np.ndarray  # s
    q: dict  # axis -> mm or rad
    direction: dict  # axis -> +1, -1, 0
    velocity: dict  # axis -> mm/s or rad/s
    rpm: np.ndarray
    temperature: dict  # sensor -> degC
    tool: np.ndarray  # (N, 3) mm
    quantity: np.ndarray  # names
    n: np.ndarray  # (N, 3)
    frame: np.ndarray  # names
    u_random: np.ndarray  # um or urad
    u_common: np.ndarray  # um or urad; what is true
    state: dict = field(default_factory=dict)
    measured: np.ndarray = None  # False: the row only records the state
    lags: dict = field(default_factory=dict, repr=False)  # lagged signals that were worked out

    def __len__(self):
        return len(self.run)

    @property
    def is_rotation(self):
        return self.quantity == "rotation"

    @property
    def in_part_frame(self):
        return self.frame == "part"

    @property
    def per_unit(self):
        """From mm or rad to the file's um or urad."""
        return np.where(self.is_rotation, 1e6, 1e3)

    @property
    def run_names(self):
        return list(dict.fromkeys(self.run))

    def taken(self, keep):
        """These rows only, in this order."""
        fields = {}
        for key, value in vars(self).items():
            if key != "lags":
                fields[key] = {k: v[keep] for k, v in value.items()} if isinstance(value, dict) else value[keep]
        return type(self)(**fields)

    def offset_groups(self):
        """Index of the group of rows that share one offset: run, quantity, frame and n."""
        keys = {}
        out = np.empty(len(self), int)
        for i in range(len(self)):
            key = (self.run[i], self.quantity[i], self.frame[i], tuple(np.round(self.n[i], 6)))
            out[i] = keys.setdefault(key, len(keys))
        return out


def join(parts):
    """One campaign of several runs."""
    first = parts[0]
    cat = np.concatenate

    def merged(name):
        keys = list(dict.fromkeys(k for p in parts for k in getattr(p, name)))
        return {k: cat([getattr(p, name).get(k, np.zeros(len(p))) for p in parts]) for k in keys}

    arrays = {
        name: cat([getattr(p, name) for p in parts])
        for name in ("run", "time", "rpm", "tool", "quantity", "n", "frame", "u_random", "u_common", "measured")
    }
    tables = {name: merged(name) for name in ("q", "direction", "velocity", "temperature", "state")}
    return type(first)(**arrays, **tables)


def decimal(value, places=6):
    """A number at the file's resolution, which is coarser than what two processors may disagree about; no negative zero."""
    return f"{round(float(value), places) + 0.0:.{places}f}"


def write_rows(path, machine, rows, values, stated_random=None, stated_common=None, silent=()):
    """The measurement file. NaN in `stated_common`: the column is left empty there. `silent`: columns left out, by their beginnings."""
    stated_random = rows.u_random if stated_random is None else stated_random
    stated_common = rows.u_common if stated_common is None else stated_common
    names = [a.name for a in machine.axes]
    rotary = {a.name for a in machine.axes if a.kind == "rotary"}
    sensors = sorted(rows.temperature)
    header = ["run_id", "time_s"] + [f"{a}_{'deg' if a in rotary else 'mm'}" for a in names]
    header += [f"dir_{a}" for a in names] + [f"vel_{a}_{'deg' if a in rotary else 'mm'}_min" for a in names]
    header += ["spindle_rpm"] + [f"T_{s}_degC" for s in sensors] + [f"s_{s}" for s in sorted(rows.state)]
    header += ["tool_x_mm", "tool_y_mm", "tool_z_mm", "quantity", "n_x", "n_y", "n_z", "frame", "value", "unit"]
    header += ["u_random", "u_common"]
    kept = [k for k, name in enumerate(header) if not name.startswith(tuple(silent))] if silent else range(len(header))
    with open(path, "w", newline="") as file:
        out = csv.writer(file)
        out.writerow([header[k] for k in kept])
        for i in range(len(rows)):
            line = [rows.run[i], f"{rows.time[i]:.9g}"]
            line += [decimal(np.degrees(rows.q[a][i]) if a in rotary else rows.q[a][i]) for a in names]
            line += [int(rows.direction[a][i]) for a in names]
            line += [
                decimal((np.degrees(rows.velocity[a][i]) if a in rotary else rows.velocity[a][i]) * 60.0)
                for a in names
            ]
            line += [f"{rows.rpm[i]:g}"] + [decimal(rows.temperature[s][i]) for s in sensors]
            line += [decimal(rows.state[s][i]) for s in sorted(rows.state)]
            line += [f"{v:.9g}" for v in rows.tool[i]] + [rows.quantity[i]] + [decimal(v, 9) for v in rows.n[i]]
            value = repr(float(values[i])) if rows.measured[i] else ""
            common = "" if np.isnan(stated_common[i]) else f"{stated_common[i]:.6g}"
            line += [rows.frame[i], value, QUANTITY_UNIT[rows.quantity[i]], f"{stated_random[i]:.6g}", common]
            out.writerow([line[k] for k in kept])


def read_rows(path, machine):
    """Rows and values of a measurement file (its optional columns with their defaults)."""
    with open(path, newline="") as file:
        table = list(csv.DictReader(line for line in file if not line.startswith("#")))
    count = len(table)

    def column(name, default=0.0):
        return np.array([float(r[name]) if r.get(name) not in (None, "") else default for r in table])

    names = [a.name for a in machine.axes]
    rotary = {a.name for a in machine.axes if a.kind == "rotary"}

    def axis_column(prefix, name, suffix=""):
        unit = "deg" if name in rotary else "mm"
        values = column(f"{prefix}{name}_{unit}{suffix}")
        return np.radians(values) if name in rotary else values

    rows = Rows(
        run=np.array([r["run_id"] for r in table]),
        time=column("time_s"),
        q={a: axis_column("", a) for a in names},
        direction={a: column(f"dir_{a}") for a in names},
        velocity={a: axis_column("vel_", a, "_min") / 60.0 for a in names},
        rpm=column("spindle_rpm"),
        temperature={k[2:-5]: column(k) for k in table[0] if k.startswith("T_") and k.endswith("_degC")},
        tool=np.stack(
            [column("tool_x_mm"), column("tool_y_mm"), column("tool_z_mm", -machine.tool_length)], axis=1
        ),
        quantity=np.array([r["quantity"] for r in table]),
        n=np.stack([column("n_x"), column("n_y"), column("n_z")], axis=1),
        frame=np.array([r.get("frame") or "machine" for r in table]),
        u_random=column("u_random"),
        u_common=column("u_common"),
        state={k[2:]: column(k) for k in table[0] if k.startswith("s_")},
        measured=np.array([r["value"] != "" for r in table]),
    )
    assert len(rows) == count
    return rows, column("value")
