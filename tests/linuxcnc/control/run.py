#!/usr/bin/python3
"""run.py PROGRAM.nc MACHINE.toml TOOLS.json [--offset X,Y,Z] [--folder F] [--trt] [--truth T.json] [--hal H] [--seconds N]: LinuxCNC itself, headless, runs an NC program.

Task, planner, motion and HAL of the installed LinuxCNC on a machine with the travel of the machine file; tool table and G54 as given (TOOLS: {"4":
140.0}, mm). Prints as JSON how it ended, the messages of the control and its seconds. FOLDER/trace.txt has a line a millisecond: its number, whether the
control is in position, the joints (mm, degrees), the tool.
--hal: more lines of HAL, before the program begins; X, Y and Z then take external offsets (a tenth of their speed).
With --truth a machine stands behind the control that the machine file does not have (truth.py, hidden.py): it says when the stylus touches the ball.
Exit code 77: LinuxCNC is not installed. Only one at a time on a machine: a lock keeps others waiting.
"""
import argparse
import fcntl
import json
import os
import shutil
import signal
import subprocess
import sys
import tempfile
import time
import tomllib
from pathlib import Path

UI = '''#!/usr/bin/python3
import linuxcnc, json, sys, time
c, s, e = linuxcnc.command(), linuxcnc.stat(), linuxcnc.error_channel()
limit = float(open("seconds").read())
messages = []
def poll():
    s.poll()
    while True:
        m = e.poll()
        if not m: break
        messages.append([m[0], m[1]])
def until(test, seconds, what):
    end = time.time() + seconds
    while time.time() < end:
        poll()
        if test(): return True
        time.sleep(0.002)
    messages.append([0, "the test bench waited in vain for: " + what])
    return False
ok = True
c.state(linuxcnc.STATE_ESTOP_RESET); c.wait_complete(5)
c.state(linuxcnc.STATE_ON); c.wait_complete(5)
joints = s.joints if s.poll() is None else 5
c.mode(linuxcnc.MODE_MANUAL); c.wait_complete(5)
c.teleop_enable(0); c.wait_complete(5)
c.home(-1)
ok = until(lambda: all(s.homed[:joints]), 20, "home") and ok
c.mode(linuxcnc.MODE_AUTO); c.wait_complete(5)
c.program_open("program.ngc"); c.wait_complete(5)
start = time.time()
c.auto(linuxcnc.AUTO_RUN, 0)
until(lambda: s.interp_state != linuxcnc.INTERP_IDLE, 5, "the start")
lines = []
def ended():
    if s.paused or s.interp_state == linuxcnc.INTERP_PAUSED:
        c.auto(linuxcnc.AUTO_RESUME)  # the operator presses start at M0 and M1
    return s.interp_state == linuxcnc.INTERP_IDLE and s.inpos and s.queue == 0
ok = until(ended, limit, "the end of the program") and ok
seconds = time.time() - start
poll()
json.dump({"ended": bool(ok), "messages": messages, "seconds": seconds, "tool": s.tool_in_spindle, "joints": list(s.joint_position[:joints]),
           "g5x": list(s.g5x_offset), "tool_offset": list(s.tool_offset)}, open("result.json", "w"))
'''


