"""A ping over two emulated links in SimPy, by callbacks alone: no generators.

Run it with `python simpy_ping.py`; it needs `pip install simpy`.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import simpy

from cohaptic import Link


class SimpyLink:
    """A link in a SimPy environment: `deliver` is called with each payload when it arrives."""

    def __init__(self, env: simpy.Environment, link: Link, deliver: Callable[[Any], None]) -> None:
        self.env, self.link, self.deliver = env, link, deliver

    def send(self, payload: Any, size: int = 64) -> None:
        """Sends a packet now."""
        self.link.handle_packet(self.env.now, size, payload)
        self._wake()

    def _wake(self) -> None:
        """Looks at the link when something happens there next. Being there too early or twice does no harm."""
        if (at := self.link.next) is not None:
            self.env.timeout(max(0.0, at - self.env.now)).callbacks.append(self._poll)

    def _poll(self, _event: simpy.Event) -> None:
        for event in self.link.poll(self.env.now):
            if event.fate == "delivered":
                self.deliver(event.payload)
        self._wake()


def ping(count: int = 1000, spec: str = "delay 20ms 3ms loss 5%", seed: int = 1) -> np.ndarray:
    """The round-trip times of the pings that came back [s]."""
    env = simpy.Environment()
    times: list[float] = []
    back = SimpyLink(
        env, Link(spec, seed, sender="server", receiver="client"), lambda sent: times.append(env.now - sent)
    )
    there = SimpyLink(env, Link(spec, seed, sender="client", receiver="server"), back.send)
    for number in range(count):
        env.timeout(0.01 * number).callbacks.append(lambda _: there.send(env.now))
    env.run()
    return np.array(times)


if __name__ == "__main__":
    times = ping()
    print(f"{len(times)} of 1000 came back, after {1e3 * times.mean():.2f} ms on average")
