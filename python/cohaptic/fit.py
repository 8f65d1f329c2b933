"""Links that are estimated from measurements."""

from __future__ import annotations

import json
import os
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from cohaptic import _native


def fit(
    source: str | os.PathLike[str] | tuple[npt.ArrayLike, npt.ArrayLike],
    receiver: str | os.PathLike[str] | None = None,
    *,
    port: int | None = None,
    offset: float | None = None,
    least: float | None = None,
    skew: bool = False,
    direction: Literal["up", "down", "rtt"] | None = None,
    split: float | None = None,
    instant_bytes: int | None = None,
    walk: bool = False,
    tick: float | None = None,
    cut: bool = False,
    hold_out: float | None = None,
) -> dict[str, Any]:
    """Estimates the link that made measurements, and gives the document of ``cohaptic fit --json``.

    Its ``scene`` has the link as keys of a scene, its ``goodness`` says how good the estimate is.

    ``source`` is a file with one-way measurements, a file of fates, a file of IRTT, ping, iperf3, LENS, CellReplay or netem-trace, or the capture of the
    sender, with that of the receiver as ``receiver``, of which only datagrams to the UDP ``port`` count. Or it is a pair of arrays: when each packet was
    sent, and its delay [s], which is NaN where the packet was lost.

    ``offset`` [s] is added to the clock of the receiver, and so to every delay. ``least`` [s] says what the least delay is. ``skew`` removes the linear
    drift of one clock against the other, where it is significant.

    ``direction`` is the way of the packets in a file that has both ways, and ``split`` the share of a round trip that is the delay of one way, such as 0.5.
    ``walk`` lets a measured rate change as a walk through five states, and ``instant_bytes`` leave at each instant of a line (mahimahi: 1504, else 1400).
    ``tick`` [s] is the tick of the clock that showed the delays, to which it rounds or, with ``cut``, cuts. ``hold_out`` is the
    share of the time at the end whose packets are not fitted and judge the link, such as 0.5.

    >>> from cohaptic import Link
    >>> sent = np.arange(20_000) * 0.01
    >>> delays = Link("delay 40ms 4ms distribution normal loss 2%", seed=1).send(sent).arrived - sent
    >>> link = fit((sent, delays))["link"]
    >>> round(link["delay_s"], 3), link["jitter"]["distribution"]
    (0.04, 'normal')
    """
    is_of_other_programs = walk or any(choice is not None for choice in (direction, split, instant_bytes))
    if isinstance(source, tuple):
        if receiver is not None or port is not None:
            raise TypeError("receiver and port are for captures: expected a file too")
        if is_of_other_programs:
            raise TypeError("direction, split, instant_bytes and walk are for files of other programs: expected a file")
        at, delays = (np.ascontiguousarray(numbers, dtype=np.float64).reshape(-1) for numbers in source)
        measured = _native.Delays.of(at, delays)
    else:
        if receiver is not None and is_of_other_programs:
            raise TypeError(
                "direction, split, instant_bytes and walk are for files of other programs: expected one file"
            )
        measured = _native.Delays.read(
            os.fspath(source),
            None if receiver is None else os.fspath(receiver),
            port,
            direction,
            split,
            instant_bytes,
            walk,
        )
    if cut and tick is None:
        raise TypeError("cut is the way of a clock with a known tick: expected tick too")
    document: dict[str, Any] = json.loads(measured.fit(offset, least, skew, tick, cut, hold_out))
    return document
