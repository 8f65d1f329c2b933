"""Scenes: reading, changing, running and analysing."""

from __future__ import annotations

import json
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy.typing as npt

from cohaptic import _native
from cohaptic.law import Law, Peer
from cohaptic.run import Run
from cohaptic.stability import Admittance, Boundary, Map, Stability, _key_range, _spread

_NO_VALUE: Any = object()

MakeLaw = Callable[[Peer], Law]
"""Function that makes the law of a peer; usually the class of the law."""


@dataclass(frozen=True)
class Expectation:
    """One expectation of a scene with its result."""

    expectation: str
    """Section of ``[expect]``."""
    name: str
    """Compared quantity in words."""
    unit: str
    """Unit of the numbers; empty for ratios."""
    low: float | None
    """Least expected value; ``None`` without a lower bound."""
    high: float | None
    """Greatest expected value; ``None`` without an upper bound."""
    measured: float | None
    """Result as a number; ``None`` if the result is no number."""
    passed: bool
    """``True`` if the result is as expected."""
    expected: str
    """Expectation in words."""
    found: str
    """Result in words."""


@dataclass(frozen=True)
class Check:
    """Result of the check of a scene against its ``[expect]``."""

    failures: list[str]
    """Lines about the expectations that do not hold."""
    expectations: list[Expectation]
    """All expectations with their results."""
    notes: list[str]
    """Notes about results that were found in a less exact way to save time."""

    @property
    def passed(self) -> bool:
        """``True`` if all expectations hold."""
        return not self.failures


