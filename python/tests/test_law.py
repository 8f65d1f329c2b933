"""Laws in Python against those of the program."""

import numpy as np
import pytest
from conftest import TWO

from cohaptic import AnalysisError, Held, Peer, Scene, State

THREE = TWO.replace('{ name = "right" }', '{ name = "right" }, { name = "onlooker", contact = "none" }')
FIXED = TWO.replace(', jitter = "3ms", loss = "10%"', "")


class Spring:
    """Average position, written again."""

    def __init__(self, peer: Peer) -> None:
        self.stiffness, self.damping = peer.stiffness, peer.damping

    def command(self, own: State, held: Held, t: float) -> np.ndarray:
        return self.stiffness * (own.position - held.mean.position) + self.damping * (own.velocity - held.mean.velocity)

    def set_gains(self, stiffness: float, damping: float) -> None:
        self.stiffness, self.damping = stiffness, damping


class Smoothed(Spring):
    """The same behind a lag, which it remembers."""

    def __init__(self, peer: Peer) -> None:
        super().__init__(peer)
        periods = peer.tick / 0.010
        self.kept, self.taken = np.exp(-periods), -np.expm1(-periods)
        self.memory = np.zeros(peer.axes)

    def command(self, own: State, held: Held, t: float) -> np.ndarray:
        self.memory = self.kept * self.memory + self.taken * super().command(own, held, t)
        return self.memory


@pytest.mark.parametrize("text", [TWO, THREE])
def test_a_law_written_again_moves_every_copy_the_same(text: str) -> None:
    scene = Scene(text)
    theirs, mine = scene.run(), scene.run(law=Spring)
    assert mine.summary == theirs.summary
    for name in theirs.trajectory:
        assert mine.trajectory[name].tobytes() == theirs.trajectory[name].tobytes(), name
    assert scene.run(law=lambda peer: Spring(Peer(**{**vars(peer), "stiffness": 500.0}))).summary != theirs.summary


def test_a_law_hears_of_gains_that_change() -> None:
    scene = Scene(TWO + '\ntimeline = [{ at = "100ms", coordination = { stiffness = 300.0 } }]\n')
    assert scene.run(law=Spring).summary == scene.run().summary
    assert scene.run().summary != Scene(TWO).run().summary


def test_several_axes_come_at_once() -> None:
    text = TWO.replace('title = "Two users"', "axes = 3").replace(
        "hand = { force = 1.5 }", "hand = { force = [1.5, 0.5, -1.0] }"
    )
    scene = Scene(text)
    shapes = set()

    class Looking(Spring):
        def command(self, own: State, held: Held, t: float) -> np.ndarray:
            shapes.add(
                (own.position.shape, held.mean.velocity.shape, held.positions.shape, held.velocities.shape, len(held))
            )
            assert np.array_equal(held.positions.mean(axis=0), held.mean.position)
            return super().command(own, held, t)

    assert scene.run(law=Looking).summary == scene.run().summary
    assert shapes == {((3,), (3,), (1, 3), (1, 3), 1)}


def test_a_number_alone_is_a_force_of_one_axis() -> None:
    class Constant:
        def __init__(self, peer: Peer) -> None:
            self.force = 0.25 * (1 + peer.place)

        def command(self, own: State, held: Held, t: float) -> float:
            return self.force

    trajectory = Scene(TWO).run(law=Constant).trajectory
    assert set(zip(trajectory.decode("peer"), trajectory["ft"].tolist(), strict=True)) == {
        ("left", 0.25),
        ("right", 0.5),
    }


@pytest.mark.parametrize(("law", "strategy"), [(Spring, "average-position"), (Smoothed, "smoothed-average-position")])
@pytest.mark.parametrize("delay", ["8ms", "24ms"])
def test_a_linear_law_is_judged_as_full_judges(law: type, strategy: str, delay: str) -> None:
    scene = Scene(FIXED).set("link.delay", delay).set("coordination.strategy", strategy)
    theirs, mine = scene.stability(method="full"), scene.stability(law=law)
    assert (mine.verdict, mine.method, mine.dimension) == (theirs.verdict, "full", theirs.dimension)
    # Both are right within their errors, and close where both are small.
    assert abs(mine.radius - theirs.radius) <= mine.error + theirs.error
    assert mine.error <= 2 * theirs.error + 1e-12
    assert mine.matrix.shape == (mine.dimension,) * 2
    assert np.abs(mine.matrix - theirs.matrix).max() < 1e-10
    assert abs(abs(mine.eigenvalues[0]) - theirs.radius) < 1e-9


def test_a_law_that_is_not_linear_is_refused_by_the_analysis() -> None:
    class Cubic(Spring):
        def command(self, own: State, held: Held, t: float) -> np.ndarray:
            return 1e6 * (own.position - held.mean.position) ** 3

    with pytest.raises(AnalysisError):
        Scene(FIXED).stability(law=Cubic)


def test_a_law_that_hides_its_memory_is_refused_by_the_analysis() -> None:
    class Hiding(Smoothed):
        def __init__(self, peer: Peer) -> None:
            super().__init__(peer)
            self.hidden = self.__dict__.pop("memory")

        def command(self, own: State, held: Held, t: float) -> np.ndarray:
            self.hidden = self.kept * self.hidden + self.taken * Spring.command(self, own, held, t)
            return self.hidden

    with pytest.raises(AnalysisError):
        Scene(FIXED).stability(law=Hiding)


def test_what_a_law_raises_is_raised() -> None:
    class Failing(Spring):
        def command(self, own: State, held: Held, t: float) -> np.ndarray:
            if t > 0.1:
                raise ZeroDivisionError("at a tenth of a second")
            return super().command(own, held, t)

    class Wide(Spring):
        def command(self, own: State, held: Held, t: float) -> np.ndarray:
            return np.zeros(2)

    class Unmade:
        def __init__(self, peer: Peer) -> None:
            raise LookupError(peer.name)

    scene = Scene(TWO)
    with pytest.raises(ZeroDivisionError, match="tenth"):
        scene.run(law=Failing)
    with pytest.raises(ValueError, match="a force of 2 numbers: expected one for each of 1 axes"):
        scene.run(law=Wide)
    with pytest.raises(LookupError, match="left"):
        scene.run(law=Unmade)
    with pytest.raises(LookupError, match="left"):
        Scene(FIXED).stability(law=Unmade)
    with pytest.raises(AttributeError, match="command"):
        scene.run(law=lambda peer: object())
    with pytest.raises(ValueError, match="expected a class"):
        scene.run(law=3)
