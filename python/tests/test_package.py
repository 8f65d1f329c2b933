"""What the package is made of."""

import doctest
import importlib
from pathlib import Path

import pytest
import tomllib
from conftest import ROOT

import cohaptic

MODULES = [
    "cohaptic",
    *(
        f"cohaptic.{name}"
        for name in (
            *("campaign", "compare", "errors", "fit", "gym", "law", "link", "peer", "peer.device"),
            *("run", "scene", "stability", "table"),
        )
    ),
]


@pytest.mark.parametrize("name", MODULES)
def test_examples_of_docstrings_hold(name: str) -> None:
    failed, _ = doctest.testmod(importlib.import_module(name), raise_on_error=False)
    assert failed == 0


@pytest.mark.parametrize("page", ["docs/python.md", "python/README.md"])
def test_the_examples_of_pages_hold(page: str) -> None:
    failed, tried = doctest.testfile(str(ROOT / page), module_relative=False, optionflags=doctest.ELLIPSIS)
    assert (failed, tried > 5) == (0, True)


def test_there_are_examples() -> None:
    counts = [
        len(test.examples) for name in MODULES for test in doctest.DocTestFinder().find(importlib.import_module(name))
    ]
    assert sum(counts) > 25


def test_everything_public_has_a_docstring() -> None:
    for name in cohaptic.__all__:
        public = getattr(cohaptic, name)
        assert isinstance(public, tuple) or public.__doc__, name


def locked(path: Path) -> dict[str, set[str]]:
    found: dict[str, set[str]] = {}
    for package in tomllib.loads(path.read_text(encoding="utf-8"))["package"]:
        found.setdefault(package["name"], set()).add(package["version"])
    return found


def test_what_computes_has_the_versions_of_the_program() -> None:
    """Equal bits need equal libraries: cargo update has to be called in both workspaces."""
    program, package = locked(ROOT / "Cargo.lock"), locked(ROOT / "python" / "Cargo.lock")
    different = {name for name in package.keys() & program.keys() if not package[name] <= program[name]}
    assert different == set()
    assert {"libm", "num-complex", "pulp", "cohaptic-wan"} <= package.keys() & program.keys()
