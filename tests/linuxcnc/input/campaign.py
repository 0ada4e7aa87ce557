#!/usr/bin/env python3
"""campaign.py PROGRAM FOLDER [COUNT] [--seed N] [--files FOLDER...]: random programs as other people write them (inches, increments, circles by centre or radius in all
planes, helices, drilling cycles, reference points, shifts, feed per revolution, subprograms, loops, variables), and the same with a word taken away or changed, read by `PROGRAM post --from linuxcnc`.
LinuxCNC's interpreter (rs274) runs what was read and what was written: the tool must cut the same way, or the program be refused. Exit code 77
where rs274 is not installed. With --files the programs are all *.ngc of these folders, each name once, behind lines that say what such files leave to the
control (units, a tool, where the axes stand); what a file needs of a control's own settings LinuxCNC refuses here, too.
"""
import argparse
import collections
import math
import os
import random
import re
import shutil
import subprocess
import sys
from pathlib import Path

NEAR_MM = 0.016  # words of four decimals of an inch on rs274's side, a tolerance of 0.01 mm on ours
WAY = 5e-4       # share of the length of all cuts
HOME_INCH = 20   # where G28 leads: above every part, as on a machine (rs274 counts its own parameters in inches)
ABOVE_MM = 150   # only retracts stand as high


