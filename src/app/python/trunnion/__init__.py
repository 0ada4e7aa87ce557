"""Five-axis post-processing for machines whose rotary axes carry the part.

The same code as the program `trunnion`, on numpy arrays and texts: same numbers, same texts, same messages. Lengths are mm, angles degrees,
deviations um and urad. Positions are rows in the order of `Machine.axes`. Work is done without the GIL; Ctrl-C ends a call.

    import trunnion
    machine = trunnion.Machine("trunnion_offset")
    program = trunnion.post("impeller.cls", machine, tolerance_mm=0.002)
    program.save("impeller.nc")
"""
from __future__ import annotations

import atexit
import json
import os
from dataclasses import dataclass
from typing import Any, Optional, Sequence, Union

import numpy as np
import numpy.typing as npt

from . import _trunnion, errors
from ._trunnion import Machine, Measurements, Model, __version__, controllers, machines
from .errors import CheckFailed, Defect, Error, InputOutput, Warning, WrongInput, WrongUse

__all__ = [
    "CheckFailed", "Defect", "Error", "Fit", "InputOutput", "Machine", "Measurements", "Model", "Program", "Verification", "Warning", "WrongInput",
    "WrongUse", "__version__", "controllers", "describe", "diagnose", "evaluate", "fit", "machines", "post", "values", "verify",
]

PathLike = Union[str, "os.PathLike[str]"]
#: Of the program's command line: `tolerance_mm=0.002` is `--tolerance-mm 0.002`, `rtcp=True` is `--rtcp`. None and False: not given.
Option = Union[None, bool, int, float, str, "os.PathLike[str]"]

# Threads of work that Ctrl-C dropped must not outlive the module.
atexit.register(_trunnion.wait_for_abandoned)


@dataclass(frozen=True)
class Program:
    """A posted NC program."""

    text: str
    result: dict[str, Any]  #: what `trunnion post --json` writes
    passed: bool  #: False only with `accept_deviation`: the text is marked NOT WITHIN TOLERANCE then

    def save(self, file: PathLike) -> None:
        """Writes the program: the file appears complete, or not at all."""
        _trunnion.write_file(os.fspath(file), self.text)


@dataclass(frozen=True)
class Verification:
    """What `verify` found."""

    result: dict[str, Any]  #: what `trunnion verify --json` writes
    passed: bool
    failed: list[str]  #: a sentence for each check that failed, with place and figures


@dataclass(frozen=True)
class Fit:
    """A fitted model, and what it leaves of each reading."""

    model: Model
    result: dict[str, Any]  #: what `trunnion model fit --json` writes
    residual: npt.NDArray[np.float64]  #: um or urad
    normalised: npt.NDArray[np.float64]  #: whitened: about 1 for noise
    outlier: npt.NDArray[np.bool_]


def _option_words(options: dict[str, Option]) -> list[str]:
    words = []
    for name, value in options.items():
        if value is None or value is False:
            continue
        words.append("--" + name.replace("_", "-"))
        if value is not True:
            words.append(repr(value) if isinstance(value, float) else os.fspath(value) if isinstance(value, os.PathLike) else str(value))
    return words


def _machine_words(machine: Union[Machine, PathLike], controller: Optional[PathLike]) -> list[str]:
    of_machine = ""
    if isinstance(machine, Machine):
        machine, of_machine = machine._words
    chosen = os.fspath(controller) if controller is not None else of_machine
    return ["-m", os.fspath(machine)] + (["-c", chosen] if chosen else [])


def post(part: PathLike, machine: Union[Machine, PathLike], *, controller: Optional[PathLike] = None, output: Optional[PathLike] = None,
         **options: Option) -> Program:
    """Makes the NC program of a CL file, read back and verified: `trunnion post`.

    `options` are those of `trunnion post --help`. `output` is the name of the file that the program is meant for (controls that name their
    programs); nothing is written: `Program.save` does. Raises CheckFailed where the program would write no file.
    """
    part = os.fspath(part)
    meant_for = os.path.splitext(os.path.basename(part))[0] + ".nc" if output is None else os.fspath(output)
    words = [part, *_machine_words(machine, controller), "-o", meant_for, *_option_words(options)]
    text, result, passed = _trunnion.post(words)
    return Program(text, json.loads(result), passed)


def verify(program: Union[Program, PathLike], machine: Union[Machine, PathLike], against: PathLike, *, controller: Optional[PathLike] = None,
           **options: Option) -> Verification:
    """Holds an NC program (a file, or what `post` gave) against the CL file `against`: `trunnion verify`."""
    is_text = isinstance(program, Program)
    name = "program.nc" if is_text else os.fspath(program)  # type: ignore[arg-type]
    words = [name, *_machine_words(machine, controller), "--against", os.fspath(against), *_option_words(options)]
    result, passed, failed = _trunnion.verify(words, program.text if isinstance(program, Program) else None)
    return Verification(json.loads(result), passed, failed)


def describe(machine: Machine) -> dict[str, Any]:
    """Which way each axis goes, program zero, the proving program: `trunnion machine --json`."""
    return json.loads(machine._described())  # type: ignore[no-any-return]


def values(model: Model) -> dict[str, Any]:
    """The effects of a model with their parameters, in the units of their keys."""
    return json.loads(model._values())  # type: ignore[no-any-return]


def evaluate(measurements: Measurements, model: Model) -> dict[str, Any]:
    """How well the model as it stands explains the readings: `trunnion model evaluate --json`."""
    return json.loads(_trunnion.evaluate(measurements, model))  # type: ignore[no-any-return]


def fit(measurements: Measurements, model: Model, *, robust: bool = True) -> Fit:
    """Fits all parameters of the model: `trunnion model fit`."""
    fitted, result, residual, normalised, outlier = _trunnion.fit(measurements, model, robust)
    return Fit(fitted, json.loads(result), residual, normalised, outlier)


def diagnose(measurements: Measurements, model: Model, *, also: Optional[Model] = None) -> dict[str, Any]:
    """Which effect the model lacks, or that these data cannot tell: `trunnion model diagnose --json`. `also`: a model whose effects compete."""
    return json.loads(_trunnion.diagnose(measurements, model, also))  # type: ignore[no-any-return]
