#!/usr/bin/python3
"""servo.py PROGRAM FOLDER [COUNT] [--seed N] [--case K] [--wrapped WORDS]: hidden servos behind a control, found from traces and taken out of the words.

Each case posts a random five-axis path, runs the program on the control of control.py with servos that nobody told of (lags of single axes, gains of all
axes that do not match, spikes after reversal, nothing), makes measurements of the trace, lets `model improve` name the effects, posts again with that
model, and runs the new program behind the same servos. Said are: what was named, and the largest tip error before and after, beside that of the first
program without servos.
"""
import argparse
import json
import subprocess
import sys
from pathlib import Path

try:
    import numpy as np
except ImportError:
    print("skipped: numpy is not installed")
    sys.exit(77)

here = Path(__file__).resolve().parent
root = here.parent.parent.parent
sys.path.insert(0, str(root / "tests/walk"))
sys.path.insert(0, str(here))
import control  # noqa: E402
from campaign import MACHINE, random_cl  # noqa: E402
from chain import Machine  # noqa: E402

# The control slows down for its accelerations everywhere, and stops at corners of the axes' way that are sharper than this.
STOPS_AT_DEG = 30.0
LENGTH = 150.0
ROWS = 500  # of a trace, for the diagnosis
KINDS = ["lag", "mismatch", "spike", "none"]


def hidden_servo(rng, kind):
    """Lags (ms), spikes (mm or deg), and the effects that are to be named for them."""
    lag, spike = np.zeros(5), np.zeros(5)
    if kind == "lag":
        who = rng.choice(5, size=int(rng.integers(1, 3)), replace=False)
        lag[who] = rng.uniform(1, 10, len(who))
    elif kind == "mismatch":
        # One gain for all but one or two axes, which have gains of their own.
        lag[:] = rng.uniform(1, 6)
        who = rng.choice(5, size=int(rng.integers(1, 3)), replace=False)
        lag[who] += rng.uniform(1, 4, len(who))
    elif kind == "spike":
        spike[rng.integers(0, 5)] = rng.uniform(0.005, 0.03)
    common = np.median(lag)
    names = {f"servo_lag:{control.AXES[i]}" for i in range(5) if abs(lag[i] - common) > 1e-9}
    names |= {f"reversal_spike:{control.AXES[i]}" for i in range(5) if spike[i]}
    return lag, spike, names


def tip_errors(chain, command, actual, points):
    """Distances of the tip from its path while it cuts; not within 40 ms of a rapid, on which a machine that follows late is still."""
    inner = np.convolve(~np.concatenate([[False], command.cut, [False]]), np.ones(81), "same")[1:-1] < 0.5
    p, _ = chain.tool(actual[inner], LENGTH)
    off = np.min([control.off_polyline(p, pass_points) for pass_points in points], axis=0)
    return np.where(off < 20, off, 0)


def run_control(nc):
    return control.Command(control.read_program(nc.read_text()), corner_deg=STOPS_AT_DEG)


def reverses(command, axis):
    """How often an axis turns round on a cut."""
    step = np.diff(command.q[:, axis])
    sign = np.sign(step[(np.abs(step) > 1e-9) & command.cut[1:]])
    return int(np.count_nonzero(np.diff(sign)))


class Case:
    def __init__(self, program, folder, seed, k):
        self.program, self.folder, self.k = program, folder, k
        self.rng = np.random.default_rng([seed, k])
        folder.mkdir(parents=True, exist_ok=True)
        self.cl = folder / "part.cls"
        text, self.points = random_cl(self.rng)
        self.cl.write_text(text)
        self.chain = control.Chain(Machine((root / f"postconfigs/machines/{MACHINE}.toml").read_text()))

    def trunnion(self, *words):
        return subprocess.run([self.program, "-q", *map(str, words)], capture_output=True, text=True)

    def post(self, name, *more):
        nc = self.folder / name
        nc.unlink(missing_ok=True)
        done = self.trunnion("post", self.cl, "-m", MACHINE, "-c", "linuxcnc", "-o", nc, *more)
        return (nc if nc.exists() else None), done

    def name_effects(self, nc, command, actual):
        """What `model improve` adds to a model that knows nothing, and the file of the model that comes out."""
        csv, rows, none, out = (self.folder / n for n in ("trace.csv", "rows.csv", "none.toml", "improved"))
        times = 5.0 + command.t
        noisy = actual + self.rng.normal(0, 0.0001, actual.shape)
        np.savetxt(csv, np.column_stack([times, noisy]), fmt="%.6f", delimiter=",", header="time_s,X_mm,Y_mm,Z_mm,A_deg,C_deg", comments="")
        done = self.trunnion("measurements", "import", "trace", csv, "-m", MACHINE, "-c", "linuxcnc", "--program", nc, "--against", self.cl, "--rows", ROWS, "-o", rows)
        if done.returncode:
            return None, None, f"not imported: {done.stderr[-300:]}"
        none.write_text('[model]\nname = "nothing"\n')
        said = self.folder / "improve.json"
        machine = root / f"postconfigs/machines/{MACHINE}.toml"
        done = self.trunnion("model", "improve", rows, "-m", machine, "--model", none, "-o", out, "--json", said)
        if not said.exists():
            return None, None, f"not diagnosed: {done.stderr[-300:]}"
        return json.loads(said.read_text()), out, ""

    def run(self, kind):
        result = {"case": self.k, "kind": kind}
        nc, done = self.post("plain.ngc")
        if nc is None:
            return result | {"result": "not posted", "why": done.stderr[-300:]}
        command = run_control(nc)
        lag, spike, names = hidden_servo(self.rng, kind)
        if kind == "spike":
            # An axis that turns round, or there is nothing to find.
            turning = [i for i in range(5) if reverses(command, i) >= 4]
            size = spike.max()
            spike[:] = 0
            spike[self.rng.choice(turning)] = size
            names = {f"reversal_spike:{control.AXES[int(np.argmax(spike))]}"}
        actual = control.behind_servos(command.q, 0.001, lag, spike)
        clean = tip_errors(self.chain, command, command.q, self.points).max()
        before = tip_errors(self.chain, command, actual, self.points).max()
        result |= {"lag_ms": lag.round(3).tolist(), "spike": spike.round(4).tolist(), "hidden": sorted(names), "clean_mm": clean, "before_mm": before,
                   "seconds": command.duration}
        said, out, why = self.name_effects(nc, command, actual)
        if said is None:
            return result | {"result": why}
        return result | {"said": said, "out": str(out)}


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("folder", type=Path)
    parser.add_argument("count", type=int, nargs="?", default=20)
    parser.add_argument("--seed", type=int, default=282)
    parser.add_argument("--case", type=int)
    args = parser.parse_args()
    for k in [args.case] if args.case is not None else range(args.count):
        print(json.dumps(Case(args.program, args.folder / f"servo_{k}", args.seed, k).run(KINDS[k % len(KINDS)])), flush=True)


if __name__ == "__main__":
    main()
