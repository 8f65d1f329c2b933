"""A device in somebody's hand, as a peer of a live session.

>>> class Still:
...     '''A grip that nobody holds, in the middle of its workspace.'''
...     def read(self):
...         return Reading((0.0, 0.0, 0.0), (0.0, 0.0, 0.0))
...     def push(self, force):
...         self.force = force
...     def stop(self):
...         print("off")
>>> joined = join(Still(), "127.0.0.1:9", session=7, place=1, duration=0.05)
off
>>> joined.ticks, joined.ended, joined.position
(50, 'time', [0.0])
"""

from __future__ import annotations

import atexit
import contextlib
import math
import os
import signal
import threading
import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal, NamedTuple, Protocol, final

from .client import Client
from .core import Mechanics, grew, is_finite
from .datagrams import Session, read_key
from .gate import Gate, Limits, Moment
from .mechanics import State, Vector


class Reading(NamedTuple):
    """Reading of a device: motion of the grip. x points to the right of the person, y up, z to the person. The origin is in the middle of the workspace."""

    position: Sequence[float]
    """Position of the grip, three numbers [m]."""
    velocity: Sequence[float]
    """Velocity of the grip, three numbers [m/s]."""
    ready: bool = True
    """``True`` if the device is calibrated and powered. Otherwise position and velocity are ignored."""
    armed: bool = True
    """``True`` if the person has switched forces on. Otherwise the hand feels and moves nothing."""


class Device(Protocol):
    """Methods of a device. A device need not inherit from this class.

    ``read`` and ``push`` are called at each exchange, a thousand times a second in most scenes, and must not block: input and output belong to a thread
    of the device.
    """

    def read(self) -> Reading | None:
        """Returns the newest reading, or ``None`` without a new one. The age of the previous reading then grows."""
        ...

    def push(self, force: Sequence[float]) -> Any:
        """Takes the force on the hand [N], three numbers. The force has passed the gate, and is zero if the hand may feel nothing."""
        ...

    def stop(self) -> Any:
        """Switches all forces off for good. Later calls of ``push`` must do nothing.

        Called at every end of :func:`join`: after its duration, a signal or an exception, and at the end of the interpreter. May be called twice and from
        any thread.
        """
        ...


@dataclass(frozen=True)
class Joined:
    """Report of a device that took part in a session."""

    ended: str
    """Cause of the end: ``time``, ``stop`` for the event of the caller, or the name of a signal."""
    ticks: int
    """Number of ticks of the peer."""
    sent: int
    """Number of samples sent."""
    ignored: int
    """Number of datagrams that were no valid sample or answer for this peer."""
    joinings: int
    """Number of successful handshakes; 0 without a key."""
    pushes: dict[str, int]
    """Number of pushes of the device, by the cause of a zero force. ``force`` counts the forces that passed the gate."""
    position: list[float]
    """Position of the copy at the end [m], a number for each axis."""
    velocity: list[float]
    """Velocity of the copy at the end [m/s], a number for each axis."""
    received: dict[int, int]
    """Samples received from each other peer, by its place."""
    taken: int
    """Notices that another program has the seat. The session sends one for each sample that it refuses for this reason."""


def join(
    device: Device,
    door: str,
    *,
    session: int,
    place: int,
    key_file: str | os.PathLike[str] | None = None,
    peers: int = 2,
    axes: int = 1,
    tick: float = 0.001,
    update: float = 0.008,
    coupling: tuple[float, float] = (3500.0, 5.0),
    coordination: tuple[float, float] = (300.0, 5.0),
    law: Literal["AP", "PD"] = "AP",
    object_mass: float = 0.45,
    object_damping: float = 0.0,
    inertia: Vector | None = None,
    grasp: Vector = (0.0, 0.0, 0.0),
    start: Vector = (0.0, 0.0, 0.0),
    exchange_every: int = 1,
    exchange_age: Literal[0, 1] = 0,
    force_limit: float = 3.0,
    fade: float = 0.25,
    duration: float = math.inf,
    patience: float = 10.0,
    fingerprint: int = 0,
    label: str = "",
    until: threading.Event | None = None,
) -> Joined:
    """Holds a device in a live session at ``door``, HOST:PORT, and returns a report at the end.

    ``session`` is the seed of the scene, and ``place`` the index of the peer in the scene, from 0. With ``key_file`` the session tells ``peers``, ``axes``,
    ``tick`` and ``update`` [s]; without a key the caller gives these. ``coupling`` is KC and BC, ``coordination`` is KT and BT [N/m, N·s/m]. ``coupling``,
    ``coordination``, ``law``, the keys of the object, ``exchange_every`` and ``exchange_age`` must have the values of the scene. With a key the session also
    gets ``fingerprint`` and ``label``. It compares the fingerprint with its own (0: unknown). It shows the label, at most 8 printable ASCII characters.

    Each force passes a gate. The gate limits the force to ``force_limit`` [N], and its change to 1000 N/s. The gate makes the force zero at once if the
    device is not ready, not armed or not read, if nobody is heard, and after a pause of the loop above 20 ms. If the device cannot be read, the pull of the
    device on the copy fades within ``fade`` [s], and rises again within ``fade`` when the device is back.

    The call ends after ``duration`` [s], when the event ``until`` is set (from any thread), or with SIGINT or SIGTERM if called in the main thread. An
    exception of the device ends the call too. ``stop`` of the device is called in each case.

    :raises TimeoutError: nobody answered within ``patience`` [s]
    :raises ValueError: parameters that do not fit together
    :raises PermissionError: others than the owner may read the key file
    :raises ConnectionError: the session was started again with another scene
    :raises ArithmeticError: the copy has diverged
    """
    with _End(device, until or threading.Event()) as end:
        told = Session(session, place, peers, axes, inertia is not None, round(tick * 1e9), round(update * 1e9))
        mechanics = Mechanics(
            coupling,
            coordination,
            law,
            object_mass,
            object_damping,
            inertia,
            grasp,
            start,
            exchange_every,
            exchange_age,
        )
        key = None if key_file is None else read_key(key_file)
        client = Client(
            door,
            told,
            mechanics,
            key=key,
            patience=patience,
            fingerprint=fingerprint,
            label=label,
            is_stopped=end.has_come,
        )
        with client:
            tick_ns = client.peer.session.tick_ns
            if exchange_every * tick_ns > 20_000_000:
                raise ValueError("exchange_every ticks must be at most 20 ms")
            end.gate = Gate(Limits(force_limit, reading_age_ns=max(10_000_000, 3 * exchange_every * tick_ns)))
            loop = _Loop(device, client, end.gate, fade)
            ticks = duration * 1e9 / tick_ns
            while loop.k < ticks - 0.5 and not end.has_come():
                loop.tick()
    peer = client.peer
    return Joined(
        ended=end.signal or ("stop" if end.until.is_set() else "time"),
        ticks=loop.k,
        sent=peer.sent,
        ignored=peer.ignored,
        joinings=peer.joinings,
        pushes={cause.value: count for cause, count in end.gate.counts.items() if count},
        position=[x for x, _ in peer.copy.states],
        velocity=[v for _, v in peer.copy.states],
        received={place: other.received for place, other in peer.others.items()},
        taken=peer.taken,
    )


