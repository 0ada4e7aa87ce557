"""A control and the machine behind it, written apart from the program: runs our NC programs and says where the axes were.

Blocks are run on their straight ways (exact path), the speed limited by F, by the axes' accelerations and by stops at sharp corners; or blended over a
few milliseconds. Behind each axis stands a servo: a first-order lag, a spike after reversal, lost motion.
"""
import re

import numpy as np

AXES = "XYZAC"
LEVER = 100.0  # mm for a rad, where lengths of all axes are added
ACCELERATION = 3000.0  # mm/s2 in that measure


def read_program(text):
    """Targets of the motion blocks: joints (mm, deg), seconds by F (None: rapid), line; the tool length, the retract height."""
    offset = [float(v) for v in re.search(r"G54.*?X *(-?[\d.]+) *Y *(-?[\d.]+) *Z *(-?[\d.]+)", text).groups()]
    lengths = {int(t): float(v) for t, v in re.findall(r"\(tool (\d+), gauge length ([\d.]+) mm", text)}
    at = np.array([0.0, 0.0, 0.0, 0.0, 0.0])
    known = np.zeros(5, bool)
    length, tool, rapid, inverse, feed = 0.0, None, True, False, None
    out = []
    for number, line in enumerate(text.splitlines(), 1):
        line = re.sub(r"\(.*?\)", "", line).strip()
        if not line:
            continue
        words = re.findall(r"([A-Z])(-?[\d.]+)", line)
        codes = {float(v) for w, v in words if w == "G"}
        new = at.copy()
        for w, v in words:
            if w == "T":
                tool = int(float(v))
            if w == "F":
                feed = float(v)
        if 43 in codes:
            length = lengths[tool]
        rapid = True if 0 in codes else False if 1 in codes else rapid
        inverse = True if 93 in codes else False if 94 in codes else inverse
        moves = False
        for w, v in words:
            if w in AXES and not codes & {4.0}:
                i = AXES.index(w)
                new[i] = float(v) if 53 in codes or i > 2 else float(v) + offset[i] + (length if i == 2 else 0.0)
                moves = True
        if not moves:
            if 4 in codes:
                out.append((at.copy(), float(dict(words)["P"]), number, "dwell"))
            continue
        if 53 in codes or rapid:
            seconds = None
        elif inverse:
            seconds = 60.0 / feed
        else:
            d = np.linalg.norm((new - at)[:3])
            seconds = (d if d > 0 else np.abs(new - at).max()) / feed * 60.0
        out.append((new, seconds, number, "move"))
        at = new
        known[:] = True
    return out


def measure(q):
    return np.asarray(q) * np.array([1, 1, 1, LEVER * np.pi / 180, LEVER * np.pi / 180])


class Command:
    """Where the control wants the axes, every `dt`: time, joints, the block."""

    def __init__(self, blocks, dt=0.001, start=None, corner_deg=3.0, rapid=600.0):
        x = [measure(np.zeros(5) if start is None else start)]
        speed, dwell, line, cut = [], [0.0], [], []
        for q, seconds, number, kind in blocks:
            if kind == "dwell":
                dwell[-1] += seconds
                continue
            y = measure(q)
            way = np.linalg.norm(y - x[-1])
            if way < 1e-12:
                continue
            x.append(y)
            dwell.append(0.0)
            speed.append(rapid if seconds is None else way / seconds)
            line.append(number)
            cut.append(seconds is not None)
        x = np.array(x)
        ways = np.linalg.norm(np.diff(x, axis=0), axis=1)
        speed = np.array(speed)
        n = len(ways)
        node = np.zeros(n + 1)
        direction = np.diff(x, axis=0) / ways[:, None]
        for i in range(1, n):
            turn = np.degrees(np.arccos(np.clip(direction[i - 1] @ direction[i], -1, 1)))
            node[i] = 0.0 if turn > corner_deg or dwell[i] > 0 else min(speed[i - 1], speed[i])
        for i in range(n):
            node[i + 1] = min(node[i + 1], np.sqrt(node[i] ** 2 + 2 * ACCELERATION * ways[i]))
        for i in range(n - 1, -1, -1):
            node[i] = min(node[i], np.sqrt(node[i + 1] ** 2 + 2 * ACCELERATION * ways[i]))
        times, s = [0.0], [0.0]
        t = 0.0
        along = np.concatenate([[0.0], np.cumsum(ways)])
        # The grid of times and lengths, exact at nodes; between them a ramp, a constant speed, a ramp.
        pieces = []
        self.arrival = [0.0]
        for i in range(n):
            t += dwell[i]
            a, b, top = node[i], node[i + 1], speed[i]
            top = min(top, np.sqrt((a * a + b * b) / 2 + ACCELERATION * ways[i]))
            top = max(top, a, b)
            up, down = (top - a) / ACCELERATION, (top - b) / ACCELERATION
            cruise = max(ways[i] - (top * top - a * a + top * top - b * b) / (2 * ACCELERATION), 0.0) / top
            pieces.append((t, along[i], a, top, up, cruise, down, b))
            t += up + cruise + down
            self.arrival.append(t)
        self.duration = t
        grid = np.arange(0.0, t, dt)
        starts = np.array([p[0] for p in pieces])
        which = np.clip(np.searchsorted(starts, grid, side="right") - 1, 0, n - 1)
        p = np.array(pieces)[which]
        tau = grid - p[:, 0]
        a, top, up, cruise, down, b = p[:, 2], p[:, 3], p[:, 4], p[:, 5], p[:, 6], p[:, 7]
        t1 = np.minimum(tau, up)
        t2 = np.clip(tau - up, 0, cruise)
        t3 = np.clip(tau - up - cruise, 0, down)
        s = p[:, 1] + a * t1 + ACCELERATION * t1 ** 2 / 2 + top * t2 + top * t3 - ACCELERATION * t3 ** 2 / 2
        s = np.minimum(s, along[which + 1])
        share = ((s - along[which]) / ways[which])[:, None]
        self.t = grid
        self.q = (x[which] * (1 - share) + x[which + 1] * share) / measure(np.ones(5))
        self.line = np.array(line)[which]
        self.cut = np.array(cut)[which]
        self.blocks = list(zip(line, cut, [self.arrival[i] for i in range(n)], self.arrival[1:]))


