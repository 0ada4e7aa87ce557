#!/usr/bin/python3
"""campaign.py PROGRAM FOLDER [COUNT] [--seed N] [--case K]: traces of a simulated control with hidden servos, spoiled in every way, held against the program.

Each case posts a random five-axis path, runs the program on the control of control.py, spoils what it recorded (noise, dropped rows, gaps, row times that
jitter, columns whose rows are not of one moment, two clocks, a start before and an end after the program, a part of it, another program, wrong units, signs
or columns) and asks `verify --trace`. Right: the largest deviation within the uncertainty that it states, the hidden servo named; or a refusal where the
rows do not tell. Wrong: anything else. Exit code 1 when one is wrong.
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
from chain import Machine  # noqa: E402
import control  # noqa: E402

MACHINE = "trunnion_offset"


def random_cl(rng):
    """Passes over a dome, the tool leaning against its normal: points, and the text."""
    radius, feed = rng.uniform(20, 60), rng.uniform(600, 4000)
    lean = rng.uniform(0, 0.3)
    lines = ["PARTNO TRACE", "UNITS/MM", "MULTAX/ON", "LOADTL/1", "SPINDL/RPM,9000,CLW", f"FEDRAT/MMPM,{feed:.1f}"]
    points = []
    corner = rng.random() < 0.4
    for k in range(int(rng.integers(2, 5))):
        theta0, phase = rng.uniform(0.25, 0.7), rng.uniform(0, 6.28)
        wave = rng.uniform(0, 0.15)
        turns = rng.uniform(0.15, 0.4)
        pass_points = []
        n = int(rng.integers(20, 60)) if not corner else int(rng.integers(5, 9))
        for i in range(n):
            f = i / (n - 1)
            phi = phase + 6.28 * turns * f
            theta = theta0 + wave * np.sin(9 * f) + (0.12 * (i % 2) if corner else 0.0)
            normal = np.array([np.sin(theta) * np.cos(phi), np.sin(theta) * np.sin(phi), np.cos(theta)])
            side = np.cross(normal, [0, 0, 1.0])
            axis = normal + lean * side / np.linalg.norm(side)
            axis /= np.linalg.norm(axis)
            p = radius * normal - np.array([0, 0, radius]) + np.array([5.0, -3.0, 8.0 * k + 20.0])
            pass_points.append((p, axis))
        above = pass_points[0][0] + 30 * pass_points[0][1]
        lines.append("RAPID")
        for p, u in [(above, pass_points[0][1]), *pass_points, (pass_points[-1][0] + 30 * pass_points[-1][1], pass_points[-1][1])]:
            lines.append("GOTO/" + ",".join(f"{v:.5f}" for v in (*p, *u)))
        points.append(np.array([p for p, _ in pass_points] + [pass_points[-1][0] + 30 * pass_points[-1][1]]))
        points[-1] = np.vstack([above, points[-1]])
    return "\n".join(lines) + "\nFINI\n", points


SPOIL = ["clean", "noise", "dropped", "gaps", "row_jitter", "item_jitter", "two_clocks", "cut", "slow_rate", "other_program", "inches", "swapped", "sign", "milliseconds",
         "words", "shdr"]


def hidden_servo(rng):
    kind = rng.choice(["none", "lag", "spike", "blend", "lag"])
    lag, spike, blend = np.zeros(5), np.zeros(5), 1
    base = rng.uniform(0, 6) if rng.random() < 0.5 else 0.0
    lag[:] = base
    if kind == "lag":
        who = rng.choice(5, size=int(rng.integers(1, 3)), replace=False)
        lag[who] += rng.uniform(1, 10, len(who))
    if kind == "spike":
        spike[rng.integers(0, 5)] = rng.uniform(0.005, 0.03)
    if kind == "blend":
        blend = int(rng.integers(6, 30))
    return kind, lag, spike, blend


def adapter_text(rng, times, recorded, rate_ms):
    """What an MTConnect adapter sends (SHDR): every axis at its own moments, where it has changed."""
    lines = []
    for i, name in enumerate(control.AXES):
        last = None
        for row in np.arange(rng.integers(0, int(rate_ms)), len(times), rate_ms).astype(int):
            value = f"{recorded[row, i]:.6f}"
            if value != last:
                lines.append((times[row], f"{name}act|{value}"))
            last = value
    lines.sort()
    return "* adapterVersion: 2.1\n" + "".join(f"{1000 * t:.3f}|{text}\n" for t, text in lines)


def run_case(program, folder, seed, k):
    rng = np.random.default_rng([seed, k])
    folder.mkdir(parents=True, exist_ok=True)
    cl, nc, csv, out = folder / "part.cls", folder / "part.ngc", folder / "trace.csv", folder / "out.json"
    text, points = random_cl(rng)
    cl.write_text(text)
    made = subprocess.run([program, "-q", "post", str(cl), "-m", MACHINE, "-c", "linuxcnc", "-o", str(nc)], capture_output=True, text=True)
    if made.returncode != 0:
        return {"case": k, "spoil": "-", "servo": "-", "result": "not posted", "why": made.stderr[-300:]}
    machine = Machine((root / f"postconfigs/machines/{MACHINE}.toml").read_text())
    chain = control.Chain(machine)
    blocks = control.read_program(nc.read_text())
    kind, lag, spike, blend = hidden_servo(rng)
    command = control.Command(blocks, corner_deg=181.0 if blend > 1 else 3.0)
    actual = control.behind_servos(control.blended(command.q, blend), 0.001, lag, spike)
    length = 150.0
    spoil = SPOIL[k % len(SPOIL)]
    t = command.t.copy()
    cut = command.cut
    recorded = actual.copy()
    keep = np.ones(len(t), bool)
    if spoil == "noise":
        recorded += rng.normal(0, rng.choice([0.0002, 0.001, 0.004]), recorded.shape)
    if spoil == "dropped":
        keep &= rng.random(len(t)) > rng.uniform(0.02, 0.3)
    if spoil == "gaps":
        for _ in range(int(rng.integers(1, 4))):
            begin, span = int(rng.integers(0, len(t))), int(rng.integers(50, 600))
            keep[begin:begin + span] = False
    if spoil == "row_jitter":
        spread = rng.uniform(0.001, 0.02)
        moment = np.clip(np.arange(len(t)) * 1.0 + rng.uniform(-1, 1, len(t)) * spread * 1000, 0, len(t) - 1)
        moment = np.maximum.accumulate(moment)
        recorded = np.array([np.interp(moment, np.arange(len(t)), actual[:, i]) for i in range(5)]).T
        actual = recorded.copy()  # the machine as it was at the moments that the rows are of
        keep[:] = False
        keep[:: int(rng.integers(1, 10))] = True
    if spoil == "item_jitter":
        spread = rng.choice([1, 5, 20, 150])
        for i in range(5):
            moment = np.clip(np.arange(len(t)) + rng.uniform(0, 1, len(t)) * spread, 0, len(t) - 1)
            recorded[:, i] = np.interp(moment, np.arange(len(t)), actual[:, i])
    clocks = 0.0
    if spoil == "two_clocks":
        clocks = float(rng.choice([2, 20, 100]))
        for i in (3, 4):
            recorded[:, i] = np.interp(np.arange(len(t)) - clocks, np.arange(len(t)), actual[:, i])
    if spoil == "cut":
        a, b = np.sort(rng.uniform(0, 1, 2))
        keep &= (t >= a * t[-1]) & (t <= b * t[-1])
    if spoil == "slow_rate":
        keep[:] = False
        keep[:: int(rng.choice([4, 10, 50, 100]))] = True
    if spoil == "other_program":
        other, _ = random_cl(np.random.default_rng([seed, k, 1]))
        cl.write_text(other)
        done = subprocess.run([program, "-q", "post", str(cl), "-m", MACHINE, "-c", "linuxcnc", "-o", str(nc)], capture_output=True)
        if done.returncode != 0:
            return {"case": k, "spoil": spoil, "servo": kind, "result": "not posted", "why": ""}
    if spoil == "inches":
        recorded[:, :3] /= 25.4
    if spoil == "swapped":
        recorded = recorded[:, [1, 0, 2, 3, 4]]
    if spoil == "sign":
        recorded[:, int(rng.integers(0, 5))] *= -1
    # The machine stands before and behind.
    before, behind = int(rng.integers(0, 1500)), int(rng.integers(0, 800))
    if spoil != "cut":
        recorded = np.vstack([np.repeat(recorded[:1], before, 0), recorded, np.repeat(recorded[-1:], behind, 0)])
        keep = np.concatenate([np.ones(before, bool), keep, np.ones(behind, bool)])
        seen = np.concatenate([np.zeros(before, bool), cut, np.zeros(behind, bool)])
        where = np.vstack([np.repeat(actual[:1], before, 0), actual, np.repeat(actual[-1:], behind, 0)])
    else:
        seen, where = cut, actual
    clock = rng.uniform(-100, 1e5)
    times = clock + np.arange(len(recorded)) * 0.001
    if spoil == "milliseconds":
        times = times * 1000
    rows = recorded[keep]
    header = "time_s,X_mm,Y_mm,Z_mm,A_deg,C_deg\n"
    positions = ""
    if spoil == "words":
        rows = rows.copy()
        rows[:, 2] -= length
        if k % 2:
            positions = "# positions: words\n"
    if spoil == "shdr":
        rate = float(rng.choice([2, 5, 10, 20]))
        shdr = folder / "trace.shdr"
        shdr.write_text(adapter_text(rng, times, recorded, rate))
        items = ",".join(f"{name}act={name}_{'deg' if name in 'ABC' else 'mm'}" for name in control.AXES)
        done = subprocess.run([program, "-q", "measurements", "import", "trace", str(shdr), "-o", str(csv), "-m", MACHINE, "--items", items],
                              capture_output=True, text=True)
        if done.returncode != 0:
            return {"case": k, "spoil": spoil, "servo": kind, "result": "wrong", "why": done.stderr[-300:]}
        text = csv.read_text()
        begin = float(next(line for line in text.splitlines() if line[0].isdigit()).split(",")[0])
        clock = times[0] - begin
    else:
        with csv.open("w") as file:
            file.write("# simulated\n" + positions + header)
            np.savetxt(file, np.column_stack([times[keep], rows]), fmt="%.6f", delimiter=",")
    # The truth: where the machine really was at these moments while it cut. The first cut comes down from the safe height: no part of the path.
    seen = seen & keep
    p, _ = chain.tool(where[seen], length)
    off = np.min([control.off_polyline(p, pass_points) for pass_points in points], axis=0) if len(p) else np.zeros(0)
    off = np.where(off < 20, off, 0)
    truth = float(off.max()) if len(off) else 0.0
    # Where a cut begins or ends a machine that follows late is on the rapid still, or on the cut: at which of both the largest is taken is nobody's fault.
    inner = np.convolve(~np.concatenate([[False], cut, [False]]), np.ones(81), "same")[1:-1] < 0.5
    inner = inner if spoil == "cut" else np.concatenate([np.zeros(before, bool), inner, np.zeros(behind, bool)])
    inner = inner[seen]
    least = float(off[inner].max()) if inner.any() else 0.0
    out.unlink(missing_ok=True)
    done = subprocess.run([program, "-q", "verify", str(nc), "-m", MACHINE, "-c", "linuxcnc", "--against", str(cl), "--trace", str(csv), "--json", str(out)],
                          capture_output=True, text=True)
    result = {"case": k, "spoil": spoil, "servo": kind, "lag": lag.round(2).tolist(), "spike": spike.round(4).tolist(), "blend": blend, "truth": truth, "least": least, "code": done.returncode}
    wrong_data = spoil in ("other_program", "inches", "swapped", "sign", "milliseconds") or (spoil == "words" and not positions)
    if done.returncode == 3:
        result["why"] = done.stderr.strip()[-400:]
        fine = wrong_data or spoil in ("item_jitter", "cut", "noise", "slow_rate", "row_jitter", "shdr") or clocks >= 100
        result["result"] = "refused" if fine else "refused without need"
        return result
    if done.returncode not in (0, 1):
        result.update(result="wrong", why=f"exit code {done.returncode}: {done.stderr[-300:]}")
        return result
    trace = json.loads(out.read_text())["trace"]
    result.update(max=trace["max_tip_deviation_mm"], uncertainty=trace["uncertainty_mm"], causes=[(c["kind"], c["axis"], round(c["value"], 3)) for c in trace["causes"]],
                  duration=trace["duration_s"], planned=trace["planned_s"], share=trace["share_of_feed_path"])
    if wrong_data:
        result["result"] = "wrong: taken for this program"
        return result
    allowed = trace["uncertainty_mm"] + 0.0005 + 0.03 * truth
    said_clocks = any("two clocks" in r for r in trace["remarks"])
    near = least - allowed <= trace["max_tip_deviation_mm"] <= truth + allowed
    worst = int(round((trace["worst"]["time_s"] - clock) * 1000))
    flags = cut if spoil == "cut" else np.concatenate([np.zeros(before, bool), cut, np.zeros(behind, bool)])
    near = near or len(set(flags[max(worst - 40, 0):worst + 40])) > 1
    if spoil == "two_clocks":
        # A delay and a clock look alike; up to 20 ms nobody can tell.
        near = near or said_clocks or clocks < 25
    result["result"] = "right" if near else "wrong"
    result["named"] = named(kind, lag, spike, result["causes"])
    return result


def named(kind, lag, spike, causes):
    """Whether the hidden servo is named; None where it is not to be asked."""
    kinds = {c[0] for c in causes}
    if kind == "lag":
        return "lag" in kinds
    if kind == "spike":
        return any(c[0] == "reversal" and c[1] == control.AXES[int(np.argmax(spike))] for c in causes)
    if kind == "blend":
        return bool(kinds & {"corner", "curve"})
    return not kinds & ({"lag", "reversal"} if lag.any() else {"lag", "reversal", "corner", "curve"})


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("program")
    parser.add_argument("folder", type=Path)
    parser.add_argument("count", type=int, nargs="?", default=30)
    parser.add_argument("--seed", type=int, default=28)
    parser.add_argument("--case", type=int)
    args = parser.parse_args()
    results = []
    for k in [args.case] if args.case is not None else range(args.count):
        result = run_case(args.program, args.folder / f"case_{k}", args.seed, k)
        results.append(result)
        print(json.dumps(result), flush=True)
    tally = {}
    for r in results:
        tally[r["result"]] = tally.get(r["result"], 0) + 1
    clean = [r for r in results if r.get("named") is not None and r["spoil"] in ("clean", "dropped", "gaps")]
    by_kind = {}
    for r in clean:
        hits, of = by_kind.get(r["servo"], (0, 0))
        by_kind[r["servo"]] = (hits + r["named"], of + 1)
    print(json.dumps({"results": tally, "named": by_kind}))
    sys.exit(1 if any(r["result"].startswith("wrong") for r in results) else 0)


if __name__ == "__main__":
    main()
