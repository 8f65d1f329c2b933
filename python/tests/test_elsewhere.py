"""Campaigns on the workers of MPI and of Ray: `pip install mpi4py mpich ray` into the virtual environment of the tests."""

import os
import shutil
import signal
import subprocess
import sys
from concurrent.futures import Executor, Future
from pathlib import Path

import numpy as np
import pytest
from conftest import ROOT, TWO

from cohaptic import Scene, Table, campaign

VARY = "coordination.stiffness=500,1000"
RUNS = 12


@pytest.fixture(scope="module")
def expected() -> Table:
    return campaign(Scene(TWO), vary=[VARY], runs=RUNS)


def mpiexec() -> str:
    """That of the package beside mpi4py, or that of the machine."""
    pytest.importorskip("mpi4py.futures", exc_type=ImportError)
    found = shutil.which("mpiexec", path=f"{Path(sys.executable).parent}{os.pathsep}{os.environ['PATH']}")
    return found or pytest.skip("no mpiexec: an MPI is not installed")


def test_ranks_of_mpi_change_nothing(expected: Table, tmp_path) -> None:
    scene, out = tmp_path / "two.toml", tmp_path / "table.npz"
    scene.write_text(TWO, encoding="utf-8")
    example = ROOT / "python" / "examples" / "mpi_campaign.py"
    words = [mpiexec(), "-n", "3", sys.executable, "-m", "mpi4py.futures", example, scene, VARY, str(RUNS), out]
    done = subprocess.run(words, capture_output=True, text=True, timeout=120, check=False)
    assert (done.returncode, done.stdout) == (0, f"{2 * RUNS} runs\n"), done.stderr
    found = np.load(out)
    assert list(found) == list(expected)
    for name in expected:
        assert found[name].tolist() == expected.decode(name).tolist() or np.isnan(found[name]).any(), name
        if expected.categories(name) is None:
            assert found[name].tobytes() == expected[name].tobytes(), name


class Killing(Executor):
    """It kills a worker when the first piece is done."""

    def __init__(self, executor: Executor) -> None:
        self.executor, self.lost, self.killed = executor, 0, False
        self.worker = executor.submit(os.getpid).result()

    def submit(self, function, /, *arguments, **keywords) -> Future:
        future = self.executor.submit(function, *arguments, **keywords)
        future.add_done_callback(self.done)
        return future

    def done(self, future: Future) -> None:
        self.lost += future.exception() is not None
        if not self.killed:
            self.killed = True
            os.kill(self.worker, signal.SIGKILL)


@pytest.mark.filterwarnings("ignore")
def test_a_worker_of_ray_that_is_killed_changes_nothing(expected: Table) -> None:
    ray = pytest.importorskip("ray")
    from cohaptic.ray import RayExecutor

    ray.init(num_cpus=2, include_dashboard=False, log_to_driver=False)
    try:
        # Ray asks again by itself, or leaves that to the campaign.
        for options in ({}, {"max_retries": 0}):
            with RayExecutor(**options) as executor:
                killing = Killing(executor)
                table = campaign(Scene(TWO), vary=[VARY], runs=RUNS, executor=killing, piece=1)
            assert killing.killed
            assert killing.lost > 0 or not options
            for name in expected:
                assert table.decode(name).tolist() == expected.decode(name).tolist() or np.isnan(table[name]).any(), (
                    name
                )
        with pytest.raises(RuntimeError, match="shut down"):
            executor.submit(os.getpid)
    finally:
        ray.shutdown()