class Maker:
    """One random program that is right."""

    def __init__(self, rng):
        self.r, self.inch, self.lines = rng, rng.random() < 0.4, []
        self.at = [0.0, 0.0, 40.0]
        self.incremental = False
        self.plane = 17
        self.shifted = False
        self.used = set()

    def shift(self):
        """The program's zero elsewhere, or back."""
        if self.incremental:
            self.add("G90")
            self.incremental = False
        axes = sorted(self.r.sample(range(3), self.r.randint(1, 3)))
        kind = self.r.choice(["G92", "G92", "G52"])
        if self.shifted and kind == "G52":
            axes = [0, 1, 2]
        if self.r.random() < 0.2:
            self.add("G92.1")
            self.shifted = False
        elif kind == "G92":
            self.add("G92 " + " ".join("XYZ"[a] + self.number(self.at[a] + self.r.uniform(-5, 5)) for a in axes))
            self.shifted = True
        else:
            self.add("G52 " + " ".join("XYZ"[a] + self.number(self.r.uniform(-5, 5)) for a in axes))
            self.shifted = True
        # Where the tool stands in the new coordinates need not be known: the next words are places of all axes.
        self.at = [0.0, 0.0, 50.0]
        self.add(self.r.choice(["G0 ", "G1 "]) + " ".join(self.to(a, self.r.uniform(*[(-30, 30), (-30, 30), (40, 60)][a])) for a in range(3)))

    def absolute(self):
        if self.incremental:
            self.add("G90")
            self.incremental = False

    def inner(self, axis):
        """A place within the part."""
        return self.value(self.r.uniform(*[(-30, 30), (-30, 30), (40, 60)][axis]))

    def call(self):
        """A subprogram with arguments."""
        self.absolute()
        to = [self.inner(a) for a in range(3)]
        self.used.add("sub")
        self.lines.append(f"o100 call [{self.number(to[0])}] [{self.number(to[1] / 2)} * 2] [{self.number(to[2])}]")
        self.at = [0.0, 0.0, 50.0]
        self.add("G1 " + " ".join(self.to(a, self.inner(a)) for a in range(3)))

    def loop(self):
        """Cuts in a loop that counts, or for a number of times."""
        self.absolute()
        n = self.r.randint(1, 4)
        step = self.number(self.r.uniform(0.5, 2))
        label = self.r.randint(200, 900)
        self.lines.append(f"#101 = {self.number(self.r.uniform(-20, 20))}")
        if self.r.random() < 0.5:
            self.lines += [f"#102 = 0", f"o{label} while [#102 LT {n}]", f"G1 X[#101 + #102*{step}] Y[{step} * SIN[#102 * 30]]", "#102 = [#102 + 1]",
                           f"o{label} if [#102 EQ 2]", f"Z[{self.number(45)} + #102 * {step}]", f"o{label} else", f"Z-[-{self.number(45)}]",
                           f"o{label} endif", f"o{label} endwhile"]
            # An if has a label of its own.
            self.lines[-6] = self.lines[-6].replace(f"o{label}", f"o{label + 1000}")
            self.lines[-4] = self.lines[-4].replace(f"o{label}", f"o{label + 1000}")
            self.lines[-2] = self.lines[-2].replace(f"o{label}", f"o{label + 1000}")
        else:
            self.lines += [f"#<way> = {step}", f"o{label} repeat [{n}]", "G1 X#101 Y-#<way>", "#101 = [#101 + #<way>]", f"o{label} endrepeat"]
        self.at = [0.0, 0.0, 50.0]
        self.add("G1 " + " ".join(self.to(a, self.inner(a)) for a in range(3)))

    def per_revolution(self):
        """F in the turn of the spindle, for some cuts."""
        if self.incremental:
            self.add("G90")
            self.incremental = False
        self.add("G95 F" + (f"{0.1 / 25.4:.5f}" if self.inch else "0.1"))
        for _ in range(self.r.randint(1, 3)):
            self.r.choice([self.cut_as_it_is, self.circle])()
        self.add(f"G94 F{self.number(400)}")

    def number(self, mm):
        return f"{mm / 25.4:.4f}" if self.inch else f"{mm:.3f}"

    def value(self, mm):
        return round(mm / 25.4, 4) * 25.4 if self.inch else round(mm, 3)

    def add(self, line):
        if self.r.random() < 0.15:
            line = line.lower()
        if self.r.random() < 0.1:
            line += " (remark)"
        if self.r.random() < 0.1:
            line = line.replace(" ", "")
        self.lines.append(line)

    def to(self, axis, mm):
        """The word that leads there."""
        word = self.value(mm - self.at[axis]) if self.incremental else self.value(mm)
        self.at[axis] = self.at[axis] + word if self.incremental else word
        return "XYZ"[axis] + self.number(word)

    def cut_as_it_is(self):
        self.add("G1 " + " ".join(self.to(a, self.r.uniform(*[(-60, 60), (-60, 60), (30, 60)][a])) for a in range(3)))

    def cut(self):
        axes = sorted(self.r.sample(range(3), self.r.randint(1, 3)))
        spans = [(-60, 60), (-60, 60), (30, 60)]
        words = " ".join(self.to(a, self.r.uniform(*spans[a])) for a in axes)
        self.add(self.r.choice(["G1 ", "G01 ", "g1 "]) + words + (f" F{self.number(self.r.choice([200, 500, 1000]))}" if self.r.random() < 0.3 else ""))

    def circle(self):
        if self.r.random() < 0.4:
            self.plane = self.r.choice([17, 18, 19])
            self.add(f"G{self.plane}")
        first, second, third = {17: (0, 1, 2), 18: (2, 0, 1), 19: (1, 2, 0)}[self.plane]
        radius = self.r.uniform(4, 15)
        begin = self.r.uniform(-math.pi, math.pi)
        turn = self.r.uniform(0.3, 5.5) * self.r.choice([1, -1])
        center = [self.at[first] - radius * math.cos(begin), self.at[second] - radius * math.sin(begin)]
        end = [center[0] + radius * math.cos(begin + turn), center[1] + radius * math.sin(begin + turn)]
        from_start = [center[0] - self.at[first], center[1] - self.at[second]]
        code = "G3" if turn > 0 else "G2"
        words = [self.to(first, end[0]), self.to(second, end[1])]
        if self.r.random() < 0.3:
            words.append(self.to(third, self.at[third] + self.r.uniform(-3, 3)))
        if self.r.random() < 0.4 and 0.4 < abs(turn) < 5.0 and abs(abs(turn) - math.pi) > 0.3:
            words.append("R" + self.number(radius if abs(turn) < math.pi else -radius))
        else:
            words += ["IJK"[first] + self.number(from_start[0]), "IJK"[second] + self.number(from_start[1])]
            if self.r.random() < 0.2:
                words.append(f"P{self.r.randint(1, 3)}")
        self.r.shuffle(words)
        self.add(" ".join([code] + words))

    def holes(self):
        if self.incremental:
            self.add("G90")
            self.incremental = False
        if self.plane != 17:
            self.plane = 17
            self.add("G17")
        self.add("G0 " + self.to(2, 60))
        kind = self.r.choice(["G81", "G82", "G83", "G73", "G85"])
        more = {"G82": " P0.5", "G83": " Q" + self.number(3), "G73": " Q" + self.number(4)}.get(kind, "")
        depth = self.value(30)
        words = f"{self.to(0, self.r.uniform(-50, 50))} {self.to(1, self.r.uniform(-50, 50))}"
        self.add(f"{self.r.choice(['G98', 'G99'])} {kind} {words} Z{self.number(depth)} R{self.number(45)}{more}")
        back = 45 if "99" in self.lines[-1][:4].upper() else 60
        for _ in range(self.r.randint(0, 3)):
            axis = self.r.randint(0, 1)
            height = self.r.choice(["", "", "G98 ", "G99 "])
            feed = f" F{self.number(self.r.choice([100, 200]))}" if self.r.random() < 0.3 else ""
            back = {"": back, "G98 ": 60, "G99 ": 45}[height]
            self.add(height + self.to(axis, self.r.uniform(-50, 50)) + feed)
        self.add("G80")
        self.at[2] = self.value(back)
        if self.r.random() < 0.5:  # the height that the last hole left the tool at is cut at
            self.add(f"G1 {self.to(0, self.r.uniform(-50, 50))} {self.to(1, self.r.uniform(-50, 50))}")
        self.add("G0 " + self.to(2, 60))

    def turn(self):
        """Rotary axes, and all positions anew."""
        if self.incremental:
            self.add("G90")
            self.incremental = False
        self.add("G0 " + self.to(2, 150))
        self.add(f"G0 A{self.r.uniform(-20, 60):.3f} C{self.r.uniform(-170, 170):.3f}")
        self.add(f"G0 {self.to(0, self.r.uniform(-40, 40))} {self.to(1, self.r.uniform(-40, 40))}")
        self.add("G0 " + self.to(2, 60))

    def home(self):
        if self.incremental:
            self.add("G90")
            self.incremental = False
        self.add(self.r.choice(["G53 G0 Z" + self.number(300), "G0 G53 Z" + self.number(350), "G28 Z" + self.number(self.at[2]), "G28 Z" + self.number(self.r.uniform(60, 100))]))
        self.add(f"G0 {self.to(0, self.r.uniform(-40, 40))} {self.to(1, self.r.uniform(-40, 40))}")
        self.add("G0 " + self.to(2, 60))

    def program(self):
        head = ["%"] if self.r.random() < 0.5 else []
        self.lines = []
        unit = "G20" if self.inch else "G21"
        self.add(self.r.choice([f"{unit} G17 G40 G49 G80 G90 G94", f"N10 G90 {unit}", f"G17 {unit} G90 G94 G54"]))
        self.add("G54")
        self.add(self.r.choice(["T1 M6", "T1\nM6", "M6 T1"]))
        self.add("S3000 M3")
        self.add("G43 H1")
        self.add("M8")
        self.add("G0 A0 C0")
        self.add("G0 X0 Y0")
        self.at[:2] = [0.0, 0.0]
        self.add("G0 " + self.to(2, 60))
        self.add(f"G1 {self.to(2, 45)} F{self.number(500)}")
        steps = [self.cut] * 5 + [self.circle] * 5 + [self.holes] * 2 + [self.turn, self.home, self.shift, self.shift, self.per_revolution, self.call, self.call, self.loop, self.loop]
        for _ in range(self.r.randint(4, 14)):
            if self.r.random() < 0.12:
                self.incremental = not self.incremental
                self.add("G91" if self.incremental else "G90")
            if self.r.random() < 0.05:
                self.inch = not self.inch
                self.add("G20" if self.inch else "G21")
                self.at = [self.value(v) if not self.incremental else v for v in self.at]
                if self.incremental:
                    self.incremental = False
                    self.add("G90")
                self.add("G1 " + " ".join(self.to(a, self.at[a] + 1) for a in range(3)) + f" F{self.number(300)}")
            self.r.choice(steps)()
        if self.incremental:
            self.add("G90")
            self.incremental = False
        self.add("G0 " + self.to(2, 100))
        if self.shifted:
            self.add("G92.1")
        self.lines += ["M5", "M9", self.r.choice(["M2", "M30"])]
        if "sub" in self.used:  # in front of the program, as the interpreter wants it
            head_of_sub = ["o100 sub", "G1 X#1 Y#2", "o101 if [#3 GT 1]", "Z#3", "o101 else", "Z[#3+0]", "o101 endif", "o100 endsub"]
            self.lines = head_of_sub + self.lines
        return "\n".join(head + self.lines + head) + "\n"


