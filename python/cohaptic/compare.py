"""Comparisons of strategies with the same seeds."""

from __future__ import annotations

from collections.abc import Iterable

from cohaptic.campaign import Runs, Vary, Workers, _answer
from cohaptic.scene import Scene


class Comparison(Runs):
    """Table of :func:`compare`, with the document of ``cohaptic compare`` as ``summary``."""


def compare(
    scene: Scene,
    strategies: str | Iterable[str],
    *,
    vary: Vary = (),
    runs: int = 10,
    executor: Workers = None,
    piece: int | None = None,
) -> Comparison:
    """Compares strategies over values of keys. Returns the figures of ``cohaptic compare`` for the same strategies.

    ``strategies`` is a text as for ``--strategies``, or a list of strategies. All strategies are compared with the first strategy. Parameters are in
    braces after the name: ``"local-damping{damping=58}"``. Every strategy has the same seeds, and all measures. Combinations that a strategy refuses are
    left out, and the summary has the reason. All other parameters are parameters of :func:`campaign`.

    >>> scene = Scene('''
    ... scene = { duration = "200ms" }
    ... object.mass = 0.45
    ... coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
    ... peer = { device = { mass = 0.1 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
    ... peers = [{ name = "left", hand = { force = 1.5 } }, { name = "right" }]
    ... link = { delay = "24ms", loss = "10%" }
    ... ''')
    >>> comparison = compare(scene, ["average-position", "extrapolated"], runs=4)
    >>> first, second = comparison.summary["combinations"]
    >>> second["strategy"], second["runs"], second["verdict"]
    ('extrapolated', 4, 'unstable')
    """
    names = strategies if isinstance(strategies, str) else ",".join(strategies)
    return Comparison(_answer(scene, vary, runs, names, False, executor, piece))
