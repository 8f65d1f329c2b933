"""Peer with a socket and a clock."""

from __future__ import annotations

import contextlib
import select
import socket
import time
from collections.abc import Callable
from typing import final

from .core import HELLO_EVERY_NS, Mechanics, Peer
from .datagrams import Joining, Session

BUFFER_LEN = 2048
"""Size of the receive buffer [bytes]: longer than any datagram of the protocol, so that a longer datagram is not cut to a valid one."""


@final
class Client:
    """Peer that has joined a session. As a context manager, the client closes its socket at the end."""

    def __init__(
        self,
        door: str,
        session: Session,
        mechanics: Mechanics,
        *,
        key: bytes | None = None,
        patience: float = 10.0,
        fingerprint: int = 0,
        label: str = "",
        is_stopped: Callable[[], bool] = lambda: False,
    ) -> None:
        self._door = _connected(door)
        try:
            joining = None
            if key is not None:
                joining = Joining(key, session, fingerprint, label)
                session = self._welcomed(joining, session, patience, is_stopped)
            self.peer = Peer(session, mechanics, joining, time.monotonic_ns())
        except BaseException:
            self._door.close()
            raise

    def __enter__(self) -> Client:
        return self

    def __exit__(self, *error: object) -> None:
        self._door.close()

    def _welcomed(self, joining: Joining, session: Session, patience: float, is_stopped: Callable[[], bool]) -> Session:
        """Says hello until the session answers."""
        until = time.monotonic() + patience
        while time.monotonic() < until and not is_stopped():
            self.send(joining.hello())
            again = time.monotonic() + HELLO_EVERY_NS / 1e9
            while (left := min(again, until) - time.monotonic()) > 0 and not is_stopped():
                if not select.select([self._door], [], [], min(left, 0.05))[0]:
                    continue
                datagram = self.receive()
                if datagram is None:
                    # The error belongs to the hello before, which found nobody.
                    time.sleep(0.01)
                elif told := joining.handle_welcome(datagram):
                    return told
        about_scene = " Does the session print another fingerprint?" if joining.fingerprint else ""
        raise TimeoutError(
            f"no welcome for place {session.place} of session {session.number} within {patience} s: "
            f"is the session up, and is the key the same?{about_scene}"
        )

    def send(self, datagram: bytes) -> None:
        """Sends a datagram. A datagram that cannot be sent is lost, because the next sample is newer anyway."""
        with contextlib.suppress(OSError):
            self._door.send(datagram)

    def receive(self) -> bytes | None:
        """Returns a datagram that has arrived, or ``None``."""
        for _ in range(8):
            try:
                return self._door.recv(BUFFER_LEN)
            except BlockingIOError:
                return None
            except OSError:
                continue  # The system tells that an earlier datagram found nobody.
        return None

    def wait_for(self, k: int, began: int) -> None:
        """Waits until tick ``k`` of a loop that began at ``began`` [ns]. A late tick is made at once, so that the peer catches up with the clock."""
        left = began + k * self.peer.session.tick_ns - time.monotonic_ns()
        if left > 0:
            time.sleep(left / 1e9)

    def exchange(self, k: int) -> int:
        """Makes steps 1 and 2 of tick ``k``: sends a sample, takes in the arrived datagrams, and begins anew after silence. Returns the time [ns]."""
        now = time.monotonic_ns()
        if (due := self.peer.sample(k)) is not None:
            self.send(due)
        # No more datagrams at one tick than can be new, so that a flood cannot stop the loop.
        for _ in range(64):
            if (datagram := self.receive()) is None:
                break
            self.peer.take(datagram, now)
        if (hello := self.peer.begin_anew(now)) is not None:
            self.send(hello)
        return now


def _connected(text: str) -> socket.socket:
    """Returns a socket that is connected to the session. The system drops datagrams from other addresses."""
    host, colon, port = text.rpartition(":")
    if not colon or not port.isdecimal():
        raise ValueError(f"{text} is no HOST:PORT")
    found = socket.getaddrinfo(host.strip("[]"), int(port), type=socket.SOCK_DGRAM)
    family, kind, protocol, _, address = found[0]
    door = socket.socket(family, kind, protocol)
    door.connect(address)
    door.setblocking(False)
    return door
