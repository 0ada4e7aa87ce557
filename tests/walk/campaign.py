#!/usr/bin/env python3
"""campaign.py PROGRAM FOLDER [COUNT] [--seed N] [--again|--identity]: random CL files on five kinds of machine and seven controls, posted by PROGRAM and
walked by a control that was written apart from it (control.py, chain.py). Whatever moves below the safe height must be on the CL path: feeds
within their tolerance on what is to be cut, rapids within theirs on what is to be a rapid; or go straight along Z to or from a point of the path.
"""
import argparse
import json
import math
import os
import random
import re
import subprocess
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).resolve().parent))
from chain import Machine, add, dot, length, scale, sub  # noqa: E402
from control import Refused, control_for  # noqa: E402

CONTROLS = ("linuxcnc", "iso", "fanuc_30i", "haas_ngc", "siemens_840d_sl", "heidenhain_tnc640", "hnc_8")
RAPID_MM = 1.0  # default of --rapid-tolerance-mm


def axis(name, direction, low, high, rapid, point=None, cyclic=False):
    rotary = name in "ABC"
    unit = "deg" if rotary else "mm"
    lines = ["[[axis]]", f'name = "{name}"', f'type = "{"rotary" if rotary else "linear"}"', f"direction = {list(direction)}"]
    if point:
        lines.append(f"point_mm = {list(point)}")
    if cyclic:
        lines.append("cyclic = true")
    else:
        lines += [f"min_{unit} = {low}", f"max_{unit} = {high}"]
    lines.append(f"rapid_{unit}_min = {rapid}")
    return "\n".join(lines)


def machine(name, zero, offset, point, axes, tool, part, more=""):
    return (f'[machine]\nname = "{name}"\n[tool]\nlength_mm = 140.0\n[part]\nzero_mm = {list(zero)}\n[output]\npoint = "{point}"\n'
            f"work_offset_mm = {list(offset)}\n" + more + "\n".join(axes) + f"\n[chain]\ntool = {json.dumps(tool)}\npart = {json.dumps(part)}\n")


def machines(rng):
    """Five kinds: Z 0 at the top, at the bottom, in the middle; words of the spindle; linear axes under the table."""
    def r(a):
        return round(rng.uniform(-a, a), 3)

    def linear(x=(-900, 900), y=(-900, 900), z=(0, 1300)):
        return [axis("X", (1, 0, 0), *x, 30000), axis("Y", (0, 1, 0), *y, 30000), axis("Z", (0, 0, 1), *z, 30000)]
    top = (r(40), r(40), -900.0 + r(20))
    low = (r(60), r(60), 250.0 + r(20))
    out = {}
    out["z_zero_on_top"] = machine(
        "Z 0 on top", top, top, "tip",
        linear(z=(-1200, 0)) + [axis("A", (-1, 0, 0), -125, 95, 9000, (r(.05), r(.05), -960.0)),
                                axis("C", (0, 0, -1), 0, 0, 18000, (r(.05), r(.05), -960.0), cyclic=True)],
        ["X", "Y", "Z"], ["A", "C"])
    out["z_zero_below"] = machine(
        "Z 0 below", low, low, "tip",
        linear(z=(0, 1300)) + [axis("A", (1, 0, 0), -100, 120, 9000, (r(2), r(2), 200.0)),
                               axis("C", (0, 0, 1), 0, 0, 18000, (r(2), r(2), 230.0), cyclic=True)],
        ["X", "Y", "Z"], ["A", "C"])
    out["z_zero_between"] = machine(
        "Z 0 between", (r(30), r(30), r(30)), (r(30), r(30), r(30)), "tip",
        linear(z=(-500, 900)) + [axis("B", (0, 1, 0), -110, 110, 9000, (0, 0, -60.0)),
                                 axis("C", (0, 0, 1), 0, 0, 18000, (r(1), r(1), 0), cyclic=True)],
        ["X", "Y", "Z"], ["B", "C"], "[retract]\nz_mm = 850.0\n")
    out["spindle_words"] = machine(
        "words of the spindle", (r(30), r(30), r(30)), (0, 0, 0), "spindle",
        linear(z=(-500, 900)) + [axis("A", (1, 0, 0), -120, 120, 9000, (0, 0, -50.0)),
                                 axis("C", (0, 0, 1), -3600, 3600, 18000, (0, 0, 0))],
        ["X", "Y", "Z"], ["A", "C"])
    out["table_moves"] = machine(
        "X and Y under the table", (r(20), r(20), 0), (r(20), r(20), 0), "tip",
        [axis("X", (-1, 0, 0), -900, 900, 25000), axis("Y", (0, -1, 0), -900, 900, 25000), axis("Z", (0, 0, 1), -400, 1000, 25000),
         axis("A", (-1, 0, 0), -120, 100, 6000, (0, 0, -60.0)), axis("C", (0, 0, -1), -3600, 3600, 8000, (0, 0, 0))],
        ["Z"], ["Y", "X", "A", "C"])
    return out


