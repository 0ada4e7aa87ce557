"""A blind set: cases that nobody can make again before their secret is told, and what is kept until then (BLIND.md)."""

import hashlib
import json
import pathlib
import shutil

import numpy as np

from . import cases, mistakes
from .trial import diagnosed

HERE = pathlib.Path(__file__).resolve().parent.parent
# What a case holds, and how often.
KINDS = {"nothing": 0.24, "one": 0.30, "two": 0.10, "outside": 0.14, "confounded": 0.08, "mistake": 0.14}
STRATA = {"nothing": ("H0",), "one": ("H1",), "two": ("H2",), "outside": ("X", "F"), "confounded": ("C",)}
NAMED_SINCE = ("unbalanced_fixture",)  # foreign physics that the library has a name for now
CYCLE = 10000  # of the numbers of cases, from which kinds within a stratum follow


def kinds_of(count, secret):
    """Of each kind as many as its share says, in an order that only the secret tells."""
    shares = [count * s for s in KINDS.values()]
    counts = [int(s) for s in shares]
    for k in np.argsort([c - s for c, s in zip(counts, shares)], kind="stable")[: count - sum(counts)]:
        counts[k] += 1
    order = [kind for kind, c in zip(KINDS, counts) for _ in range(c)]
    cases.generator_of(f"blind {secret} order").shuffle(order)
    return order


def drawn(name, kind, secret):
    rng = cases.generator_of(f"blind {secret} {name}")
    if kind == "mistake":
        return mistakes.made(name, str(rng.choice(mistakes.KINDS)), rng)
    if kind == "nothing" and rng.random() < 0.4:  # what the model holds must not tell that a file is wrong
        return mistakes.made(name, mistakes.NONE, rng)
    while True:
        case = cases.made(name, str(rng.choice(STRATA[kind])), int(rng.integers(CYCLE)), rng)
        if case.about.get("kind") not in NAMED_SINCE:
            return case


def answer_of(case, kind):
    out = {"kind": kind, "effects": case.truth}
    if kind == "mistake":
        out["mistake"] = case.about["answer"]
    if "lambda" in case.about:
        out["lambda"] = case.about["lambda"]
    if "rho" in case.about:
        out["rho"] = round(float(case.about["rho"]), 6)
    out["parameters"] = {n: {k: float(f"{v:.6g}") for k, v in p.items()} for n, p, _ in case.hidden}
    if kind in ("nothing", "outside"):
        out["what"] = case.about.get("kind", case.about["stratum"])
    return out


def digest(nonce, answer):
    return hashlib.sha256((nonce + json.dumps(answer, sort_keys=True)).encode()).hexdigest()


def write_case(task):
    """The files of one case; its answer with the number that makes the seal."""
    folder, name, kind, secret = task
    case = drawn(name, kind, secret)
    where = folder / name
    where.mkdir(parents=True)
    if "answer" in case.about:
        mistakes.write(case, where)
    else:
        case.write(where)
    nonce = hashlib.sha256(f"{secret} {name}".encode()).hexdigest()
    answer = answer_of(case, kind)
    files = {f.name: hashlib.sha256(f.read_bytes()).hexdigest() for f in sorted(where.iterdir())}
    return name, {"nonce": nonce, "answer": answer}, {"seal": digest(nonce, answer), "files": files}


def write(folder, keep, count, secret, pool):
    """`folder` is given away, `keep` is not."""
    folder.mkdir(parents=True)
    names = [f"case_{k + 1:04d}" for k in range(count)]
    done = list(pool.imap(write_case, [(folder, n, k, secret) for n, k in zip(names, kinds_of(count, secret))]))
    (folder / "sealed.json").write_text(json.dumps({n: sealed for n, _, sealed in done}, indent=1) + "\n")
    keep.write_text(json.dumps({"secret": secret, "cases": {n: answer for n, answer, _ in done}}, indent=1) + "\n")
    shutil.copy(HERE / "BLIND.md", folder / "README.md")
    shutil.copy(HERE / "blind-score", folder / "score")


SAID = {"nothing_to_find": "nothing", "not_testable": "nothing", "data_problem": "data", "named": "effects", "ambiguous": "effects",
        "not_in_library": "outside", "named_but_incomplete": "outside", "bookkeeping": "files"}


def mistake_text(b):
    words = [b["kind"]]
    for key in ("axis", "run", "quantity"):
        words += [str(b[key])] if b.get(key) else []
    for key in ("axes", "components"):
        words += b.get(key) or []
    for key in ("factor", "by_mm", "by_s"):
        words += [f"{b[key]:.6g}"] if isinstance(b.get(key), (int, float)) else []
    return " ".join(words)


def answered(task):
    """What `trunnion model diagnose` says of a case, as a line of the answers."""
    binary, folder = task
    said = diagnosed(binary, folder)
    sets = [s for s in said["sets"]] or ([said["effects"]] if said["effects"] else [])
    if said["verdict"] == "ambiguous" and said["bookkeeping"]:
        sets = sets + [["files"]]
    mistake = mistake_text(said["bookkeeping"][0]) if said["bookkeeping"] else ""
    return [folder.name, SAID[said["verdict"]], "|".join("+".join(s) for s in sets), mistake, f"{said['confidence']:.3f}"]
