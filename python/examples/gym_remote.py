"""A pendulum that is balanced over a network: the return of one controller over the delay.

Run it with `python gym_remote.py`; it needs `pip install gymnasium`.
"""

from __future__ import annotations

import gymnasium
import numpy as np

from cohaptic.gym import RemoteEnv

PERIOD = 0.05


def balance(delay: str, steps: int = 200, seed: int = 1) -> float:
    """The return of a proportional-derivative controller of an upright pendulum."""
    env = gymnasium.make("Pendulum-v1", disable_env_checker=True)
    remote = RemoteEnv(env, period=PERIOD, idle=np.zeros(1, dtype=np.float32), actions=delay, observations=delay)
    _, _ = remote.reset(seed=seed, options={"x_init": 0.1, "y_init": 0.1})
    observation, total = np.array([1.0, 0.0, 0.0]), 0.0
    for _ in range(steps):
        cosine, sine, rate = observation
        torque = -30.0 * np.arctan2(sine, cosine) - 4.0 * rate
        observation, reward, terminated, truncated, _ = remote.step(
            np.array([np.clip(torque, -2, 2)], dtype=np.float32)
        )
        total += float(reward)
        if terminated or truncated:
            break
    return total


if __name__ == "__main__":
    for delay in ("delay 0ms", "delay 50ms", "delay 100ms", "delay 100ms 50ms loss 20%"):
        print(f"{delay:<28} return {balance(delay):8.1f}")
