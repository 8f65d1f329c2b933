"""Documents of campaigns, comparisons, links and fits: those that the program prints."""

import itertools
from concurrent.futures import ProcessPoolExecutor
from multiprocessing import get_context
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from conftest import TWO, Command

import cohaptic
from cohaptic import Link, Scene, campaign, compare, fit

# What a document says of the run of the program, and not of its subject.
OF_PROGRAM = ("schema", "version", "wall_s", "runs_per_s", "out", "file", "files", "packets_per_s")


def without_program(document: dict[str, Any]) -> dict[str, Any]:
    return {key: value for key, value in document.items() if key not in OF_PROGRAM}


@pytest.fixture
def two(tmp_path: Path) -> str:
    path = tmp_path / "two.toml"
    path.write_text(TWO, encoding="utf-8")
    return str(path)


@pytest.mark.parametrize("verdicts", [False, True])
def test_the_summary_of_a_campaign_is_that_of_the_program(verdicts: bool, two: str, answer, tmp_path) -> None:
    vary = ["coordination.stiffness=500,1000", "link.delay=8ms,24ms"]
    options = [word for text in vary for word in ("--vary", text)] + ["--verdicts"] * verdicts
    document = answer("campaign", two, *options, "--runs", "5", "--format", "csv", "--out", str(tmp_path / "out"))
    table = campaign(Scene(two), vary=vary, runs=5, verdicts=verdicts)
    assert table.summary == without_program(document)
    assert ("verdict" in document["combinations"][0]) == verdicts == ("radius" in table)
    for name in ["discrepancy", *["verdicts"] * verdicts]:
        assert table.plot(name).svg == (tmp_path / "out" / f"{name}.svg").read_text(encoding="utf-8")
    with pytest.raises(ValueError, match="no picture"):
        table.plot("verdict")
    header, *rows = (tmp_path / "out" / "runs.csv").read_text(encoding="utf-8").splitlines()
    assert [name.replace("link.delay_ms", "link.delay") for name in header.split(",")] == list(table)
    if verdicts:
        place = header.split(",").index("verdict")
        assert table.decode("verdict").tolist() == [row.split(",")[place] for row in rows]
        assert table["radius"].tolist() == [float(row.split(",")[place + 2]) for row in rows]


def test_why_there_is_no_verdict_is_said_as_by_the_program(answer, tmp_path) -> None:
    path = "scenarios/network/timeline.toml"
    document = answer("campaign", path, "--verdicts", "--no-plot", "--out", str(tmp_path / "out"))
    table = campaign(Scene(path), verdicts=True)
    assert table.summary == without_program(document)
    assert table.summary["combinations"][0]["reason"].startswith("the timeline changes the scene")
    assert table.decode("verdict").tolist() == [""]
    assert np.isnan(table["radius"]).all()


STRATEGIES = ["average-position", "local-damping", "extrapolated{horizon=20ms}"]


def test_a_comparison_is_that_of_the_program_whoever_makes_its_runs(two: str, answer, tmp_path) -> None:
    vary, overrides = ["link.jitter=0ms,1ms"], ["link.loss=0%"]
    options = ["--strategies", ",".join(STRATEGIES), "--vary", *vary, "--set", *overrides, "--runs", "4"]
    document = answer("compare", two, *options, "--out", str(tmp_path / "out"))
    scene = Scene(two, overrides)
    comparison = compare(scene, STRATEGIES, vary=vary, runs=4)
    assert comparison.summary == without_program(document)
    refused = [combination["refused"] for combination in comparison.summary["combinations"]]
    assert [reason is None for reason in refused] == [True, True, True, False, True, True]
    assert comparison.rows == comparison.summary["runs"] == 20
    with ProcessPoolExecutor(2, mp_context=get_context("spawn")) as executor:
        assert compare(scene, ",".join(STRATEGIES), vary=vary, runs=4, executor=executor).summary == comparison.summary


def test_what_cannot_be_compared_is_refused() -> None:
    scene = Scene(TWO)
    for strategies, vary, part in [
        ("average-position", [], "names fewer than two strategies"),
        (["average-position", "extrapolatd"], [], "unknown strategy"),
        (STRATEGIES, ["coordination.strategy=wave"], "expected another key"),
    ]:
        with pytest.raises(ValueError, match=part):
            compare(scene, strategies, vary=vary)


@pytest.mark.parametrize(
    "spec",
    [
        "delay 20ms 5ms 25% loss 1% duplicate 0.5%",
        "delay=20ms jitter=5ms order=in-order loss=20%",
        "delay 10ms rate 512kbit limit 5",
    ],
)
def test_a_link_is_measured_as_by_the_program(spec: str, answer) -> None:
    options = ["--packets", "20000", "--every", "2ms", "--size", "200B", "--seed", "3", "--ecn"]
    document = answer("link", *spec.split(), *options)
    measured = Link(spec, seed=3).measure(20_000, 0.002, 200, ecn=True)
    assert measured == without_program(document)
    assert measured["fates"]["offered"] == 20_000
    # Packets that were sent before have no part in it.
    link = Link(spec, seed=3)
    link.send(np.arange(100) * 0.01)
    assert link.measure(20_000, 0.002, 200, ecn=True) == measured


