#!/usr/bin/env python3
"""mutants.py PROGRAM FOLDER [COUNT] [--seed N] [--real FOLDER]: programs that PROGRAM has posted and verified, each with one word or one block changed, or
a modal word put in. The walk (control.py, chain.py, campaign.judge) says which of them cut wrong; `verify` of PROGRAM must let none of those pass.

Wrong is: the control cannot run it; a motion is beside the path, by the tolerance of the CL file (random files) or by three tolerances of the program that
was posted (real files); a feed is cut in another state than before: work offset, tool, length, spindle, coolant, feed mode, path mode, dwells and stops
before it, the tool axis by more than two tolerances, or F by more than a half. With `--real` the CL files of a folder, each cut to its first points.
"""
import argparse
import collections
import math
import os
import random
import re
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from campaign import CONTROLS, RAPID_MM, Path_, judge, machines, random_part  # noqa: E402
from chain import Machine, dot, length, sub  # noqa: E402
from control import Refused, control_for  # noqa: E402

AXIS_DEG = 1.0

# Words that change what the control does next. Each is a block of its own.
ISO = ["G0", "G1", "G2", "G17", "G18", "G19", "G20", "G40", "G41 D1", "G42 D1", "G43 H77", "G49", "G52 X1.", "G54", "G55", "G59", "G61", "G64", "G68 X0. Y0. R10.",
       "G80", "G91", "G92 X0.", "G93", "G94", "G95", "G10 L2 P1 X5. Y0. Z0.", "G4 P100.", "G28 Z0.", "M0", "M1", "M2", "M3", "M4", "M5", "M8", "M9", "M30",
       "M98 P100", "M99", "S90 M3", "S9000 M4", "T9 M6", "T9", "F50.", "F90000.", "X5.", "Z-200.", "U1.", "E1", "%"]
WORDS = {
    "siemens_840d_sl": ["G0", "G1", "G2", "G18", "G19", "G41", "G42", "G54", "G55", "G500", "G53", "G60", "G64", "G641 ADIS=5", "G70", "G700", "G91", "G93", "G94", "G95",
                        "TRANS X5", "ATRANS Z1", "ROT Z10", "AROT X5", "MIRROR X0", "SCALE X2", "TRAORI", "TRAFOOF", "D0", "D2", "T9", "M6", "M0", "M1", "M2", "M3",
                        "M4", "M5", "M8", "M9", "M30", "M17", "S90 M3", "S9000 M4", "G4 F1", "F50", "F90000", "X=IC(5)", "Z-200", "SUPA G0 X0", "R1=5",
                        "G110 X0", "OFFN=1", "CUT2D", "G450", "CDOF"],
    "heidenhain_tnc640": ["L X+5 R0 FMAX", "L Z-200 R0 FMAX", "L IX+5 R0 FMAX", "L R0 F50", "L RL", "L RR", "L M91", "L Z+0 R0 FMAX M91", "M0", "M1", "M2", "M3", "M4", "M5", "M8", "M9",
                          "M30", "M128", "M129", "M126", "M127", "M136", "M103 F50", "M116", "M140 MB MAX", "CYCL DEF 7.0 DATUM SHIFT", "CYCL DEF 7.1 X+5",
                          "CYCL DEF 8.0 MIRRORING", "CYCL DEF 10.0 ROTATION", "CYCL DEF 247 DATUM SETTING ~\nQ339=+2", "CYCL DEF 9.0 DWELL TIME",
                          "CYCL DEF 32.0 TOLERANCE", "CYCL DEF 32.1 T0.5", "PLANE RESET STAY", "TOOL CALL 9 Z S500", "TOOL CALL Z S90", "TOOL CALL DL+5", "STOP M6",
                          "CALL LBL 1", "LBL 0", "FN 0: Q1 = +5", "END PGM X MM"],
}
WORD = re.compile(r"([XYZABCFSHDTP])(=DC\()?([+-]?(?:\d+\.?\d*|\.\d+))")


def with_value(line, found, value, control):
    digits = len(found[3].partition(".")[2])
    text = f"{value:.{max(digits, 3)}f}" if "." in found[3] or found[1] in "XYZABC" else f"{value:.0f}"
    if control == "heidenhain_tnc640" and value >= 0 and found[3][0] in "+-":
        text = "+" + text
    return line[:found.start(3)] + text + line[found.end(3):]


