"""Matrices, maps, boundaries and admittances against the program and against NumPy."""

import pickle

import numpy as np
import pytest

from cohaptic import Scene

PATH = "scenarios/network/ideal.toml"
X, Y = "coordination.stiffness=200..3000", "coordination.damping=0..30"


@pytest.fixture(scope="module")
def path(tmp_path_factory: pytest.TempPathFactory) -> str:
    file = tmp_path_factory.mktemp("scenes") / "three.toml"
    file.write_text(
        """
scene        = { duration = "2s", count = 3 }
object       = { mass = 0.45 }
coordination = { strategy = "average-position", stiffness = 1000.0, damping = 5.0, update = "8ms" }
peer         = { device = { mass = 0.1, damping = 5.0 }, coupling = { stiffness = 3500.0, damping = 5.0 } }
link         = { delay = "8ms" }
""",
        encoding="utf-8",
    )
    return str(file)


def test_eigenvalues_are_those_of_numpy(path: str) -> None:
    stability = Scene(path).stability(method="full")
    theirs = np.linalg.eigvals(stability.matrix)
    distances = np.abs(stability.eigenvalues[:, None] - theirs[None, :])
    assert distances.min(axis=0).max() < 1e-7
    assert distances.min(axis=1).max() < 1e-7
    assert abs(np.abs(stability.eigenvalues).max() - stability.radius) < 1e-12
    assert np.abs(stability.eigenvalues[:-1]).tolist() == sorted(np.abs(stability.eigenvalues[:-1]), reverse=True)
    assert len(stability.states) == stability.dimension == 17
    assert {peer for peer, _ in stability.states} == {"peer1", "peer2", "peer3"}
    assert stability.frame == 0.008


@pytest.mark.parametrize("more", [[], ["link.loss=10%"]])
def test_a_map_is_that_of_the_program(path: str, answer, more: list[str]) -> None:
    document = answer(
        "stability", "map", path, "--x", X, "--y", Y, "--grid", "9x5", *(f"--set={text}" for text in more)
    )
    found = Scene(path, more).map(x=X, y=("coordination.damping", 0, 30), grid=(9, 5))
    assert found.criterion == document["criterion"] == ("mean-square" if more else "spectral-radius")
    radius = np.array(document["mean_square_radius" if more else "spectral_radius"])
    assert found.radius.tobytes() == radius.tobytes()
    assert (found.x.tolist(), found.y.tolist()) == (document["x"], document["y"])
    assert found.stable.mean() == document["stable_fraction"]
    assert 0 < found.stable.mean() < 1
    data = found.to_xarray()
    cell = data.sel({"coordination.stiffness": found.x[3], "coordination.damping": found.y[2]})
    assert (float(cell["radius"]), str(cell["verdict"].values)) == (found.radius[2, 3], found.verdict[2, 3])
    # A contour separates stable cells from others.
    assert all(line.shape[1] == 2 for line in found.contours)
    assert len(found.contours) > 0


def test_a_map_does_not_depend_on_threads(path: str) -> None:
    one, two = (Scene(path).map(x=X, y=Y, grid=(7, 4), threads=threads) for threads in (1, 2))
    assert one.radius.tobytes() == two.radius.tobytes()


def test_a_boundary_is_that_of_the_program(path: str, answer) -> None:
    document = answer("stability", "boundary", path, "--along", "link.delay=0ms..100ms", "--samples", "50")
    found = Scene(path).boundary(("link.delay", "0ms", "100ms"), samples=50)
    theirs = [(crossing["value"], crossing["from"], crossing["to"]) for crossing in document["crossings"]]
    assert [tuple(crossing) for crossing in found.crossings] == theirs
    assert (found.first, found.unit, found.is_settled, found.tolerance) == ("stable", "ms", True, document["tolerance"])
    assert len(found.values) == document["samples"]
    value = found.crossings[0].value
    verdicts = [Scene(path).set("link.delay", f"{value + step}ms").stability().verdict for step in (-1e-3, 1e-3)]
    assert verdicts == ["stable", "unstable"]


def test_an_admittance_is_that_of_the_program(path: str, answer) -> None:
    hz = [0.01, 1.0, 7.5, 100.0]
    document = answer("admittance", path, "--peer", "peer2", "--at", ",".join(map(str, hz)))
    found = Scene(path).admittance(hz, peer="peer2")
    assert found.frequencies.tolist() == hz
    assert np.asarray(found).dtype == complex
    assert np.allclose(found.magnitude_db, [point["magnitude_db"] for point in document["points"]], rtol=0, atol=1e-12)
    assert np.allclose(found.phase, [point["phase_deg"] for point in document["points"]], rtol=0, atol=1e-10)
    assert tuple(found.inertia) == (document["inertia"]["value"], document["inertia"]["error"])
    assert (found.verdict, found.radius, found.object_mass) == (document["verdict"], document["spectral_radius"], 0.45)
    usual = answer("admittance", path, "--peer", "peer1")
    spread = Scene(path).admittance()
    assert np.allclose(spread.frequencies, [point["hz"] for point in usual["points"]], rtol=1e-14)


@pytest.mark.parametrize("more", [[], ["link.loss=10%"]])
def test_pictures_are_those_of_the_program(path: str, cohaptic_program, tmp_path, more: list[str]) -> None:
    scene = Scene(path, more)
    along = "link.delay=0ms..60ms"
    for found, words in {
        scene.map(x=X, y=Y, grid=(9, 5)).plot: ["stability", "map", path, "--x", X, "--y", Y, "--grid", "9x5"],
        scene.boundary(along, samples=20).plot: ["stability", "boundary", path, "--along", along, "--samples", "20"],
        scene.admittance(peer="peer2").plot: ["admittance", path, "--peer", "peer2"],
    }.items():
        out = tmp_path / "-".join(words[:2])
        done = cohaptic_program(*words, *(f"--set={text}" for text in more), "--out", str(out))
        assert done.returncode == 0, done.stderr
        (drawn,) = out.glob("*.svg")
        assert found().svg == drawn.read_text(encoding="utf-8"), drawn.name


def test_what_is_drawn_travels_to_other_processes(path: str) -> None:
    found = Scene(path).map(x=X, y=Y, grid=(3, 3))
    copy = pickle.loads(pickle.dumps(found))
    assert copy.plot().svg == copy._repr_svg_() == found._repr_svg_()
    assert copy.radius.tobytes() == found.radius.tobytes()
    assert "drawing" not in repr(found)


def test_what_makes_no_sense_is_refused(path: str) -> None:
    scene = Scene(path)
    with pytest.raises(ValueError, match="no range"):
        scene.map(x="coordination.stiffness=5", y=Y)
    with pytest.raises(ValueError, match="grid of 0 x 4"):
        scene.map(x=X, y=Y, grid=(0, 4))
    with pytest.raises(ValueError, match="at least 2 samples"):
        scene.boundary(X, samples=1)
    with pytest.raises(ValueError, match='no peer "nobody"'):
        scene.admittance([1.0], peer="nobody")
    with pytest.raises(ValueError, match='no axis "w"'):
        scene.admittance([1.0], axis="w")
    with pytest.raises(ValueError, match="expected a frequency above 0"):
        scene.admittance([0.0])