def test_streams_that_make_no_sense_are_refused() -> None:
    link = Link("delay 1ms")
    for packets, every, part in [
        (0, 0.001, "expected at least 1"),
        (10, -1.0, "expected seconds"),
        (10, 1e300, "expected seconds"),
        (10, 2e9, "292 years"),
    ]:
        with pytest.raises(ValueError, match=part):
            link.measure(packets, every)


LINK = "delay 40ms 4ms distribution normal loss 2%"


@pytest.fixture
def fates(cohaptic_program: Command, tmp_path: Path) -> str:
    path = str(tmp_path / "fates.csv")
    done = cohaptic_program("link", *LINK.split(), "--packets", "20000", "--every", "10ms", "--fates", path)
    assert done.returncode == 0, done.stderr
    return path


def test_a_walk_of_a_rate_is_that_of_the_program(tmp_path, answer) -> None:
    line = tmp_path / "line"
    counts = [1 + second // 7 * 5 % 11 for second in range(120)]
    instants = [1000 * second + 90 * instant for second, count in enumerate(counts) for instant in range(count)]
    line.write_text("".join(f"{at}\n" for at in instants), encoding="utf-8")
    fitted = fit(line, instant_bytes=1504, walk=True)
    assert fitted == without_program(answer("fit", str(line), "--bytes", "1504B", "--walk"))
    assert fitted["recorded"]["walk"]["seconds"] == 119


def test_a_fit_of_a_file_is_that_of_the_program(fates: str, answer) -> None:
    fitted = fit(fates)
    assert fitted == without_program(answer("fit", fates))
    assert fitted["link"]["jitter"]["distribution"] == "normal"
    corrected = fit(fates, offset=0.001, skew=True)
    assert corrected == without_program(answer("fit", fates, "--offset", "1ms", "--skew"))
    assert corrected["clocks"]["added_s"] == 0.001
    assert fit(fates, least=0.01) == without_program(answer("fit", fates, "--least", "10ms"))
    # The text is a link of a scene.
    assert Scene(TWO.replace("link ", "#link ") + fitted["scene"]).peers == ["left", "right"]


def test_a_fit_of_arrays_is_that_of_their_table(answer, tmp_path) -> None:
    sent = np.arange(20_000) / 100
    delays = np.round(Link(LINK, seed=1).send(sent).arrived - sent, 9)
    path = tmp_path / "delays.csv"
    cells = (
        f"{at!r},{'' if np.isnan(delay) else repr(delay)}"
        for at, delay in zip(sent.tolist(), delays.tolist(), strict=True)
    )
    path.write_text("\n".join(itertools.chain(["t,delay"], cells, [""])), encoding="utf-8")
    assert fit((sent, delays)) == fit(path) == without_program(answer("fit", str(path)))


def test_a_fit_of_round_trips_is_that_of_the_program(answer, tmp_path) -> None:
    path = tmp_path / "line.txt"
    answers = (
        f"[{100 + number / 100:.6f}] 64 bytes from h: icmp_seq={number} ttl=57 time={20 + number * 37 % 13}.{number % 10} ms"
        for number in range(1, 200)
        if number % 20 != 7
    )
    path.write_text("\n".join(["PING h", *answers, ""]), encoding="utf-8")
    fitted = fit(path, split=0.5, tick=1e-4, cut=True)
    assert fitted == without_program(answer("fit", str(path), "--split", "even", "--tick", "100us", "--cut"))
    assert fitted["measured_by"]["program"] == "ping"
    with pytest.raises(cohaptic.CohapticError, match="split: the file has round trips"):
        fit(path)
    with pytest.raises(cohaptic.CohapticError, match="direction: expected a file with both ways"):
        fit(path, direction="up", split=0.5)
    with pytest.raises(ValueError, match="sideways"):
        fit(path, direction="sideways")  # type: ignore[arg-type]
    with pytest.raises(TypeError, match="known tick"):
        fit(path, split=0.5, cut=True)


def test_measurements_without_a_link_are_refused(fates: str, tmp_path) -> None:
    with pytest.raises(cohaptic.UnreadableError, match=r"nowhere\.csv"):
        fit("nowhere.csv")
    capture = tmp_path / "sender.pcapng"
    capture.write_bytes(bytes.fromhex("0a0d0d0a1c0000004d3c2b1a01000000ffffffffffffffff1c000000"))
    with pytest.raises(cohaptic.CohapticError, match="capture of one end"):
        fit(capture)
    with pytest.raises(cohaptic.CohapticError, match="the capture of the sender holds no frame"):
        fit(capture, capture)
    sent = np.arange(100) * 0.01
    with pytest.raises(cohaptic.CohapticError, match="offset=0"):
        fit((sent, sent % 0.07 + 100.0))
    with pytest.raises(cohaptic.CohapticError, match="packet 3"):
        fit((sent[[0, 2, 1]], sent[:3]))
    with pytest.raises(ValueError, match="one delay of each packet"):
        fit((sent, sent[:3]))
    with pytest.raises(TypeError, match="for captures"):
        fit((sent, sent), port=9)
    with pytest.raises(ValueError, match="least"):
        fit(fates, least=-1.0)
