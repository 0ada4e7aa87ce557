"""The smoke set, and seals: a hash of what is hidden in each of its cases, fixed before the program was tried on them."""

import json

SMOKE = ([f"H0-{i:04d}" for i in range(30)] + [f"H1-{i:04d}" for i in range(32, 68)] + [f"X-{i:04d}" for i in range(14)]
         + [f"C-{i:04d}" for i in range(8)] + [f"R-{i:04d}" for i in range(8)] + [f"H2-{i:04d}" for i in range(4)])


def write(path, records):
    known = json.loads(path.read_text()) if path.exists() else {}
    known.update({r["case"]: r["seal"] for r in records})
    path.write_text(json.dumps(dict(sorted(known.items())), indent=0) + "\n")


def broken(path, records):
    if not path.exists():
        return []
    known = json.loads(path.read_text())
    return [r["case"] for r in records if r["case"] in known and r["seal"] != known[r["case"]] and r["verdict"] != "error"]
