"""Cases by name. A name such as H1-0123 fixes the seed, and with it machine, campaign, hidden truth and noise."""

import hashlib
import json
import math
from dataclasses import dataclass, field

import numpy as np

from . import campaigns, foreign, machines, physics, small, unseen
from .chain import readings
from .oracle import Oracle, rescaled, small_basis, strength

LAMBDAS = (20, 50, 100, 400)
FULL = {"H0": 1000, "H1": 1200, "H2": 150, "X": 300, "C": 160, "R": 240, "F": 160, "D": 160, "S": 180, "U": 200}
NULLS = ["clean"] * 4 + ["offsets"] * 2 + ["drifting", "outliers", "unequal", "wrong_sigma"]
WILD = 0.01  # of the readings, stratum U
ROUGH = ["outliers", "unequal", "few", "common_empty", "part_frame", "state_only"]
SUBJECTS = {
    "component": [f"E{w}{j}" for j in "XYZAC" for w in "XYZABC"], "periodic": list("XYZ"), "worm": list("AC"),
    "squareness": ["C0Y", "B0Z", "A0Z"], "location": list("AC"), "backlash": list("XYZAC"),
    "crosstalk": ["XY", "XZ", "YZ"], "sag": ["A"], "overhang": ["Z"], "spindle_growth": [""],
    "screw_heating": list("XYZ"), "thermal_location": list("AC"), "ambient_drift": [""], "time_drift": [""],
    "servo_lag": list("XYZ"), "spindle_tilt": [""], "tool_length": [""], "setup_tilt": [""], "step": [""],
}
# Half of the library's identifiers are components: they are drawn as three kinds' worth.
KINDS = ["component", "component", "component"] + [k for k in SUBJECTS if k != "component"]


@dataclass
class Case:
    name: str
    machine: object
    rows: object
    base: list  # (id, parameters, choice): known to be there, values hidden
    hidden: list  # (id, parameters, choice)
    values: np.ndarray
    stated_random: np.ndarray
    stated_common: np.ndarray
    outside: dict = field(default_factory=dict)  # twists of physics that the library lacks
    about: dict = field(default_factory=dict)  # stratum, strength, rivals: for the score only
    rng: object = None
    silent: tuple = ()  # beginnings of the names of columns that the file leaves out

    @property
    def truth(self):
        return sorted(h[0] for h in self.hidden)

    def twists(self, rows):
        return physics.add_twists(*(physics.twists(n, p, c, self.machine, rows) for n, p, c in self.base + self.hidden))

    def seal(self, folder):
        """What must not change once a figure was published: the files, to the last character, and what they hide."""
        hidden = [(n, c, {k: f"{v:.6g}" for k, v in p.items()}) for n, p, c in self.hidden]
        text = json.dumps([self.name, hidden, sorted(self.outside), self.about["stratum"], self.about.get("kind")], sort_keys=True)
        parts = [text.encode()] + [(folder / file).read_bytes() for file in ("machine.toml", "known.toml", "data.csv")]
        return hashlib.sha256(b"\0".join(parts)).hexdigest()

    def write(self, folder):
        machines.write_machine(folder / "machine.toml", self.machine)
        machines.write_model(folder / "known.toml", "known", self.base, values=False)
        from .rows import write_rows
        write_rows(folder / "data.csv", self.machine, self.rows, self.values, self.stated_random, self.stated_common, self.silent)


def generator_of(name):
    return np.random.default_rng(int.from_bytes(hashlib.sha256(f"trunnion discovery {name}".encode()).digest()[:8], "big"))


def names(counts):
    return [f"{s}-{i:04d}" for s, count in counts.items() for i in range(count)]


def drawn_effect(name, machine, rows, rng):
    """Amplitudes and shapes of one library effect."""
    kind, _, subject = name.partition(":")
    choice = None
    if kind == "crosstalk":
        which = [f"E{w}{subject[0]}" for w in "XYZ"] + [f"E{w}{j}" for w in "ABC" for j in subject]
        choice = {"component": str(rng.choice(which))}
    if kind == "thermal_location":
        choice = {"sensor": str(rng.choice(sorted(rows.temperature)))}
    if kind == "step":
        choice = {"run": str(rng.choice(rows.run_names))}
    keys = physics.linear_keys(name, machine, rows, choice)
    parameters = {k: size * rng.uniform(0.35, 1.0) * float(rng.choice([-1, 1])) for k, size in keys.items()}
    if kind == "backlash":
        parameters = {k: abs(v) for k, v in parameters.items()}
    if kind == "periodic":
        pitch = machine.axis(subject).pitch
        parameters["p_mm"] = pitch / float(rng.integers(1, 4)) if pitch else float(rng.uniform(3.0, 30.0))
    if kind == "worm":
        parameters["n"] = float(rng.integers(8, 100))
    if kind in ("spindle_growth", "thermal_location", "ambient_drift"):
        parameters["tau_s"] = math.exp(rng.uniform(math.log(400), math.log(6000)))
    if kind == "step":
        inside = rows.time[rows.run == choice["run"]]
        parameters["t_s"] = float(rng.uniform(0.25, 0.75) * inside.max())
    return name, parameters, choice


