"""What the tests share: the program that Python is compared with, and the shipped scenes."""

import json
import os
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

ROOT = Path(__file__).resolve().parents[2]
SCENES = sorted(path.relative_to(ROOT).as_posix() for path in (ROOT / "scenarios").rglob("*.toml"))

TWO = """
scene        = { duration = "500ms", title = "Two users" }
object       = { mass = 0.45 }
coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
peer         = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
peers        = [{ name = "left", hand = { force = 1.5 } }, { name = "right" }]
link         = { delay = "24ms", jitter = "3ms", loss = "10%" }
"""

Command = Callable[..., subprocess.CompletedProcess[str]]


def program() -> Path:
    """The program: that of COHAPTIC_PROGRAM, or the newest build."""
    if named := os.environ.get("COHAPTIC_PROGRAM"):
        return Path(named)
    built = [path for kind in ("debug", "release") if (path := ROOT / "target" / kind / "cohaptic").exists()]
    if not built:
        pytest.skip("the program is not built: cargo build, or COHAPTIC_PROGRAM=FILE")
    return max(built, key=lambda path: path.stat().st_mtime)


@pytest.fixture(scope="session")
def cohaptic_program() -> Command:
    """Runs the program in the root of the project."""
    path = program()

    def run(*arguments: str) -> subprocess.CompletedProcess[str]:
        return subprocess.run([path, *arguments], cwd=ROOT, capture_output=True, text=True, check=False)

    return run


@pytest.fixture(scope="session")
def answer(cohaptic_program: Command) -> Callable[..., Any]:
    """The document of a command."""

    def document(*arguments: str) -> Any:
        done = cohaptic_program(*arguments, "--json")
        assert done.returncode == 0, done.stderr
        return json.loads(done.stdout)

    return document


@pytest.fixture(autouse=True)
def in_root(monkeypatch: pytest.MonkeyPatch) -> None:
    """Names of scenes are those of the program."""
    monkeypatch.chdir(ROOT)
