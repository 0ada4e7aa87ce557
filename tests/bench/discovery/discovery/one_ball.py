"""One ball on the table, followed over A and C, as a touch probe or an R-test reads it: a location or component error hidden at 1, 5 and 20 times its
usual size, the mistakes in the files of `mistakes`, and nothing at all. Asked: is a cause named with confidence that is none."""

import math

import numpy as np

from . import machines, mistakes
from .campaigns import Campaign
from .cases import Case, drawn_effect, generator_of, measured_values
from .oracle import Oracle
from .trial import diagnosed

EFFECTS = [f"component:E{w}{j}" for j in "XYZAC" for w in "XYZABC"] + ["squareness:C0Y", "squareness:B0Z", "squareness:A0Z", "location:A", "location:C"]
SIZES = (1, 5, 20, 100)
WHERE = ["location:A", "location:C"]  # what a shop has in its model before anything else


def machine_and_campaign(rng):
    machine = machines.MACHINES[rng.integers(len(machines.MACHINES))]()
    sigma = float(np.exp(rng.uniform(math.log(0.5), math.log(1.5))))
    return machine, Campaign(machine, rng, sigma_um=sigma, sigma_urad=2 * sigma, common=float(rng.choice([0.0, 0.5])))


def ball(c, rng, name="ball"):
    c.ball(name, int(rng.integers(3, 7)), int(rng.integers(6, 11)), tool=c.tool(c.machine.tool_length))


def grown(effect, times):
    name, parameters, choice = effect
    return name, {k: times * v for k, v in parameters.items()}, choice


def with_effect(name, rng):
    """P-20-EXX-0007: an error 20 times its usual size; P-0-none-0007: none. As a model the places of A and C, where they are not asked for."""
    _, times, short, _ = name.split("-")
    machine, c = machine_and_campaign(rng)
    ball(c, rng)
    rows = c.rows()
    effect = next((e for e in EFFECTS if e.endswith(":" + short)), None)
    base = [drawn_effect(n, machine, rows, rng) for n in WHERE if effect not in WHERE]
    hidden = [grown(drawn_effect(effect, machine, rows, rng), int(times))] if effect else []
    made = Case(name, machine, rows, base, hidden, None, rows.u_random, rows.u_common.copy(), {}, {"stratum": "P"}, rng)
    made.values = measured_values(made, rows, rng)
    return made


def seen(made):
    """Chi-square of the readings beside the model as given, over what noise leaves of it."""
    oracle = Oracle(made.machine, made.rows, made.base)
    left = oracle.project(made.values[oracle.use])
    return float(left @ left) / len(left)


def with_mistake(name, rng):
    """P-unit-mistake-0007: the kinds of `mistakes`, all that is wrong with the machine known."""
    kind = name.split("-")[1]
    for _ in range(200):
        machine, c = machine_and_campaign(rng)
        ball(c, rng)
        base = WHERE + ["squareness:C0Y", "squareness:B0Z", "squareness:A0Z"]
        if kind == "run_sense":
            ball(c, rng, "ball_2")
        if kind in ("unit", "time_shift"):
            for axis in "XYZ":
                c.angle(f"angle_{axis.lower()}", axis)
        if kind == "time_shift":
            c.warm_up("warm_a", 90, 40)
            c.warm_up("warm_b", 120, 40)
            base = [*base, "spindle_growth"]
        rows = c.rows()
        true = Case(name, machine, rows, [drawn_effect(n, machine, rows, rng) for n in base], [], None, rows.u_random, rows.u_common.copy(), {},
                    {"stratum": f"B {kind}"}, rng)
        values = measured_values(true, rows, rng)
        said, wrong, readings, factor, answer = mistakes.wrong(kind, machine, rows, values, rng)
        if kind in ("all_sense", "unit", "tool_length") or mistakes.harmful(said, wrong, readings, true.base):
            break
    return Case(name, said, wrong, true.base, [], readings, rows.u_random * factor, rows.u_common * factor, {},
                {"stratum": f"B {kind}", "answer": answer, "values_given": kind in ("all_sense", "unit")}, rng)


def names(first, count):
    out = []
    for k in range(first, first + count):
        out += [f"P-{s}-{e.split(':')[1]}-{k:04d}" for s in SIZES for e in EFFECTS]
        out += [f"P-0-none-{20 * k + i:04d}" for i in range(20)]
        out += [f"P-{m}-mistake-{4 * k + i:04d}" for m in mistakes.KINDS for i in range(4)]
    return out


def run(task):
    binary, name, folder = task
    mistake = "mistake" in name
    made = (with_mistake if mistake else with_effect)(name, generator_of(name))
    mistakes.write(made, folder / name)
    said = diagnosed(binary, folder / name)
    record = {"case": name, "kind": name.split("-")[1], "truth": made.truth, "verdict": said["verdict"], "effects": said["effects"], "sets": said["sets"],
              "bookkeeping": [{k: v for k, v in b.items() if k != "what"} for b in said["bookkeeping"]],
              "confidence": said["confidence"], "explained": said.get("explained")}
    if mistake:
        record["right"] = said["verdict"] == "bookkeeping" and mistakes.right(made.about["answer"], said["bookkeeping"])
        record["answer"] = made.about["answer"]
    else:
        record["seen"] = seen(made)
    return record


def answered(r):
    """What the verdict makes of a hidden effect."""
    if r["verdict"] == "bookkeeping":
        return "bookkeeping"
    if r["verdict"] in ("named", "named_but_incomplete"):
        return "right" if r["effects"] == r["truth"] else "with others" if set(r["truth"]) & set(r["effects"]) else "wrong"
    if r["verdict"] == "ambiguous":
        return "ambiguous" if any(set(r["truth"]) & set(s) for s in r["sets"]) else "wrong sets"
    return "unnamed" if r["verdict"] == "not_in_library" else "silent"


ANSWERS = ("bookkeeping", "right", "with others", "wrong", "ambiguous", "wrong sets", "unnamed", "silent")


def left_open(r):
    """`ambiguous` between effects and a mistake, the right one the first that is said."""
    return r["verdict"] == "ambiguous" and mistakes.right(r["answer"], r["bookkeeping"])


def table(records):
    out = ["| times its usual size | cases | " + " | ".join(ANSWERS) + " |", "|---" * (2 + len(ANSWERS)) + "|"]
    for size in (*SIZES, 0):
        those = [answered(r) for r in records if r["kind"] == str(size)]
        out.append(f"| {size or 'nothing hidden'} | {len(those)} | " + " | ".join(str(those.count(a)) for a in ANSWERS) + " |")
    out += ["", "| mistake | cases | right one, `bookkeeping` | right one, `ambiguous` with effects | effects only |", "|---|---|---|---|---|"]
    wrong = [r for r in records if "mistake" in r["case"]]
    for kind in (*mistakes.KINDS, "all"):
        those = [r for r in wrong if kind in ("all", r["kind"])]
        sure, asked = sum(r["right"] for r in those), sum(left_open(r) for r in those)
        named = sum(bool(r["effects"]) and not left_open(r) for r in those)
        out.append(f"| {kind} | {len(those)} | {sure} | {asked} | {named} |")
    return "\n".join(out)