def known_base(machine, rows, rng, hidden):
    """What the shop knows to be there; its values are fitted with the rest."""
    menus = [[], ["location:A", "location:C"], ["squareness:C0Y", "squareness:B0Z", "squareness:A0Z"], ["component:EXX"],
             ["location:C", "component:EYY"], ["location:A", "squareness:A0Z", "component:EZZ"]]
    chosen = [n for n in menus[rng.integers(len(menus))] if n not in hidden]
    return [drawn_effect(n, machine, rows, rng) for n in chosen]


def set_up(rows, rng):
    """Each run's part stands some tens of micrometres off: a translation in P, seen by displacements."""
    out = np.zeros((len(rows), 6))
    for run in rows.run_names:
        out[rows.run == run, :3] = rng.uniform(-0.03, 0.03, 3)
    return out


def measured_values(case, rows, rng, noise="white", offset_scale=1.0, wild_share=None):
    """Readings of the true machine in um or urad: exact chain, set-up, run offsets, noise, a display with finite steps."""
    twists = case.twists(rows) if case.base or case.hidden else {}
    twists = physics.add_twists(twists, case.outside)
    with_set_up = physics.add_twists(twists, {"P": set_up(rows, rng)})
    exact = np.where(rows.is_rotation, readings(case.machine, rows, twists) if twists else 0.0,
                     readings(case.machine, rows, with_set_up)) * rows.per_unit
    groups = rows.offset_groups()
    offsets = rng.normal(size=groups.max() + 1)[groups] * rows.u_common * offset_scale
    white = rng.normal(size=len(rows))
    if noise == "drifting":
        phi = rng.uniform(0.3, 0.6)
        for g in range(groups.max() + 1):
            index = np.flatnonzero(groups == g)
            for before, here in zip(index[:-1], index[1:]):
                white[here] = phi * white[before] + math.sqrt(1 - phi * phi) * white[here]
    if noise == "outliers":
        draw = rng.random(len(rows))
        wild = draw < (wild_share or rng.uniform(0.02, 0.05))
        white = np.where(wild, rng.normal(size=len(rows)) * 10.0, white)
    values = exact + offsets + white * rows.u_random
    return np.round(values / 0.02) * 0.02


def finished(name, machine, rows, base, hidden, rng, about, noise="white", outside=None, **settings):
    case = Case(name, machine, rows, base, hidden, None, rows.u_random, rows.u_common.copy(), outside or {}, about, rng)
    case.values = measured_values(case, rows, rng, noise, **settings)
    return case


def scaled_to(oracle, base, effect, wanted):
    """The effect with amplitudes that give the wanted chi-square, its signal, and its exact columns."""
    name, parameters, choice = effect
    keys = physics.linear_keys(name, oracle.machine, oracle.rows, choice)
    ground = physics.add_twists(*(physics.twists(*b, oracle.machine, oracle.rows) for b in base)) if base else {}
    for _ in range(2):
        own = physics.twists(name, parameters, choice, oracle.machine, oracle.rows)
        signal = oracle.exact_signal(physics.add_twists(ground, own), ground)
        factor = rescaled(max(strength(signal), 1e-12), wanted)
        parameters = {k: v * factor if k in keys else v for k, v in parameters.items()}
    return (name, parameters, choice), signal * factor


def campaign_for(rng, effects, small=None, **settings):
    machine = machines.MACHINES[rng.integers(len(machines.MACHINES))]()
    small = bool(rng.random() < 0.7) if small is None else small
    sigma = float(np.exp(rng.uniform(math.log(0.3), math.log(1.0))))
    settings = {"sigma_um": sigma, "sigma_urad": 2 * sigma, **settings}
    return machine, campaigns.composed(machine, rng, effects, small, **settings)


def identifier(kind, rng):
    subject = str(rng.choice(SUBJECTS[kind]))
    return f"{kind}:{subject}" if subject else kind


def null(name, index, rng):
    kind = NULLS[index % len(NULLS)]
    settings = {"common": float(rng.uniform(1.0, 3.0))} if kind == "offsets" else {}
    machine, rows = campaign_for(rng, [], **settings)
    if kind == "unequal":
        rows.u_random = rows.u_random * np.exp(rng.uniform(0, math.log(10), len(rows)))
    base = known_base(machine, rows, rng, [])
    case = finished(name, machine, rows, base, [], rng, {"stratum": f"H0 {kind}"}, kind)
    if kind == "wrong_sigma":
        case.stated_random = rows.u_random * (1.2 if index % 20 < 10 else 1 / 1.2)
    return case


