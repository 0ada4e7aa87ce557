"""Measurement campaigns as shops run them, drawn at random: lasers, diagonals, balls on the table, circles, angles, warm-ups."""

import math

import numpy as np

from .chain import follow_point
from .rows import Rows, join

UNIT = np.eye(3)


def travel(axis, share=0.85):
    """The part of the travel that a campaign uses."""
    middle, half = 0.5 * (axis.low + axis.high), 0.5 * (axis.high - axis.low)
    return middle - share * half, middle + share * half


def displayed(values):
    """Numbers as a file shows them: six decimals. What the last digits of one processor's arithmetic say is gone."""
    return np.round(values, 6) + 0.0  # no negative zero


def commanded(axis, values):
    """Positions as they are given to a control: six decimals of a millimetre or a degree."""
    values = np.asarray(values, float)
    return displayed(values) if axis.kind == "linear" else np.radians(displayed(np.degrees(values)))


class Campaign:
    """Collects runs; every run has its own clock, temperatures and set-up."""

    def __init__(self, machine, rng, sigma_um=0.6, sigma_urad=1.2, common=0.5):
        self.machine, self.rng, self.parts = machine, rng, []
        self.sigma = {"displacement": sigma_um, "rotation": sigma_urad}
        self.common = common  # in units of the sigma
        self.weather = rng.uniform(-1.5, 2.0)

    def rows(self):
        return join(self.parts)

    def home(self):
        """A pose inside every travel, not the same in all runs."""
        out = {}
        for a in self.machine.axes:
            if a.kind == "linear":
                low, high = travel(a, 0.35)
                out[a.name] = self.rng.uniform(low, high)
            else:
                out[a.name] = 0.0
        return out

    def add(self, name, poses, normals, quantity="displacement", frame="machine", tool=None, seconds=8.0, rpm=0.0,
            velocity=None, directions=None, per_pose_normals=None, warmth=1.0):
        """`poses`: {axis: array}. Every pose is read along each of `normals` (or along its own of `per_pose_normals`)."""
        rng, machine = self.rng, self.machine
        count = len(next(iter(poses.values())))
        home = self.home()
        q = {a.name: commanded(a, poses.get(a.name, np.full(count, home[a.name]))) for a in machine.axes}
        pace = rng.uniform(0.7, 1.3, count) * seconds
        time = np.concatenate([[0.0], np.cumsum(pace)[:-1]])
        direction = {}
        for a in machine.axes:
            # What the axis did last: the sign of its last step, kept while it stands; unknown before its first.
            if directions and a.name in directions:
                direction[a.name] = np.asarray(directions[a.name], float)
                continue
            signs = np.sign(np.diff(q[a.name], prepend=q[a.name][:1]))
            for i in range(1, count):
                signs[i] = signs[i] or signs[i - 1]
            direction[a.name] = signs
        velocity = {a.name: np.asarray((velocity or {}).get(a.name, np.zeros(count)), float) for a in machine.axes}
        normals = np.asarray(normals if per_pose_normals is None else [[0, 0, 1]], float)
        repeat = len(normals)
        index = np.repeat(np.arange(count), repeat)
        n = np.tile(normals, (count, 1)) if per_pose_normals is None else np.asarray(per_pose_normals, float)
        total = len(index)
        tool = (0.0, 0.0, -machine.tool_length) if tool is None else tool
        sigma = self.sigma[quantity]
        self.parts.append(Rows(
            run=np.array([name] * total), time=time[index], q={k: v[index] for k, v in q.items()},
            direction={k: v[index] for k, v in direction.items()}, velocity={k: v[index] for k, v in velocity.items()},
            rpm=np.broadcast_to(np.asarray(rpm, float), (count,))[index],
            temperature={k: v[index] for k, v in self.temperatures(time, warmth).items()},
            tool=np.tile(np.asarray(tool, float), (total, 1)), quantity=np.array([quantity] * total), n=n,
            frame=np.array([frame] * total), u_random=np.full(total, sigma),
            u_common=np.full(total, sigma * self.common), measured=np.ones(total, bool)))

    def temperatures(self, time, warmth):
        rng, out = self.rng, {}
        drift, swing = rng.normal(0, 1.2), rng.uniform(0.3, 1.2)
        period, phase = rng.uniform(2000, 6000), rng.uniform(0, 2 * math.pi)
        start = self.machine.reference_degC + self.weather + rng.normal(0, 0.8)
        out["ambient"] = start + warmth * (drift * time / 3600 + swing * np.sin(2 * math.pi * time / period + phase))
        for axis, sensor in self.machine.axis_sensors.items():
            rise, lag = rng.uniform(0.0, 5.0), rng.uniform(600, 2500)
            out[sensor] = start + rng.normal(0, 0.8) + rise * warmth * -np.expm1(-time / lag)
        return out

    def tool(self, length=None):
        """The machine's tool, or another one."""
        if length is None:
            length = self.machine.tool_length * self.rng.choice([0.7, 1.0, 1.0, 1.4])
        return (0.0, 0.0, -length)

    # One run each ------------------------------------------------------------------------------------------------

    def positions(self, axis, points, share=0.85):
        """Unequal sampling: a jittered ladder over the travel."""
        low, high = travel(axis, share)
        step = (high - low) / (points - 1)
        return np.linspace(low, high, points) + self.rng.uniform(-0.3, 0.3, points) * step

    def there_and_back(self, values):
        both = np.concatenate([values, values[::-1]])
        signs = np.concatenate([np.ones(len(values)), -np.ones(len(values))])
        return both, signs

    def laser(self, name, axis, points=12, normals=UNIT, quantity="displacement"):
        values, signs = self.there_and_back(self.positions(self.machine.axis(axis), points))
        self.add(name, {axis: values}, normals, quantity, tool=self.tool(), directions={axis: signs})

    def diagonal(self, name, signs, points=10, axes="XYZ"):
        steps, way = self.there_and_back(np.linspace(-1, 1, points) + self.rng.uniform(-0.05, 0.05, points))
        poses, directions, normal = {}, {}, np.zeros(3)
        for axis, sign in zip(axes, signs):
            low, high = travel(self.machine.axis(axis), 0.7)
            poses[axis] = 0.5 * (low + high) + 0.5 * (high - low) * sign * steps
            directions[axis] = sign * way
            normal["XYZ".index(axis)] = sign * (high - low)
        self.add(name, poses, [normal / np.linalg.norm(normal)], tool=self.tool(), directions=directions)

    def ball(self, name, tilts=5, turns=6, frame="machine", normals=UNIT, tool=None):
        """A ball on the table, followed over the rotary axes (R-test)."""
        rng, machine = self.rng, self.machine
        a = machine.axis("A")
        low, high = max(a.low, -math.radians(90)), min(a.high, math.radians(90))
        tilt = np.linspace(0.9 * low, 0.9 * high, tilts) + rng.uniform(-0.06, 0.06, tilts)
        turn = np.arange(turns) * 2 * math.pi / turns + rng.uniform(-0.2, 0.2, turns)
        order = [(t, c) for i, t in enumerate(tilt) for c in (turn if i % 2 == 0 else turn[::-1])]
        rotary = {"A": np.array([t for t, _ in order]), "C": np.array([c for _, c in order])}
        reach = 0.25 * min(x.high - x.low for x in machine.axes if x.kind == "linear")
        angle = rng.uniform(0, 2 * math.pi)
        point = (rng.uniform(0.5, 1.0) * reach * math.cos(angle), rng.uniform(0.5, 1.0) * reach * math.sin(angle),
                 rng.uniform(0.1, 0.7) * reach)
        tool = self.tool() if tool is None else tool
        poses = dict(rotary)
        poses.update(follow_point(machine, rotary, point, tool))
        self.add(name, poses, normals, frame=frame, tool=tool, seconds=14.0)

    def circle(self, name, plane, feed_mm_min, points=36, turns=(1, -1), tilt=0.0):
        """A ball-bar circle at one feed, both senses."""
        rng, machine = self.rng, self.machine
        first, second = (machine.axis(p) for p in plane)
        radius = 0.3 * min(first.high - first.low, second.high - second.low)
        poses, speed, sides, normals = {p: [] for p in plane}, {p: [] for p in plane}, {p: [] for p in plane}, []
        start = rng.uniform(0, 2 * math.pi)
        for sense in turns:
            angle = start + sense * (np.arange(points) + rng.uniform(-0.2, 0.2, points)) * 2 * math.pi / points
            v = feed_mm_min / 60.0 * sense
            for p, axis, value, rate in ((plane[0], first, np.cos(angle), -np.sin(angle)),
                                         (plane[1], second, np.sin(angle), np.cos(angle))):
                middle = 0.5 * sum(travel(axis))
                poses[p].append(middle + radius * value)
                speed[p].append(v * rate)
                sides[p].append(np.sign(v * rate))
            normal = np.zeros((points, 3))
            # The bar's direction in the machine: how the tool stands off the part's centre.
            normal[:, "XYZ".index(plane[0])] = np.cos(angle)
            normal[:, "XYZ".index(plane[1])] = np.sin(angle)
            normals.append(normal)
        cat = {k: {p: np.concatenate(v) for p, v in d.items()}
               for k, d in (("poses", poses), ("speed", speed), ("sides", sides))}
        self.add(name, cat["poses"], None, tool=self.tool(), seconds=0.1 + 2 * math.pi * radius / points / feed_mm_min * 60,
                 velocity=cat["speed"], directions=cat["sides"], per_pose_normals=np.concatenate(normals))

    def moving_laser(self, name, axis, feeds, points=8):
        """Positions read on the fly at several feeds, there and back."""
        values, speed, sides = [], [], []
        for feed in feeds:
            there, signs = self.there_and_back(self.positions(self.machine.axis(axis), points))
            values.append(there)
            sides.append(signs)
            speed.append(signs * feed / 60.0)
        self.add(name, {axis: np.concatenate(values)}, [UNIT["XYZ".index(axis)]], tool=self.tool(), seconds=2.0,
                 velocity={axis: np.concatenate(speed)}, directions={axis: np.concatenate(sides)})

    def angle(self, name, axis, points=8):
        self.laser(name, axis, points, quantity="rotation")

    def rotary(self, name, axis, points=48, quantity="rotation"):
        """Angular positioning of a rotary axis at uneven angles, both ways."""
        a = self.machine.axis(axis)
        low, high = (0.0, 2 * math.pi) if math.isinf(a.low) else travel(a, 0.9)
        values, signs = self.there_and_back(np.sort(self.rng.uniform(low, high, points // 2)))
        normal = np.abs(np.asarray(a.direction, float))
        self.add(name, {axis: values}, [normal], quantity, tool=self.tool(), directions={axis: signs})

    def warm_up(self, name, minutes=90, points=30, speeds=(0, 8000, 0, 12000)):
        """Environment and spindle (ETVE): one pose, three directions, a spindle cycle."""
        order = self.rng.permutation(len(speeds))
        block = np.minimum(np.arange(points) * len(speeds) // points, len(speeds) - 1)
        rpm = np.array([speeds[k] for k in order], float)[block]
        pose = self.home()
        self.add(name, {k: np.full(points, v) for k, v in pose.items()}, UNIT, rpm=rpm, seconds=minutes * 60 / points,
                 tool=self.tool(), directions={k: np.zeros(points) for k in pose})

    def warm_table(self, name, minutes=80, points=16):
        """A ball measured again and again at a few table angles while the machine lives through its day."""
        angles = np.tile([0.0, 0.5 * math.pi, math.pi, 1.5 * math.pi], points // 4)
        a = self.machine.axis("A")
        tilt = np.tile([0.0, 0.6 * a.high, 0.6 * a.low], points)[:points]
        rotary = {"A": tilt, "C": angles}
        tool = self.tool()
        poses = dict(rotary)
        poses.update(follow_point(self.machine, rotary, (30.0, 20.0, 25.0), tool))
        self.add(name, poses, UNIT, tool=tool, seconds=minutes * 60 / points, warmth=1.5)


FOCUS = {  # what shows an effect of this kind, beside the core
    "angle_x": lambda c: c.angle("angle_x", "X"), "angle_y": lambda c: c.angle("angle_y", "Y"),
    "angle_z": lambda c: c.angle("angle_z", "Z"), "rotary_a": lambda c: c.rotary("rotary_a", "A"),
    "rotary_c": lambda c: c.rotary("rotary_c", "C"), "warm_up": lambda c: c.warm_up("warm_up"),
    "warm_table": lambda c: c.warm_table("warm_table"),
    "circle_xy": lambda c: (c.circle("circle_xy", "XY", 1000, 24), c.circle("circle_xy2", "XY", 4000, 24)),
    "moving_x": lambda c: c.moving_laser("moving_x", "X", (500, 2000, 6000)),
    "moving_y": lambda c: c.moving_laser("moving_y", "Y", (500, 2000, 6000)),
    "moving_z": lambda c: c.moving_laser("moving_z", "Z", (500, 2000, 6000)),
    "fine_x": lambda c: c.laser("fine_x", "X", 40, [UNIT[0]]), "fine_y": lambda c: c.laser("fine_y", "Y", 40, [UNIT[1]]),
    "fine_z": lambda c: c.laser("fine_z", "Z", 40, [UNIT[2]]), "ball3": lambda c: c.ball("ball3", frame="part"),
    "plane_xy": lambda c: plane(c, "XY"), "plane_xz": lambda c: plane(c, "XZ"), "plane_yz": lambda c: plane(c, "YZ"),
    "diag3": lambda c: c.diagonal("diag3", (1, -1, 1)),
}


def plane(campaign, axes, points=6):
    """A grid of positions in a plane, all three deviations (grid plate, tracker)."""
    first, second = (campaign.positions(campaign.machine.axis(a), points) for a in axes)
    order = [(u, v) for i, u in enumerate(first) for v in (second if i % 2 == 0 else second[::-1])]
    campaign.add(f"plane_{axes.lower()}", {axes[0]: np.array([u for u, _ in order]),
                                          axes[1]: np.array([v for _, v in order])}, UNIT, tool=campaign.tool())


def core(campaign, small=False):
    """What every campaign holds: three lasers with straightness, two balls with two tools, two diagonals."""
    points = 6 if small else 10
    for axis in "XYZ":
        campaign.laser(f"laser_{axis.lower()}", axis, points)
    length = campaign.machine.tool_length
    tilts, turns = (3, 5) if small else (4, 6)
    campaign.ball("ball1", tilts, turns, tool=(0, 0, -length))
    campaign.ball("ball2", tilts, turns, tool=(0, 0, -1.4 * length))
    campaign.diagonal("diag1", (1, 1, 1), 8)
    campaign.diagonal("diag2", (-1, 1, 1), 8)


NEEDS = {
    "component": lambda s: {"X": ["angle_x", "plane_xy"], "Y": ["angle_y", "plane_yz"], "Z": ["angle_z", "plane_xz"],
                            "A": ["rotary_a", "ball3"], "C": ["rotary_c", "ball3"]}[s[2]],
    "periodic": lambda s: [f"fine_{s.lower()}"], "worm": lambda s: [f"rotary_{s.lower()}"],
    "squareness": lambda s: [{"C0Y": "plane_xy", "B0Z": "plane_xz", "A0Z": "plane_yz"}[s], "diag3"],
    "location": lambda s: ["ball3"],
    "backlash": lambda s: [f"rotary_{s.lower()}"] if s in "AC" else [f"moving_{s.lower()}"],
    "crosstalk": lambda s: [f"plane_{s.lower()}"], "sag": lambda s: ["rotary_a", "ball3"],
    "overhang": lambda s: ["angle_z", "plane_xz"], "spindle_growth": lambda s: ["warm_up"],
    "screw_heating": lambda s: [f"moving_{s.lower()}", f"fine_{s.lower()}"],
    "thermal_location": lambda s: ["warm_table", "warm_up"], "ambient_drift": lambda s: ["warm_up", "warm_table"],
    "time_drift": lambda s: ["warm_up", "warm_table"], "servo_lag": lambda s: [f"moving_{s.lower()}"],
    "spindle_tilt": lambda s: ["ball3", "diag3"], "tool_length": lambda s: ["ball3"],
    "setup_tilt": lambda s: ["plane_xy"], "step": lambda s: ["warm_table"],
}


def composed(machine, rng, effects=(), small=False, extra=0.25, **settings):
    """A campaign that can show the given effects; other runs come with it by chance."""
    campaign = Campaign(machine, rng, **settings)
    core(campaign, small)
    wanted = []
    for effect in effects:
        kind, _, subject = effect.partition(":")
        wanted += NEEDS.get(kind, lambda s: [])(subject)
    chosen = [f for f in FOCUS if f in wanted or rng.random() < extra / 2]
    for focus in chosen:
        FOCUS[focus](campaign)
    return campaign.rows()
