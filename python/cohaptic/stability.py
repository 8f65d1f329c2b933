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
    """A number with the bound of its error."""

    value: float
    """The number."""
    error: float
    """Bound of the error: the true number is within value ± error."""


@dataclass(frozen=True)
class Part:
    """A part of a scene whose motion is independent of all other parts."""

    kind: str
    """``whole``, ``together``, ``apart``, ``mode`` or ``loose-device``."""
    peer: str | None
    """First peer of the part; ``None`` for a part of all peers."""
    dimension: int
    """Number of states of the part."""
    multiplicity: int
    """Number of equal parts for which this part stands."""
    radius: float
    """Spectral radius of the part."""
    error: float
    """Bound of the error of the radius."""


@dataclass(frozen=True)
class ContactMode:
    """A combination of contacts in which a scene is linear, or a motion of an object that turns."""

    motion: str
    """Components of the motion; empty for an object that does not turn."""
    contacts: str
    """Closed contacts; empty for a linear scene."""
    verdict: str
    """Verdict on the mode, as if the mode lasted."""
    radius: float
    """Largest radius of the parts."""
    error: float
    """Bound of the error of the radius."""
    parts: list[Part]
    """Parts with independent motions."""


class Stability:
    """Verdict on the stability of a scene, with the numbers behind the verdict and their errors.

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
    """``stable``, ``marginal``, ``overflow`` or ``unstable``, by the criterion in :attr:`judged`."""
    judged: str
    """Criterion: ``spectral-radius`` without random links, otherwise ``mean-square``, or ``nominal`` if the mean square cannot be computed."""
    left_out: list[str]
    """Random parts of the links that a nominal verdict leaves out, such as ``random loss``; empty for other verdicts."""
    radius: float
    """Spectral radius over a frame, without the random parts of links."""
    error: float
    """Bound of the error of the spectral radius."""
    mean_square: Radius | None
    """Radius of the second moment; ``None`` without random links, and if the second moment cannot be computed."""
    method: str
    """Method of the analysis."""
    frame: float
    """Length of the frame [s]."""
    dimension: int
    """Number of states."""
    rigid_modes: int
    """Number of rigid-body modes that were removed."""
    modes: list[ContactMode]
    """Modes of contact: one for a linear scene, otherwise one for each combination of contacts."""
    notes: list[str]
    """Parts of the scene that the verdict leaves out, in words."""

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
        """``True`` if the verdict is ``stable``."""
        return self.verdict == "stable"

    @property
    def parts(self) -> list[Part]:
        """Parts of the mode with the largest radius; of several such modes, the last."""
        return max(reversed(self.modes), key=lambda mode: mode.radius).parts

    @cached_property
    def _monodromy(self) -> tuple[np.ndarray, list[tuple[str, str]], float, float, int, float]:
        return _native.monodromy(self._scene, self._law)

    @property
    def matrix(self) -> np.ndarray:
        """Monodromy matrix: the matrix by which one frame multiplies the relative state, without the random parts of links."""
        return self._monodromy[0]

    @property
    def matrix_error(self) -> float:
        """Bound of the errors of the entries of the matrix, as the largest sum over a row."""
        return self._monodromy[5]

    @property
    def states(self) -> list[tuple[str, str]]:
        """Peer and kind of the state of each row of the matrix. Velocities are multiplied by :attr:`velocity_time`."""
        return self._monodromy[1]

    @property
    def velocity_time(self) -> float:
        """Time by which velocities of the state are multiplied, so that they are lengths [s]."""
        return self._monodromy[3]

    @cached_property
    def eigenvalues(self) -> np.ndarray:
        """Eigenvalues of the matrix, in the order of decreasing modulus."""
        return _native.eigenvalues(self.matrix.tolist())

    def __repr__(self) -> str:
        verdict = f"nominally {self.verdict}" if self.judged == "nominal" else self.verdict
        return f"<Stability {verdict}: radius {self.radius:.12f} within {self.error:.1e}>"


@dataclass(frozen=True)
class Map:
    """Radius over a grid of two keys. Arrays have a row for each value of y."""

    keys: tuple[str, str]
    """Keys along x and y."""
    units: tuple[str, str]
    """Units of the two keys: ``ms`` or ``%`` as in the range, ``N/m`` for a stiffness; empty for a number without a unit."""
    x: np.ndarray
    """Values of the first key."""
    y: np.ndarray
    """Values of the second key."""
    radius: np.ndarray
    """Radius of each cell, by the criterion."""
    verdict: np.ndarray
    """Verdict on each cell. A radius near 1 is computed again with a bound of its error."""
    nominal: np.ndarray
    """``True`` for a cell whose verdict leaves out random parts of links."""
    criterion: str
    """Criterion of the radii: ``spectral-radius`` or ``mean-square``."""
    contours: list[np.ndarray]
    """Lines on which the radius is 1, with a row (x, y) for each point."""
    _drawing: _native.Drawing = field(repr=False)

    @classmethod
    def _of(cls, said: dict[str, Any]) -> Map:
        verdict = np.array(said["verdicts"]).reshape(said["radius"].shape)
        keys, units = tuple(said["keys"]), tuple(said["units"])
        same = {key: said[key] for key in ("x", "y", "radius", "nominal", "criterion", "contours")}
        return cls(keys=keys, units=units, verdict=verdict, _drawing=said["drawing"], **same)

    @property
    def stable(self) -> np.ndarray:
        """``True`` for each stable cell."""
        return np.asarray(self.verdict == "stable")

    def plot(self) -> Picture:
        """Returns the picture of ``cohaptic stability map``: the shaded outline of the stable region."""
        return Picture(self._drawing.svg())

    def _repr_svg_(self) -> str:
        return self._drawing.svg()

    def to_xarray(self) -> Any:
        """Returns the map as an ``xarray.Dataset``. The package ``xarray`` must be installed."""
        import xarray

        (x, y), (x_unit, y_unit) = self.keys, self.units
        coordinates = {x: (x, self.x, {"units": x_unit}), y: (y, self.y, {"units": y_unit})}
        fields = {"radius": self.radius, "verdict": self.verdict, "nominal": self.nominal}
        return xarray.Dataset(
            {name: ((y, x), values) for name, values in fields.items()}, coordinates, {"criterion": self.criterion}
        )


class Crossing(NamedTuple):
    """Value of a key at which the verdict changes."""

    value: float
    """Value of the key at the crossing."""
    before: str
    """Verdict below the value."""
    after: str
    """Verdict above the value."""


@dataclass(frozen=True)
class Boundary:
    """Every crossing of the stability boundary along a key."""

    key: str
    """Key that was varied."""
    unit: str
    """Unit of the key, as in :attr:`Map.units`."""
    criterion: str
    """Criterion of the radii: ``spectral-radius`` or ``mean-square``."""
    first: str
    """Verdict at the lower end of the range."""
    crossings: list[Crossing]
    """Crossings, in ascending order of the value."""
    marginal: list[tuple[float, float]]
    """Intervals in which the radius stays at 1 or touches 1, within the errors of the radii."""
    tolerance: float
    """Width to which each crossing was located, in the unit of the key."""
    is_settled: bool
    """``True`` if every interval was checked as closely as necessary."""
    nominal: int
    """Number of checked values whose verdict leaves out random parts of links."""
    values: np.ndarray
    """Checked values of the key."""
    radius: np.ndarray
    """Radius at each checked value, by the criterion."""
    error: np.ndarray
    """Bound of the error of each radius."""
    _drawing: _native.Drawing = field(repr=False)

    @classmethod
    def _of(cls, said: dict[str, Any]) -> Boundary:
        drawing = said.pop("drawing")
        return cls(_drawing=drawing, **{**said, "crossings": [Crossing(*crossing) for crossing in said["crossings"]]})

    def plot(self) -> Picture:
        """Returns the picture of ``cohaptic stability boundary``: the radius along the key, with the crossings."""
        return Picture(self._drawing.svg())

    def _repr_svg_(self) -> str:
        return self._drawing.svg()


@dataclass(frozen=True)
class Admittance:
    """Velocity divided by force at the device of a peer. NumPy functions take the object in place of its :attr:`values`."""

    frequencies: np.ndarray
    """Frequencies [Hz]."""
    values: np.ndarray
    """Complex admittance at each frequency [m/(N·s)]; for a rotation [rad/(N·m·s)]."""
    errors: np.ndarray
    """Bound of the rounding error of each value."""
    verdict: str
    """Verdict on the stability of the scene. An unstable scene has no steady state, so its admittance cannot be measured."""
    radius: float
    """Spectral radius of the scene."""
    error: float
    """Bound of the error of the spectral radius."""
    stiffness: Radius
    """Stiffness that a slow hand feels [N/m]."""
    viscosity: Radius
    """Viscous damping that a slow hand feels [N·s/m]."""
    inertia: Radius
    """Mass that a slow hand feels [kg]."""
    object_mass: float
    """Mass that a slow hand would feel of the whole object alone [kg]."""
    notes: list[str]
    """Parts of the scene that the numbers leave out, in words."""
    _drawing: _native.Drawing = field(repr=False)

    @classmethod
    def _of(cls, said: dict[str, Any]) -> Admittance:
        drawing = said.pop("drawing")
        felt = {name: Radius(*said[name]) for name in ("stiffness", "viscosity", "inertia")}
        return cls(_drawing=drawing, **{**said, **felt})

    def plot(self) -> Picture:
        """Returns the picture of ``cohaptic admittance``: a Bode plot."""
        return Picture(self._drawing.svg())

    def _repr_svg_(self) -> str:
        return self._drawing.svg()

    @property
    def magnitude_db(self) -> np.ndarray:
        """Magnitude of the values, relative to 1 m/(N·s) [dB]."""
        decibels: np.ndarray = 20.0 * np.log10(np.abs(self.values))
        return decibels

    @property
    def phase(self) -> np.ndarray:
        """Phase of the values [degrees], without jumps by 360 degrees."""
        degrees: np.ndarray = np.degrees(np.unwrap(np.angle(self.values)))
        return degrees

    def __array__(self, dtype: Any = None, copy: bool | None = None) -> np.ndarray:
        """Returns the complex values."""
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
    """Returns the frequencies of ``cohaptic admittance``, in a geometric series."""
    top = min(_HIGHEST, highest)
    ratio = top / _LOWEST
    return [_LOWEST * math.pow(ratio, place / (_POINTS - 1)) for place in range(_POINTS - 1)] + [top]
