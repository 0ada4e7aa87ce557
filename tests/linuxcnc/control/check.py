#!/usr/bin/env python3
"""check.py PROGRAM FOLDER [CASE ...]: LinuxCNC runs what PROGRAM (trunnion) has posted, and the tool is followed on the CL path.

The tool table and G54 are set as the header of the program says. The joints are sampled every millisecond; the tip in the part follows by the chain of
tests/walk, written apart from the program. Below the safe height the tip must be on the path, within the tolerance where it cuts, within 1 mm at rapids,
or on the way along the tool axis to or from a point of the path; each point of the path must be passed. Exit code 77: LinuxCNC is not installed.
"""
import json
import re
import shutil
import subprocess
import sys
from pathlib import Path

here = Path(__file__).resolve().parent
sys.path.insert(0, str(here.parent.parent / "walk"))
from chain import Machine, add, dot, length, scale, sub  # noqa: E402
sys.path.insert(0, str(here))
from on_control import ran  # noqa: E402

RAPID_MM = 1.0


def read_cl(text, tool=None):
    """Points, axes, whether the motion to it is a rapid, and the tool: GOTO, RAPID and LOADTL are all that these files use."""
    points, rapid, axis = [], False, (0.0, 0.0, 1.0)
    for line in text.splitlines():
        word, _, rest = line.strip().partition("/")
        if word == "LOADTL":
            tool = int(rest.split(",")[0])
        elif word == "RAPID":
            rapid = True
        elif word == "GOTO":
            v = [float(f) for f in rest.split(",")]
            if len(v) == 6:
                axis = scale(tuple(v[3:]), 1.0 / length(tuple(v[3:])))
            points.append((tuple(v[:3]), axis, rapid, tool))
            rapid = False
    return points


def header_offset(text):
    """The place of G54 that the header asks for, and the tools with their lengths."""
    found = re.search(r"G54\b.*?X *(-?[\d.]+) *Y *(-?[\d.]+) *Z *(-?[\d.]+)", text)
    return [float(v) for v in found.groups()] if found else None


def to_segment(p, a, b):
    ab = sub(b, a)
    l2 = dot(ab, ab)
    t = 0.0 if l2 == 0 else min(max(dot(sub(p, a), ab) / l2, 0.0), 1.0)
    return length(sub(p, add(a, scale(ab, t))))


def off_line(p, point):
    d = sub(p, point[0])
    return length(sub(d, scale(point[1], dot(d, point[1]))))


def follow(machine, names, tools, points, trace, tolerance_mm):
    """Largest distance of the tip from the path where it cuts and at rapids, and the points that it does not pass."""
    passed = [1e9] * len(points)
    worst = {"cut": 0.0, "rapid": 0.0}
    findings = []
    at = 0
    last = None
    for line in trace.splitlines():
        fields = line.split()
        if len(fields) < len(names) + 3 or fields[0] == "overrun":
            findings.append("the sampler lost lines")
            continue
        q = {n: float(v) for n, v in zip(names, fields[2:2 + len(names)])}
        tool = int(fields[2 + len(names)])
        if tool not in tools or abs(q["Z"] - machine.safe) < 1e-4 or q == last:
            continue
        last = q
        p = machine.tip_in_part(q, tools[tool])
        window = range(max(at - 2, 0), min(at + 60, len(points)))
        best = None
        for i in window:
            # The next pieces first: paths lie side by side, and a rapid's millimetre reaches over to another.
            if best and best[0] <= 1.0 and i > at + 3:
                break
            if points[i][3] != tool:
                continue
            begin = points[i - 1][0] if i > 0 and points[i - 1][3] == tool else points[i][0]
            d = to_segment(p, begin, points[i][0])
            limit = RAPID_MM if points[i][2] else tolerance_mm
            if best is None or d / limit < best[0]:
                best = (d / limit, d, i)
            passed[i] = min(passed[i], length(sub(p, points[i][0])))
        if best and best[0] <= 1.0:
            kind = "rapid" if points[best[2]][2] else "cut"
            worst[kind] = max(worst[kind], best[1])
            if best[2] > at and passed[best[2] - 1] < 1.0:
                at = best[2]
        elif not any(off_line(p, points[i]) <= RAPID_MM for i in window if points[i][3] == tool):
            findings.append(f"sample {fields[0]}: the tip is {best[1] if best else float('nan'):.3f} mm beside the path, tool {tool}")
            if len(findings) > 5:
                break
    # A sample a millisecond apart need not hit the point itself: at the feed it is this far apart at most.
    missed = [i for i, d in enumerate(passed) if d > 0.2]
    if missed:
        findings.append(f"{len(missed)} points are not passed, the first is number {missed[0]}: {passed[missed[0]]:.3f} mm")
    return worst, findings


