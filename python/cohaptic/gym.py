"""Environments of ``gymnasium`` with a remote agent: observations and actions travel over links."""

from __future__ import annotations

from copy import deepcopy
from typing import Any, SupportsFloat

import gymnasium
import numpy as np

from cohaptic.link import Link


class RemoteEnv(gymnasium.Wrapper[Any, Any, Any, Any]):
    """Environment at the other end of two links.

    At each step the action of the agent is sent to the environment, and the environment takes the newest action that has arrived. The observation of the
    environment is sent back, and the agent sees the newest observation that has arrived. Before the first action arrives, the environment takes the action
    ``idle``. Before the first observation arrives, the agent sees the observation of the reset. ``info`` has ``action_age`` and ``observation_age`` [s].

    Observations and actions are copied when they are sent and when they are handed out. So an environment may write the next observation into the same
    array, and an agent may change the observation that it sees.

    ``period`` is the time of a step [s]. Links begin anew at each reset. Their seed is the seed of the latest reset with a seed, or ``seed`` before such a
    reset. A reset without a seed begins another episode. The seed of its links is computed from the last seed and the number of episodes since then.
    """

    def __init__(
        self,
        env: gymnasium.Env[Any, Any],
        *,
        period: float,
        idle: Any,
        actions: str = "",
        observations: str = "",
        size: int = 64,
        seed: int = 0,
    ) -> None:
        super().__init__(env)
        self._period, self._idle, self._size = period, deepcopy(idle), size
        self._specs = {"action": actions, "observation": observations}
        self._seed, self._episode = seed, -1
        self._begin(seed, None)

    def _begin(self, seed: int, observation: Any) -> None:
        names = {"action": ("agent", "environment"), "observation": ("environment", "agent")}
        self._links = {
            what: Link(self._specs[what], seed, sender=sender, receiver=receiver)
            for what, (sender, receiver) in names.items()
        }
        self._held = {"action": (0.0, self._idle), "observation": (0.0, deepcopy(observation))}
        self._steps = 0

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begins a new episode. The agent sees the first observation at once."""
        observation, info = self.env.reset(seed=seed, options=options)
        if seed is None:
            self._episode += 1
        else:
            self._seed, self._episode = seed, 0
        self._begin(_seed_of(self._seed, self._episode), observation)
        return deepcopy(observation), info

    def step(self, action: Any) -> tuple[Any, SupportsFloat, bool, bool, dict[str, Any]]:
        """Does a step of the environment with the newest action that has arrived, and returns the newest observation that has arrived."""
        now = self._steps * self._period
        taken = self._over("action", now, action)
        observation, reward, terminated, truncated, info = self.env.step(taken)
        self._steps += 1
        seen = self._over("observation", self._steps * self._period, observation)
        ages = {
            "action_age": now - self._held["action"][0],
            "observation_age": self._steps * self._period - self._held["observation"][0],
        }
        return seen, reward, terminated, truncated, {**info, **ages}

    def _over(self, what: str, now: float, payload: Any) -> Any:
        """Sends an action or an observation, and returns the newest one of the same kind that has arrived."""
        link = self._links[what]
        link.handle_packet(now, self._size, deepcopy(payload))
        for event in link.poll(now):
            if event.fate == "delivered" and event.offered >= self._held[what][0]:
                self._held[what] = (event.offered, event.payload)
        return deepcopy(self._held[what][1])


def _seed_of(seed: int, episode: int) -> int:
    """Returns the seed of the links of an episode: the seed of the reset for episode 0, then independent seeds."""
    return seed if episode == 0 else int(np.random.SeedSequence([seed, episode]).generate_state(1, np.uint64)[0])