def ini_of(machine, trt, folder, offsets=False):
    axes = [a["name"] for a in machine["axis"]]
    letters = "".join(axes)
    kinematics = f"xyzac-trt-kins coordinates={letters}" if trt else f"trivkins coordinates={letters}"
    lines = ["[EMC]", "MACHINE = test", "VERSION = 1.1", "[DISPLAY]", f"DISPLAY = {folder}/ui.py", "CYCLE_TIME = 0.1", "[TASK]", "TASK = milltask",
             "CYCLE_TIME = 0.001", "[RS274NGC]", "PARAMETER_FILE = linuxcnc.var"]
    if trt:
        lines += ["SUBROUTINE_PATH = .", "HAL_PIN_VARS = 1", "REMAP=M428 modalgroup=10 ngc=428remap", "REMAP=M429 modalgroup=10 ngc=429remap"]
    lines += ["[EMCMOT]", "EMCMOT = motmod", "COMM_TIMEOUT = 4.0", "BASE_PERIOD = 0", "SERVO_PERIOD = 1000000", "[EMCIO]", "EMCIO = io",
              "CYCLE_TIME = 0.1", "TOOL_TABLE = tool.tbl", "[HAL]", "HALFILE = machine.hal", "[KINS]", f"KINEMATICS = {kinematics}",
              f"JOINTS = {len(axes)}", "[TRAJ]", f"COORDINATES = {letters}", "LINEAR_UNITS = mm", "ANGULAR_UNITS = degree",
              "DEFAULT_LINEAR_VELOCITY = 100", "MAX_LINEAR_VELOCITY = 1000", "NO_FORCE_HOMING = 1"]
    for i, a in enumerate(machine["axis"]):
        rotary = a["type"] == "rotary"
        unit = "deg" if rotary else "mm"
        # Its own sums end up to 4e-15 beyond a limit that a word names.
        low, high = (-1e9, 1e9) if a.get("cyclic") else (a[f"min_{unit}"] - 1e-6, a[f"max_{unit}"] + 1e-6)
        speed = a.get(f"rapid_{unit}_min", 10000) / 60.0
        home = min(max(0.0, low), high)
        limits = [f"MIN_LIMIT = {low}", f"MAX_LIMIT = {high}", f"MAX_VELOCITY = {speed}", f"MAX_ACCELERATION = {speed * 8}"]
        # Of an axis letter: what tool-centre-point kinematics make of its words need not be the joint's travel.
        wide = [f"MIN_LIMIT = {-1e9 if trt else low}", f"MAX_LIMIT = {1e9 if trt else high}", *limits[2:]]
        lines += [f"[AXIS_{a['name']}]", *wide] + (["OFFSET_AV_RATIO = 0.1"] if offsets and not rotary else [])
        lines += [f"[JOINT_{i}]", f"TYPE = {'ANGULAR' if rotary else 'LINEAR'}", *limits, f"HOME = {home}", f"HOME_OFFSET = {home}", "HOME_SEQUENCE = 0",
                  "FERROR = 1000", "MIN_FERROR = 100"]
    return "\n".join(lines) + "\n"


def hal_of(machine, trt, truth=False):
    n = len(machine["axis"])
    out = ["loadrt [KINS]KINEMATICS", "loadrt [EMCMOT]EMCMOT servo_period_nsec=[EMCMOT]SERVO_PERIOD num_joints=[KINS]JOINTS num_dio=1",
           "loadrt sampler depth=60000 cfg=b" + "f" * n + "s", "addf motion-command-handler servo-thread", "addf motion-controller servo-thread",
           "addf sampler.0 servo-thread"]
    for i in range(n):
        out.append(f"net j{i} joint.{i}.motor-pos-cmd => joint.{i}.motor-pos-fb => sampler.0.pin.{i + 1}")
    out += ["net inpos motion.in-position => sampler.0.pin.0",
            f"net tool iocontrol.0.tool-number => sampler.0.pin.{n + 1}",
            "net estop iocontrol.0.user-enable-out => iocontrol.0.emc-enable-in",
            "net tool-prepare iocontrol.0.tool-prepare => iocontrol.0.tool-prepared",
            "net tool-change iocontrol.0.tool-change => iocontrol.0.tool-changed"]
    if trt:
        axes = {a["name"]: a for a in machine["axis"]}
        a, c = axes["A"]["point_mm"], axes["C"]["point_mm"]
        # Its terms: the C axis passes through the rotation point, the A axis beside it by y-offset and z-offset.
        out += [f"setp xyzac-trt-kins.x-rot-point {c[0]}", f"setp xyzac-trt-kins.y-rot-point {c[1]}", f"setp xyzac-trt-kins.z-rot-point {c[2]}",
                f"setp xyzac-trt-kins.y-offset {a[1] - c[1]}", f"setp xyzac-trt-kins.z-offset {a[2] - c[2]}",
                "net tool-offset motion.tooloffset.z => xyzac-trt-kins.tool-offset",
                "net kinstype motion.analog-out-03 => motion.switchkins-type"]
    if truth:
        out.append("loadusr -W ./truth.py")
        out += [f"net j{i} => truth.{a['name'].lower()}" for i, a in enumerate(machine["axis"])]
        out.append("net touched truth.hit => motion.probe-input")
    out.append("loadusr halsampler -t trace.txt")
    return "\n".join(out) + "\n"


REMAPS = {"428remap.ngc": "o<428remap>sub\nM66 E0 L0\nM68 E3 Q0\nM66 E0 L0\no<428remap>endsub\nM2\n",
          "429remap.ngc": "o<429remap>sub\nM66 E0 L0\nM68 E3 Q1\nM66 E0 L0\no<429remap>endsub\nM2\n"}