def changed(rng, lines, control, tolerance, first):
    """One change, and what it is called. Comments and the lines before `first` stay."""
    lines = list(lines)
    what = rng.choice(("word", "word", "word", "sign", "drop word", "drop block", "double", "swap", "move", "modal", "modal", "modal", "rapid", "feed"))
    for _ in range(50):
        i = rng.randrange(first, len(lines))
        line = lines[i]
        if line.startswith((";", "(")) or not line.strip():
            continue
        words = list(WORD.finditer(line))
        axis_words = [w for w in words if w[1] in "XYZABC"]
        if what in ("word", "sign") and words:
            w = rng.choice(words)
            value = float(w[3])
            if what == "sign":
                new = -value
            elif w[1] in "XYZ":
                new = value + rng.choice((-1, 1)) * tolerance * 3 * 10 ** rng.uniform(0, 4)
            elif w[1] in "ABC":
                new = value + rng.choice((-1, 1)) * 3 * 10 ** rng.uniform(-1, 1.7)
            elif w[1] == "F":
                new = value * rng.choice((0.1, 0.3, 0.5, 2, 3, 10))
            else:
                new = value + rng.choice((1, 7, 500))
            lines[i] = with_value(line, w, new, control)
            if lines[i] != line:
                return lines, what + " " + w[1]
        elif what == "drop word" and words:
            tokens = line.split(" ")
            j = rng.randrange(1 if len(tokens) > 1 and re.match(r"N?\d+$", tokens[0]) else 0, len(tokens))
            dropped = tokens.pop(j)
            lines[i] = " ".join(tokens)
            return lines, what + " " + re.sub(r"[-+.\d()]+.*", "", dropped)
        elif what == "drop block":
            del lines[i]
            return lines, what
        elif what == "double":
            lines.insert(i, line)
            return lines, what
        elif what == "swap" and i + 1 < len(lines) and lines[i] != lines[i + 1]:
            lines[i], lines[i + 1] = lines[i + 1], lines[i]
            return lines, what
        elif what == "move":
            j = min(max(first, i + rng.randint(-20, 20)), len(lines) - 1)
            if i != j:
                lines.insert(j, lines.pop(i))
                return lines, what
        elif what == "modal":
            word = rng.choice(WORDS.get(control, ISO))
            lines.insert(i, word)
            return lines, "modal " + word.split("\n")[0]
        elif what in ("rapid", "feed") and axis_words:
            if control == "heidenhain_tnc640":
                new = line.replace(" FMAX", " F1000") if what == "feed" else re.sub(r" F[\d.]+|$", " FMAX", line, count=1)
            else:
                code = "G0 " if what == "rapid" else "G1 "
                new = re.sub(r"G0?[01] ", code, line) if re.search(r"G0?[01] ", line) else line[:axis_words[0].start()] + code + line[axis_words[0].start():]
            if new != line and " F1000" not in line:
                lines[i] = new
                return lines, "made a " + what
    return None, None


def angle_deg(m, a, b):
    """Between the tool axes of two positions, seen from the part."""
    def of(q):
        origin, up = m.machine_to_part((0.0, 0.0, 0.0), q), m.machine_to_part((0.0, 0.0, 1.0), q)
        return sub(up, origin)
    u, v = of(a), of(b)
    return math.degrees(math.atan2(length((u[1] * v[2] - u[2] * v[1], u[2] * v[0] - u[0] * v[2], u[0] * v[1] - u[1] * v[0])), dot(u, v)))


