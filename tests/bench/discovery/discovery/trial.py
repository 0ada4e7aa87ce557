"""One case through the program: diagnosis, the effect added, the planned run measured."""

import hashlib
import json
import os
import pathlib
import pickle
import resource
import subprocess

import numpy as np

from . import baselines, cases, machines, physics
from .chain import readings
from .oracle import Oracle, orthonormal
from .rows import join, read_rows, write_rows

NAMING = ("named", "named_but_incomplete", "ambiguous")


def program(binary, *arguments, timeout=180):
    done = subprocess.run([str(binary), *map(str, arguments)], capture_output=True, text=True, timeout=timeout)
    if done.returncode != 0:
        raise RuntimeError(f"exit code {done.returncode}: {done.stderr.strip()[-300:]}")
    return done.stdout


def processor_seconds():
    """Of the programs that this process has run: the same whatever else the computer does."""
    used = resource.getrusage(resource.RUSAGE_CHILDREN)
    return used.ru_utime + used.ru_stime


def diagnosed(binary, folder, data="data.csv"):
    return json.loads(program(binary, "model", "diagnose", folder / data, "-m", folder / "machine.toml", "--model",
                              folder / "known.toml", "--json", "-"))


def generator_stamp():
    """Of the code that makes cases: what an earlier version of it made is made anew."""
    judges = {"score.py", "seals.py", "statistics.py", "trial.py", "cross_check.py"}
    sources = sorted(p for p in pathlib.Path(__file__).parent.glob("*.py") if p.name not in judges)
    return hashlib.sha256(b"\0".join(p.read_bytes() for p in sources)).hexdigest()


def prepared(name, folder, with_baselines, anew=False):
    """The case, made once and kept: the files, and what only the score may see."""
    kept, stamp = folder / "sealed.pkl", generator_stamp()
    if kept.exists() and not anew:
        case, extra, made_by = pickle.loads(kept.read_bytes())
        if made_by == stamp and (not with_baselines or "baselines" in extra):
            return case, extra
    folder.mkdir(parents=True, exist_ok=True)
    case = cases.case(name)
    extra = {}
    if with_baselines:
        oracle = getattr(case, "oracle", None) or Oracle(case.machine, case.rows, case.base)
        extra["baselines"] = baselines.answers(oracle, case.values, cases.generator_of(name + " folds"))
    if hasattr(case, "oracle"):
        del case.oracle
    case.write(folder)
    case.rows.lags.clear()
    kept.write_bytes(pickle.dumps((case, extra, stamp)))
    return case, extra


def covered(entry, hidden):
    """(estimate - truth)/sigma of each parameter that the program gives a sigma; whole numbers are right or wrong, not near."""
    out = []
    for key, truth in hidden[1].items():
        found = entry["parameters"].get(key)
        if found is None or not found["sigma"] or key == "n":
            continue
        z = (found["value"] - truth) / found["sigma"]
        out.append(round(float(z), 3))
    return out


def held_out_ratio(binary, case, folder, effect, choice):
    """RMS on a repeated campaign after `model add`, in units of its floor sqrt(1 + p/N): expected value, no further noise."""
    arguments = ["model", "add", effect, folder / "data.csv", "-m", folder / "machine.toml", "--model", folder / "known.toml"]
    for key, value in (choice or {}).items():
        arguments += ["--with", f"{key}={value}"]
    program(binary, *arguments, "-o", folder / "added.toml")
    rows, machine = case.rows, case.machine
    found = machines.read_model(folder / "added.toml")
    predicted = physics.add_twists(*(physics.twists(n, p, c, machine, rows) for n, p, c in found))
    error = (readings(machine, rows, predicted) - readings(machine, rows, case.twists(rows))) * rows.per_unit
    oracle = Oracle(machine, rows, [])
    white = oracle.project(error[oracle.use])
    columns = [oracle.project(oracle.raw_columns(n, p, c)) for n, p, c in case.base + case.hidden]
    p, count = orthonormal(np.concatenate(columns, axis=1), 1e-6).shape[1], len(oracle.use)
    return float(np.sqrt((1.0 + white @ white / count) / (1.0 + p / count)))


def toml_value(value):
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, dict):
        return "{ " + ", ".join(f"{k} = {toml_value(v)}" for k, v in value.items()) + " }"
    if isinstance(value, list):
        return "[" + ", ".join(toml_value(v) for v in value) + "]"
    return json.dumps(value)


def after_planned_run(binary, case, folder, result):
    """The run that the program asks for, measured on the true machine by this chain; then the diagnosis again."""
    runs = (result.get("next_measurement") or {}).get("runs") or []
    if not runs:
        return None
    lines = []
    for k, run in enumerate(runs):
        lines.append("[[run]]")
        lines += [f"{key} = {toml_value(value)}" for key, value in run.items() if key != "id"]
        lines.append(f'id = "planned{k}"')
    (folder / "planned.toml").write_text("\n".join(lines) + "\n")
    (folder / "empty.toml").write_text('[model]\nname = "none"\n')
    program(binary, "simulate", folder / "planned.toml", "-m", folder / "machine.toml", "--truth", folder / "empty.toml",
            "-o", folder / "planned.csv", "--seed", 1)
    fresh, _ = read_rows(folder / "planned.csv", case.machine)
    rng = cases.generator_of(case.name + " planned")
    for sensor in case.rows.temperature:
        # The plan says where and how fast; the room of that day is the world's.
        swing = 1.5 * np.sin(2 * np.pi * fresh.time / 3000.0 + rng.uniform(0, 6))
        fresh.temperature[sensor] = fresh.temperature.get(sensor, case.machine.reference_degC + swing)
        if np.ptp(fresh.temperature[sensor]) == 0:
            fresh.temperature[sensor] = case.machine.reference_degC + swing
    rows = join([case.rows, fresh])
    values = np.concatenate([case.values, cases.measured_values(case, fresh, rng)])
    write_rows(folder / "data2.csv", case.machine, rows, values)
    again = diagnosed(binary, folder, "data2.csv")
    return {"verdict": again["verdict"], "effects": again["effects"], "rows": len(fresh),
            "minutes": result["next_measurement"].get("minutes")}


def run(binary, name, root, with_baselines=False, with_held_out=True):
    """Everything that the score needs to know of one case."""
    os.environ["OPENBLAS_NUM_THREADS"] = "1"
    folder = root / name
    try:
        case, extra = prepared(name, folder, with_baselines)
        record = {"case": name, "truth": case.truth, "about": case.about, "seal": case.seal(folder), **extra}
        before = processor_seconds()
        result = diagnosed(binary, folder)
        record["seconds"] = processor_seconds() - before
        record.update({k: result[k] for k in ("verdict", "effects", "sets", "confidence")})
        entry = next((r for r in result["ranking"] if [r["effect"]] == case.truth), None)
        stratum = case.about["stratum"]
        if entry and result["verdict"] == "named" and result["effects"] == case.truth:
            record["z"] = covered(entry, case.hidden[0])
            if with_held_out and stratum == "H1":
                record["held_out"] = held_out_ratio(binary, case, folder, case.truth[0], case.hidden[0][2])
        if stratum == "C" and result["verdict"] == "ambiguous":
            record["planned"] = after_planned_run(binary, case, folder, result)
        return record
    except Exception as error:  # noqa: BLE001 - a case that cannot be run is a failure of the program, and is counted
        return {"case": name, "truth": [], "about": {"stratum": "?"}, "seal": "", "verdict": "error", "effects": [], "sets": [],
                "confidence": 0.0, "seconds": 0.0, "message": repr(error)[:500]}
