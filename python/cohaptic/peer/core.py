"""Peer without socket and clock: copy of the object, coupling to the device, and samples held of the other peers."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Literal

from .datagrams import Joining, Sample, Session, decode, encode, is_notice
from .mechanics import Attitude, Body, Matrix, State, Turn, Vector, apply, cross, transposed

SILENCE_NS = 1_000_000_000
"""Time without a new sample of any peer, after which the peer begins anew [ns]."""
HELLO_EVERY_NS = 250_000_000


@dataclass(frozen=True)
class Mechanics:
    """Keys of the scene that a peer needs. The values must equal the values in the scene of the session."""

    coupling: tuple[float, float] = (3500.0, 5.0)
    """Stiffness KC [N/m] and damping BC [N·s/m] of the coupling."""
    coordination: tuple[float, float] = (300.0, 5.0)
    """Stiffness KT [N/m] and damping BT [N·s/m] of the coordination."""
    law: Literal["AP", "PD"] = "AP"
    """Coordination law: average-position (AP) or proportional-derivative (PD)."""
    object_mass: float = 0.45
    """Mass of the whole object [kg]; each copy has its share."""
    object_damping: float = 0.0
    """Damping of each copy [N·s/m]."""
    inertia: Vector | None = None
    """Inertia of the whole object about its axes [kg·m²]; ``None`` for an object that does not turn."""
    grasp: Vector = (0.0, 0.0, 0.0)
    """Point at which the device holds an object that turns, in the axes of the object [m]."""
    start: Vector = (0.0, 0.0, 0.0)
    """Position of the copies at the beginning [m]."""
    exchange_every: int = 1
    """Number of ticks from one exchange to the next: the device is read and pushed at exchanges only."""
    exchange_age: Literal[0, 1] = 0
    """1 if the force is computed from the reading of the previous exchange, otherwise 0."""

    def __post_init__(self) -> None:
        if not self.object_mass > 0 or self.exchange_every < 1 or self.exchange_age not in (0, 1):
            raise ValueError("mass and exchange-every must be above 0, and exchange-age 0 or 1")
        if self.law not in ("AP", "PD"):
            raise ValueError(f"the law must be AP or PD, and is {self.law}")


@dataclass
class Other:
    """State held of another peer: the sample with the highest number, or the initial state before the first sample."""

    states: list[State]
    matrix: Matrix = field(default_factory=lambda: Attitude().matrix())
    world_rate: Vector = (0.0, 0.0, 0.0)
    newest: int | None = None
    heard_at: int | None = None
    received: int = 0
    late: int = 0

    def take(self, sample: Sample, now: int) -> bool:
        """Takes a sample. Returns whether the sample is newer than the held sample."""
        self.received += 1
        if self.newest is not None and sample.number <= self.newest:
            self.late += 1
            return False
        self.newest, self.states, self.heard_at = sample.number, sample.states, now
        if sample.attitude:
            self.matrix = sample.attitude.matrix()
            self.world_rate = apply(self.matrix, sample.attitude.rate)
        return True


class Peer:
    """Peer of a session, with the steps of a tick in the order of docs/live-protocol.md.

    Times are in ns on a clock that never goes back.
    """

    def __init__(self, session: Session, mechanics: Mechanics, joining: Joining | None, now: int) -> None:
        if not (1 <= session.axes <= 3 and 0 <= session.place < session.peers and 0 < session.tick_ns <= 10**9):
            raise ValueError("place, peers, axes and periods do not fit together")
        if session.turns != (mechanics.inertia is not None) or (session.turns and session.axes != 3):
            raise ValueError(
                "the object of a session turns if, and only if, it has an inertia, and it has three axes then"
            )
        self.session, self.mechanics, self.joining = session, mechanics, joining
        self.ticks_per_update = max(1, round(session.update_ns / session.tick_ns))
        step = session.tick_ns * 1e-9
        start = [(position, 0.0) for position in mechanics.start[: session.axes]]
        self.copy = Body(mechanics.object_mass / session.peers, mechanics.object_damping, step, start)
        self.others = {place: Other(start) for place in range(session.peers) if place != session.place}
        self.turn: Turn | None = None
        if mechanics.inertia:
            # Gains and damping of the turn are those of the translation times J/m, as if each element of the mass were alone.
            self.over_mass = [moment / mechanics.object_mass for moment in mechanics.inertia]
            damping = [mechanics.object_damping * share for share in self.over_mass]
            self.turn = Turn([moment / session.peers for moment in mechanics.inertia], damping, step)
            start = [(x + arm, v) for (x, v), arm in zip(start, mechanics.grasp, strict=True)]
        self.reading, self.read_before = start, start
        """State from which forces are computed (r of docs/model.md), and the state read at the latest exchange."""
        self.weight = 1.0
        """Weight of the coupling force FC, from 0 to 1."""
        self.on_hand = [0.0] * session.axes
        """Force on the device until the next exchange [N]."""
        self.sent = self.ignored = self.taken = 0
        self.joinings = 1 if joining else 0
        self.heard_at = now
        self._rejoining: Joining | None = None
        self._next_hello = 0

    def sample(self, k: int) -> bytes | None:
        """Returns the datagram that is due at tick ``k``, or ``None`` if no datagram is due."""
        if k % self.ticks_per_update:
            return None
        attitude = self.turn.attitude if self.turn else None
        sample = Sample(self.session.place, self.sent, k * self.session.tick_ns, self.copy.states, attitude)
        self.sent += 1
        plain = encode(self.session, sample)
        return self.joining.seal(plain) if self.joining else plain

    def take(self, datagram: bytes, now: int) -> bool:
        """Takes in a datagram. Returns whether the datagram is a valid sample or answer for this peer."""
        if self._rejoining and (told := self._rejoining.handle_welcome(datagram)):
            if told != self.session:
                raise ConnectionError("the session was started again with another scene")
            self.joining, self._rejoining, self.heard_at = self._rejoining, None, now
            self.joinings += 1
            self._forget_numbers()
            return True
        if is_notice(self.session, self.joining, datagram):
            self.taken += 1
            return True
        plain = self.joining.open(datagram) if self.joining else datagram
        sample = decode(self.session, plain) if plain else None
        if sample is None or sample.sender not in self.others:
            self.ignored += 1
            return False
        if self.others[sample.sender].take(sample, now):
            self.heard_at = now
        return True

    def is_in_silence(self, now: int) -> bool:
        """Returns whether no new sample came for a second. A scene of one peer is never silent, because there is nobody to hear."""
        return bool(self.others) and now - self.heard_at >= SILENCE_NS

    def begin_anew(self, now: int) -> bytes | None:
        """Begins anew after silence, and returns a hello if one is due.

        The session may have been started again. Its numbers then begin at 0, and the keys of the joining are no longer valid.
        """
        if not self.is_in_silence(now):
            self._rejoining = None
        elif not self.joining:
            self._forget_numbers()
        elif now >= self._next_hello:
            self._rejoining = self._rejoining or self.joining.again()
            self._next_hello = now + HELLO_EVERY_NS
            return self._rejoining.hello()
        return None

    def exchanges(self, k: int) -> bool:
        """Returns whether the device is read and pushed at tick ``k``."""
        return k % self.mechanics.exchange_every == 0

    def tick(self, k: int, device: list[State] | None) -> None:
        """Computes the forces of tick ``k`` and moves the copy to the next tick.

        At an exchange ``device`` is the state read now, or ``None`` if nothing could be read, and ``on_hand`` becomes the new force.
        """
        if self.exchanges(k) and device is not None:
            self.reading = self.read_before if self.mechanics.exchange_age else device
            self.read_before = device
        (kc, bc), (kt, bt) = self.mechanics.coupling, self._gains()
        # The device holds the grasp point of an object that turns: xO + R·r with the velocity vO + R·(ω x r).
        arm = swing = (0.0, 0.0, 0.0)
        if self.turn:
            matrix, grasp = self.turn.attitude.matrix(), self.mechanics.grasp
            arm, swing = apply(matrix, grasp), apply(matrix, cross(self.turn.attitude.rate, grasp))
        coupling, on_copy = [], []
        for axis, ((xh, vh), (xo, vo)) in enumerate(zip(self.reading, self.copy.states, strict=True)):
            # (9) FC = KC·(xH - xO) + BC·(vH - vO), the force of the device on the copy.
            fc = self.weight * (kc * (xh - xo - arm[axis]) + bc * (vh - vo - swing[axis]))
            # (10) FT = KT·(xO - xd) + BT·(vO - vd), towards the mean of the samples held from the others.
            ft = 0.0
            if self.others:
                xd = sum(other.states[axis][0] for other in self.others.values()) / len(self.others)
                vd = sum(other.states[axis][1] for other in self.others.values()) / len(self.others)
                ft = kt * (xo - xd) + bt * (vo - vd)
            coupling.append(fc)
            on_copy.append(fc - ft)
        if self.exchanges(k):
            self.on_hand = [-fc for fc in coupling]
        self.copy.move(on_copy)
        if self.turn:
            self.turn.move(self._torque(self.turn.attitude, coupling))

    def _gains(self) -> tuple[float, float]:
        # PD(K, B) = AP((N-1)·K, (N-1)·B), as docs/model.md shows.
        kt, bt = self.mechanics.coordination
        share = len(self.others) if self.mechanics.law == "PD" else 1
        return kt * share, bt * share

    def _torque(self, own: Attitude, coupling: Sequence[float]) -> Sequence[float]:
        """Returns r x RᵀFC - τT in the axes of the body, with τT = BR∘(ω - Rᵀ·w̄) - 2·vee sk(RᵀM̄·P) and P = diag(½·ΣKR - KR)."""
        to_body, others = transposed(own.matrix()), list(self.others.values())
        lever = cross(self.mechanics.grasp, apply(to_body, coupling))
        if not others:
            return lever
        stiffness, damping = ([gain * share for share in self.over_mass] for gain in self._gains())
        mean = [[sum(other.matrix[i][j] for other in others) / len(others) for j in range(3)] for i in range(3)]
        rate = apply(to_body, [sum(other.world_rate[i] for other in others) / len(others) for i in range(3)])
        weights = [sum(stiffness) / 2 - gain for gain in stiffness]
        apart = [[sum(to_body[i][k] * mean[k][j] for k in range(3)) * weights[j] for j in range(3)] for i in range(3)]
        spring = apart[2][1] - apart[1][2], apart[0][2] - apart[2][0], apart[1][0] - apart[0][1]
        return [lever[i] + spring[i] - damping[i] * (own.rate[i] - rate[i]) for i in range(3)]

    def _forget_numbers(self) -> None:
        for other in self.others.values():
            other.newest = None

    def check(self) -> None:
        """Raises an exception if the copy has diverged."""
        if not self.copy.is_finite:
            raise ArithmeticError("the copy has diverged: the scene is unstable with this device")


def grew(weight: float, wanted: bool, step: float) -> float:
    """Returns the weight of a pull one step later. The weight rises and falls linearly."""
    return min(1.0, weight + step) if wanted else max(0.0, weight - step)


def is_finite(states: Sequence[State]) -> bool:
    """Returns whether all numbers of the states are finite."""
    return all(math.isfinite(x) and math.isfinite(v) for x, v in states)
