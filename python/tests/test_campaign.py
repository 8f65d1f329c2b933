"""Campaigns over any executor, whose workers may be lost."""

import csv
import os
import signal
from concurrent.futures import Executor, Future, ProcessPoolExecutor, ThreadPoolExecutor
from multiprocessing import get_context

import numpy as np
import pytest
from conftest import TWO
from distributed import Client, LocalCluster

import cohaptic
from cohaptic import Scene, Table, campaign

VARY = {"coordination.stiffness": [500, 1000], "link.delay": ["8ms", "24ms"]}
TEXTS = ["coordination.stiffness=500,1000", "link.delay=8ms,24ms"]
RUNS = 5


@pytest.fixture(scope="module")
def scene() -> Scene:
    return Scene(TWO)


@pytest.fixture(scope="module")
def expected(scene: Scene) -> Table:
    return campaign(scene, vary=VARY, runs=RUNS)


def processes() -> ProcessPoolExecutor:
    return ProcessPoolExecutor(2, mp_context=get_context("spawn"))


def assert_same(one: Table, other: Table) -> None:
    assert list(one) == list(other)
    for name in one:
        assert (
            one.decode(name).tobytes() == other.decode(name).tobytes()
            or one.decode(name).tolist() == other.decode(name).tolist()
        ), name


def test_the_table_is_that_of_the_program(expected: Table, cohaptic_program, tmp_path) -> None:
    path = tmp_path / "two.toml"
    path.write_text(TWO, encoding="utf-8")
    varied = [word for text in TEXTS for word in ("--vary", text)]
    out = tmp_path / "out"
    done = cohaptic_program("campaign", str(path), *varied, "--runs", str(RUNS), "--format", "csv", "--out", str(out))
    assert done.returncode == 0, done.stderr
    with (out / "runs.csv").open(newline="", encoding="utf-8") as file:
        names, *rows = csv.reader(file)
    # The program has the unit of a key in the name of its column.
    suffix = {"ms": "_ms", "N/m": "", "": ""}
    assert names == [name + suffix[expected.unit(name)] for name in expected]
    assert len(rows) == expected.rows == 4 * RUNS
    for name, texts in zip(expected, zip(*rows, strict=True), strict=True):
        column = expected.decode(name)
        if column.dtype == object:
            assert column.tolist() == list(texts), name
        else:
            numbers = np.array([float(text) if text else np.nan for text in texts])
            assert np.array_equal(column.astype(float), numbers, equal_nan=True), name


def test_a_row_is_the_run_of_its_seed(scene: Scene, expected: Table) -> None:
    row = expected.rows - 2
    summary = (
        scene.set("coordination.stiffness", 1000).set("link.delay", "24ms").run(seed=int(expected["seed"][row])).summary
    )
    assert summary["max_discrepancy_m"] == expected["max_discrepancy_m"][row]
    assert summary["link_totals"]["delivered"] == expected["links.delivered"][row]


@pytest.mark.parametrize("piece", [1, 7, None])
def test_pieces_and_threads_change_nothing(scene: Scene, expected: Table, piece: int | None) -> None:
    with ThreadPoolExecutor(3) as threads:
        assert_same(campaign(scene, vary=TEXTS, runs=RUNS, executor=threads, piece=piece), expected)


def test_processes_change_nothing(scene: Scene, expected: Table) -> None:
    with processes() as pool:
        assert_same(campaign(scene, vary=VARY, runs=RUNS, executor=pool), expected)


class Losing(Executor):
    """Its workers die at some calls."""

    def __init__(self, pool: ProcessPoolExecutor, deaths: set[int]) -> None:
        self.pool, self.deaths, self.calls = pool, deaths, 0

    def submit(self, function, /, *arguments, **keywords) -> Future:
        self.calls += 1
        if self.calls in self.deaths:
            return self.pool.submit(os._exit, 1)
        return self.pool.submit(function, *arguments, **keywords)

    def shutdown(self, wait: bool = True, *, cancel_futures: bool = False) -> None:
        self.pool.shutdown(wait, cancel_futures=cancel_futures)


def test_runs_of_a_worker_that_dies_are_asked_again(scene: Scene, expected: Table) -> None:
    made = []

    def make() -> Executor:
        # The first executor breaks in the middle, those after it do not.
        made.append(Losing(processes(), set() if made else {3}))
        return made[-1]

    assert_same(campaign(scene, vary=VARY, runs=RUNS, executor=make, piece=2), expected)
    assert len(made) == 2
    # Of one that cannot be made again the rest is computed here.
    with Losing(processes(), {3}) as losing:
        assert_same(campaign(scene, vary=VARY, runs=RUNS, executor=losing, piece=2), expected)


class Killing(Executor):
    """It kills a worker when the first piece is done."""

    def __init__(self, executor: Executor, worker: int) -> None:
        self.executor, self.worker, self.killed = executor, worker, False

    def submit(self, function, /, *arguments, **keywords) -> Future:
        future = self.executor.submit(function, *arguments, **keywords)
        future.add_done_callback(self.kill)
        return future

    def kill(self, _: Future) -> None:
        if not self.killed:
            self.killed = True
            os.kill(self.worker, signal.SIGKILL)


@pytest.mark.filterwarnings("ignore")
def test_a_worker_of_dask_that_is_killed_changes_nothing(scene: Scene, expected: Table) -> None:
    with LocalCluster(n_workers=2, threads_per_worker=1, dashboard_address=None) as cluster, Client(cluster) as client:
        first, *_ = client.run(os.getpid).values()
        killing = Killing(client.get_executor(), first)
        assert_same(campaign(scene, vary=VARY, runs=RUNS, executor=killing, piece=1), expected)
        assert killing.killed


class Forgetful(Executor):
    """It loses each piece a number of times."""

    def __init__(self, times: int) -> None:
        self.times, self.asked = times, {}

    def submit(self, function, /, *arguments, **keywords) -> Future:
        future: Future = Future()
        self.asked[arguments] = count = self.asked.get(arguments, 0) + 1
        if count <= self.times:
            future.set_exception(ConnectionError("the worker is gone"))
        else:
            future.set_result(function(*arguments, **keywords))
        return future


def test_lost_pieces_are_asked_again_up_to_three_times(scene: Scene, expected: Table) -> None:
    forgetful = Forgetful(2)
    assert_same(campaign(scene, vary=VARY, runs=RUNS, executor=forgetful, piece=4), expected)
    assert set(forgetful.asked.values()) == {3}
    with pytest.raises(ConnectionError, match="gone"):
        campaign(scene, vary=VARY, runs=RUNS, executor=Forgetful(3), piece=4)


def test_a_scene_that_is_refused_is_refused_before_anything_runs(scene: Scene) -> None:
    forgetful = Forgetful(0)
    with pytest.raises(cohaptic.SceneError) as caught:
        campaign(scene, vary={"link.delay": ["8ms", "8 parsecs"]}, executor=forgetful)
    assert caught.value.key == "link.delay"
    assert forgetful.asked == {}
    with pytest.raises(ValueError, match="varied twice"):
        campaign(scene, vary=["link.delay=8ms,9ms", "link.delay=8ms,9ms"])
    with pytest.raises(ValueError, match="0 runs"):
        campaign(scene, runs=0)
