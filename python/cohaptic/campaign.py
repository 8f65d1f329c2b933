"""Many runs of one scene, spread over any executor."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from concurrent.futures import FIRST_COMPLETED, BrokenExecutor, Executor, ThreadPoolExecutor, wait
from functools import cached_property, partial
from typing import Any

from cohaptic import _native
from cohaptic.errors import CohapticError
from cohaptic.run import Picture
from cohaptic.scene import Scene, _toml
from cohaptic.table import Table

_Cells = list[list[Any]]
_Piece = tuple[int, int]
_Work = Callable[[int, int], _Cells]
_Plan = tuple[str, str, list[str], list[str], int, str | None, str]

Vary = Mapping[str, Sequence[Any]] | Iterable[str]
"""Keys with their values, or texts as for ``--vary``."""

Workers = Executor | Callable[[], Executor] | None
"""Executor, or function that makes an executor; ``None`` for threads of this process."""

_ASKED = 3
"""Number of times that the same runs are asked for, before the exception of their worker is raised."""

_PIECES = 64
"""Approximate number of pieces of a campaign: enough to keep workers busy to the end, and so few that their overhead is small."""


class Runs(Table):
    """Table with a row per run, and the document of the runs."""

    def __init__(self, answer: _native.CampaignAnswer) -> None:
        super().__init__(answer.table)
        self._answer = answer

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Document of the command with ``--json``, without the wall time of the runs and the files."""
        document: dict[str, Any] = json.loads(self._answer.summary)
        return document


class Campaign(Runs):
    """Table of :func:`campaign`, with the document of ``cohaptic campaign`` as ``summary``."""

    def plot(self, name: str = "discrepancy") -> Picture:
        """Returns a picture of ``cohaptic campaign``: ``discrepancy``, or ``verdicts`` if combinations were judged."""
        return Picture(self._answer.picture(name))


def campaign(
    scene: Scene,
    *,
    vary: Vary = (),
    runs: int = 1,
    verdicts: bool = False,
    executor: Workers = None,
    piece: int | None = None,
) -> Campaign:
    """Runs a scene over values of keys and over seeds. Returns a row per run: the rows of ``cohaptic campaign`` for the same keys.

    ``vary`` maps keys to their values, or has texts as for ``--vary``, such as ``"coordination.stiffness=500..1500/3"``. Every combination is run with
    ``runs`` seeds, which count up from the seed of the scene. The column of a key has the name of the key, and :meth:`Table.unit` returns its unit. (The
    table of the program has both in one name, such as ``link.delay_ms``.) With ``verdicts`` each combination is judged like :meth:`Scene.stability`, and
    each row has the verdict of its combination.

    ``executor`` is a ``concurrent.futures.Executor`` whose workers have this package, or a callable that makes an executor. By default threads of this
    process do the runs. ``piece`` is the number of runs in one call of a worker. Runs that a worker lost are asked for again, up to three times. If the
    executor breaks, a callable makes a new executor; without a callable, this process does the remaining runs. The row of a run does not depend on the
    worker.

    >>> scene = Scene('''
    ... scene = { duration = "100ms", count = 2 }
    ... object.mass = 0.45
    ... coordination = { strategy = "average-position", stiffness = 1000.0, update = "8ms" }
    ... peer = { device = { mass = 0.1 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    ... link = { delay = "8ms", loss = "10%" }
    ... ''')
    >>> table = campaign(scene, vary={"coordination.stiffness": [500, 1000]}, runs=3)
    >>> table.rows, table["seed"].tolist()
    (6, [0, 1, 2, 0, 1, 2])
    >>> [(combination["vary"], combination["runs"]) for combination in table.summary["combinations"]]
    [(['coordination.stiffness=500'], 3), (['coordination.stiffness=1000'], 3)]
    """
    return Campaign(_answer(scene, vary, runs, None, verdicts, executor, piece))


def _answer(
    scene: Scene,
    vary: Vary,
    runs: int,
    strategies: str | None,
    verdicts: bool,
    executor: Workers,
    piece: int | None,
) -> _native.CampaignAnswer:
    native = scene._native
    texts = [f"{key}={_listed(values)}" for key, values in vary.items()] if isinstance(vary, Mapping) else list(vary)
    whole = _native.Campaign(native.text, native.file, native.overrides, texts, runs, 0, strategies)
    plan = (native.text, native.file, native.overrides, texts, runs, strategies, whole.roster)
    size = piece or max(8, math.ceil(whole.runs / _PIECES))
    pieces = [(start, min(start + size, whole.runs)) for start in range(0, whole.runs, size)]
    if executor is None:
        rows = _here(whole, pieces)
    elif isinstance(executor, Executor) or not callable(executor):
        rows = _gathered(partial(_rows, plan), pieces, executor, None)
    else:
        rows = _gathered(partial(_rows, plan), pieces, executor(), executor)
    return whole.answer([row for place in pieces for row in rows[place]], verdicts, 0)


def _listed(values: Sequence[Any]) -> str:
    return ",".join(map(_toml, values))


def _rows(plan: _Plan, start: int, end: int) -> _Cells:
    """Returns the rows of the runs from ``start`` to ``end``. Any process can call this function."""
    text, file, overrides, vary, runs, strategies, roster = plan
    return _native.Campaign(text, file, overrides, vary, runs, 1, strategies, roster).rows(start, end)


def _here(whole: _native.Campaign, pieces: list[_Piece]) -> dict[_Piece, _Cells]:
    """Returns all rows, computed by threads of this process that end with this call."""
    with ThreadPoolExecutor(os.cpu_count()) as threads:
        try:
            return _gathered(whole.rows, pieces, threads, None)
        except BaseException:
            whole.stop()
            raise


def _gathered(
    work: _Work,
    pieces: list[_Piece],
    executor: Executor,
    make: Callable[[], Executor] | None,
) -> dict[_Piece, _Cells]:
    rows: dict[_Piece, _Cells] = {}
    asked = dict.fromkeys(pieces, 0)
    try:
        while missing := [place for place in pieces if place not in rows]:
            if not _ask(work, missing, executor, rows, asked):
                continue
            if make is None:
                # Nobody is left to ask.
                rows.update({place: work(*place) for place in missing if place not in rows})
            else:
                executor.shutdown(wait=False, cancel_futures=True)
                executor = make()
    finally:
        if make is not None:
            executor.shutdown(cancel_futures=True)
    return rows


def _ask(
    work: _Work,
    missing: list[_Piece],
    executor: Executor,
    rows: dict[_Piece, _Cells],
    asked: dict[_Piece, int],
) -> bool:
    """Asks for pieces, and adds the results to the rows. Returns whether the executor broke meanwhile."""
    futures = {}
    broken = False
    try:
        for place in missing:
            asked[place] += 1
            futures[executor.submit(work, *place)] = place
    except BrokenExecutor:
        broken = True
    left = set(futures)
    try:
        while left:
            done, left = wait(left, return_when=FIRST_COMPLETED)
            for future in done:
                place = futures[future]
                try:
                    rows[place] = future.result()
                except CohapticError:
                    # A scene is refused, whoever runs it.
                    raise
                except BrokenExecutor:
                    broken = True
                except Exception:
                    if asked[place] >= _ASKED:
                        raise
    except BaseException:
        for future in left:
            future.cancel()
        raise
    return broken
