"""Verdicts, matrices, maps, boundaries and admittances."""

from __future__ import annotations

import math
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any, NamedTuple

import numpy as np

from cohaptic import _native
from cohaptic.run import Picture


class Radius(NamedTuple):
    """A number and how far the true one may be from it."""

    value: float
    """The number."""
    error: float
    """The true one lies within value ± error."""


@dataclass(frozen=True)
class Part:
    """A part of a scene that does not mix with the others."""

    kind: str
    """``whole``, ``together``, ``apart``, ``mode`` or ``loose-device``."""
    peer: str | None
    """The first peer that it is about; ``None`` where it is about all."""
    dimension: int
    """How many states it has."""
    multiplicity: int
    """How often it is there."""
    radius: float
    """Its spectral radius."""
    error: float
    """How far that may be off."""


@dataclass(frozen=True)
class ContactMode:
    """A combination of contacts in which a scene is linear, or a motion of an object that turns."""

    motion: str
    """The components of the motion; empty for an object that does not turn."""
    contacts: str
    """Which contacts are closed; empty for a linear scene."""
    verdict: str
    """As if it lasted."""
    radius: float
    """The largest of its parts."""
    error: float
    """How far that may be off."""
    parts: list[Part]
    """The parts that do not mix."""


class Stability:
    """Whether a scene is stable, and how sure that is.

    >>> from cohaptic import Scene
    >>> scene = Scene('''
    ... scene = { duration = "2s", count = 3 }
    ... object.mass = 0.45
    ... coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
    ... peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    ... link.delay = "8ms"
    ... ''')
    >>> stability = scene.stability()
    >>> stability.verdict, round(stability.radius, 9)
    ('stable', 0.896488139)
    >>> [(part.kind, part.multiplicity) for part in stability.parts]
    [('together', 1), ('apart', 2)]
    >>> stability.matrix.shape, round(float(abs(stability.eigenvalues[0])), 9)
    ((17, 17), 0.896488139)
    """

    verdict: str
    """``stable``, ``marginal``, ``overflow`` or ``unstable``: the answer to the question that `judged` names."""
    judged: str
    """``spectral-radius``; where links leave something to chance, ``mean-square``, or ``nominal`` where that cannot be followed."""
    left_out: list[str]
    """The random parts of the links that a nominal verdict leaves out, such as ``random loss``; empty otherwise."""
    radius: float
    """The spectral radius over a frame, with nothing left to chance."""
    error: float
    """How far that may be off."""
    mean_square: Radius | None
    """The radius of the second moment, where links leave something to chance and it can be followed."""
    method: str
    """The method that was taken."""
    frame: float
    """The span that the radius is over [s]."""
    dimension: int
    """How many states there are."""
    rigid_modes: int
    """How many rigid-body modes were removed."""
    modes: list[ContactMode]
    """One for a linear scene; else one for each combination of contacts."""
    notes: list[str]
    """What the verdict leaves out."""

    def __init__(self, scene: _native.Scene, method: str, law: Any | None) -> None:
        said = _native.stability(scene, method, law)
        moment = said["mean_square"]
        self._scene, self._law = scene, law
        self.verdict, self.radius, self.error = said["verdict"], said["radius"], said["error"]
        self.judged, self.left_out = said["judged"], said["left_out"]
        self.mean_square = None if moment is None else Radius(*moment)
        self.method, self.frame, self.notes = said["method"], said["frame"], said["notes"]
        self.dimension, self.rigid_modes = said["dimension"], said["rigid_modes"]
        self.modes = [
            ContactMode(**{**mode, "parts": [Part(**part) for part in mode["parts"]]}) for mode in said["modes"]
        ]

    @property
    def stable(self) -> bool:
        """Whether the verdict is ``stable``."""
        return self.verdict == "stable"

    @property
    def parts(self) -> list[Part]:
        """The parts of the mode with the largest radius, of several the last."""
        return max(reversed(self.modes), key=lambda mode: mode.radius).parts

    @cached_property
    def _monodromy(self) -> tuple[np.ndarray, list[tuple[str, str]], float, float, int, float]:
        return _native.monodromy(self._scene, self._law)

    @property
    def matrix(self) -> np.ndarray:
        """The monodromy matrix: what one frame multiplies the relative state by, with nothing left to chance."""
        return self._monodromy[0]

    @property
    def matrix_error(self) -> float:
        """A bound of the errors of the entries of the matrix, as the largest sum over a row."""
        return self._monodromy[5]

    @property
    def states(self) -> list[tuple[str, str]]:
        """The peer and the kind of each row of the matrix. Velocities are multiplied by :attr:`velocity_time`."""
        return self._monodromy[1]

    @property
    def velocity_time(self) -> float:
        """What velocities in the state are multiplied by to be lengths [s]."""
        return self._monodromy[3]

    @cached_property
    def eigenvalues(self) -> np.ndarray:
        """The eigenvalues of the matrix, by falling modulus."""
        return _native.eigenvalues(self.matrix.tolist())

    def __repr__(self) -> str:
        verdict = f"nominally {self.verdict}" if self.judged == "nominal" else self.verdict
        return f"<Stability {verdict}: radius {self.radius:.12f} within {self.error:.1e}>"


