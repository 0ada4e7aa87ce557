"""The machine with its errors, written a second time: finite 4x4 matrices composed exactly.

Nothing here is linearised and nothing comes from the program under test. Lengths in mm, angles in rad. Frames and signs: the chain of
part and tool, joint by joint from the bed outwards, each joint's small twist (d, r) in the axes of its fixed side, at its moving origin.
"""

from dataclasses import dataclass, field

import numpy as np


@dataclass(frozen=True)
class Axis:
    name: str
    kind: str  # "linear" or "rotary"
    direction: tuple
    low: float  # mm or rad; -inf, inf for a cyclic rotary axis
    high: float
    point: tuple = (0.0, 0.0, 0.0)
    pitch: float = 0.0  # screw pitch in mm; 0: not known


@dataclass(frozen=True)
class Machine:
    name: str
    axes: tuple
    tool_chain: tuple
    part_chain: tuple
    tool_length: float = 150.0
    part_zero: tuple = (0.0, 0.0, 0.0)
    reference_degC: float = 20.0
    axis_sensors: dict = field(default_factory=dict)
    ambient_sensor: str = "ambient"

    def axis(self, name):
        return next(a for a in self.axes if a.name == name)

    @property
    def joints(self):
        """Every body that may move a little: the axes, the spindle S and the part P."""
        return [a.name for a in self.axes] + ["S", "P"]

    def has(self, name):
        return any(a.name == name for a in self.axes)


def identity(count):
    return np.broadcast_to(np.eye(4), (count, 4, 4)).copy()


def translation(vectors):
    out = identity(len(vectors))
    out[:, :3, 3] = vectors
    return out


def cross_matrix(v):
    out = np.zeros((len(v), 3, 3))
    out[:, 0, 1], out[:, 0, 2], out[:, 1, 2] = -v[:, 2], v[:, 1], -v[:, 0]
    out[:, 1, 0], out[:, 2, 0], out[:, 2, 1] = v[:, 2], -v[:, 1], v[:, 0]
    return out


def rotation_about(direction, angles):
    """Rodrigues' formula about one fixed unit vector."""
    axis = np.asarray(direction, float)
    k = cross_matrix((axis / np.linalg.norm(axis))[None])[0]
    out = identity(len(angles))
    s, c = np.sin(angles)[:, None, None], np.cos(angles)[:, None, None]
    out[:, :3, :3] = np.eye(3) + s * k + (1.0 - c) * (k @ k)
    return out


def exponential(twist):
    """exp of the twists (d, r): the finite rigid motion, its series where r is too small to divide by."""
    d, r = twist[:, :3], twist[:, 3:]
    angle = np.linalg.norm(r, axis=1)
    small = angle < 1e-7
    safe = np.where(small, 1.0, angle)
    a = np.where(small, 1.0, np.sin(safe) / safe)[:, None, None]
    b = np.where(small, 0.5, 2.0 * np.sin(safe / 2.0) ** 2 / safe**2)[:, None, None]
    c = np.where(small, 1.0 / 6.0, (safe - np.sin(safe)) / safe**3)[:, None, None]
    k = cross_matrix(r)
    kk = k @ k
    out = identity(len(twist))
    out[:, :3, :3] = np.eye(3) + a * k + b * kk
    out[:, :3, 3] = np.einsum("nij,nj->ni", np.eye(3) + b * k + c * kk, d)
    return out


def rotation_vector(rotation):
    """The rotation vector of rotations by far less than half a turn."""
    axial = 0.5 * np.stack(
        [
            rotation[:, 2, 1] - rotation[:, 1, 2],
            rotation[:, 0, 2] - rotation[:, 2, 0],
            rotation[:, 1, 0] - rotation[:, 0, 1],
        ],
        axis=1,
    )
    sine = np.linalg.norm(axial, axis=1)
    factor = np.where(sine < 1e-9, 1.0, np.arcsin(np.clip(sine, 0.0, 1.0)) / np.where(sine < 1e-9, 1.0, sine))
    return axial * factor[:, None]


def joint_motion(axis, position, twist):
    """Pose of the body that the joint carries, in its fixed side."""
    error = None if twist is None else exponential(twist)
    if axis.kind == "linear":
        moved = translation(position[:, None] * np.asarray(axis.direction, float))
        return moved if error is None else moved @ error
    turned = rotation_about(axis.direction, position)
    point = np.broadcast_to(np.asarray(axis.point, float), (len(position), 3))
    inner = turned if error is None else error @ turned
    return translation(point) @ inner @ translation(-point)


def tool_and_part(machine, positions, tool, twists):
    """X_MT and X_MP for every row."""
    count = len(tool)
    holder = identity(count)
    for name in machine.tool_chain:
        holder = holder @ joint_motion(machine.axis(name), positions[name], twists.get(name))
    if "S" in twists:
        holder = holder @ exponential(twists["S"])
    holder = holder @ translation(tool)
    part = identity(count)
    for name in machine.part_chain:
        part = part @ joint_motion(machine.axis(name), positions[name], twists.get(name))
    part = part @ translation(np.broadcast_to(np.asarray(machine.part_zero, float), (count, 3)))
    if "P" in twists:
        part = part @ exponential(twists["P"])
    return holder, part


def tool_in_part(holder, part):
    out = identity(len(part))
    inverse = np.transpose(part[:, :3, :3], (0, 2, 1))
    out[:, :3, :3] = inverse @ holder[:, :3, :3]
    out[:, :3, 3] = np.einsum("nij,nj->ni", inverse, holder[:, :3, 3] - part[:, :3, 3])
    return out


def readings(machine, rows, twists):
    """What an ideal instrument shows: n . (actual - nominal), in mm or rad."""
    nominal_tool, nominal_part = tool_and_part(machine, rows.q, rows.tool, {})
    nominal = tool_in_part(nominal_tool, nominal_part)
    actual = tool_in_part(*tool_and_part(machine, rows.q, rows.tool, twists))
    shift = actual[:, :3, 3] - nominal[:, :3, 3]
    turn = rotation_vector(actual[:, :3, :3] @ np.transpose(nominal[:, :3, :3], (0, 2, 1)))
    deviation = np.where(rows.is_rotation[:, None], turn, shift)
    in_machine = np.einsum("nij,nj->ni", nominal_part[:, :3, :3], deviation)
    deviation = np.where(rows.in_part_frame[:, None], deviation, in_machine)
    return np.einsum("ni,ni->n", deviation, rows.n)


def follow_point(machine, rotary, point, tool):
    """Positions of the linear axes that hold the tool point on a point of the part, while the rotary axes turn."""
    count = len(next(iter(rotary.values())))
    linear = [a.name for a in machine.axes if a.kind == "linear"]
    tools = np.broadcast_to(np.asarray(tool, float), (count, 3))

    def tip(values):
        q = dict(rotary)
        q.update({name: np.full(count, v) if np.isscalar(v) else v for name, v in zip(linear, values)})
        return tool_in_part(*tool_and_part(machine, q, tools, {}))[:, :3, 3]

    origin = tip([0.0] * len(linear))
    # For fixed rotary angles the tip in the part is affine in the linear axes: three columns give it exactly.
    columns = np.stack(
        [tip([1.0 if i == k else 0.0 for i in range(len(linear))]) - origin for k in range(len(linear))], axis=2
    )
    solution = np.linalg.solve(columns, (np.asarray(point, float) - origin)[:, :, None])[:, :, 0]
    return {name: solution[:, k] for k, name in enumerate(linear)}