def mutated(text, rng):
    """One word taken away, changed, or put in."""
    lines = text.splitlines()
    for _ in range(100):
        i = rng.randrange(len(lines))
        words = list(re.finditer(r"[A-Za-z][-+]?[0-9.]+", re.sub(r"\(.*?\)", lambda m: " " * len(m[0]), lines[i])))
        if not words:
            continue
        word = rng.choice(words)
        kind = rng.choice(["drop", "drop", "drop line", "swap", "left on", "number"])
        line = lines[i]
        if kind == "drop":
            lines[i] = line[:word.start()] + line[word.end():]
        elif kind == "drop line":
            del lines[i]
        elif kind == "left on":
            lines.insert(i, rng.choice(["G91", "G90", "G20", "G21", "G18", "G19", "G17", "G93", "G95", "G41 D1", "G92 X1", "G52 Y2", "G92.1", "G68 R10", "G51 X2", "G90.1"]))
        elif kind == "swap":
            other = {"G20": "G21", "G21": "G20", "G90": "G91", "G91": "G90", "G2": "G3", "G3": "G2", "G0": "G1", "G1": "G0", "G17": "G18",
                     "G98": "G99", "G99": "G98"}.get(word[0].upper())
            if other is None:
                continue
            lines[i] = line[:word.start()] + other + line[word.end():]
        else:
            lines[i] = line[:word.start()] + word[0][0] + f"{rng.uniform(-20, 40):.2f}" + line[word.end():]
        return "\n".join(lines) + "\n", f"{kind} {word[0]} in line {i + 1}: {line}"
    return text, "nothing"