@dataclass(frozen=True)
class Map:
    """The radius over a grid of two keys; arrays have a row for each value of y."""

    keys: tuple[str, str]
    """The keys along x and y."""
    units: tuple[str, str]
    """The units of their numbers: ``ms`` or ``%`` as in the range, ``N/m`` of a stiffness; empty where there is none."""
    x: np.ndarray
    """The values of the first key."""
    y: np.ndarray
    """The values of the second key."""
    radius: np.ndarray
    """The radius, by the criterion."""
    verdict: np.ndarray
    """The verdict on each cell; a radius near 1 is computed again with a bound for it."""
    nominal: np.ndarray
    """Which cells leave out what their links leave to chance."""
    criterion: str
    """``spectral-radius`` or ``mean-square``."""
    contours: list[np.ndarray]
    """Where the radius is 1: lines with a row (x, y) for each point."""
    _drawing: _native.Drawing = field(repr=False)

    @classmethod
    def _of(cls, said: dict[str, Any]) -> Map:
        verdict = np.array(said["verdicts"]).reshape(said["radius"].shape)
        keys, units = tuple(said["keys"]), tuple(said["units"])
        same = {key: said[key] for key in ("x", "y", "radius", "nominal", "criterion", "contours")}
        return cls(keys=keys, units=units, verdict=verdict, _drawing=said["drawing"], **same)

    @property
    def stable(self) -> np.ndarray:
        """Which cells are stable."""
        return np.asarray(self.verdict == "stable")

    def plot(self) -> Picture:
        """The program's own picture: the outline of the stable region, shaded."""
        return Picture(self._drawing.svg())

    def _repr_svg_(self) -> str:
        return self._drawing.svg()

    def to_xarray(self) -> Any:
        """The map as an ``xarray.Dataset``, which must be installed."""
        import xarray

        (x, y), (x_unit, y_unit) = self.keys, self.units
        coordinates = {x: (x, self.x, {"units": x_unit}), y: (y, self.y, {"units": y_unit})}
        fields = {"radius": self.radius, "verdict": self.verdict, "nominal": self.nominal}
        return xarray.Dataset(
            {name: ((y, x), values) for name, values in fields.items()}, coordinates, {"criterion": self.criterion}
        )


class Crossing(NamedTuple):
    """A value at which the verdict changes."""

    value: float
    """The value."""
    before: str
    """The verdict below it."""
    after: str
    """The verdict above it."""