def differs(m, before, after):
    """The first feed that is cut otherwise: the same places in the same order, another state."""
    def cuts(motions):
        return [x for x in motions if not x.rapid and x.moved and all(x.end[n] is not None for n in m.axes)]
    feeds = cuts(before)
    at = 0
    for motion in cuts(after):
        here = next((k for k in range(at, min(at + 3, len(feeds))) if all(abs(motion.end[n] - feeds[k].end[n]) < 1e-7 for n in m.axes)), None)
        if here is None:
            continue
        at = here + 1
        was, now = feeds[here].state, motion.state
        *was_rest, was_mode, was_f, was_path, was_pauses = was
        *now_rest, now_mode, now_f, now_path, now_pauses = now
        if (was_rest, was_mode, was_path, was_pauses) != (now_rest, now_mode, now_path, now_pauses):
            return f"NC line {motion.line}: cut in another state: {now} for {was}"
        if was_f and now_f and not 0.6 < now_f / was_f < 1.5:
            return f"NC line {motion.line}: F{now_f:g} for F{was_f:g}"
    if before and after and len(before) == len(after):
        for x, y in zip(before, after):
            if all(y.end[n] is not None and x.end[n] is not None for n in m.axes) and not y.rapid and angle_deg(m, x.end, y.end) > 2 * AXIS_DEG:
                return f"NC line {y.line}: the tool axis is {angle_deg(m, x.end, y.end):.2f} deg off"
    return None


def walked(control, m, tools, text):
    return control_for(control, m, tools, reads_on=False).run(text)


def wrong(control, m, tools, path, limits, before, text):
    """Why the program cuts wrong, or nothing."""
    try:
        motions = walked(control, m, tools, text)
    except Refused as why:
        return str(why)
    except (KeyError, TypeError) as why:  # a word with a number that no control has
        return f"the walk stops: {why!r}"
    findings = judge(m, motions, path, *limits, near_mm=RAPID_MM)
    return findings[0] if findings else differs(m, before, motions)


def path_of(m, motions):
    """The way of a program below the safe height as a path."""
    path = Path_()

    def add(q, x):
        path.points.append((m.tip_in_part(q, x.tool_mm), sub(m.machine_to_part((0, 0, 1), q), m.machine_to_part((0, 0, 0), q))))
        path.rapid.append(x.rapid)
        path.tool.append(x.tool)
        path.line.append(x.line)
    for x in motions:
        if any(x.end[n] is None for n in m.axes) or m.is_up(x.end["Z"], 5e-3):
            continue
        if all(x.start[n] is not None for n in m.axes) and m.is_up(x.start["Z"], 5e-3):
            add(x.start, x)  # from where it comes down
        add(x.end, x)
    return path


def real_part(rng, files):
    """The first points of a real file, and its tools."""
    name = rng.choice(files)
    lines, points = [], 0
    most = rng.randint(20, 120)
    for line in name.read_text(errors="replace").splitlines():
        points += line.lstrip().startswith("GOTO")
        if points > most:
            break
        lines.append(line)
    while lines and lines[-1].rstrip().endswith("$"):
        lines.pop()
    if not any(line.startswith("SPINDL") for line in lines):
        after = next((i for i, line in enumerate(lines) if line.startswith("LOADTL")), 0)
        lines.insert(after + 1, "SPINDL/3000,RPM,CLW")
    return name.name, "\n".join(lines) + "\nFINI\n"


