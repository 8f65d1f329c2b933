"""One emulated link, for simulations of your own."""

from __future__ import annotations

import json
from collections.abc import Iterable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from cohaptic import _native

CAUSES: tuple[str, ...] = tuple(_native.causes())
"""Names of the causes of a drop, indexed by the codes in :attr:`Sent.cause`. Code 0 means that the packet was delivered."""

ON_THE_WAY = 255
"""Code in :attr:`Sent.cause` of a packet that never comes out of the link."""


class Copies(NamedTuple):
    """Copies of packets that a link made, in the order in which the copies arrived or were dropped."""

    packet: np.ndarray
    """Index of the packet that was copied, in the order of sending."""
    number: np.ndarray
    """Number of the copy among the copies of its packet, from 1."""
    arrived: np.ndarray
    """Instant of the arrival [s]; NaN for a dropped copy."""
    cause: np.ndarray
    """Code of the cause of the drop, as in :attr:`Sent.cause`."""


class Sent(NamedTuple):
    """Fates of packets. Each array has an entry per packet, in the order of sending."""

    arrived: np.ndarray
    """Instant of the arrival [s]; NaN for a dropped packet."""
    cause: np.ndarray
    """Code of the cause of the drop, an index of :data:`CAUSES`; 0 for a delivered packet."""
    marked: np.ndarray
    """``True`` for a packet that an active queue marked (ECN)."""
    damaged: np.ndarray
    """``True`` for a packet with flipped bits."""
    copies: Copies
    """Copies of packets that the link made."""

    @property
    def delivered(self) -> np.ndarray:
        """``True`` for each delivered packet."""
        return np.asarray(self.cause == 0)


class Event(NamedTuple):
    """Fate of a packet, or of a copy of a packet."""

    payload: Any
    """Object that was given to :meth:`Link.handle_packet`."""
    sequence: int
    """Number of the packet, from 0."""
    copy: int
    """Number of the copy, from 1; 0 for the packet itself."""
    offered: float
    """Instant at which the packet was offered to the link [s]."""
    at: float
    """Instant of the fate [s]."""
    fate: str
    """``delivered``, ``duplicated``, or the cause of the drop."""
    size: int
    """Size of the packet [bytes]."""
    marked: bool
    """``True`` if an active queue marked the packet (ECN)."""
    damaged: bool
    """``True`` if bits of the packet were flipped."""


class Link:
    """A directed link: delays, losses, queues, order.

    ``spec`` has one of three forms: words of ``tc-netem`` such as ``"delay 20ms 5ms loss 1%"``; keys of a scene such as ``"delay=20ms jitter=5ms loss=1%"``,
    or a list of keys if a value has spaces; or the name of a link of the library, with further keys if wanted: ``"starlink/down rate=50Mbit"``. Seed,
    sender and receiver are the address of the random numbers. Links with equal addresses have equal random numbers, and so has ``cohaptic link`` with
    the same seed.

    >>> sent = Link("delay 20ms loss 10%", seed=1).send(np.arange(5) * 0.01, 64)
    >>> sent.arrived
    array([ nan, 0.03, 0.04, 0.05, 0.06])
    >>> [CAUSES[code] for code in sent.cause[:2]]
    ['loss', '']

    Step by step, with any object as payload:

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
        """Sends a packet at each of ``times`` [s], which must not decrease, and returns the fates of the packets.

        Each call begins with a new link: packets of earlier calls, and packets that were offered step by step, have no influence. ``sizes`` [bytes] is one
        size for all packets, or an array with a size for each packet.
        """
        at = np.ascontiguousarray(times, dtype=np.float64).reshape(-1)
        size = np.ascontiguousarray(sizes, dtype=np.uint64).reshape(-1)
        arrived, cause, marked, damaged, copies = self._native.send(at, size, ecn)
        return Sent(arrived, cause, marked, damaged, Copies(*copies))

    def measure(
        self, packets: int = 100_000, every: float = 0.001, size: int = 64, *, ecn: bool = False
    ) -> dict[str, Any]:
        """Sends a steady stream, a packet each ``every`` seconds, and returns the document of ``cohaptic link --json``.

        The document has the figures that the link was asked for and the figures that the link achieved, without the speed of the emulator and the files.
        As in :meth:`send`, each call begins with a new link.

        >>> measured = Link("delay 20ms 5ms loss 1%", seed=1).measure()
        >>> measured["asked"]["loss"], measured["achieved"]["loss"]
        (0.01, 0.00946)
        >>> [figure["name"] for figure in measured["compared"] if figure["outside"]]
        []
        """
        document: dict[str, Any] = json.loads(self._native.measure(self._said, packets, every, size, ecn))
        return document

    def handle_packet(self, now: float, size: int = 64, payload: Any = None, *, ecn: bool = False) -> None:
        """Offers a packet of ``size`` bytes at the instant ``now`` [s]. Instants must not decrease from call to call."""
        self._native.handle_packet(now, size, payload, ecn)

    def poll(self, now: float) -> list[Event]:
        """Lets time pass until ``now`` [s], and returns the events since the last call, in order of time."""
        return [Event(*event) for event in self._native.poll(now)]

    @property
    def next(self) -> float | None:
        """Instant at which :meth:`poll` must be called next [s]; ``None`` if no packet is on the way.

        ``poll(link.next)`` returns the events of this instant, also for instants of ``time.time()``, which are 238 ns apart as floating-point numbers: if
        the nearest number is before the arrival, ``next`` is the next number after the arrival.
        """
        return self._native.next

    def change(self, now: float, spec: str | Iterable[str]) -> None:
        """Replaces the configuration of the link from the instant ``now`` [s] on. Packets on the way stay on the way."""
        self._native.change(now, _keys(spec))


def profile(name: str) -> dict[str, Any]:
    """Returns a link of the library with the source of each number. ``name`` is ``"starlink"``, or with a version ``"starlink@1"``.

    ``down`` and ``up`` have the ``keys`` of the link as TOML, and the ``reasons`` of each key: its ``grade``, the ``sources``, and ``how`` the number follows
    from the sources. ``cohaptic link --list`` lists the names.

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
