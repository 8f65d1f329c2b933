"""A stability map by numpy (https://numpy.org, BSD): `stability_map.py SCENE full|modes`, a file that `others-table` writes.

N equal peers under average-position coordination, whose samples take a whole number of frames. Over a frame the samples held are constant, so that a peer
moves by a power of its tick's matrix; what is on the way are states too. `full` has all of them in one matrix, as it stands; `modes` uses that equal peers
move together or apart, which somebody has to see first. Matrices of all cells are built and taken apart at once. The eigenvalue 1 of moving everything to
another place is left out.
"""

import os
import sys
from time import perf_counter

# One core, as cohaptic's `--jobs 1`. Before numpy is loaded.
for library in ("OPENBLAS", "OMP", "MKL"):
    os.environ[f"{library}_NUM_THREADS"] = "1"

from scene import Scene, answer, skip

try:
    import numpy as np
except ImportError:
    skip("numpy is not installed: python3 -m pip install numpy")


def peer(scene):
    """Of all cells, what a frame does to (xh, vh, xo, vo): by themselves, and by the mean of the samples held."""
    low, high, count = scene.stiffness
    kt = scene.scale * np.linspace(low, high, count)
    low, high, count = scene.damping
    bt = scene.scale * np.linspace(low, high, count)
    kt, bt = (grid.ravel() for grid in np.meshgrid(kt, bt))
    kc, bc = scene.coupling
    zero, one = np.zeros_like(kt), np.ones_like(kt)
    coupling = np.stack([kc * one, bc * one, -kc * one, -bc * one], axis=-1)
    on_copy = coupling - np.stack([zero, zero, kt, bt], axis=-1)
    target = np.stack([kt, bt], axis=-1)
    tick, by_mean = np.zeros((len(kt), 4, 4)), np.zeros((len(kt), 4, 2))
    for first, (x_by_v, x_by_f, v_by_v, v_by_f), force in ((0, scene.device, -coupling), (2, scene.copy, on_copy)):
        tick[:, first] = x_by_f * force
        tick[:, first + 1] = v_by_f * force
        tick[:, first, first] += 1.0
        tick[:, first, first + 1] += x_by_v
        tick[:, first + 1, first + 1] += 1.0 + v_by_v
    by_mean[:, 2] = scene.copy[1] * target
    by_mean[:, 3] = scene.copy[3] * target
    state, held = tick, by_mean
    for _ in range(scene.ticks_a_frame - 1):
        state, held = tick @ state, by_mean + tick @ held
    return state, held


def frame(state, held, weights, on_the_way):
    """The matrix of peers, each of which has `weights` of the samples of each other: their states, then the samples on the way, the newest first."""
    n = len(weights)
    size = 4 * n + 2 * n * on_the_way
    matrix = np.zeros((len(state), size, size))
    for i in range(n):
        matrix[:, 4 * i : 4 * i + 4, 4 * i : 4 * i + 4] = state
        for k in range(n):
            oldest = size - 2 * n + 2 * k
            matrix[:, 4 * i : 4 * i + 4, oldest : oldest + 2] = weights[i][k] * held
        sent = 4 * n + 2 * i
        matrix[:, sent, 4 * i + 2] = matrix[:, sent + 1, 4 * i + 3] = 1.0
    for place in range(4 * n + 2 * n, size):
        matrix[:, place, place - 2 * n] = 1.0
    return matrix


def radius(matrix, rigid):
    values = np.linalg.eigvals(matrix)
    sizes = np.abs(values)
    if rigid:
        nearest = np.argmin(np.abs(values - 1.0), axis=-1)
        np.put_along_axis(sizes, nearest[:, None], 0.0, axis=-1)
    return sizes.max(axis=-1)


def main():
    scene, how = Scene(sys.argv[1]), sys.argv[2]
    n, frames = scene.peers, scene.delay // (scene.ticks_a_frame * scene.tick_nanos)
    begin = perf_counter()
    state, held = peer(scene)
    if how == "full":
        weights = [[0.0 if i == k else 1.0 / (n - 1) for k in range(n)] for i in range(n)]
        radii = radius(frame(state, held, weights, frames), rigid=True)
    else:
        together = radius(frame(state, held, [[1.0]], frames), rigid=True)
        apart = radius(frame(state, held, [[-1.0 / (n - 1)]], frames), rigid=False)
        radii = np.maximum(together, apart)
    seconds = perf_counter() - begin
    answer(
        program=f"numpy {np.__version__}, " + ("all peers in one matrix" if how == "full" else "peers together and apart, by hand"),
        seconds=seconds,
        radii=radii.tolist(),
        lacks="anything but this one scene: other strategies, contacts, clocks, delays between frames, graphs, random loss and delay; bounds of errors",
    )


main()
