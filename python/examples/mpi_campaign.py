"""A campaign on the ranks of an MPI job: the first one asks, all others run.

    mpiexec -n 8 python -m mpi4py.futures mpi_campaign.py SCENE KEY=VALUE,VALUE RUNS TABLE.npz

It needs `pip install mpi4py` and an MPI, such as that of the cluster.
"""

from __future__ import annotations

import sys

import numpy as np
from mpi4py.futures import MPIPoolExecutor

import cohaptic


def main() -> None:
    scene, vary, runs, out = sys.argv[1:]
    with MPIPoolExecutor() as ranks:
        table = cohaptic.campaign(cohaptic.Scene(scene), vary=[vary], runs=int(runs), executor=ranks)
    np.savez(
        out,
        allow_pickle=False,
        **{
            name: table.decode(name).astype(table[name].dtype if table.categories(name) is None else str)
            for name in table
        },
    )
    print(f"{table.rows} runs")


if __name__ == "__main__":
    main()
