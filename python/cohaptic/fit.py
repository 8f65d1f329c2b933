"""Estimation of links from measurements."""

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
    """Estimates the link behind measurements, and returns the document of ``cohaptic fit --json``.

    In the document, ``scene`` has the link as keys of a scene, and ``goodness`` says how good the estimate is.

    ``source`` is one of these: a file with one-way measurements; a file of fates; a file of IRTT, ping, iperf3, LENS, CellReplay or netem-trace; the capture
    of the sender, with the capture of the receiver as ``receiver``; or a pair of arrays with the instant of sending and the delay of each packet [s]. The
    delay of a lost packet is NaN. Of captures, only datagrams to the UDP ``port`` count.

    ``offset`` [s] is added to the clock of the receiver, and so to every delay. ``least`` [s] is the known least delay. ``skew`` removes the linear drift
    between the two clocks if the drift is significant.

    ``direction`` selects the way of the packets in a file with both ways. ``split`` is the share of a round trip that is the delay of one way, such as
    0.5. With ``walk`` a measured rate changes as a walk through five states. ``instant_bytes`` is the number of bytes that leave at each instant of a line
    (1504 for mahimahi, otherwise 1400). ``tick`` [s] is the tick of the clock that measured the delays. Delays are rounded to the tick, or cut to the
    tick with ``cut``. ``hold_out`` is the share of the time at the end, such as 0.5, whose packets are not fitted but judge the link.

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