PART = "tests/cases/controllers/part.cls"
CASES = {
    # name: CL file, machine, tolerance, options of post, its own five-axis kinematics, seconds at most
    "identity": (PART, "trunnion_offset", 0.01, [], False, 90),
    "switched to identity": (PART, "xyzac_trt", 0.01, [], True, 90),
    "tool-centre-point control": (PART, "xyzac_trt", 0.01, ["--rtcp"], True, 90),
}
# Samples as a whole, on request: minutes of wall time each.
SAMPLES = {
    "table 3.2": ("samples/01_impeller/table_3_2.cls", "trunnion_offset", 0.01, ["--tool", "1"], False, 120),
    "impeller": ("samples/01_impeller/impeller.cls", "trunnion_offset", 0.01, [], False, 900),
    "impeller, tool-centre-point control": ("samples/01_impeller/impeller.cls", "xyzac_trt", 0.01, ["--rtcp"], True, 900),
    "blades": ("samples/03_thermal_impellers/blades.cls", "trunnion_offset", 0.01, [], False, 900),
    "blades, shifted work offset": ("samples/03_thermal_impellers/blades.cls", "trunnion_offset", 0.01,
                                    ["--offsets", "samples/03_thermal_impellers/blade_offsets.csv", "--thermal-output", "work-offset"], False, 900),
    "compensated impeller": ("samples/01_impeller/impeller.cls", "samples/05_compensated_impeller/machine.toml", 0.005,
                             ["--model", "samples/05_compensated_impeller/truth.toml"], False, 900),
}
# Programs that correct errors of the machine leave the path of the machine without errors by what they correct, mm.
CORRECTED_MM = {"blades, shifted work offset": 0.1, "compensated impeller": 0.15}


def run(program, folder, name):
    root = here.parent.parent.parent
    cl, machine_name, tolerance, options, trt, seconds = (CASES | SAMPLES)[name]
    folder = folder / name.replace(" ", "_")
    folder.mkdir(parents=True, exist_ok=True)
    source = root / cl
    text = source.read_text()
    points = read_cl(text, int(options[1]) if "--tool" in options else None)
    lengths = {t: 80.0 + 11.0 * i for i, t in enumerate(sorted({p[3] for p in points}))}
    (folder / "tools.csv").write_text("tool,length_mm\n" + "".join(f"{t},{l}\n" for t, l in lengths.items()))
    (folder / "tools.json").write_text(json.dumps(lengths))
    machine_file = root / machine_name if "/" in machine_name else root / "postconfigs/machines" / f"{machine_name}.toml"
    nc = folder / "out.ngc"
    subprocess.run([program, "-q", "post", str(source), "-m", str(machine_file), "-c", "linuxcnc", "-o", str(nc), "--tolerance-mm", str(tolerance),
                    "--tools", str(folder / "tools.csv"), *options], check=True, cwd=root)
    machine = Machine(machine_file.read_text())
    offset = header_offset(nc.read_text())
    assert offset is not None, f"{name}: the header does not say where G54 must stand"
    result = ran(name, nc, machine_file, folder, seconds, "--offset", ",".join(str(v) for v in offset), *(["--trt"] if trt else []))
    names = list(machine.axes)
    worst, findings = follow(machine, names, lengths, points, (folder / "run/trace.txt").read_text(), tolerance + CORRECTED_MM.get(name, 0.0))
    print(f"{name}: {result['seconds']:.1f} s, tip within {1000 * worst['cut']:.2f} um where it cuts, {worst['rapid']:.3f} mm at rapids")
    assert not findings, f"{name}: {findings}"


def main():
    if not shutil.which("linuxcnc"):
        print("skipped: linuxcnc is not installed")
        sys.exit(77)
    for name in sys.argv[3:] or CASES:
        run(sys.argv[1], Path(sys.argv[2]), name)


if __name__ == "__main__":
    main()