class Path_:
    """The CL path: points, whether the motion to a point is a rapid, and in which operation it stands."""

    def __init__(self):
        self.points, self.rapid, self.tool, self.line = [], [], [], []


def unit(v):
    return scale(v, 1.0 / length(v))


def random_part(rng, control):
    """CL text of one or a few operations, what they are, and the tools with their lengths."""
    text = [f"PARTNO/RANDOM {rng.randrange(10000)}", "UNITS/MM", "MULTAX/ON"]
    path = Path_()
    tools = {}

    def goto(p, u, rapid):
        text.append("GOTO/" + ",".join(f"{v:.7f}" for v in (*p, *u)))
        path.points.append((tuple(round(v, 7) for v in p), u))
        path.rapid.append(rapid)
        path.tool.append(tool)
        path.line.append(len(text))
    for _ in range(rng.randint(1, 3)):
        tool = rng.randint(1, 30)
        tools.setdefault(tool, round(rng.uniform(60, 220), 3))
        text.append(f"LOADTL/{tool},LENGTH,{tools[tool]}")
        text.append(f"SPINDL/{rng.randint(500, 12000)},RPM,CLW")
        if rng.random() < 0.5:
            text.append("COOLNT/FLOOD")
        text.append(f"FEDRAT/{rng.randint(200, 3000)}.,MMPM")
        flat = rng.random() < 0.3
        tilt, round_ = math.radians(rng.uniform(5, 75)), rng.uniform(-math.pi, math.pi)
        for _ in range(rng.randint(1, 3)):
            if rng.random() < 0.4:
                tilt, round_ = math.radians(rng.uniform(5, 75)), rng.uniform(-math.pi, math.pi)
            p = [rng.uniform(-60, 60), rng.uniform(-60, 60), rng.uniform(0, 40)]

            def u_of():
                return unit((math.sin(tilt) * math.cos(round_), math.sin(tilt) * math.sin(round_), math.cos(tilt)))
            u = u_of()
            text.append("RAPID")
            goto(add(p, scale(u, 50)), u, True)
            if rng.random() < 0.5:
                text.append("RAPID")
                goto(add(p, scale(u, 3)), u, True)
            goto(tuple(p), u, False)
            way = rng.uniform(-math.pi, math.pi)
            for _ in range(rng.randint(1, 8)):
                way += rng.uniform(-0.6, 0.6)
                step = rng.uniform(0.5, 9)
                p = [p[0] + step * math.cos(way), p[1] + step * math.sin(way), p[2] + rng.uniform(-0.4, 0.4) * step]
                if not flat:
                    tilt = min(max(tilt + rng.uniform(-0.08, 0.08), 0.03), math.radians(80))
                    round_ += rng.uniform(-0.15, 0.15)
                u = u_of()
                goto(tuple(p), u, False)
            text.append("RAPID")
            goto(add(p, scale(u, 50)), u, True)
        text.append("COOLNT/OFF")
        text.append("SPINDL/OFF")
    text.append("FINI")
    return "\n".join(text) + "\n", path, tools


def distance_to(p, a, b):
    ab = sub(b, a)
    l2 = dot(ab, ab)
    t = 0.0 if l2 == 0 else min(max(dot(sub(p, a), ab) / l2, 0.0), 1.0)
    return length(sub(p, add(a, scale(ab, t))))