class Path_:
    """Cuts as the interpreter makes them: points of A-C machine words, mm and degrees, runs of a cut apart."""

    def __init__(self, calls):
        self.runs, self.way = [], 0.0
        unit, at, plane = 1.0, None, "XY"
        shift = [0.0, 0.0, 0.0]  # the calls count from it
        cutting = False
        for line in calls.splitlines():
            call = re.search(r"N\.*\d* +([A-Z_0-9]+)\((.*)\)", line)
            if not call:
                continue
            name, values = call[1], call[2]
            if name == "USE_LENGTH_UNITS":
                unit = 25.4 if "INCH" in values else 1.0
            elif name == "SET_G92_OFFSET":
                shift = [float(x) * unit for x in values.split(",")[:3]]
            elif name == "SELECT_PLANE":
                plane = values[-2:]
            elif name in ("STRAIGHT_FEED", "STRAIGHT_TRAVERSE"):
                v = [float(x) for x in values.split(",")]
                to = (*(x * unit + s for x, s in zip(v, shift)), v[3], v[5])
                self.go(at, to, name == "STRAIGHT_FEED", cutting)
                cutting, at = name == "STRAIGHT_FEED", to
            elif name == "ARC_FEED":
                v = [float(x) for x in values.split(",")]
                axes = {"XY": (0, 1, 2), "XZ": (2, 0, 1), "YZ": (1, 2, 0)}[plane]
                shifts = [shift[a] for a in axes]
                v[:4] = [x * unit + s for x, s in zip(v, shifts[:2] * 2)]
                v[5] = v[5] * unit + shifts[2]
                for to in self.arc(at, v, axes):
                    self.go(at, to, True, cutting)
                    cutting, at = True, to

    def go(self, at, to, cuts, cutting):
        if not cuts or at is None:
            return
        if not cutting:
            # A cut straight from a retract: how long it is says the machine's retract, not the program (under G20 rs274 by itself takes
            # 25.4 inches for the tool's one, and stands as far below).
            if abs(at[2]) > ABOVE_MM and (*at[:2], *at[3:]) == (*to[:2], *to[3:]):
                at = to
            self.runs.append([at])
        if to != at:
            self.way += math.dist(at, to)
            self.runs[-1].append(to)

    @staticmethod
    def arc(at, v, axes):
        first, second, third = axes
        end, center, turns, up = (v[0], v[1]), (v[2], v[3]), int(v[4]), v[5]
        r0 = math.hypot(at[first] - center[0], at[second] - center[1])
        r1 = math.hypot(end[0] - center[0], end[1] - center[1])
        a0 = math.atan2(at[second] - center[1], at[first] - center[0])
        a1 = math.atan2(end[1] - center[1], end[0] - center[0])
        sweep = a1 - a0
        if turns > 0:
            while sweep <= 1e-9:
                sweep += 2 * math.pi
            sweep += 2 * math.pi * (turns - 1)
        else:
            while sweep >= -1e-9:
                sweep -= 2 * math.pi
            sweep += 2 * math.pi * (turns + 1)
        count = max(4, int(abs(sweep) / (2 * math.acos(1 - min(0.5, 0.0005 / max(r0, 1e-6))))) + 1)
        for i in range(1, count + 1):
            t = i / count
            r, a = r0 + t * (r1 - r0), a0 + t * sweep
            to = list(at)
            to[first], to[second], to[third] = center[0] + r * math.cos(a), center[1] + r * math.sin(a), at[third] + t * (up - at[third])
            yield tuple(to)


