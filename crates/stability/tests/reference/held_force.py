"""Step map of a body under a held force, in double, for `crossover.py` and `exchange.py`."""

import numpy as np


def step_map(mass, damping, stiffness, h):
    """Position and velocity after a time h with a held force: the exponential of the augmented plant, by a series that is scaled and squared."""
    a = np.array([[0.0, 1.0, 0.0], [-stiffness / mass, -damping / mass, 1.0 / mass], [0.0, 0.0, 0.0]]) * (h / 1024.0)
    term = total = np.eye(3)
    for number in range(1, 16):
        term = term @ a / number
        total = total + term
    for _ in range(10):
        total = total @ total
    return total[:2, :2], total[:2, 2]
