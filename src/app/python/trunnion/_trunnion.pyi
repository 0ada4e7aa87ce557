import os
from typing import Optional, Sequence, Union

import numpy as np
import numpy.typing as npt

_Floats = npt.NDArray[np.float64]
_File = Union[str, "os.PathLike[str]"]

__version__: str

class Machine:
    """A machine file with its controller file; both by path, or by the name of one that ships."""

    def __init__(self, file: _File, controller: _File = ...) -> None: ...
    @property
    def name(self) -> str: ...
    @property
    def file(self) -> str: ...
    @property
    def controller(self) -> str: ...
    @property
    def axes(self) -> list[str]:
        """Names of the axes, in the order in which positions stand in a row."""
    @property
    def tool_length_mm(self) -> float:
        """Gauge length of tools that nobody names."""
    @property
    def _words(self) -> tuple[str, str]: ...
    def _described(self) -> str: ...
    def forward(self, positions: npt.ArrayLike, tool_length_mm: Optional[float] = ...) -> tuple[_Floats, _Floats]:
        """Tips (mm) and tool axes in the part, of positions (mm, deg): (..., axes) to (..., 3) twice."""
    def inverse(
        self, tips_mm: npt.ArrayLike, tool_axes: npt.ArrayLike, near: Optional[npt.ArrayLike] = ..., tool_length_mm: Optional[float] = ...
    ) -> _Floats:
        """Positions that put the tool there, (..., 2, axes): nearest to `near` (the zero of all axes) in the rotary axes first, NaN where there is
        no such solution within the limits of the rotary axes. Limits of linear axes: `beyond_limits`."""
    def beyond_limits(self, positions: npt.ArrayLike) -> _Floats:
        """How far each axis is beyond its travel: mm, deg; 0 within it."""
    def words(self, positions: npt.ArrayLike, tool_length_mm: Optional[float] = ...) -> _Floats:
        """The NC words of positions, not rounded."""

class Measurements:
    """Measurement files of one machine."""

    def __init__(self, machine: Machine, files: Sequence[_File]) -> None: ...
    @staticmethod
    def from_text(machine: Machine, text: str, name: str = ...) -> Measurements: ...
    def __len__(self) -> int:
        """Count of the readings: the length of the arrays below."""
    @property
    def runs(self) -> list[str]: ...
    @property
    def run(self) -> npt.NDArray[np.int64]:
        """Of each reading: index in `runs`."""
    @property
    def is_rotation(self) -> npt.NDArray[np.bool_]: ...
    @property
    def value(self) -> _Floats:
        """um, or urad of a rotation."""
    @property
    def u_random(self) -> _Floats: ...
    @property
    def n(self) -> _Floats:
        """Directions of sensitivity, (readings, 3)."""
    @property
    def positions(self) -> _Floats:
        """(readings, axes): mm, deg."""

class Model:
    """What is known of a machine's errors."""

    def __init__(self, machine: Machine, file: _File) -> None: ...
    @staticmethod
    def from_text(machine: Machine, text: str, name: str = ...) -> Model:
        """`name`: a file beside which its error tables stand."""
    @property
    def file(self) -> str: ...
    @property
    def text(self) -> str:
        """TOML."""
    def save(self, file: _File) -> None: ...
    def deviations(self, positions: npt.ArrayLike, tool_length_mm: Optional[float] = ...) -> tuple[_Floats, _Floats]:
        """Actual minus nominal of the tool relative to the part, in machine axes: um and urad, (..., 3) each. At rest, at reference temperature."""
    def _values(self) -> str: ...

def machines() -> list[str]:
    """Names of the machines that ship."""

def controllers() -> list[str]:
    """Names of the controllers that ship."""

def post(words: Sequence[str]) -> tuple[str, str, bool]: ...
def verify(words: Sequence[str], text: Optional[str] = ...) -> tuple[str, bool, list[str]]: ...
def evaluate(measurements: Measurements, model: Model) -> str: ...
def fit(measurements: Measurements, model: Model, robust: bool = ...) -> tuple[Model, str, _Floats, _Floats, npt.NDArray[np.bool_]]: ...
def diagnose(measurements: Measurements, model: Model, also: Optional[Model] = ...) -> str: ...
def write_file(file: str, text: str) -> None: ...
def wait_for_abandoned() -> None: ...