def off(point, a, b):
    d = [q - p for p, q in zip(a, b)]
    n = sum(x * x for x in d)
    t = 0.0 if n == 0 else max(0.0, min(1.0, sum((p - q) * x for p, q, x in zip(point, a, d)) / n))
    return math.dist(point, [p + t * x for p, x in zip(a, d)])


def farthest(points, path):
    """How far one of the points is off the path. Their order is not looked at: the ways are as long, and turns by which they could differ are not
    made."""
    segments = [(a, b) for run in path for a, b in zip(run, run[1:])] or [(run[0], run[0]) for run in path]
    worst, k = 0.0, 0
    for p in points:
        # From where the one before was.
        near = next((i % len(segments) for i in range(k, k + len(segments)) if off(p, *segments[i % len(segments)]) < NEAR_MM), None)
        if near is None:
            worst = max(worst, min(off(p, *s) for s in segments))
        else:
            k = near
    return worst


def differs(given, made):
    """Nothing where both cut the same way, else what is different."""
    if abs(given.way - made.way) > WAY * given.way + 0.02:
        return f"{given.way:.3f} mm of cuts are {made.way:.3f} mm"
    points = [p for run in made.runs for p in run[1:]]
    if given.runs and (d := farthest(points, given.runs)) > NEAR_MM:
        return f"a point {d:.4f} mm off what was read"
    if made.runs and (d := farthest([p for run in given.runs for p in run[1:]], made.runs)) > NEAR_MM:
        return f"a point of what was read {d:.4f} mm off"
    return None


def without_ways_down(path):
    """Without the straight ways down with which runs begin: behind a stop what is written comes down at feed where the program had stood already."""
    for run in path.runs:
        while len(run) > 1 and run[1][2] < run[0][2] and (*run[0][:2], *run[0][3:]) == (*run[1][:2], *run[1][3:]):
            path.way -= math.dist(run[0], run[1])
            del run[0]
    return path


def interpret(folder, name):
    (folder / "out.txt").unlink(missing_ok=True)
    (folder / "new.var").write_text(f"5163\t{HOME_INCH}\n")
    (folder / "tool.tbl").write_text("".join(f"T{t} P{t} Z{t} D1\n" for t in range(1, 60)))
    done = subprocess.run(["rs274", "-g", "-n", "2", "-t", "tool.tbl", "-v", "new.var", name, "out.txt"], cwd=folder, capture_output=True, text=True,
                          env={**os.environ, "HOME": str(folder)}, timeout=60, check=False)
    if done.returncode != 0:
        return None
    return Path_((folder / "out.txt").read_text())


