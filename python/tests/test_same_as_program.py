"""Every shipped scene, run and judged by the program and from Python: equal to the bit."""

import csv
import json
import struct

import numpy as np
import pytest
from conftest import SCENES, Command

import cohaptic

# What a document says of the run of the program, and not of the scene.
OF_PROGRAM = ("schema", "version", "wall_s", "realtime_factor", "files")


def bits(value: float) -> bytes:
    return struct.pack("<d", value)


def assert_same_column(name: str, texts: list[str], table: cohaptic.Table) -> None:
    mine = table.decode(name)
    assert len(mine) == len(texts), name
    if mine.dtype == object:
        assert mine.tolist() == texts, name
        return
    theirs = np.array([float(text) if text else np.nan for text in texts])
    numbers = mine.astype(np.float64)
    # An empty cell is NaN here, whatever its bits.
    same = (numbers.view(np.uint64) == theirs.view(np.uint64)) | (np.isnan(numbers) & np.isnan(theirs))
    assert same.all(), (name, int(np.argmin(same)))


def rows(path) -> dict[str, list[str]]:
    with path.open(newline="", encoding="utf-8") as file:
        names, *lines = csv.reader(file)
    return (
        {name: list(column) for name, column in zip(names, zip(*lines, strict=True), strict=True)}
        if lines
        else {key: [] for key in names}
    )


@pytest.mark.parametrize("path", SCENES)
def test_a_run_is_the_same(path: str, cohaptic_program: Command, tmp_path) -> None:
    done = cohaptic_program("run", path, "--json", "--out", str(tmp_path))
    if done.returncode != 0:
        with pytest.raises(cohaptic.SceneError) as refused:
            cohaptic.Scene(path).run()
        assert done.stderr == f"error: {refused.value}\n"
        return
    document = json.loads(done.stdout)
    run = cohaptic.Scene(path).run()
    assert run.summary == {key: value for key, value in document.items() if key not in OF_PROGRAM}
    for name, table in {"trajectory": run.trajectory, "packets": run.packets, "links": run.links}.items():
        columns = rows(tmp_path / f"{name}.csv")
        assert list(columns) == list(table), name
        for column, texts in columns.items():
            assert_same_column(column, texts, table)
    for picture in tmp_path.glob("*.svg"):
        assert run.plot(picture.stem).svg == picture.read_text(encoding="utf-8"), picture.name
    # Without rows it is computed in another way.
    assert cohaptic.Scene(path).run(record=False).summary == run.summary


# Their second moments take from ten seconds to minutes; those of the others come by the same code.
SLOW = {
    "scenarios/live/two-and-a-program.toml",
    "scenarios/network/clock-offset-and-drift.toml",
    "scenarios/network/jitter-normal.toml",
    "scenarios/network/loss-four-state.toml",
}


@pytest.mark.parametrize("path", [path for path in SCENES if path not in SLOW])
def test_a_verdict_is_the_same(path: str, cohaptic_program: Command) -> None:
    done = cohaptic_program("stability", "point", path, "--json")
    if done.returncode != 0:
        with pytest.raises(cohaptic.CohapticError) as refused:
            cohaptic.Scene(path).stability()
        # The program says of which file it speaks.
        assert done.stderr in (f"error: {refused.value}\n", f"error: {path}: {refused.value}\n")
        return
    document = json.loads(done.stdout)
    stability = cohaptic.Scene(path).stability()
    assert stability.verdict == document["verdict"]
    finite = {"radius": document["spectral_radius"], "error": document["error_bound"]}
    for name, theirs in finite.items():
        mine = getattr(stability, name)
        assert not np.isfinite(mine) if theirs is None else bits(mine) == bits(theirs), name
    assert (stability.judged, stability.left_out) == (document["judged"], document["left_out"])
    if stability.mean_square is None:
        assert "mean_square_radius" not in document
    else:
        assert bits(stability.mean_square.value) == bits(document["mean_square_radius"])
        assert bits(stability.mean_square.error) == bits(document["mean_square_error_bound"])
    assert (stability.notes, stability.method, stability.dimension) == (
        document["notes"],
        document["method"],
        document["dimension"],
    )
    theirs = [
        (part["kind"], part.get("peer"), part["dimension"], part["multiplicity"], part["spectral_radius"])
        for part in document["parts"]
    ]
    assert [
        (part.kind, part.peer, part.dimension, part.multiplicity, part.radius) for part in stability.parts
    ] == theirs


def test_scenes_are_checked_alike(answer) -> None:
    paths = SCENES[::5]
    document = answer("check", *paths)
    assert [scene["file"] for scene in document["scenes"]] == paths
    for scene in document["scenes"]:
        check = cohaptic.Scene(scene["file"]).check()
        assert (check.passed, check.failures, check.notes) == (scene["passed"], scene["failures"], scene["notes"])
        assert [vars(outcome) for outcome in check.expectations] == scene["expectations"]


@pytest.mark.parametrize("path", SCENES[::7])
def test_an_explanation_is_the_same(path: str, cohaptic_program: Command) -> None:
    done = cohaptic_program("explain", path, "--json")
    if done.returncode == 0:
        document = json.loads(done.stdout)
        assert cohaptic.Scene(path).explain() == {
            key: value for key, value in document.items() if key not in OF_PROGRAM
        }


def test_overrides_seeds_and_measures_are_those_of_the_program(answer) -> None:
    path = "scenarios/network/jitter-normal.toml"
    overrides = ["coordination.stiffness=800", "link.loss=5%"]
    document = answer(
        "run",
        path,
        "--seed",
        "7",
        "--measure",
        "energy_j,travel_s",
        *(f"--set={text}" for text in overrides[:1]),
        "--set",
        overrides[1],
    )
    scene = cohaptic.Scene(path).set("coordination.stiffness", 800).set("link.loss", "5%")
    assert scene.overrides == overrides
    run = scene.run(seed=7, measure=["energy_j", "travel_s"])
    assert run.summary == {key: value for key, value in document.items() if key not in OF_PROGRAM}
