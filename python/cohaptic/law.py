"""Coordination laws that are written in Python.

A law is made for each peer, and is asked for a force at each tick of the peer. Average-position coordination is a spring and a damper to the mean of
the other peers:

>>> class Spring:
...     def __init__(self, peer):
...         self.peer = peer
...     def command(self, own, held, t):
...         to_mean = own.position - held.mean.position
...         return self.peer.stiffness * to_mean + self.peer.damping * (own.velocity - held.mean.velocity)

``scene.run(law=Spring)`` runs the scene with this law, and ``scene.stability(law=Spring)`` analyses it.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Protocol

from cohaptic._native import Held, State

__all__ = ["Held", "Law", "Peer", "State"]


@dataclass(frozen=True)
class Peer:
    """The peer that a law is made for."""

    name: str
    """Name of the peer."""
    place: int
    """Index of the peer in the scene, from 0."""
    others: int
    """Number of other peers."""
    axes: int
    """Number of axes of the scene, 1 to 3."""
    stiffness: float
    """Stiffness of the coordination [N/m], scaled by the number of peers as the scene says."""
    damping: float
    """Damping of the coordination [N·s/m], scaled in the same way."""
    tick: float
    """Time between two ticks of the peer [s]."""
    update: float
    """Time between two samples that the peer sends [s]."""


class Law(Protocol):
    """Methods and attributes of a coordination law. A law need not inherit from this class.

    The force depends only on the calls made so far. A law keeps everything that it remembers from tick to tick in the attribute ``memory``, an array or
    a list whose length never changes. The analysis reads and sets this attribute. A law without ``memory`` remembers nothing. If the law has a method
    ``set_gains(stiffness, damping)`` [N/m, N·s/m], this method is called when the timeline changes the gains.
    """

    def command(self, own: State, held: Held, t: float) -> Any:
        """Returns the coordination force [N], a number for each axis. The force acts on the copy with the opposite sign.

        ``own`` is the state of the peer's copy: ``position`` [m] and ``velocity`` [m/s] are arrays with a number for each axis. ``held`` has the newest
        samples of the other peers: the ``mean`` of the samples, and ``positions`` and ``velocities`` with a row for each peer. ``t`` is the instant [s].
        """
        ...
