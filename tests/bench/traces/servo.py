#!/usr/bin/python3
"""servo.py PROGRAM FOLDER [COUNT] [--seed N] [--case K] [--acceleration MM_S2]: hidden servos behind a control, found from traces and taken out of the words.

Each case posts a random five-axis path, runs the program on the control of control.py with servos that nobody told of (lags of single axes, gains of all
axes that do not match, spikes after reversal, nothing), makes measurements of the trace and a model with what all axes are late alike, lets
`model improve` name the effects, posts again with the model that comes out, and runs the new program behind the same servos. Said are: what was named (the
effects of that model; all that any step took for possible beside them), how honest the readings' uncertainties are, and the largest tip error before and
after, beside that of the first program without servos.
"""
import argparse
import json
import subprocess
import sys
import tomllib
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
import readings  # noqa: E402
from campaign import MACHINE, random_cl  # noqa: E402
from chain import Machine  # noqa: E402

# The control slows down for its accelerations everywhere, and stops at corners of the axes' way that are sharper than this.
STOPS_AT_DEG = 30.0
LENGTH = 150.0
ROWS = 2500  # of a trace that are read, for the diagnosis
KINDS = ["lag", "mismatch", "spike", "none"]  # in turn


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
        done = self.trunnion("measurements", "import", "trace", csv, "-m", MACHINE, "-c", "linuxcnc", "--program", nc, "--against", self.cl, "--rows", ROWS, "-o", rows, "--model-out", none)
        if done.returncode:
            return None, None, f"not imported: {done.stderr[-300:]}"
        for old in out.glob("*.toml"):
            old.unlink()
        said = self.folder / "improve.json"
        machine = root / f"postconfigs/machines/{MACHINE}.toml"
        done = self.trunnion("model", "improve", rows, "-m", machine, "--model", none, "-o", out, "--json", said)
        if not said.exists():
            return None, None, f"not diagnosed: {done.stderr[-300:]}"
        return json.loads(said.read_text()), out, ""

    def blends(self, nc):
        """Servos that are never late, behind a control that takes the mean of its command: no lag is told."""
        command = control.Command(control.read_program(nc.read_text()), corner_deg=181.0)
        rows = int(self.rng.integers(6, 30))
        actual = control.behind_servos(control.blended(command.q, rows), 0.001, np.zeros(5), np.zeros(5))
        self.name_effects(nc, command, actual)
        first = self.folder / "none.toml"
        told = tomllib.loads(first.read_text())["model"].get("lag_of_all_axes_ms", 0.0) if first.exists() else None
        return {"blend_ms": rows, "lag_of_all_ms": told, "right": told == 0.0}

    def run(self, kind):
        result = {"case": self.k, "kind": kind}
        nc, done = self.post("plain.ngc")
        if nc is None:
            return result | {"result": "not posted", "why": done.stderr[-300:]}
        command = run_control(nc)
        lag, spike, names = hidden_servo(self.rng, kind)
        if kind == "blend":
            return result | self.blends(nc)
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
        model = sorted(out.glob("*.toml"))
        named = sorted(effect["id"] for effect in tomllib.loads(model[-1].read_text()).get("effect", [])) if model else []
        possible = {effect for step in said["steps"] for effect in step["effects"]} - set(named)
        z = readings.normalized(self.folder / "rows.csv", self.chain, LENGTH, lag, spike)
        result |= {"lag_of_all_ms": tomllib.loads((self.folder / "none.toml").read_text())["model"].get("lag_of_all_axes_ms", 0.0), "named": named, "right": set(named) == names, "possible": sorted(possible), "verdicts": [step["verdict"] for step in said["steps"]],
                   "z_rms": float(np.sqrt(np.mean(z**2))), "z_most": float(np.abs(z).max())}
        if not lag.any() or not any(effect.startswith("servo_lag:") for effect in named) or not model:
            return result | {"result": "done"}
        nc, done = self.post("led.ngc", "--model", model[-1])
        if nc is None:
            result["not_within"] = done.stderr[-300:]
            nc, done = self.post("led.ngc", "--model", model[-1], "--accept-deviation")
        if nc is None:
            return result | {"result": "not posted with the model", "why": done.stderr[-300:]}
        command = run_control(nc)
        after = tip_errors(self.chain, command, control.behind_servos(command.q, 0.001, lag, spike), self.points).max()
        # What no lead takes out: the delay that all axes share, alone.
        shared = np.full(5, np.median(lag))
        plain = run_control(self.folder / "plain.ngc")
        alone = tip_errors(self.chain, plain, control.behind_servos(plain.q, 0.001, shared), self.points).max()
        return result | {"result": "done", "after_mm": after, "shared_alone_mm": alone, "seconds_after": command.duration, "ratio": after / clean,
                         "ratio_shared": after / alone}


def summary(results):
    out = {}
    for kind in KINDS:
        of = [r for r in results if r["kind"] == kind and "named" in r]
        ratios = sorted(r["ratio"] for r in of if "ratio" in r)
        shared = sorted(r["ratio_shared"] for r in of if "ratio" in r)
        slower = sorted(r["seconds_after"] / r["seconds"] for r in of if "ratio" in r)
        falls = sorted(r["after_mm"] / r["before_mm"] for r in of if "ratio" in r)
        told = {"cases": len(of), "none_possible_beside": sum(not r["possible"] for r in of), "z_rms_most": round(max((r["z_rms"] for r in of), default=0.0), 2), "named_right": sum(r["right"] for r in of), "hidden_among_named": sum(set(r["hidden"]) <= set(r["named"]) for r in of)}
        for key, values in (("ratio", ratios), ("ratio_to_shared_delay", shared), ("time", slower), ("after_to_before", falls)):
            if values:
                told[key] = {"median": round(float(np.median(values)), 3), "at_90": round(values[int(0.9 * (len(values) - 1))], 3), "largest": round(values[-1], 3)}
        if ratios:
            told["within_1.3"] = int(sum(r <= 1.3 for r in ratios))
        out[kind] = told
    out["others"] = [r for r in results if "named" not in r]
    return out


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("folder", type=Path)
    parser.add_argument("count", type=int, nargs="?", default=20)
    parser.add_argument("--seed", type=int, default=282)
    parser.add_argument("--case", type=int)
    parser.add_argument("--blend", action="store_true", help="controls that blend over 6 to 29 ms, without late servos: none must be told")
    parser.add_argument("--acceleration", type=float, default=control.ACCELERATION, help="of the control, mm/s2")
    args = parser.parse_args()
    control.ACCELERATION = args.acceleration
    results = []
    for k in [args.case] if args.case is not None else range(args.count):
        results.append(Case(args.program, args.folder / f"servo_{k}", args.seed, k).run("blend" if args.blend else KINDS[k % len(KINDS)]))
        print(json.dumps(results[-1]), flush=True)
    if args.blend:
        wrong = sum(not r.get("right") for r in results)
        print(json.dumps({"cases": len(results), "a_lag_is_told": wrong}))
        sys.exit(1 if wrong else 0)
    print(json.dumps(summary(results)))


if __name__ == "__main__":
    main()
