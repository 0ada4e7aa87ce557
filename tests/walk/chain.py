"""The nominal chain of a machine file, written apart from the program: a point of the part to the machine and back.

Positions `q` are what each axis is commanded to (mm, degrees), those of the spindle's gauge point S. Vectors are tuples, mm.
"""
import math
import tomllib


def add(a, b):
    return (a[0] + b[0], a[1] + b[1], a[2] + b[2])


def sub(a, b):
    return (a[0] - b[0], a[1] - b[1], a[2] - b[2])


def scale(a, s):
    return (a[0] * s, a[1] * s, a[2] * s)


def dot(a, b):
    return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]


def cross(a, b):
    return (a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0])


def length(a):
    return math.sqrt(dot(a, a))


def turned(v, axis, angle_deg):
    """Rodrigues' formula: v turned about the unit vector `axis`, right hand."""
    c, s = math.cos(math.radians(angle_deg)), math.sin(math.radians(angle_deg))
    return add(add(scale(v, c), scale(cross(axis, v), s)), scale(axis, dot(axis, v) * (1 - c)))


class Machine:
    def __init__(self, text):
        file = tomllib.loads(text)
        self.axes = {a["name"]: a for a in file["axis"]}
        self.tool_chain = file["chain"]["tool"]
        self.part_chain = file["chain"]["part"]
        self.linear = [n for n in self.axes if self.axes[n]["type"] == "linear"]
        self.rotary = [n for n in self.axes if self.axes[n]["type"] == "rotary"]
        self.gauge_mm = file["tool"]["length_mm"]
        self.zero = tuple(file.get("part", {}).get("zero_mm", (0, 0, 0)))
        output = file.get("output", {})
        self.spindle_words = output.get("point", "tip") == "spindle"
        self.offset = tuple(output.get("work_offset_mm", (0, 0, 0)))
        self.table = file.get("table")
        z = self.axes["Z"]
        up = z["direction"][2] > 0
        if "Z" in self.part_chain:
            up = not up
        self.away = 1.0 if up else -1.0  # sense of Z that takes the tool from the part
        self.safe = file.get("retract", {}).get("z_mm", z["max_mm"] if up else z["min_mm"])

    def is_up(self, z, slack_mm=1e-6):
        """Z at the safe height, or beyond it."""
        return z is not None and self.away * (z - self.safe) >= -slack_mm

    def direction(self, name):
        return tuple(self.axes[name]["direction"])

    def part_to_machine(self, p, q):
        v = add(p, self.zero)
        for name in reversed(self.part_chain):
            if name in self.linear:
                v = add(v, scale(self.direction(name), q[name]))
            else:
                a = tuple(self.axes[name]["point_mm"])
                v = add(turned(sub(v, a), self.direction(name), q[name]), a)
        return v

    def machine_to_table(self, v, q):
        """As it would lie with all axes of the part at 0."""
        for name in self.part_chain:
            if name in self.linear:
                v = sub(v, scale(self.direction(name), q[name]))
            else:
                a = tuple(self.axes[name]["point_mm"])
                v = add(turned(sub(v, a), self.direction(name), -q[name]), a)
        return v

    def machine_to_part(self, v, q):
        return sub(self.machine_to_table(v, q), self.zero)

    def tip(self, q, tool_mm):
        """Of the tool in the machine."""
        v = (0.0, 0.0, -tool_mm)
        for name in self.tool_chain:
            v = add(v, scale(self.direction(name), q[name]))
        return v

    def tip_in_part(self, q, tool_mm):
        return self.machine_to_part(self.tip(q, tool_mm), q)

    def linear_for(self, tip_P, q, tool_mm):
        """Positions of the linear axes that bring the tip to `tip_P` at the rotary positions of q: Cramer's rule, as
        they may stand on either side."""
        zero = {**q, **{n: 0.0 for n in self.linear}}
        want = sub(self.part_to_machine(tip_P, zero), self.tip(zero, tool_mm))
        # The tool's way less the part's: sum of q e over the tool chain minus that over the part chain.
        columns = [scale(self.direction(n), 1.0 if n in self.tool_chain else -1.0) for n in self.linear]
        det = dot(columns[0], cross(columns[1], columns[2]))
        out = dict(q)
        for i, n in enumerate(self.linear):
            c = list(columns)
            c[i] = want
            out[n] = dot(c[0], cross(c[1], c[2])) / det
        return out

    def above_table_mm(self, tip_M, q):
        """Height of a point over the top of the given table disc, or nothing outside of it."""
        if not self.table:
            return None
        v = self.machine_to_table(tip_M, q)
        innermost = [n for n in self.part_chain if n in self.rotary][-1]
        n, a = self.direction(innermost), tuple(self.axes[innermost]["point_mm"])
        if n[2] < 0:
            n = scale(n, -1.0)
        d = sub(v, a)
        height = dot(d, n)
        radius = length(sub(d, scale(n, height)))
        return height - self.table["top_mm"] if radius <= self.table["radius_mm"] else None
