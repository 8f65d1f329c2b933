"""The JSON Schemas that the program prints, by the validator of others: sound, and strict wherever the readers are."""

import copy
import json
from collections.abc import Callable, Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import tomllib
from conftest import ROOT, SCENES, Command
from jsonschema import Draft7Validator

from cohaptic import Scene, SceneError

# Files with every table and every key that the shipped scenes leave out. The name of a file begins with its kind.
TEXTS = sorted((ROOT / "crates/scene/src/schema/tests/samples").glob("*.toml"))
KINDS = ["relay-tcp", "relay", "router", "exec", "scene", "study"]
SAMPLES = [
    *((next(kind for kind in KINDS if path.stem.startswith(kind)), path) for path in TEXTS),
    *(("scene", ROOT / name) for name in SCENES),
    ("scene", ROOT / "crates/scene/tests/integration/data/every-key.toml"),
    *(("study", path) for path in sorted((ROOT / "studies").rglob("study.toml"))),
]

Tables = Iterator[dict[str, Any]]


@pytest.fixture(scope="module")
def schema(cohaptic_program: Command) -> Callable[[str], Draft7Validator]:
    """The validator of a kind of file."""

    @cache
    def of(kind: str) -> Draft7Validator:
        done = cohaptic_program("schema", kind)
        assert done.returncode == 0, done.stderr
        document = json.loads(done.stdout)
        Draft7Validator.check_schema(document)
        return Draft7Validator(document)

    return of


def tables(value: Any) -> Tables:
    """Every table within a value."""
    if isinstance(value, dict):
        yield value
    for inner in value.values() if isinstance(value, dict) else value if isinstance(value, list) else ():
        yield from tables(inner)


def test_every_kind_has_samples() -> None:
    assert {kind for kind, _ in SAMPLES} == set(KINDS)


@pytest.mark.parametrize(("kind", "path"), SAMPLES, ids=lambda value: value.stem if isinstance(value, Path) else value)
def test_a_sample_is_taken_and_an_unknown_key_is_not_wherever_it_stands(
    kind: str, path: Path, schema: Callable[[str], Draft7Validator]
) -> None:
    document = tomllib.loads(path.read_text(encoding="utf-8"))
    validator = schema(kind)
    assert [error.message for error in validator.iter_errors(document)] == []
    for place in range(len(list(tables(document)))):
        spoilt = copy.deepcopy(document)
        list(tables(spoilt))[place]["no-such-key"] = {"no-such-key": 1}
        assert not validator.is_valid(spoilt), list(tables(document))[place]


@pytest.mark.parametrize(
    ("of", "by"),
    [
        ("mass = 1, enclosure", "mass = -1, enclosure"),
        ("mass = 1, enclosure", 'mass = "1kg", enclosure'),
        ('"average-position"', '"average"'),
        ('duration = "4s"', "duration = 4"),
        ('duration = "4s"', 'duration = "4"'),
        ('duration = "4s"', 'title = "x"'),
        ("stages = 2", "stages = 2.5"),
        ('loss = "5%"', "loss = 1.5"),
    ],
)
def test_a_value_that_the_reader_refuses_is_refused(of: str, by: str, schema: Callable[[str], Draft7Validator]) -> None:
    text = next(path for path in TEXTS if path.stem == "scene-parts").read_text(encoding="utf-8")
    spoilt = text.replace(of, by, 1)
    assert spoilt != text
    with pytest.raises(SceneError):
        Scene(spoilt)
    assert not schema("scene").is_valid(tomllib.loads(spoilt))