def one_hidden(name, index, rng, kind=None, wanted=None, stratum="H1", small=None, rough=None, **settings):
    kind = kind or KINDS[index % len(KINDS)]
    wanted = wanted or LAMBDAS[(index // len(KINDS)) % len(LAMBDAS)]
    effect = identifier(kind, rng)
    columns = np.zeros((0, 0))
    # A campaign that cannot see the effect at all is drawn again.
    while not small_basis(columns).shape[1]:
        machine, rows = campaign_for(rng, [effect], small)
        if rough:
            rows = roughened(rows, rough, rng)
        base = known_base(machine, rows, rng, [effect])
        drawn = drawn_effect(effect, machine, rows, rng)
        oracle = Oracle(machine, rows, base)
        hidden, signal = scaled_to(oracle, base, drawn, wanted)
        columns = oracle.project(oracle.raw_columns(*hidden))
    rivals = oracle.rivals(signal, {effect}, columns, hidden)
    about = {"stratum": stratum, "kind": kind, "lambda": wanted, "rivals": dict(list(rivals.items())[:4]),
             "rho": max(rivals.values(), default=0.0), "p": oracle.base.shape[1] + columns.shape[1], "N": int(rows.measured.sum())}
    case = finished(name, machine, rows, base, [hidden], rng, about, "outliers" if rough == "outliers" else "white", **settings)
    case.oracle = oracle
    if rough == "common_empty":
        case.stated_common = np.full(len(rows), np.nan)
    return case


def roughened(rows, rough, rng):
    if rough == "unequal":
        rows.u_random = rows.u_random * np.exp(rng.uniform(0, math.log(10), len(rows)))
    if rough == "few":
        # Rows that a shop left out: a third is there, every run keeps some.
        keep = np.sort(rng.permutation(len(rows))[: max(60, len(rows) // 3)])
        rows = rows.taken(keep)
    if rough == "part_frame":
        rows.frame = np.where(rows.is_rotation, rows.frame, "part")
    if rough == "state_only":
        rows.measured = rng.random(len(rows)) > 0.2
    return rows


def unknown_offsets(name, index, rng):
    """One reading of a hundred is wild, and nobody knows how large the offsets of the runs are; half of the cases hide one effect."""
    if index % 2:
        kind, wanted = KINDS[index // 2 % len(KINDS)], (50, 150)[index // 2 // len(KINDS) % 2]
        case = one_hidden(name, index, rng, kind, wanted, "U", rough="outliers", wild_share=WILD)
    else:
        machine, rows = campaign_for(rng, [])
        about = {"stratum": "U", "null": True}
        case = finished(name, machine, rows, known_base(machine, rows, rng, []), [], rng, about, "outliers", wild_share=WILD)
    case.stated_common = np.full(len(case.rows), np.nan)
    return case


def two_hidden(name, index, rng):
    """Two at once, each strong, ratio 1, 3 or 10."""
    while True:
        kinds = rng.choice(sorted(set(KINDS) - {"setup_tilt"}), 2, replace=False)
        effects = [identifier(k, rng) for k in kinds]
        machine, rows = campaign_for(rng, effects)
        base = known_base(machine, rows, rng, effects)
        oracle = Oracle(machine, rows, base)
        ratio = (1, 3, 10)[index % 3]
        hidden, signals, columns = [], [], []
        for effect, wanted in zip(effects, (100 * ratio, 100)):
            one, signal = scaled_to(oracle, base, drawn_effect(effect, machine, rows, rng), wanted)
            hidden.append(one)
            signals.append(signal)
            columns.append(oracle.project(oracle.raw_columns(*one)))
        if not all(small_basis(c).shape[1] for c in columns):
            continue
        rho = max(max(oracle.rivals(s, set(effects), c, h).values()) for s, c, h in zip(signals, columns, hidden))
        cosine = abs(signals[0] @ signals[1]) / math.sqrt(strength(signals[0]) * strength(signals[1]))
        if rho < 0.8 and cosine < 0.6:
            break
    about = {"stratum": "H2", "kind": "+".join(sorted(kinds)), "ratio": ratio, "rho": rho}
    return finished(name, machine, rows, base, hidden, rng, about)


def outside_library(name, index, rng, source=foreign, stratum="X"):
    """A foreign effect, its amplitude such that three library effects cannot hide it: leftover chi-square 60 to 250."""
    which = list(source.EFFECTS)[index % len(source.EFFECTS)]
    machine, rows = campaign_for(rng, source.NEEDS[which])
    if which == "coolant":
        rows = unseen.with_coolant(rows, rng)
    base = known_base(machine, rows, rng, [])
    oracle = Oracle(machine, rows, base)
    twists = source.EFFECTS[which](machine, rows, rng)
    signal = oracle.exact_signal(twists, {})
    left, chosen = oracle.leftover(signal, 3)
    wanted = float(np.exp(rng.uniform(math.log(60), math.log(250))))
    factor = rescaled(max(left, 1e-9), wanted)
    outside = {j: t * factor for j, t in twists.items()}
    about = {"stratum": stratum, "kind": which, "leftover": wanted, "lambda": strength(signal) * factor**2, "imitators": chosen}
    return finished(name, machine, rows, base, [], rng, about, outside=outside)


def unusual_design(name, index, rng):
    """A campaign of an uncommon kind, with nothing hidden or one effect: what the diagnosis must take as it comes."""
    which = list(unseen.DESIGNS)[index % len(unseen.DESIGNS)]
    hide = (index // len(unseen.DESIGNS)) % 2 == 1
    while True:
        effect = identifier(KINDS[int(rng.integers(len(KINDS)))], rng)
        machine, rows = campaign_for(rng, [effect] if hide else [], small=False)
        rows = unseen.prepared(which, rows, rng)
        base = known_base(machine, rows, rng, [effect])
        if not hide:
            break
        oracle = Oracle(machine, rows, base)
        drawn = drawn_effect(effect, machine, rows, rng)
        if np.linalg.norm(oracle.project(oracle.raw_columns(*drawn))) > 1e-2:  # else these readings do not see it
            break
    about = {"stratum": f"D {which}", "kind": which, "null": not hide}
    if not hide:
        case = finished(name, machine, rows, base, [], rng, about)
    else:
        hidden, signal = scaled_to(oracle, base, drawn, 150)
        columns = oracle.project(oracle.raw_columns(*hidden))
        rivals = oracle.rivals(signal, {effect}, columns, hidden)
        about |= {"lambda": 150, "rho": max(rivals.values(), default=0.0), "rivals": dict(list(rivals.items())[:4])}
        case = finished(name, machine, rows, base, [hidden], rng, about)
    case.silent = unseen.SILENT.get(which, ())
    return case


def small_campaign(name, index, rng):
    """Few runs over what they happen to move, one effect of natural size: often too little to tell effects apart."""
    which = list(small.DESIGNS)[index % len(small.DESIGNS)]
    machine = machines.MACHINES[rng.integers(len(machines.MACHINES))]()
    rows = small.campaign(which, machine, rng)
    while True:
        effect = identifier(str(rng.choice([k for k in KINDS if k not in small.LEFT_OUT])), rng)
        if small.shown(effect, rows):
            break
    base = known_base(machine, rows, rng, [effect]) if rng.random() < 0.4 else []
    _, parameters, choice = drawn_effect(effect, machine, rows, rng)
    size = float(rng.choice(small.SIZES))
    linear = physics.linear_keys(effect, machine, rows, choice)
    hidden = (effect, {k: v * size if k in linear else v for k, v in parameters.items()}, choice)
    ground = physics.add_twists(*(physics.twists(*b, machine, rows) for b in base)) if base else {}
    own = physics.add_twists(ground, physics.twists(*hidden, machine, rows))
    seen = strength(Oracle(machine, rows, base).exact_signal(own, ground))
    return finished(name, machine, rows, base, [hidden], rng, {"stratum": "S", "kind": which, "lambda": seen})


def case(name):
    stratum, _, number = name.partition("-")
    return made(name, stratum, int(number), generator_of(name))


def made(name, stratum, index, rng):
    from . import confounded
    if stratum == "H0":
        return null(name, index, rng)
    if stratum == "H1":
        return one_hidden(name, index, rng)
    if stratum == "H2":
        return two_hidden(name, index, rng)
    if stratum == "X":
        return outside_library(name, index, rng)
    if stratum == "C":
        return confounded.pair(name, index, rng)
    if stratum == "R":
        rough = ROUGH[index % len(ROUGH)]
        kind = KINDS[(index // len(ROUGH)) % len(KINDS)]
        return one_hidden(name, index, rng, kind, 150 if index % 2 else 60, f"R {rough}", rough=rough)
    if stratum == "F":
        return outside_library(name, index, rng, unseen, "F")
    if stratum == "D":
        return unusual_design(name, index, rng)
    if stratum == "S":
        return small_campaign(name, index, rng)
    if stratum == "U":
        return unknown_offsets(name, index, rng)
    raise ValueError(f"no such case: {name}")
