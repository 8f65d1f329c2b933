"""Runs with their results, and pictures."""

from __future__ import annotations

import html
import json
import re
from functools import cached_property
from pathlib import Path
from typing import TYPE_CHECKING, Any

from cohaptic.table import Table

if TYPE_CHECKING:
    from cohaptic import _native


class Picture:
    """Picture as SVG. Notebooks show the picture.

    >>> Picture("<svg><title>Delays &amp; losses</title></svg>")
    <Picture: Delays & losses>
    """

    def __init__(self, svg: str) -> None:
        self.svg = svg

    def __repr__(self) -> str:
        title = re.search("<title>(.*?)</title>", self.svg, re.DOTALL)
        return f"<Picture: {html.unescape(title[1])}>" if title else "<Picture>"

    def _repr_svg_(self) -> str:
        return self.svg

    def save(self, path: str | Path) -> None:
        """Writes the picture to an SVG file."""
        Path(path).write_text(self.svg, encoding="utf-8")


class Run:
    """Result of :meth:`cohaptic.Scene.run`.

    >>> from cohaptic import Scene
    >>> scene = Scene('''
    ... scene = { duration = "100ms", count = 2 }
    ... object.mass = 0.45
    ... coordination = { strategy = "average-position", stiffness = 1000.0, update = "8ms" }
    ... peer = { device = { mass = 0.1 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    ... ''')
    >>> run = scene.run()
    >>> run.summary["ending"], run.trajectory.rows, run.links["delivered"].tolist()
    ('complete', 200, [13, 13])
    >>> run.plot("network").svg[:5]
    '<svg '
    """

    def __init__(self, native: _native.Run) -> None:
        self._native = native

    @property
    def title(self) -> str:
        """Title of the scene."""
        return self._native.title

    @cached_property
    def summary(self) -> dict[str, Any]:
        """Document of ``cohaptic run --json``, without the wall time of the run and the files."""
        document: dict[str, Any] = json.loads(self._native.summary)
        return document

    @cached_property
    def trajectory(self) -> Table:
        """Table with a row per peer and tick, and the columns of ``trajectory.csv``."""
        return self._kept(self._native.trajectory)

    @cached_property
    def packets(self) -> Table:
        """Table with a row per delivered or dropped packet, and the columns of ``packets.csv``. ``arrived`` is NaN for a dropped packet."""
        return self._kept(self._native.packets)

    @cached_property
    def links(self) -> Table:
        """Table with a row per link or access line, and the columns of ``links.csv``. ``mean-delay-s`` is NaN for a link without a delivery."""
        return Table(self._native.links())

    def plot(self, name: str = "positions") -> Picture:
        """Returns a picture of ``cohaptic run``: ``positions``, ``forces`` or ``network``; for an object that turns also ``orientations`` or ``views``."""
        return Picture(self._native.picture(name))

    def _repr_svg_(self) -> str | None:
        return self.plot().svg if self._native.trajectory is not None else None

    @staticmethod
    def _kept(table: _native.Table | None) -> Table:
        if table is None:
            raise ValueError("rows were not kept: expected a run with record=True")
        return Table(table)

    def __repr__(self) -> str:
        return f"<Run of {self.title!r}: {self.summary['ending']}>"
