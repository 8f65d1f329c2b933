"""A peer of a live session in pure Python: a device of your own, or a whole program.

:func:`join` holds a :class:`Device` in a session. The other names are the parts of which it is made, for programs that need another loop, such as
``docs/examples/udp_peer.py``. Nothing here needs the compiled part of the package: this folder also works alone, where only the standard library of
Python 3.10 or later is installed.

>>> gate = Gate(Limits(force=3.0))
>>> ms = 1_000_000
>>> [gate.admit([0.0, 0.0, 8.0], Moment(k * ms, True, True, k * ms, k * ms))[0][2] for k in range(5)]
[0.0, 1.0, 2.0, 3.0, 3.0]
"""

from .client import Client
from .core import Mechanics, Peer
from .datagrams import Joining, Sample, Session, decode, encode, read_key
from .device import Device, Joined, Reading, join
from .gate import Cause, Gate, Limits, Moment
from .mechanics import Attitude, Body

__all__ = [
    "Attitude",
    "Body",
    "Cause",
    "Client",
    "Device",
    "Gate",
    "Joined",
    "Joining",
    "Limits",
    "Mechanics",
    "Moment",
    "Peer",
    "Reading",
    "Sample",
    "Session",
    "decode",
    "encode",
    "join",
    "read_key",
]