def judge(m, motions, path, tolerance_mm, rapid_mm=RAPID_MM, near_mm=None):
    """Findings, as texts. `near_mm`: how far from the safe height, and from a line along Z, a rapid may be; of programs that
    were posted no more than digits of the words, of those that somebody changed as far as a rapid from its line. The path is followed in its order: `at` is the point that was reached last."""
    samples = 12
    at = -1
    slack = 2e-3  # digits of the words
    findings = []

    def say(motion, text):
        findings.append(f"NC line {motion.line}: {text}")
    for motion in motions:
        names = motion.moved
        known = all(motion.start[n] is not None for n in m.axes)
        if not known:
            # From an unknown place: Z to the safe height, or what is done there.
            if names == ["Z"] and (motion.safe_word or near_mm) and m.is_up(motion.end["Z"]):
                continue
            # Words of the part under tool-centre-point control are rounded, and where the part is tilted Z follows X and Y.
            if not (m.is_up(motion.start["Z"], near_mm or 5e-3) and m.is_up(motion.end["Z"], near_mm or 5e-3)):
                say(motion, f"{names} move from an unknown place below the safe height")
            continue
        if (motion.safe_word or (near_mm and motion.rapid)) and names in ([], ["Z"]) and m.is_up(motion.end["Z"]):
            continue  # the retract: straight out along the tool
        # Where the part is tilted Z follows X and Y.
        if all(m.is_up(q["Z"], near_mm if near_mm and motion.rapid else 5e-3) for q in (motion.start, motion.end)) and not (motion.tcp and any(n in m.rotary for n in names)):
            continue
        if not motion.rapid and not motion.spindle:
            say(motion, "a feed with the spindle at rest")
        if motion.length_on != motion.tool and not m.spindle_words:
            say(motion, f"tool {motion.tool} is in the spindle and the length of {motion.length_on} counts")
        if m.spindle_words and motion.length_on:
            say(motion, "words of the spindle and length compensation is on")
        tips = []
        p0 = m.tip_in_part(motion.start, motion.tool_mm)
        p1 = m.tip_in_part(motion.end, motion.tool_mm)
        for i in range(samples + 1):
            t = i / samples
            q = {n: motion.start[n] + t * (motion.end[n] - motion.start[n]) for n in m.axes}
            if motion.tcp:
                q = m.linear_for(add(p0, scale(sub(p1, p0), t)), q, motion.tool_mm)
            if m.table:
                height = m.above_table_mm(m.tip(q, motion.tool_mm), q)
                if height is not None and height < 0:
                    say(motion, f"the tool is {-height:.3f} mm below the top of the table")
            tips.append((m.tip_in_part(q, motion.tool_mm), q))
        rotary_moves = any(n in m.rotary for n in names)
        turns = max((abs(motion.end[n] - motion.start[n]) for n in m.rotary), default=0.0)
        beside = near_mm if near_mm and (motion.rapid or m.is_up(motion.start["Z"], 5e-3)) else 3e-3
        straight_z = names == ["Z"] or (turns < 1e-9 and all(abs(motion.end[n] - motion.start[n]) < beside for n in m.linear if n != "Z"))
        # Does it stay on the path, from `at` on? A motion may pass several points.
        limit = (rapid_mm if motion.rapid else tolerance_mm) + slack
        reached = at
        worst = 0.0
        place = max(at, 0)
        for p, q in tips:
            best, best_i = min((distance_to(p, path.points[max(i - 1, 0)][0], path.points[i][0]), i)
                               for i in range(place, min(place + 4, len(path.points))))
            if best <= limit:
                # The earliest piece that holds it: a fold of the path must not be skipped.
                for i in range(place, best_i):
                    if distance_to(p, path.points[max(i - 1, 0)][0], path.points[i][0]) <= limit:
                        best_i = i
                        break
                place = best_i
            worst = max(worst, best)
        if worst <= limit:
            # Rapids on rapids, feeds on feeds: judged where the middle of the block is.
            middle = tips[samples // 2][0]
            pieces = [i for i in range(max(at, 0), min(max(at, 0) + 5, len(path.points)))
                      if distance_to(middle, path.points[max(i - 1, 0)][0], path.points[i][0]) <= limit]
            way = length(sub(tips[-1][0], tips[0][0]))
            if motion.rapid and way > 2 * limit and pieces and not any(path.rapid[i] for i in pieces) and not straight_z:
                say(motion, "a rapid where the CL file cuts")
            reached = place
        elif straight_z:
            # To or from a point of the path along the tool, or out and back where the rotary axes turn.
            ends = [min(length(sub(t[0], path.points[i][0])) for i in range(max(at, 0), min(max(at, 0) + 4, len(path.points))))
                    for t in (tips[0], tips[-1])]
            line = [min(_off_line(t[0], path.points[i]) for i in range(max(at, 0), min(max(at, 0) + 4, len(path.points))))
                    for t in (tips[0], tips[-1])]
            if max(line) > rapid_mm + slack:
                say(motion, f"Z alone moves {max(line):.3f} mm beside the path")
            if ends[1] <= limit:
                reached = next(i for i in range(max(at, 0), min(max(at, 0) + 4, len(path.points)))
                               if length(sub(tips[-1][0], path.points[i][0])) <= limit)
        else:
            what = "rapid" if motion.rapid else "feed"
            say(motion, f"a {what} of {names} goes {worst:.3f} mm beside the path below the safe height"
                        + (", rotary axes turn" if rotary_moves else ""))
        # A point is reached when a block ends at it.
        for i in range(reached, min(reached + 3, len(path.points))):
            if i > reached and motion.rapid and not path.rapid[i]:
                break  # a point that is cut lies near: no rapid goes there
            if i >= 0 and length(sub(tips[-1][0], path.points[i][0])) <= limit:
                reached = i
        at = max(at, reached)
    if at < len(path.points) - 1:
        findings.append(f"the program ends at CL point {at + 1} of {len(path.points)} (CL line {path.line[at]})")
    return findings


def _off_line(p, point):
    """Distance from the line through a CL point along its tool axis."""
    d = sub(p, point[0])
    return length(sub(d, scale(point[1], dot(d, point[1]))))


def again(program, base, rng, given):
    """The program that was made, read as a path (`--from`) and posted for another control, on the same machine or on another one: twice the tolerance
    off the CL path at most, once for each time."""
    control, kind, kinds, tools, rtcp, tolerance = given
    to_control = rng.choice(CONTROLS)
    possible = [k for k in sorted(kinds) if (to_control, k) != ("heidenhain_tnc640", "spindle_words")]
    to_kind = kind if kind in possible and not rtcp and rng.random() < 0.5 else rng.choice(possible)
    text = kinds[to_kind]
    m = Machine(text)
    to_machine, out = base.with_suffix(".2.toml"), base.with_suffix(".2.nc")
    to_machine.write_text(text)
    out.unlink(missing_ok=True)
    lengths = base.with_suffix(".csv")
    lengths.write_text("tool,length_mm\n" + "".join(f"{t},{mm}\n" for t, mm in tools.items()))
    done = subprocess.run([program, "-q", "post", str(base.with_suffix(".nc")), "--from", control, "--from-machine", str(base.with_suffix(".toml")),
                           "-m", str(to_machine), "-c", to_control, "-o", str(out), "--tolerance-mm", str(tolerance), "--axis-tolerance-deg", "1",
                           "--tools", str(lengths)], capture_output=True, text=True)
    label = f" and then {to_control}, {to_kind}"
    if done.returncode != 0:
        assert not out.exists(), f"{base}: exit code {done.returncode} and there is a program"
        return label, None, None, done.stderr.strip().splitlines()[-1] if done.stderr.strip() else "no message"
    return label, m, control_for(to_control, m, tools).run(out.read_text()), None


def differences(first, second):
    """Two programs, as their controls run them: axis positions, tool, feed, spindle, coolant, offset and length of every motion."""
    if len(first) != len(second):
        return [f"{len(first)} motions become {len(second)}"]
    out = []
    for a, b in zip(first, second):
        off = max(((abs(a.end[n] - b.end[n]), n) for n in a.end if a.end[n] is not None and b.end[n] is not None), default=(0.0, ""))
        if off[0] > 1e-9 or any((a.end[n] is None) != (b.end[n] is None) for n in a.end):
            out.append(f"NC line {a.line} and {b.line}: {off[1]} differs by {off[0]:.6f}")
        elif (a.rapid, a.tcp, a.tool, a.state) != (b.rapid, b.tcp, b.tool, b.state):
            out.append(f"NC line {a.line} and {b.line}: {(a.rapid, a.tcp, a.tool, a.state)} becomes {(b.rapid, b.tcp, b.tool, b.state)}")
    return out


def same_again(program, base, given, motions):
    """The program that was made, read as a path for its own machine and control: the same motions, to the digit. Points that were inserted may lie on
    both sides of the path: nothing is put between them at four times the tolerance. (A rapid that went over the safe height because of its line may go
    straight at three times the tolerance of rapids: then it is asked for again at once that.)"""
    control, tools, rtcp, tolerance = given
    out = base.with_suffix(".2.nc")
    out.unlink(missing_ok=True)
    lengths = base.with_suffix(".csv")
    lengths.write_text("tool,length_mm\n" + "".join(f"{t},{mm}\n" for t, mm in tools.items()))
    findings = []
    for rapid in (3 * RAPID_MM, RAPID_MM):
        done = subprocess.run([program, "-q", "post", str(base.with_suffix(".nc")), "--from", control, "-m", str(base.with_suffix(".toml")), "-c", control,
                               "-o", str(out), "--tolerance-mm", str(round(4 * tolerance, 6)), "--rapid-tolerance-mm", str(rapid), "--axis-tolerance-deg", "4",
                               "--tools", str(lengths)] + (["--rtcp"] if rtcp else []), capture_output=True, text=True)
        if done.returncode != 0:
            assert not out.exists(), f"{base}: exit code {done.returncode} and there is a program"
            return None, done.stderr.strip().splitlines()[-1] if done.stderr.strip() else "no message"
        m = Machine(base.with_suffix(".toml").read_text())
        findings = differences(motions, control_for(control, m, tools).run(out.read_text()))
        if not findings:
            break
    return findings, None


def one(program, folder, rng, number, extra, mode):
    control = rng.choice(CONTROLS)
    kinds = machines(rng)
    # A TOOL CALL adds the length by itself: words of the spindle's point are nothing for that control.
    kind = rng.choice([k for k in sorted(kinds) if (control, k) != ("heidenhain_tnc640", "spindle_words")])
    cl, path, tools = random_part(rng, control)
    rtcp = control in ("fanuc_30i", "haas_ngc", "siemens_840d_sl", "heidenhain_tnc640") and kind != "spindle_words" and rng.random() < 0.25
    tolerance = rng.choice((0.005, 0.01, 0.05))
    base = folder / f"case_{number}"
    text = kinds[kind]
    m = Machine(text)
    if rtcp:  # words are coordinates of the part: the offset is where its zero is
        text = re.sub(r"work_offset_mm = .*", f"work_offset_mm = {list(m.zero)}", text)
        m = Machine(text)
    base.with_suffix(".toml").write_text(text)
    base.with_suffix(".cls").write_text(cl)
    nc = base.with_suffix(".nc")
    nc.unlink(missing_ok=True)
    command = [program, "-q", "post", str(base.with_suffix(".cls")), "-m", str(base.with_suffix(".toml")), "-c", control, "-o", str(nc),
               "--tolerance-mm", str(tolerance), "--axis-tolerance-deg", "1"] + (["--rtcp"] if rtcp else []) + extra
    done = subprocess.run(command, capture_output=True, text=True)
    label = f"case {number}: {control}, {kind}{', tool-centre-point control' if rtcp else ''}"
    if done.returncode != 0:
        assert not nc.exists(), f"{label}: exit code {done.returncode} and there is a program"
        return label, "refused", [done.stderr.strip().splitlines()[-1] if done.stderr.strip() else "no message"]
    try:
        walker = control_for(control, m, tools)
        motions = walker.run(nc.read_text())
        findings = judge(m, motions, path, tolerance)
        if mode == "identity" and not findings:
            findings, refused = same_again(program, base, (control, tools, rtcp, tolerance), motions)
            label += " and the same again"
            if refused:
                return label, "refused", [refused]
        if mode == "again" and not findings:
            more, m, motions, refused = again(program, base, rng, (control, kind, kinds, tools, rtcp, tolerance))
            label += more
            if refused:
                return label, "refused", [refused]
            findings = judge(m, motions, path, 2 * tolerance, 2 * RAPID_MM)
    except Refused as why:
        findings = [str(why)]
    return label, "wrong" if findings else "right", findings


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("folder")
    parser.add_argument("count", nargs="?", type=int, default=int(os.environ.get("TRUNNION_WALKS", "200")))
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--first", type=int, default=0)
    parser.add_argument("--most-refused", type=float, default=0.02, help="share of files that may be refused")
    parser.add_argument("--again", action="store_const", const="again", dest="mode",
                        help="each program is read as a path, posted for another control or machine, and walked, too")
    parser.add_argument("--identity", action="store_const", const="identity", dest="mode",
                        help="each program is read as a path for its own machine and control: the same motions must come out")
    args, extra = parser.parse_known_args()
    folder = Path(args.folder)
    folder.mkdir(parents=True, exist_ok=True)
    count = {"right": 0, "wrong": 0, "refused": 0}
    shown = 0
    for number in range(args.first, args.first + args.count):
        label, result, texts = one(args.program, folder, random.Random(f"{args.seed}/{number}"), number, extra, args.mode)
        count[result] += 1
        if result != "right" and shown < 40:
            shown += 1
            print(f"{label}: {result}: {texts[0]}" + (f" (and {len(texts) - 1} more)" if len(texts) > 1 else ""))
        if result == "right":
            for end in (".toml", ".cls", ".nc", ".2.toml", ".2.nc", ".csv"):
                (folder / f"case_{number}{end}").unlink(missing_ok=True)
    print(f"{args.count} files: {count['right']} right, {count['wrong']} wrong, {count['refused']} refused")
    if count["wrong"] or count["refused"] > args.most_refused * args.count:
        sys.exit(1)


if __name__ == "__main__":
    main()
