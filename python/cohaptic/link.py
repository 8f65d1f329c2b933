"""One emulated link, for simulations of your own."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from cohaptic import _native

CAUSES: tuple[str, ...] = tuple(_native.causes())
"""Why a packet was dropped, by its code in :attr:`Sent.cause`; 0 is no cause."""

ON_THE_WAY = 255
"""The code of a packet that never comes out of the link."""


class Copies(NamedTuple):
    """The copies that a link made of packets, in the order in which they arrived or were dropped."""

    packet: np.ndarray
    """Of which packet, by its place."""
    number: np.ndarray
    """Which copy, from 1."""
    arrived: np.ndarray
    """When it arrived [s]; NaN if it was dropped."""
    cause: np.ndarray
    """Why it was dropped, as in :attr:`Sent.cause`."""


class Sent(NamedTuple):
    """What became of packets: an entry for each, in the order in which they were sent."""

    arrived: np.ndarray
    """When it arrived [s]; NaN if it was dropped."""
    cause: np.ndarray
    """0 if it arrived, else the place of the cause in :data:`CAUSES`."""
    marked: np.ndarray
    """Whether an active queue marked it."""
    damaged: np.ndarray
    """Whether bits were flipped."""
    copies: Copies
    """The copies that the link made."""

    @property
    def delivered(self) -> np.ndarray:
        """Whether it arrived."""
        return np.asarray(self.cause == 0)


class Event(NamedTuple):
    """What became of one packet, or of one copy of it."""

    payload: Any
    """The object that was handed over."""
    sequence: int
    """The number of the packet, from 0."""
    copy: int
    """0 for the packet itself; copies count from 1."""
    offered: float
    """When it was offered [s]."""
    at: float
    """When it happened [s]."""
    fate: str
    """``delivered``, ``duplicated``, or why it was dropped."""
    size: int
    """In bytes."""
    marked: bool
    """Whether an active queue marked it."""
    damaged: bool
    """Whether bits were flipped."""


class Link:
    """A directed link: delays, losses, queues, order.

    ``spec`` is said in words of ``tc-netem``, or in keys of a scene: ``"delay 20ms 5ms loss 1%"`` or ``"delay=20ms jitter=5ms loss=1%"``; a list has keys
    whose values have spaces. Or it is a link of the library, which keys may follow: ``"starlink/down rate=50Mbit"``. Seed, sender and receiver are the
    address of its random numbers: equal addresses give equal links, those of ``cohaptic link`` with the same seed.

    >>> sent = Link("delay 20ms loss 10%", seed=1).send(np.arange(5) * 0.01, 64)
    >>> sent.arrived
    array([ nan, 0.03, 0.04, 0.05, 0.06])
    >>> [CAUSES[code] for code in sent.cause[:2]]
    ['loss', '']

    Step by step, with any object on board:

    >>> link = Link("delay 20ms")
    >>> link.handle_packet(0.0, 64, "hello")
    >>> link.next
    0.02
    >>> [event.payload for event in link.poll(0.02)]
    ['hello']
    """

    def __init__(
        self, spec: str | Iterable[str], seed: int = 0, *, sender: str = "sender", receiver: str = "receiver"
    ) -> None:
        keys = _keys(spec)
        self._native = _native.Link(keys, seed, sender, receiver)
        self._said = " ".join(spec.split() if isinstance(spec, str) else keys)

    def send(self, times: npt.ArrayLike, sizes: npt.ArrayLike = 64, *, ecn: bool = False) -> Sent:
        """Sends packets at those times [s], which do not fall, and gives what becomes of each.

        The link is a new one for each call: what was sent before, and step by step, has no part in it. ``sizes`` [bytes] is one of all, or one of each.
        """
        at = np.ascontiguousarray(times, dtype=np.float64).reshape(-1)
        size = np.ascontiguousarray(sizes, dtype=np.uint64).reshape(-1)
        arrived, cause, marked, damaged, copies = self._native.send(at, size, ecn)
        return Sent(arrived, cause, marked, damaged, Copies(*copies))

    def measure(
        self, packets: int = 100_000, every: float = 0.001, size: int = 64, *, ecn: bool = False
    ) -> dict[str, Any]:
        """Sends a steady stream, a packet every so often [s], and gives the document of ``cohaptic link --json``.

        It has the figures that the link was asked for and those that it achieved, without the speed of the emulator and the files. As in :meth:`send`,
        the link is a new one for each call.

        >>> measured = Link("delay 20ms 5ms loss 1%", seed=1).measure()
        >>> measured["asked"]["loss"], measured["achieved"]["loss"]
        (0.01, 0.00946)
        >>> [figure["name"] for figure in measured["compared"] if figure["outside"]]
        []
        """
        document: dict[str, Any] = json.loads(self._native.measure(self._said, packets, every, size, ecn))
        return document

    def handle_packet(self, now: float, size: int = 64, payload: Any = None, *, ecn: bool = False) -> None:
        """Offers a packet [s, bytes]. Instants must not fall from call to call."""
        self._native.handle_packet(now, size, payload, ecn)

    def poll(self, now: float) -> list[Event]:
        """Lets time pass until then [s], and gives what has happened since the last call, in order."""
        return [Event(*event) for event in self._native.poll(now)]

    @property
    def next(self) -> float | None:
        """The instant at which :meth:`poll` is to be called next [s]; ``None`` if nothing is on the way.

        ``poll(link.next)`` gives what happens then, also where instants are those of ``time.time()``, whose numbers are 238 ns apart: where the nearest
        number is before the arrival, ``next`` is the one after it.
        """
        return self._native.next

    def change(self, now: float, spec: str | Iterable[str]) -> None:
        """Replaces the link from now [s] on, with its packets on the way."""
        self._native.change(now, _keys(spec))


def profile(name: str) -> dict[str, Any]:
    """A link of the library with the source of each number: ``"starlink"``, or with the version, ``"starlink@1"``.

    ``down`` and ``up`` have the ``keys`` of the link as TOML, and the ``reasons`` of each key: its ``grade``, the ``sources`` and ``how`` the number follows
    from them. ``cohaptic link --list`` lists the names.

    >>> dish = profile("starlink")
    >>> dish["grade"], dish["down"]["keys"]["rate"], dish["down"]["reasons"]["rate"]["sources"]
    ('C', '"178Mbit"', ['michel-2022'])
    """
    document: dict[str, Any] = json.loads(_native.profile(name))
    return document


def _keys(spec: str | Iterable[str]) -> list[str]:
    if not isinstance(spec, str):
        return list(spec)
    first, *rest = spec.split() or [""]
    if _native.is_profile(first):
        return [f"profile={first}", *rest]
    if "=" in spec:
        return spec.split()
    words = spec.strip()
    return [f'netem="{words}"'] if words else []