def blended(q, samples):
    """A control that blends: each axis' command averaged over so many samples."""
    if samples < 2:
        return q
    kernel = np.ones(samples) / samples
    pad = np.vstack([np.repeat(q[:1], samples, 0), q, np.repeat(q[-1:], samples, 0)])
    out = np.array([np.convolve(pad[:, i], kernel, "same") for i in range(q.shape[1])]).T
    return out[samples:-samples]


def senses(x, least=0.001, stands=1e-6):
    """Senses of motion, of a friction that does not turn round for less than `least` (mm or deg), and stands where a sample is no further than `stands`: what
    the digits of words move an axis back by is no reversal."""
    out = np.zeros(len(x))
    sense, furthest = 0.0, 0
    for k in range(1, len(x)):
        step = x[k] - x[furthest]
        if step * sense > 0 or (abs(x[k] - x[k - 1]) < stands and abs(step) < least):
            furthest = k
        elif abs(step) > least:
            sense = np.sign(step)
            out[furthest + 1:k] = sense
            furthest = k
        out[k] = sense
    return out


def behind_servos(q, dt, lag_ms, spike=None, lost=None):
    """Actual positions: first-order lags (ms, by axis), spikes after reversal and lost motion (mm or deg, by axis)."""
    out = q.copy()
    for i in range(q.shape[1]):
        tau = lag_ms[i] / 1000.0
        if tau > 0:
            # Exact for a command that runs evenly between two samples.
            e = np.exp(-dt / tau)
            y = q[0, i]
            lagged = np.empty(len(q))
            lagged[0] = y
            c = q[:, i]
            for k in range(1, len(q)):
                v = (c[k] - c[k - 1]) / dt
                y = c[k] - v * tau + (y - c[k - 1] + v * tau) * e
                lagged[k] = y
            out[:, i] = lagged
        if (spike is not None and spike[i]) or (lost is not None and lost[i]):
            held, since = senses(q[:, i]), np.full(len(q), 1e9)
            turns = np.flatnonzero((held[1:] != held[:-1]) & (held[:-1] != 0)) + 1
            for begun, end in zip(turns, [*turns[1:], len(q)]):
                since[begun:end] = np.arange(end - begun) * dt
            if spike is not None and spike[i]:
                out[:, i] -= spike[i] * held * np.exp(-since / 0.015)
            if lost is not None and lost[i]:
                out[:, i] -= 0.5 * lost[i] * held
    return out


class Chain:
    """The tool in the part of a machine file whose rotary axes carry the part; arrays of positions."""

    def __init__(self, machine):
        self.m = machine

    def tool(self, q, length):
        m = self.m
        p = np.zeros((len(q), 3))
        for n in m.tool_chain:
            p += q[:, AXES.index(n), None] * np.array(m.direction(n))
        p[:, 2] -= length
        u = np.tile([0.0, 0.0, 1.0], (len(q), 1))
        for n in m.part_chain:
            k, a = np.array(m.direction(n)), np.array(m.axes[n]["point_mm"])
            angle = -np.radians(q[:, AXES.index(n)])
            p = self.turned(p - a, k, angle) + a
            u = self.turned(u, k, angle)
        return p - np.array(m.zero), u

    @staticmethod
    def turned(v, k, angle):
        c, s = np.cos(angle)[:, None], np.sin(angle)[:, None]
        return v * c + np.cross(k, v) * s + k * (v @ k)[:, None] * (1 - c)


def off_polyline(p, points):
    """Distances of places from a polyline."""
    best = np.full(len(p), np.inf)
    for a, b in zip(points[:-1], points[1:]):
        ab = b - a
        l2 = ab @ ab
        t = np.clip((p - a) @ ab / l2, 0, 1) if l2 > 0 else np.zeros(len(p))
        best = np.minimum(best, np.linalg.norm(p - a - t[:, None] * ab, axis=1))
    return best