def alone(args):
    """Task must not read motion's status between motion's taking a touch and its next status: it would read on behind a touch that has not begun, and stop with
    "Queue is not empty after probing" (LinuxCNC issues 263, 662 and 3650, pull request 3971). On one processor on which motion comes first it cannot."""
    return ["taskset", "-c", str(max(os.sched_getaffinity(0)))] if args.truth and os.geteuid() == 0 and shutil.which("taskset") else []


def put_motion_first(process):
    for _ in range(100):
        time.sleep(0.1)
        found = subprocess.run(["pgrep", "-x", "rtapi_app"], capture_output=True, text=True).stdout.split()
        if found or process.poll() is not None:
            break
    for pid in found:
        subprocess.run(["chrt", "-a", "-f", "-p", "50", pid], capture_output=True)


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("machine")
    parser.add_argument("tools")
    parser.add_argument("--offset", default="0,0,0")
    parser.add_argument("--folder")
    parser.add_argument("--trt", action="store_true", help="its xyzac-trt kinematics with M428 and M429, not trivkins")
    parser.add_argument("--truth", help="the machine behind the control (JSON), for probing programs")
    parser.add_argument("--hal", help="a file of more HAL lines")
    parser.add_argument("--seconds", type=float, default=60)
    args = parser.parse_args()
    if not shutil.which("linuxcnc") or not shutil.which("halrun"):
        print("skipped: linuxcnc is not installed")
        sys.exit(77)
    machine = tomllib.loads(Path(args.machine).read_text())
    tools = json.loads(Path(args.tools).read_text())
    folder = Path(args.folder or tempfile.mkdtemp(prefix="linuxcnc_"))
    folder.mkdir(parents=True, exist_ok=True)
    folder = folder.resolve()
    (folder / "ui.py").write_text(UI)
    (folder / "ui.py").chmod(0o755)
    (folder / "seconds").write_text(str(args.seconds))
    (folder / "machine.ini").write_text(ini_of(machine, args.trt, folder, bool(args.hal)))
    (folder / "machine.hal").write_text(hal_of(machine, args.trt, bool(args.truth)) + (Path(args.hal).read_text() if args.hal else ""))
    if args.truth:
        shutil.copy(args.truth, folder / "truth.json")
        for name in ("truth.py", "hidden.py"):
            shutil.copy(Path(__file__).resolve().parent / name, folder / name)
        (folder / "truth.py").chmod(0o755)
    for name, text in REMAPS.items():
        (folder / name).write_text(text)
    (folder / "program.ngc").write_text(Path(args.program).read_text())
    (folder / "tool.tbl").write_text("".join(f"T{t} P{i + 1} Z{l} D10\n" for i, (t, l) in enumerate(tools.items())))
    offset = [float(v) for v in args.offset.split(",")]
    rows = [(5161 + i, 0) for i in range(9)] + [(5181 + i, 0) for i in range(9)] + [(5210, 0)] + [(5211 + i, 0) for i in range(9)] + [(5220, 1)]
    for system in range(9):
        rows += [(5221 + 20 * system + i, offset[i] if system == 0 and i < 3 else 0) for i in range(10)]
    (folder / "linuxcnc.var").write_text("".join(f"{n}\t{v}\n" for n, v in rows))
    for name in ("result.json", "trace.txt"):
        (folder / name).unlink(missing_ok=True)
    environment = {k: v for k, v in os.environ.items() if k != "DISPLAY"}
    # Its realtime part drops to this user, who must be able to write there.
    environment.update(HOME=str(folder), RTAPI_UID="65534", RTAPI_FIFO_PATH=str(folder / "fifo"), PATH="/usr/bin:/bin:/usr/sbin:/sbin")
    folder.chmod(0o777)
    with open("/tmp/trunnion-linuxcnc.lock", "w") as lock:
        fcntl.flock(lock, fcntl.LOCK_EX)
        log = open(folder / "log.txt", "w")
        process = subprocess.Popen([*alone(args), "linuxcnc", str(folder / "machine.ini")], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                                   stdout=log, stderr=log, start_new_session=True)
        if alone(args):
            put_motion_first(process)
        try:
            process.wait(args.seconds + 60)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, signal.SIGKILL)
        finally:
            subprocess.run(["halrun", "-U"], env=environment, cwd=folder, capture_output=True, timeout=60)
    result = folder / "result.json"
    if not result.exists():
        print((folder / "log.txt").read_text()[-1500:], file=sys.stderr)
        for name in ("linuxcnc_print.txt", "linuxcnc_debug.txt"):
            if (folder / name).exists():
                print((folder / name).read_text()[-1500:], file=sys.stderr)
        sys.exit(1)
    print(result.read_text())


if __name__ == "__main__":
    main()