@dataclass(frozen=True)
class Boundary:
    """Every crossing along a key."""

    key: str
    """The key."""
    unit: str
    """The unit of its numbers, as in :attr:`Map.units`."""
    criterion: str
    """``spectral-radius`` or ``mean-square``."""
    first: str
    """The verdict at the lower end."""
    crossings: list[Crossing]
    """In ascending order."""
    marginal: list[tuple[float, float]]
    """Where the radius stays at 1, or touches it, as closely as can be told."""
    tolerance: float
    """How closely each crossing was found."""
    is_settled: bool
    """Whether every interval was looked at as closely as it needs."""
    nominal: int
    """How many of the values leave out what their links leave to chance."""
    values: np.ndarray
    """Every value that was looked at."""
    radius: np.ndarray
    """Its radius, by the criterion."""
    error: np.ndarray
    """How far that may be off."""
    _drawing: _native.Drawing = field(repr=False)

    @classmethod
    def _of(cls, said: dict[str, Any]) -> Boundary:
        drawing = said.pop("drawing")
        return cls(_drawing=drawing, **{**said, "crossings": [Crossing(*crossing) for crossing in said["crossings"]]})

    def plot(self) -> Picture:
        """The program's own picture: the radius along the key, with the crossings."""
        return Picture(self._drawing.svg())

    def _repr_svg_(self) -> str:
        return self._drawing.svg()


@dataclass(frozen=True)
class Admittance:
    """Velocity over force at the device of a peer. NumPy takes it as its :attr:`values`."""

    frequencies: np.ndarray
    """In hertz."""
    values: np.ndarray
    """Complex [m/(N·s)]; for a turn [rad/(N·m·s)]."""
    errors: np.ndarray
    """How far rounding may have moved each at most."""
    verdict: str
    """That on the scene; an unstable one has no steady state, and nothing that could be measured."""
    radius: float
    """The spectral radius of the scene."""
    error: float
    """How far that may be off."""
    stiffness: Radius
    """What a slow hand feels [N/m]."""
    viscosity: Radius
    """What a slow hand feels [N·s/m]."""
    inertia: Radius
    """What a slow hand feels [kg]."""
    object_mass: float
    """What the whole object alone would be felt as."""
    notes: list[str]
    """What the numbers leave out."""
    _drawing: _native.Drawing = field(repr=False)

    @classmethod
    def _of(cls, said: dict[str, Any]) -> Admittance:
        drawing = said.pop("drawing")
        felt = {name: Radius(*said[name]) for name in ("stiffness", "viscosity", "inertia")}
        return cls(_drawing=drawing, **{**said, **felt})

    def plot(self) -> Picture:
        """The program's own picture: a Bode plot."""
        return Picture(self._drawing.svg())

    def _repr_svg_(self) -> str:
        return self._drawing.svg()

    @property
    def magnitude_db(self) -> np.ndarray:
        """Relative to 1 m/(N·s) [dB]."""
        decibels: np.ndarray = 20.0 * np.log10(np.abs(self.values))
        return decibels

    @property
    def phase(self) -> np.ndarray:
        """In degrees, without jumps."""
        degrees: np.ndarray = np.degrees(np.unwrap(np.angle(self.values)))
        return degrees

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        """The complex values."""
        return (
            np.array(self.values, dtype=dtype, copy=True) if copy else self.values.astype(dtype or complex, copy=False)
        )


def _key_range(text: str | tuple[str, Any, Any]) -> str:
    if isinstance(text, str):
        return text
    key, low, high = text
    return f"{key}={low}..{high}"


_LOWEST, _HIGHEST, _POINTS = 0.01, 100.0, 60


def _spread(highest: float) -> list[float]:
    """The frequencies of ``cohaptic admittance``: each the same factor above the one before."""
    top = min(_HIGHEST, highest)
    ratio = top / _LOWEST
    return [_LOWEST * math.pow(ratio, place / (_POINTS - 1)) for place in range(_POINTS - 1)] + [top]
