"""A scene, and what can be asked of it."""

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
"""Makes the law of a peer: a class, mostly."""


@dataclass(frozen=True)
class Expectation:
    """One expectation of a scene, and what came out."""

    expectation: str
    """The section of ``[expect]``."""
    name: str
    """The quantity that is compared, in words."""
    unit: str
    """The unit of the numbers; empty for ratios."""
    low: float | None
    """The least value that is expected."""
    high: float | None
    """The greatest value that is expected."""
    measured: float | None
    """What came out, if it is a number."""
    passed: bool
    """Whether that is as expected."""
    expected: str
    """The expectation in words."""
    found: str
    """What came out, in words."""


@dataclass(frozen=True)
class Check:
    """Whether a scene does what its ``[expect]`` says."""

    failures: list[str]
    """A line for each expectation that does not hold."""
    expectations: list[Expectation]
    """What came out of each."""
    notes: list[str]
    """What was told in another way than it could be with more time."""

    @property
    def passed(self) -> bool:
        """Whether all expectations hold."""
        return not self.failures


class Scene:
    """A checked scene, from a file or from a text of TOML.

    A text is told from the name of a file by a line break or a ``=``. Scenes do not change: :meth:`set` gives another one.

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
        """The text and the overrides; files that the scene names are read again."""
        native = self._native
        return _parsed, (native.text, native.file, native.overrides)

    @property
    def title(self) -> str:
        """Its title."""
        return self._native.title

    @property
    def text(self) -> str:
        """The text that it was read from."""
        return self._native.text

    @property
    def overrides(self) -> list[str]:
        """What was set, as ``KEY=VALUE``."""
        return self._native.overrides

    @property
    def peers(self) -> list[str]:
        """The names of its peers."""
        return self._native.peers

    @property
    def axes(self) -> int:
        """How many axes it has."""
        return self._native.axes

    @property
    def duration(self) -> float:
        """How long it lasts [s]."""
        return self._native.duration

    @property
    def seed(self) -> int:
        """The seed of its random numbers."""
        return self._native.seed

    def set(self, key: str | Mapping[str, Any], value: Any = _NO_VALUE) -> Scene:
        """The scene with another value of a key, as by ``--set``: a number, a truth value, a list, a mapping, or a text such as ``"8ms"``.

        Like there, a text is taken as TOML if it is TOML. A mapping of keys to values in place of a key sets all of them at once, where
        no scene makes sense with one of them alone.

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

        Without ``record`` no rows are kept, and a scene may be so large that only its summary fits into memory; then ``threads`` share the work where
        that pays. ``measure`` names measures, or ``"all"``. ``law`` makes a coordination law for each peer in place of the scene's.
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
        """Whether the scene does what its ``[expect]`` says; a scene without one passes."""
        failures, expectations, notes = self._native.check(general)
        return Check(failures, [Expectation(**outcome) for outcome in json.loads(expectations)], notes)

    def explain(self) -> dict[str, Any]:
        """What the scene makes the program model, what is left out, and what a run costs: the document of ``cohaptic explain --json``."""
        document: dict[str, Any] = json.loads(self._native.explain())
        return document

    def stability(self, *, method: str = "reduced", law: MakeLaw | None = None) -> Stability:
        """Whether the scene is stable, without simulating it, by the method ``reduced``, ``determinant`` or ``full``.

        A linear ``law`` is judged by the method ``full``.
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
        """The radius over a grid of two keys, each as ``"coordination.stiffness=0..6000"`` or as key, lowest and highest value."""
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
        """Every value of a key at which the scene turns stable or unstable; ranges are said as in :meth:`map`."""
        return Boundary._of(_native.boundary(self._native, _key_range(along), tolerance, samples, threads or 0))

    def admittance(
        self,
        frequencies: npt.ArrayLike | None = None,
        *,
        peer: str | None = None,
        axis: str | None = None,
        seen: str | None = None,
    ) -> Admittance:
        """How fast the device of a peer moves for the force that pushes it, at frequencies [Hz].

        Without frequencies they are 60 from 0.01 Hz to 100 Hz; without a peer it is that of the first one. ``axis`` is that of the push, ``seen`` that of the
        motion.
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
    """A value as it stands behind ``--set KEY=``; within lists and mappings texts have quotes."""
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