def judge(program, folder, text, machine="trunnion_offset", ways_down=True, control="linuxcnc"):
    """(what came of it, why)."""
    (folder / "in.ngc").write_text(text)
    (folder / "out.nc").unlink(missing_ok=True)
    done = subprocess.run([program, "post", "in.ngc", "--from", control, "-m", machine, "-c", "linuxcnc", "-o", "out.nc", "--from-path", "motion"],
                          cwd=folder, capture_output=True, text=True, timeout=120, check=False)
    given = interpret(folder, "in.ngc")
    says = [line for line in done.stderr.splitlines() if "error" in line]
    why = says[0] if says else done.stderr[-300:]
    if done.returncode not in (0, 1, 3):
        return "crashed", f"exit code {done.returncode}: {why}"
    if done.returncode != 0:
        if (folder / "out.nc").exists():
            return "wrong", "refused, and an output stands there"
        return ("refused", why) if given else ("refused by both", why)
    if given is None:
        return "accepted what LinuxCNC refuses", ""
    made = interpret(folder, "out.nc")
    if made is None:
        return "wrong", "LinuxCNC does not read what was written"
    if not ways_down:
        given, made = without_ways_down(given), without_ways_down(made)
    different = differs(given, made)
    return ("wrong", different) if different else ("right", "")


BEFORE = "G21 G90 G94 G40 G17 G80\nT1 M6\nG43 H1\nS1000 M3 F500\nG0 Z190\nG0 X0 Y0 A0 C0\n"


def files(program, folder, folders, show):
    """Programs of others as they stand. The exit code."""
    # They cut anywhere: a machine with long travels.
    shipped = Path(__file__).resolve().parents[3] / "postconfigs/machines/trunnion_offset.toml"
    machine = folder / "long_travels.toml"
    text = re.sub(r"(m[inax]{2}_mm) = (-?)\d+", r"\1 = \g<2>20000", shipped.read_text())
    machine.write_text(text.replace("min_deg = -30", "min_deg = -120"))
    by_name = {path.name: path for one in folders for path in sorted(Path(one).rglob("*.ngc"))}
    if not by_name:
        print("skipped: no *.ngc in " + " ".join(folders))
        return 77
    counts, bad = collections.Counter(), 0
    for name, path in sorted(by_name.items()):
        text = re.sub(r"^%.*$", "", path.read_text(encoding="latin-1"), flags=re.M)
        end = "" if re.search(r"M0?2\b|M30", text, re.I) else "\nM2\n"
        try:
            came, why = judge(program, folder, BEFORE + text + end, machine.name, ways_down=False)
        except subprocess.TimeoutExpired:
            came, why = "too long", ""
        counts[came] += 1
        if came in ("wrong", "crashed"):
            bad += 1
            (folder / f"bad_{name}").write_text(BEFORE + text + end)
        if came in ("wrong", "crashed") or show and came != "right":
            print(f"{name}: {came}: {why}")
    for came, n in sorted(counts.items()):
        print(f"files: {came}: {n}")
    return 1 if bad else 0


def main():
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("program")
    parser.add_argument("folder")
    parser.add_argument("count", nargs="?", type=int, default=int(os.environ.get("TRUNNION_INPUTS", "60")))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--show", action="store_true", help="every refusal with its message")
    parser.add_argument("--files", nargs="+", help="folders of programs instead of random ones")
    args = parser.parse_args()
    if shutil.which("rs274") is None:
        print("skipped: rs274 is not installed")
        return 77
    folder = Path(args.folder).resolve()
    folder.mkdir(parents=True, exist_ok=True)
    program = str(Path(args.program).resolve())
    if args.files:
        return files(program, folder, args.files, args.show)
    counts, bad = {}, 0
    for i in range(args.count):
        rng = random.Random(args.seed * 100003 + i)
        text = Maker(rng).program()
        changed = []
        for _ in range(2):
            changed.append(mutated(text, rng))
        for kind, what, how in [("whole", text, "as it was made")] + [("changed", t, h) for t, h in changed]:
            came, why = judge(program, folder, what)
            counts[kind, came] = counts.get((kind, came), 0) + 1
            fails = came in ("wrong", "crashed", "accepted what LinuxCNC refuses") or (kind == "whole" and came != "right")
            if fails:
                bad += 1
                kept = folder / f"bad_{args.seed}_{i}_{kind}_{bad}.ngc"
                kept.write_text(what)
                print(f"{kept.name}: {came}: {why} ({how})")
            elif args.show and came != "right":
                print(f"{i} {came}: {why} ({how})")
    for (kind, came), n in sorted(counts.items()):
        print(f"{kind}: {came}: {n}")
    return 1 if bad else 0


if __name__ == "__main__":
    sys.exit(main())
