"""Datagrams of a live session, byte by byte as in docs/live-protocol.md and docs/wire-format.md."""

from __future__ import annotations

import hashlib
import hmac
import math
import os
import stat
import struct
from dataclasses import dataclass

from .mechanics import Attitude, State

HEADER = struct.Struct("<4sHBBQIIQQQ")
"""Magic, version, axes, 1 with an attitude, session, sender, 0, number, send time [ns], 0."""
ATTITUDE = struct.Struct("<7d")
"""Quaternion w, x, y, z, angular velocity about the axes of the body [rad/s]."""
HELLO = struct.Struct("<4sHHQII16sQ8s16x")
"""Magic, version, 0, session, place, 0, client nonce, fingerprint of the scene, label."""
WELCOME = struct.Struct("<4sHBBQII16s16sQQ")
"""Magic, version, axes, 1 if the object turns, session, place, peers, both nonces, tick [ns], update [ns]."""
NOTICE = struct.Struct("<4sHHQII")
"""Magic, version, 0, session, place, 0. With a key, nonce of the client and tag follow."""
NONCE_LEN = TAG_LEN = 16


@dataclass(frozen=True)
class Session:
    """Facts of a session. With a key the welcome tells all but number and place."""

    number: int
    """Session number: the seed of the scene."""
    place: int
    """Place of this peer among the peers of the scene, from 0."""
    peers: int = 2
    """Number of peers of the scene, this one included."""
    axes: int = 1
    """1 to 3."""
    turns: bool = False
    """Whether the object turns, which needs three axes."""
    tick_ns: int = 1_000_000
    """Tc [ns]."""
    update_ns: int = 8_000_000
    """Tn [ns]."""


@dataclass(frozen=True)
class Sample:
    """Position and velocity of a copy, and its attitude if the object turns."""

    sender: int
    number: int
    sent_ns: int
    states: list[State]
    attitude: Attitude | None = None


def mac(key: bytes, message: bytes) -> bytes:
    """Returns HMAC-SHA256 of a message."""
    return hmac.new(key, message, hashlib.sha256).digest()


def tag(key: bytes, message: bytes) -> bytes:
    """Returns the tag of a datagram."""
    return mac(key, message)[:TAG_LEN]


def encode(session: Session, sample: Sample) -> bytes:
    """Returns a sample without a seal."""
    motion = 1 if sample.attitude else 0
    header = HEADER.pack(
        b"CHPT", 1, session.axes, motion, session.number, sample.sender, 0, sample.number, sample.sent_ns, 0
    )
    attitude = ATTITUDE.pack(*sample.attitude.quaternion, *sample.attitude.rate) if sample.attitude else b""
    return header + b"".join(struct.pack("<dd", *state) for state in sample.states) + attitude


def decode(session: Session, datagram: bytes) -> Sample | None:
    """Reads a sample without a seal. Returns ``None`` for everything but a valid sample of this session."""
    end = HEADER.size + 16 * session.axes
    if len(datagram) != end + (ATTITUDE.size if session.turns else 0):
        return None
    magic, version, axes, motion, number_of_session, sender, zero1, number, sent, zero2 = HEADER.unpack_from(datagram)
    expected = (b"CHPT", 1, session.axes, int(session.turns), session.number, 0, 0)
    if (magic, version, axes, motion, number_of_session, zero1, zero2) != expected:
        return None
    states = [(x, v) for x, v in struct.iter_unpack("<dd", datagram[HEADER.size : end])]
    numbers = [number for state in states for number in state]
    attitude = None
    if session.turns:
        w, x, y, z, *rate = ATTITUDE.unpack_from(datagram, end)
        attitude = Attitude((w, x, y, z), (rate[0], rate[1], rate[2]))
        numbers += [w, x, y, z, *rate]
    if not all(map(math.isfinite, numbers)):
        return None
    if attitude and abs(math.fsum(q * q for q in attitude.quaternion) - 1) > 2**-20:
        return None
    return Sample(sender, number, sent, states, attitude)


def is_notice(session: Session, joining: Joining | None, datagram: bytes) -> bool:
    """Returns whether the session says that another program has the seat of this peer. ``joining`` is that of the peer in a session with a key."""
    notice = NOTICE.pack(b"CHPS", 1, 0, session.number, session.place, 0) + (joining.nonce if joining else b"")
    # Samples differ here, and cost no tag.
    if not datagram.startswith(notice):
        return False
    return hmac.compare_digest(datagram, notice + (tag(joining.key, notice) if joining else b""))


class Joining:
    """One joining in a session with a key: first the hello, then the keys of both directions."""

    def __init__(self, key: bytes, session: Session, fingerprint: int = 0, label: str = "") -> None:
        if len(label) > 8 or not all("!" <= letter <= "~" for letter in label):
            raise ValueError("a label has at most 8 printable ASCII characters, and no space")
        self.key, self.session, self.fingerprint, self.label = key, session, fingerprint, label
        self.nonce = os.urandom(NONCE_LEN)
        self.to_door = self.to_peer = b""

    def again(self) -> Joining:
        """Returns another joining, with a nonce of its own."""
        return Joining(self.key, self.session, self.fingerprint, self.label)

    def hello(self) -> bytes:
        """Returns the datagram that asks for the seat."""
        session = self.session
        hello = HELLO.pack(
            b"CHPH", 1, 0, session.number, session.place, 0, self.nonce, self.fingerprint, self.label.encode()
        )
        return hello + tag(self.key, hello)

    def handle_welcome(self, datagram: bytes) -> Session | None:
        """Reads a welcome, and derives the keys. Returns ``None`` for everything but an answer to this joining."""
        if len(datagram) != WELCOME.size + TAG_LEN:
            return None
        body, found_tag = datagram[:-TAG_LEN], datagram[-TAG_LEN:]
        if not hmac.compare_digest(tag(self.key, body), found_tag):
            return None
        magic, version, axes, turns, number, place, peers, nonce, server_nonce, tick, update = WELCOME.unpack(body)
        if (magic, version, number, place, nonce) != (b"CHPW", 1, self.session.number, self.session.place, self.nonce):
            return None
        both = struct.pack("<QI", number, place) + nonce + server_nonce
        self.to_door = mac(self.key, b"cohaptic 1 to door" + both)
        self.to_peer = mac(self.key, b"cohaptic 1 to peer" + both)
        return Session(number, place, peers, axes, turns == 1, tick, update)

    def seal(self, sample: bytes) -> bytes:
        """Returns a sample that the session believes."""
        body = sample + self.nonce
        return body + tag(self.to_door, body)

    def open(self, datagram: bytes) -> bytes | None:
        """Returns the sample in a sealed datagram, or ``None`` if the datagram was not made for this joining."""
        body, found_tag = datagram[:-TAG_LEN], datagram[-TAG_LEN:]
        if body[-NONCE_LEN:] != self.nonce or not hmac.compare_digest(tag(self.to_peer, body), found_tag):
            return None
        return body[:-NONCE_LEN]


def read_key(path: str | os.PathLike[str]) -> bytes:
    """Reads a key file of 64 hexadecimal digits, which only its owner may read."""
    with open(path, "rb") as file:
        if os.name == "posix" and os.fstat(file.fileno()).st_mode & (stat.S_IRWXG | stat.S_IRWXO):
            raise PermissionError(f"{path}: others than the owner may read the key file: chmod 600 makes it private")
        digits = file.read(80).rstrip()
    if len(digits) != 64 or digits.strip(b"0123456789abcdefABCDEF"):
        raise ValueError(f"{path}: the key file must hold 64 hexadecimal digits")
    return bytes.fromhex(digits.decode("ascii"))
