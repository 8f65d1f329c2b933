"""Faults have a place, and travel between processes."""

import pickle

import pytest
from conftest import TWO

from cohaptic import AnalysisError, CohapticError, Link, Scene, SceneError, UnreadableError


def test_a_fault_has_file_line_column_and_key(tmp_path) -> None:
    path = tmp_path / "two.toml"
    path.write_text(TWO.replace('delay = "24ms"', 'delay = "24 parsecs"'), encoding="utf-8")
    with pytest.raises(SceneError) as caught:
        Scene(path)
    error = caught.value
    assert (error.file, error.argument, error.line, error.column, error.key) == (str(path), None, 7, 26, "link.delay")
    assert error.fault is not None
    assert error.fault.startswith('unknown unit "parsecs"')
    assert str(error).startswith(f"{path}:7:26: link.delay: unknown unit")
    assert isinstance(error, CohapticError)
    assert isinstance(error, ValueError)
    again = pickle.loads(pickle.dumps(error))
    assert (type(again), str(again), vars(again)) == (SceneError, str(error), vars(error))


def test_a_fault_in_what_is_set_names_it() -> None:
    with pytest.raises(SceneError) as caught:
        Scene(TWO).set("link.dlay", "8ms")
    error = caught.value
    assert (error.file, error.argument, error.key) == (None, "link.dlay=8ms", "link.dlay")
    assert error.fault is not None
    assert 'did you mean "delay"?' in error.fault


def test_a_missing_file_is_one_that_cannot_be_read() -> None:
    with pytest.raises(UnreadableError, match=r"no-such\.toml: cannot be read"):
        Scene("no-such.toml")


def test_a_scene_without_an_analysis_says_why() -> None:
    with pytest.raises(AnalysisError):
        Scene(TWO).set("coordination.strategy", "set-position").stability()
    with pytest.raises(ValueError, match="expected reduced, determinant or full"):
        Scene(TWO).stability(method="guess")


def test_links_are_refused_with_a_place() -> None:
    with pytest.raises(SceneError) as caught:
        Link("delay=20ms loss=120%")
    assert caught.value.key == "link.loss"
    with pytest.raises(SceneError):
        Link("delay 20ms loss")


def test_a_scene_travels_to_other_processes() -> None:
    scene = Scene(TWO).set("coordination.stiffness", 800)
    again = pickle.loads(pickle.dumps(scene))
    assert (again.text, again.overrides, again.run().summary) == (scene.text, scene.overrides, scene.run().summary)


def test_values_are_written_as_the_program_reads_them() -> None:
    scene = Scene(TWO)
    changed = (
        scene.set("peers.left.hand", {"force": 2.0})
        .set("object.position", [0.25])
        .set("object.split-mass", False)
        .set("scene.seed", 5)
    )
    assert changed.seed == 5
    assert changed.overrides == [
        'peers.left.hand={ "force" = 2.0 }',
        "object.position=[0.25]",
        "object.split-mass=false",
        "scene.seed=5",
    ]
    assert scene.overrides == []
    assert scene.set({"peers": [], "scene.count": 4}).peers[3] == "peer4"
    for wrong in (("scene.seed",), ({"scene.seed": 5}, 5)):
        with pytest.raises(TypeError, match="a mapping alone"):
            scene.set(*wrong)
    with pytest.raises(TypeError, match="not a value of a scene"):
        scene.set("scene.seed", object())