class _Loop:
    """Loop over the ticks of a peer with a device, on the thread of the caller."""

    def __init__(self, device: Device, client: Client, gate: Gate, fade: float) -> None:
        self.device, self.client, self.gate = device, client, gate
        self.k = 0
        """Number of the next tick."""
        self.began = time.monotonic_ns()
        self.per_tick = client.peer.session.tick_ns / (fade * 1e9) if fade > 0 else 1.0
        self.ready = self.armed = False
        self.reading_at: int | None = None
        self.setpoint_at: int | None = None
        client.peer.weight = 0.0

    def tick(self) -> None:
        """Waits for the next tick, and makes the tick."""
        peer, k = self.client.peer, self.k
        self.client.wait_for(k, self.began)
        self.client.exchange(k)
        now = time.monotonic_ns()
        states = self._read(now) if peer.exchanges(k) else None
        # A device that cannot be read, or may not be felt, fades out of the copy and comes back as slowly, so that the others feel no jump.
        is_read = self.reading_at is not None and now - self.reading_at <= self.gate.limits.reading_age_ns
        peer.weight = grew(peer.weight, self.ready and self.armed and is_read, self.per_tick)
        peer.tick(k, states)
        self.k += 1
        # In a silent session no force is asked for, because no other peer can be felt.
        if not peer.is_in_silence(now):
            self.setpoint_at = now
        if peer.exchanges(k):
            wanted = [*peer.on_hand, 0.0, 0.0][:3]
            force, _ = self.gate.admit(wanted, Moment(now, self.ready, self.armed, self.reading_at, self.setpoint_at))
            self.device.push(force)
        peer.check()

    def _read(self, now: int) -> list[State] | None:
        """Reads the device. Returns its states along the axes of the session, or ``None`` if the states cannot be used."""
        reading = self.device.read()
        if reading is None:
            return None
        self.ready, self.armed = bool(reading.ready), bool(reading.armed)
        axes = self.client.peer.session.axes
        states = [(float(x), float(v)) for x, v in zip(reading.position, reading.velocity, strict=True)][:axes]
        if len(states) < axes:
            raise ValueError(f"a reading needs a number for each of the {axes} axes of the session")
        if not self.ready or not is_finite(states):
            return None
        self.reading_at = now
        return states


@final
class _End:
    """Ends of a loop: duration, event, signal, exception, and the end of the interpreter. The device is stopped in each case."""

    def __init__(self, device: Device, until: threading.Event) -> None:
        self.device, self.until = device, until
        self.gate = Gate(Limits())
        self.signal: str | None = None
        self._is_over = False
        self._before: dict[int, Any] = {}

    def __enter__(self) -> _End:
        # Without this, a daemon thread would end with the interpreter and leave its force on.
        atexit.register(self.stop)
        if threading.current_thread() is threading.main_thread():
            for number in (signal.SIGINT, signal.SIGTERM):
                self._before[number] = signal.signal(number, self._on_signal)
        return self

    def has_come(self) -> bool:
        """Returns whether the loop is to end now."""
        return self.signal is not None or self.until.is_set() or self.gate.is_stopped

    def stop(self) -> None:
        """Stops gate and device."""
        self._is_over = True
        self.gate.stop()
        try:
            # The loop may end because of a fault of the device, which then takes no force any more.
            with contextlib.suppress(Exception):
                self.device.push([0.0, 0.0, 0.0])
        finally:
            self.device.stop()

    def __exit__(self, *error: object) -> None:
        try:
            self.stop()
        finally:
            atexit.unregister(self.stop)
            for number, before in self._before.items():
                signal.signal(number, before if before is not None else signal.SIG_DFL)

    def _on_signal(self, number: int, _frame: Any) -> None:
        # A device that hangs in `read` or `push` is left by the second signal. Nothing leaves `stop`.
        if self.signal is not None and not self._is_over:
            raise KeyboardInterrupt
        self.signal = self.signal or signal.Signals(number).name
