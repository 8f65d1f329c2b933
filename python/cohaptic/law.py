"""Coordination laws that are written in Python.

A law is made for each peer, and asked for a force at each of its ticks. A spring and a damper to the mean of the others, which is
average-position coordination, is

>>> class Spring:
...     def __init__(self, peer):
...         self.peer = peer
...     def command(self, own, held, t):
...         to_mean = own.position - held.mean.position
...         return self.peer.stiffness * to_mean + self.peer.damping * (own.velocity - held.mean.velocity)

and is run and judged by ``scene.run(law=Spring)`` and ``scene.stability(law=Spring)``.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from cohaptic._native import Held, State

__all__ = ["Held", "Law", "Peer", "State"]


@dataclass(frozen=True)
class Peer:
    """Whose law it is."""

    name: str
    """Its name."""
    place: int
    """Its place in the scene."""
    others: int
    """How many others take part."""
    axes: int
    """How many axes the scene has."""
    stiffness: float
    """The stiffness of the coordination, scaled by the number of peers as the scene says [N/m]."""
    damping: float
    """The damping of the coordination, scaled in the same way [N·s/m]."""
    tick: float
    """The time between two ticks [s]."""
    update: float
    """The time between two samples that it sends [s]."""


class Law(Protocol):
    """What a law has. Nothing has to inherit from it.

    The answer depends on the calls made so far and on nothing else. All that is remembered from tick to tick stands in an attribute ``memory``, an array
    or a list of always as many numbers, which the analysis reads and sets; a law without it remembers nothing. A method
    ``set_gains(stiffness, damping)`` [N/m, N·s/m], if there is one, hears of gains that the timeline changes.
    """

    def command(self, own: State, held: Held, t: float) -> Any:
        """The force that is subtracted [N], a number for each axis.

        ``own`` is the copy of the peer: ``position`` and ``velocity`` are arrays with a number for each axis. ``held`` has the newest samples from the
        others: their ``mean``, and ``positions`` and ``velocities`` with a row for each. ``t`` is the instant [s].
        """
        ...
