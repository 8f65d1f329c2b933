"""The examples, and the environment behind links."""

import importlib.util
import itertools
from pathlib import Path
from types import ModuleType

import gymnasium
import matplotlib as mpl
import matplotlib.pyplot as plt
import numpy as np
import pytest
from conftest import ROOT

from cohaptic import Link, Scene
from cohaptic.gym import RemoteEnv

# Without a display.
mpl.use("agg")


def example(name: str) -> ModuleType:
    spec = importlib.util.spec_from_file_location(name, ROOT / "python" / "examples" / f"{name}.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_a_ping_takes_both_links() -> None:
    ping = example("simpy_ping").ping
    assert np.allclose(ping(10, "delay 20ms"), 0.04)
    sent = np.arange(500) * 0.01
    address = {"seed": 7}
    there = Link("delay 20ms 3ms loss 5%", sender="client", receiver="server", **address).send(sent)
    arrived = there.arrived[there.delivered]
    assert not np.all(np.diff(arrived) > 0.0) or len(arrived) < 500
    order = np.argsort(arrived, kind="stable")
    back = Link("delay 20ms 3ms loss 5%", sender="server", receiver="client", **address).send(arrived[order])
    trips = (back.arrived - sent[there.delivered][order])[back.delivered]
    # SimPy counts its time in sums of floating-point numbers.
    assert np.allclose(np.sort(ping(500, seed=7)), np.sort(trips), atol=2e-9)


def test_the_figure_of_a_paper_shows_what_was_computed(tmp_path: Path) -> None:
    paper_figure = example("paper_figure")
    scene = Scene(ROOT / "scenarios" / "coordination" / "n3.toml")
    figure, (left, right) = plt.subplots(1, 2)
    paper_figure.regions(left, scene)
    # The shares that `cohaptic stability map` prints for the same grid on the front page: 55.15 % and 26.98 %.
    assert [text.get_text() for text in left.get_legend().get_texts()] == ["AP, 55%", "PD, 27%"]
    paper_figure.discrepancies(right, scene)
    medians = {line.get_label(): line.get_ydata() for line in right.get_lines()}
    assert np.all(medians["AP"] > medians["PD"])
    assert np.all(np.diff(medians["AP"]) > 0)
    plt.close(figure)
    paper_figure.draw(scene, str(tmp_path / "figure.pdf"))
    assert (tmp_path / "figure.pdf").read_bytes().startswith(b"%PDF")


def test_delay_makes_balancing_harder() -> None:
    balance = example("gym_remote").balance
    near, far = balance("delay 0ms"), balance("delay 200ms")
    assert near == balance("")
    assert near > 2 * far


class Counting(gymnasium.Env):
    """Its observation is the number of the step and the action that was taken."""

    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (2,))
    action_space = gymnasium.spaces.Box(-np.inf, np.inf, (1,))

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.steps = 0
        return (0, None), {}

    def step(self, action):
        self.steps += 1
        return (self.steps, action), 0.0, False, False, {}


def test_what_is_seen_and_done_is_as_old_as_the_links_make_it() -> None:
    remote = RemoteEnv(Counting(), period=0.1, idle="idle", actions="delay 200ms", observations="delay 100ms")
    observation, _ = remote.reset()
    seen = []
    for number in range(6):
        observation, _, _, _, info = remote.step(f"action {number}")
        seen.append((observation, round(info["action_age"], 9), round(info["observation_age"], 9)))
    # Step 1 is observed a step later; action 0 is done two steps after it was sent.
    assert [observation for observation, _, _ in seen] == [
        (0, None),
        (1, "idle"),
        (2, "idle"),
        (3, "action 0"),
        (4, "action 1"),
        (5, "action 2"),
    ]
    assert seen[-1][1:] == (0.2, 0.1)
    remote.reset()
    assert remote.step("again")[0] == (0, None)


def test_overtaken_actions_are_not_done() -> None:
    remote = RemoteEnv(Counting(), period=0.001, idle=-1, actions="delay 20ms 5ms", observations="", seed=3)
    remote.reset()
    done = [remote.step(number)[0][1] for number in range(500)]
    assert done == sorted(done)
    assert done[-1] > 450
    # Some overtook others, which were skipped.
    assert len(set(done)) < done[-1]
    with pytest.raises(ValueError, match="netem"):
        RemoteEnv(Counting(), period=0.1, idle=0, actions="delay")


class InPlace(gymnasium.Env):
    """Writes its observation into one array, and spoils the action that it has taken."""

    observation_space = gymnasium.spaces.Box(-np.inf, np.inf, (2,))
    action_space = gymnasium.spaces.Box(-np.inf, np.inf, (1,))

    def __init__(self) -> None:
        self.state = np.zeros(2)

    def reset(self, *, seed=None, options=None):
        super().reset(seed=seed)
        self.state[:] = 0.0
        return self.state, {}

    def step(self, action):
        self.state[:] = (self.state[0] + 1.0, action[0])
        action[0] = np.nan
        return self.state, 0.0, False, False, {}


def test_what_is_on_the_way_does_not_change() -> None:
    remote = RemoteEnv(InPlace(), period=0.1, idle=np.array([-1.0]), actions="delay 200ms", observations="delay 100ms")
    first, _ = remote.reset()
    action = np.zeros(1)
    seen = []
    for number in range(5):
        action[0] = number
        observation = remote.step(action)[0]
        seen.append(observation.tolist())
        # An agent that works in place.
        observation[:] = 7.0
    assert seen == [[0, 0], [1, -1], [2, -1], [3, 0], [4, 1]]
    assert first.tolist() == [0, 0]
    assert remote.reset()[0].tolist() == [0, 0]
    assert remote.step(action)[0].tolist() == [0, 0]


def test_each_episode_has_a_network_of_its_own() -> None:
    def episode(remote: RemoteEnv, seed: int | None = None) -> list[float]:
        remote.reset(seed=seed)
        return [remote.step(0)[4]["action_age"] for _ in range(100)]

    def remote() -> RemoteEnv:
        return RemoteEnv(Counting(), period=0.01, idle=0, actions="delay 20ms 15ms", seed=5)

    one, other = remote(), remote()
    episodes = [episode(one) for _ in range(4)]
    assert episodes == [episode(other) for _ in range(4)], "the same seed, the same networks"
    assert all(a != b for a, b in itertools.combinations(episodes, 2))
    # A seed begins the same row of networks anew, whatever came before.
    assert [episode(one, 5), episode(one), episode(one)] == episodes[:3]
    assert episode(one, 6) not in episodes
