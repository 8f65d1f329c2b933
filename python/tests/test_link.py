"""A link alone: that of the program, all at once and step by step."""

import csv
import itertools
import json
import math

import numpy as np
import pytest
from conftest import Command

from cohaptic import CAUSES, Link, profile

SPECS = [
    "delay 20ms 5ms loss 1%",
    "delay 20ms 5ms distribution normal duplicate 10% corrupt 5%",
    "delay=20ms jitter=5ms order=in-order loss=20%",
    "rate 256kbit limit 5",
    "wifi-busy/down loss=2%",
    "",
]


def fates(spec: str, program: Command, path, packets: int, seed: int) -> list[dict[str, str]]:
    words = spec.split() or ["delay", "0ms"]
    done = program(
        "link",
        *words,
        "--packets",
        str(packets),
        "--every",
        "3ms",
        "--size",
        "200B",
        "--seed",
        str(seed),
        "--fates",
        str(path),
    )
    assert done.returncode == 0, done.stderr
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


@pytest.mark.parametrize("spec", SPECS)
def test_all_at_once_it_is_the_link_of_the_program(spec: str, cohaptic_program: Command, tmp_path) -> None:
    packets = 5000
    rows = [
        row for row in fates(spec, cohaptic_program, tmp_path / "fates.csv", packets, 3) if row["fate"] != "duplicated"
    ]
    sent = Link(spec, seed=3).send(np.arange(packets) * 0.003, 200)
    originals = sorted((row for row in rows if row["copy"] == "0"), key=lambda row: int(row["sequence"]))
    assert len(originals) == packets
    cause = [0 if row["fate"] == "delivered" else CAUSES.index(row["fate"]) for row in originals]
    assert sent.cause.tolist() == cause
    arrived = [int(row["at_ns"]) / 1e9 if row["fate"] == "delivered" else np.nan for row in originals]
    assert np.array_equal(sent.arrived, arrived, equal_nan=True)
    assert sent.damaged.tolist() == [row["damaged"] == "1" for row in originals]
    assert sent.marked.tolist() == [row["marked"] == "1" for row in originals]
    copies = [
        (int(row["sequence"]), int(row["copy"]), int(row["at_ns"]) / 1e9)
        for row in rows
        if row["copy"] != "0" and row["fate"] == "delivered"
    ]
    kept = sent.copies.cause == 0
    mine = zip(
        sent.copies.packet[kept].tolist(),
        sent.copies.number[kept].tolist(),
        sent.copies.arrived[kept].tolist(),
        strict=True,
    )
    assert list(mine) == copies
    if spec.startswith("delay 20ms 5ms"):
        assert (sent.cause != 0).any() or "loss" not in spec
        assert len(copies) > 0 or "duplicate" not in spec


@pytest.mark.parametrize("spec", SPECS[:2])
def test_step_by_step_it_does_the_same(spec: str) -> None:
    times = np.arange(2000) * 0.003
    sent = Link(spec, seed=9).send(times, 64)
    link = Link(spec, seed=9)
    events = []
    for place, now in enumerate(times):
        link.handle_packet(now, 64, {"place": place})
        events += link.poll(now)
    while (after := link.next) is not None:
        events += link.poll(after)
    ends = [event for event in events if event.fate != "duplicated"]
    originals = {event.sequence: event for event in ends if event.copy == 0}
    assert len(originals) == len(times)
    assert all(event.payload == {"place": place} for place, event in originals.items())
    arrived = [originals[place].at if originals[place].fate == "delivered" else np.nan for place in range(len(times))]
    assert np.array_equal(sent.arrived, arrived, equal_nan=True)
    assert sum(event.copy > 0 for event in ends) == len(sent.copies.packet)
    assert all(first.at <= second.at for first, second in itertools.pairwise(events))


@pytest.mark.parametrize("epoch", [0.0, 1.0, 1e6, 2.0**33, 1_700_000_000.123, 1_796_000_000.987, 1.8e10])
def test_what_comes_next_is_delivered_when_it_is_asked_for(epoch: float) -> None:
    link = Link("delay 2s 5ms distribution normal", seed=4)
    for place in range(200):
        link.handle_packet(epoch + place * 0.003)
    delivered = 0
    while (at := link.next) is not None:
        # Numbers are more than a nanosecond apart from 2^23 s on: there the one before is too early.
        if epoch > 2.0**23:
            assert link.poll(math.nextafter(at, 0.0)) == []
        happened = link.poll(at)
        assert happened, f"nothing at {at!r}, which was next"
        delivered += len(happened)
    assert delivered == 200


def test_the_seed_and_the_ends_are_the_address() -> None:
    def arrivals(**address) -> list[float]:
        return Link("delay 20ms 5ms", **address).send(np.arange(100) * 0.01).arrived.tolist()

    assert arrivals(seed=1) == arrivals(seed=1) == arrivals(seed=1, sender="sender", receiver="receiver")
    assert arrivals(seed=1) != arrivals(seed=2)
    assert arrivals(seed=1) != arrivals(seed=1, sender="left")


def test_a_link_that_changes_keeps_what_is_on_the_way() -> None:
    link = Link("delay 50ms")
    link.handle_packet(0.0, payload="first")
    link.change(0.01, "delay 10ms")
    link.handle_packet(0.01, payload="second")
    assert [(event.payload, event.at) for event in link.poll(1.0)] == [("second", 0.02), ("first", 0.05)]


def test_times_that_make_no_sense_are_refused() -> None:
    link = Link("delay 1ms")
    with pytest.raises(ValueError, match="time goes back"):
        link.send([1.0, 0.5])
    for wrong in (-1.0, np.nan, np.inf, 1e11):
        with pytest.raises(ValueError, match="not an instant"):
            link.send([wrong])
    with pytest.raises(ValueError, match="expected one of all, or one of each"):
        link.send([0.0, 1.0, 2.0], [64, 64])
    link.poll(2.0)
    with pytest.raises(ValueError, match="time goes back"):
        link.handle_packet(1.0)
    assert link.send([]).arrived.shape == (0,)


def test_a_profile_has_its_sources(cohaptic_program: Command) -> None:
    done = cohaptic_program("link", "dsl", "--show", "--json")
    assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["profiles"] == [profile("dsl@1")]
    with pytest.raises(ValueError, match='did you mean "dsl"'):
        profile("dls")
