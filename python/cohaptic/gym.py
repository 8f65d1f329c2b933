"""A ``gymnasium`` environment whose agent is far away: observations and actions travel over links."""

from __future__ import annotations

from typing import Any, SupportsFloat

import gymnasium

from cohaptic.link import Link


class RemoteEnv(gymnasium.Wrapper[Any, Any, Any, Any]):
    """An environment behind two links.

    At each step the agent's action is sent to the environment, which takes the newest action that has arrived, and the environment's observation is sent
    back, where the agent sees the newest one that has arrived. Until the first action is there, ``idle`` is done; until the first observation
    is there, the one of the reset is seen. ``info`` has ``action_age`` and ``observation_age`` [s].

    ``period`` is the time of a step [s]. Links begin anew at each reset, with the seed of the reset if it has one.
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
        seed: int = 1,
    ) -> None:
        super().__init__(env)
        self._period, self._idle, self._size, self._seed = period, idle, size, seed
        self._specs = {"action": actions, "observation": observations}
        self._begin(seed, None)

    def _begin(self, seed: int, observation: Any) -> None:
        names = {"action": ("agent", "environment"), "observation": ("environment", "agent")}
        self._links = {
            what: Link(self._specs[what], seed, sender=sender, receiver=receiver)
            for what, (sender, receiver) in names.items()
        }
        self._held = {"action": (0.0, self._idle), "observation": (0.0, observation)}
        self._steps = 0

    def reset(self, *, seed: int | None = None, options: dict[str, Any] | None = None) -> tuple[Any, dict[str, Any]]:
        """Begins anew; the agent sees the beginning at once."""
        observation, info = self.env.reset(seed=seed, options=options)
        self._begin(self._seed if seed is None else seed, observation)
        return observation, info

    def step(self, action: Any) -> tuple[Any, SupportsFloat, bool, bool, dict[str, Any]]:
        """One step of the environment, with what has arrived."""
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
        """Sends something, and gives the newest of its kind that has arrived."""
        link = self._links[what]
        link.handle_packet(now, self._size, payload)
        for event in link.poll(now):
            if event.fate == "delivered" and event.offered >= self._held[what][0]:
                self._held[what] = (event.offered, event.payload)
        return self._held[what][1]