class Scene:
    """A checked scene, from a file or from a text of TOML.

    A source with a line break or a ``=`` is a text; any other source is the name of a file. Scenes do not change: :meth:`set` returns another scene.

    >>> scene = Scene('''
    ... scene = { duration = "1s", count = 3, title = "Three users" }
    ... object.mass = 0.45
    ... coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
    ... peer = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    ... link.delay = "8ms"
    ... ''')
    >>> scene.peers
    ['peer1', 'peer2', 'peer3']
    >>> scene.set("coordination.stiffness", 1500).stability().verdict
    'stable'
    """

    def __init__(self, source: str | os.PathLike[str], overrides: Iterable[str] = ()) -> None:
        overrides = list(overrides)
        if isinstance(source, str) and ("\n" in source or "=" in source):
            self._native = _native.Scene(source, "<text>", overrides)
        else:
            self._native = _native.Scene.read(os.fspath(source), overrides)

    @classmethod
    def _of(cls, native: _native.Scene) -> Scene:
        scene = cls.__new__(cls)
        scene._native = native
        return scene

    def __reduce__(self) -> tuple[Any, ...]:
        """Pickles the text and the overrides. Files that the scene names are read again."""
        native = self._native
        return _parsed, (native.text, native.file, native.overrides)

    @property
    def title(self) -> str:
        """Title of the scene."""
        return self._native.title

    @property
    def text(self) -> str:
        """Text from which the scene was read."""
        return self._native.text

    @property
    def overrides(self) -> list[str]:
        """Overrides of the text, as ``KEY=VALUE``."""
        return self._native.overrides

    @property
    def peers(self) -> list[str]:
        """Names of the peers."""
        return self._native.peers

    @property
    def axes(self) -> int:
        """Number of axes, 1 to 3."""
        return self._native.axes

    @property
    def duration(self) -> float:
        """Duration of the scene [s]."""
        return self._native.duration

    @property
    def seed(self) -> int:
        """Seed of all random numbers of the scene."""
        return self._native.seed

    def set(self, key: str | Mapping[str, Any], value: Any = _NO_VALUE) -> Scene:
        """Returns the scene with another value of a key, as by ``--set``: a number, a truth value, a list, a mapping, or a text such as ``"8ms"``.

        As with ``--set``, a text that is TOML is read as TOML. A mapping of keys to values in place of a key sets all of the keys at once. Use a mapping
        if the scene makes no sense with one of the changes alone.

        >>> scene = Scene('''
        ... scene = { duration = "1s" }
        ... object.mass = 0.45
        ... coordination = { strategy = "average-position", stiffness = 1000.0, update = "8ms" }
        ... peer = { device = { mass = 0.1 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
        ... peers = [{ name = "left" }, { name = "right" }]
        ... ''')
        >>> scene.set({"peers": [], "scene.count": 5}).peers[-1]
        'peer5'
        """
        if isinstance(key, Mapping):
            if value is not _NO_VALUE:
                raise TypeError("set() takes a key and a value, or a mapping alone")
            return self._with(*(f"{name}={_toml(item)}" for name, item in key.items()))
        if value is _NO_VALUE:
            raise TypeError("set() takes a key and a value, or a mapping alone")
        return self._with(f"{key}={_toml(value)}")

    def _with(self, *overrides: str) -> Scene:
        native = self._native
        return _parsed(native.text, native.file, [*native.overrides, *overrides])

    def run(
        self,
        *,
        seed: int | None = None,
        threads: int | None = None,
        record: bool = True,
        measure: str | Sequence[str] | None = None,
        law: MakeLaw | None = None,
        general: bool = False,
    ) -> Run:
        """Runs the scene in virtual time.

        Without ``record`` no rows are kept, so a scene may be so large that only its summary fits into memory. ``threads`` then share the work if this is
        faster; by default there is one thread per core. ``measure`` names measures, or is ``"all"``. ``law`` makes a coordination law for each peer, in
        place of the law of the scene. With ``general`` everything is simulated, also parts that the scene does not need; the results are the same.
        """
        scene = self
        if seed is not None:
            scene = scene._with(f"scene.seed={seed}")
        if measure is not None:
            names = measure if measure == "all" else [measure] if isinstance(measure, str) else list(measure)
            scene = scene._with(f"measure.names={json.dumps(names)}")
        threads = os.cpu_count() or 1 if threads is None else threads
        return Run(_native.Run(scene._native, threads, general, record, record, law))

    def check(self, *, general: bool = False) -> Check:
        """Checks the scene against its ``[expect]``. A scene without ``[expect]`` passes."""
        failures, expectations, notes = self._native.check(general)
        return Check(failures, [Expectation(**outcome) for outcome in json.loads(expectations)], notes)

    def explain(self) -> dict[str, Any]:
        """Returns the document of ``cohaptic explain --json``: the modelled parts of the scene, the parts left out, and the cost of a run."""
        document: dict[str, Any] = json.loads(self._native.explain())
        return document

    def stability(self, *, method: str = "reduced", law: MakeLaw | None = None) -> Stability:
        """Analyses the stability of the scene without a simulation, by the method ``reduced``, ``determinant`` or ``full``.

        A ``law`` in Python must be linear, and is always analysed by the method ``full``.
        """
        return Stability(self._native, method, law)

    def map(
        self,
        x: str | tuple[str, Any, Any],
        y: str | tuple[str, Any, Any],
        *,
        grid: tuple[int, int] = (60, 40),
        threads: int | None = None,
    ) -> Map:
        """Returns the radius over a grid of two keys.

        Each range is a text such as ``"coordination.stiffness=0..6000"``, or a tuple of the key, the lowest and the highest value. ``grid`` has the number
        of values of x and of y.
        """
        columns, rows = grid
        return Map._of(_native.map(self._native, _key_range(x), _key_range(y), columns, rows, threads or 0))

    def boundary(
        self,
        along: str | tuple[str, Any, Any],
        *,
        tolerance: float | None = None,
        samples: int | None = None,
        threads: int | None = None,
    ) -> Boundary:
        """Returns every value of a key at which the scene becomes stable or unstable. The range has the form of :meth:`map`."""
        return Boundary._of(_native.boundary(self._native, _key_range(along), tolerance, samples, threads or 0))

    def admittance(
        self,
        frequencies: npt.ArrayLike | None = None,
        *,
        peer: str | None = None,
        axis: str | None = None,
        seen: str | None = None,
    ) -> Admittance:
        """Returns the admittance at the device of a peer: velocity of the device divided by the force that pushes it, at ``frequencies`` [Hz].

        By default there are 60 frequencies from 0.01 Hz to 100 Hz, and the peer is the first peer. ``axis`` is the axis of the push, and ``seen`` the axis
        of the motion.
        """
        at = _spread if frequencies is None else [float(hz) for hz in _flat(frequencies)]
        return Admittance._of(_native.admittance(self._native, peer or self.peers[0], at, axis, seen))

    def __repr__(self) -> str:
        return f"<Scene {self.title!r} of {len(self.peers)} peers>"


def _parsed(text: str, file: str, overrides: list[str]) -> Scene:
    return Scene._of(_native.Scene(text, file, overrides))


def _flat(numbers: npt.ArrayLike) -> Any:
    import numpy as np

    return np.asarray(numbers, dtype=np.float64).reshape(-1)


def _toml(value: Any) -> str:
    """Returns a value as text for ``--set KEY=``. Texts within lists and mappings have quotes."""
    return value if isinstance(value, str) else _inner(value)


def _inner(value: Any) -> str:
    if isinstance(value, bool):
        return "true" if value else "false"
    if isinstance(value, str):
        return json.dumps(value, ensure_ascii=False)
    if isinstance(value, Mapping):
        return "{ " + ", ".join(f"{json.dumps(str(key))} = {_inner(item)}" for key, item in value.items()) + " }"
    if isinstance(value, Sequence):
        return "[" + ", ".join(map(_inner, value)) + "]"
    if hasattr(value, "tolist"):
        # A number or an array of NumPy.
        return _inner(value.tolist())
    if isinstance(value, int | float):
        return repr(value)
    raise TypeError(
        f"{value!r} is not a value of a scene: expected a number, a truth value, a text, a list or a mapping"
    )