def case(program, folder, rng, number, files):
    """A program that was posted and passed: everything that its mutants need. Or nothing."""
    control = rng.choice(CONTROLS)
    kinds = machines(rng)
    kind = rng.choice([k for k in sorted(kinds) if (control, k) != ("heidenhain_tnc640", "spindle_words")])
    tolerance = rng.choice((0.005, 0.01, 0.05))
    tcp = control in ("fanuc_30i", "haas_ngc", "siemens_840d_sl", "heidenhain_tnc640") and kind != "spindle_words" and rng.random() < 0.25
    text = kinds[kind]
    m = Machine(text)
    if tcp:
        text = re.sub(r"work_offset_mm = .*", f"work_offset_mm = {list(m.zero)}", text)
        m = Machine(text)
    base = folder / f"mutant_{number}"
    options = ["-m", str(base.with_suffix(".toml")), "-c", control, "--tolerance-mm", str(tolerance), "--axis-tolerance-deg", str(AXIS_DEG)]
    if files:
        name, cl = real_part(rng, files)
        path, tools = None, {}
        options += ["--tool-length-mm", "140"]
    else:
        name = "random"
        cl, path, tools = random_part(rng, control)
    base.with_suffix(".toml").write_text(text)
    base.with_suffix(".cls").write_text(cl)
    nc = base.with_suffix(".nc")
    nc.unlink(missing_ok=True)
    posted = [program, "-q", "post", str(base.with_suffix(".cls")), "-o", str(nc)] + options
    done = subprocess.run(posted + (["--rtcp"] if tcp else []), capture_output=True, text=True)
    if done.returncode != 0:
        return None
    lines = nc.read_text().splitlines()
    if path is None:
        tools = {int(t): float(v) for t, v in re.findall(r"tool (\d+), gauge length ([\d.]+) mm", nc.read_text(), re.I)}
    try:
        before = walked(control, m, tools, nc.read_text())
    except Refused:
        return None  # words that the walk does not know
    if path is None:
        path, limits = path_of(m, before), (3 * tolerance, 3 * RAPID_MM)
    else:
        limits = tolerance, RAPID_MM
    if judge(m, before, path, *limits, near_mm=RAPID_MM):
        return None
    return control, kind + (", tool-centre-point control" if tcp else ""), name, m, tools, path, tolerance, limits, before, lines, base, options


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("folder")
    parser.add_argument("count", nargs="?", type=int, default=int(os.environ.get("TRUNNION_MUTANTS", "300")))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--real", help="folder of CL files")
    parser.add_argument("--each", type=int, default=25, help="mutants of one program")
    args = parser.parse_args()
    folder = Path(args.folder)
    folder.mkdir(parents=True, exist_ok=True)
    files = sorted(f for f in Path(args.real).iterdir() if f.is_file()) if args.real else []
    table = collections.defaultdict(lambda: [0, 0, 0, 0])  # wrong and found, wrong and passed, right and passed, right and refused
    done = number = tried = 0
    missed = []
    names = collections.Counter()
    while done < args.count:
        rng = random.Random(f"{args.seed}/{number}")
        number += 1
        made = case(args.program, folder, rng, number, files)
        tried += 1
        if made is None:
            if tried > 50 and done == 0:
                sys.exit("no program could be made")
            continue
        control, kind, name, m, tools, path, tolerance, limits, before, lines, base, options = made
        names[name] += 1
        first = next(i for i, x in enumerate(lines) if not x.startswith((";", "(", "%", "O", "0 BEGIN")) and not re.match(r"\d+ ;", x))
        changed_nc = base.with_suffix(".changed.nc")
        kept = False
        for k in range(args.each):
            mutant, what = changed(rng, lines, control, tolerance, first)
            if mutant is None or mutant == lines:
                continue
            text = "\n".join(mutant) + "\n"
            why = wrong(control, m, tools, path, limits, before, text)
            changed_nc.write_text(text)
            got = subprocess.run([args.program, "-q", "verify", str(changed_nc), "--against", str(base.with_suffix(".cls"))] + options, capture_output=True, text=True)
            if got.returncode not in (0, 1, 3):
                missed.append(f"{base.name} {control} {kind}: exit code {got.returncode} for {what}")
            passed = got.returncode == 0
            table[what.split(" ")[0] if not what.startswith("modal") else "modal"][(0 if not passed else 1) if why else (2 if passed else 3)] += 1
            done += 1
            if why and passed:
                kept = True
                keep = folder / f"{base.name}.{k}.missed.nc"
                keep.write_text(text)
                missed.append(f"{keep.name}: {control}, {kind}, {name}, {what}: {why}")
        changed_nc.unlink(missing_ok=True)
        if not kept:
            for end in (".toml", ".cls", ".nc"):
                base.with_suffix(end).unlink(missing_ok=True)
    print(f"{done} mutants of {sum(names.values())} programs" + (f" from {len(names)} files" if files else ""))
    print(f"{'change':<10} {'wrong':>7} {'found':>7} {'right':>7} {'passed':>7}")
    for what, (found, passed_wrong, right, refused) in sorted(table.items()):
        print(f"{what:<10} {found + passed_wrong:>7} {found:>7} {right + refused:>7} {right:>7}")
    for line in missed[:60]:
        print(line)
    print(f"{len(missed)} wrong programs passed")
    if missed:
        sys.exit(1)


if __name__ == "__main__":
    main()
