"""Does the shards of a command on the workers of a Dask cluster, and puts them together.

    python dask_shards.py SCHEDULER N DIR cohaptic campaign scene.toml --runs 1000

SCHEDULER is the address of a scheduler or its file, and DIR a folder that all workers share. A shard whose worker is lost is done again by another one.
"""

import os
import subprocess
import sys

from dask.distributed import Client, as_completed


def do_shard(command, folder, shard):
    """Runs the program on a worker, and gives the line that it prints."""
    done = subprocess.run([*command, "--out", folder, "--shard", shard], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"shard {shard}: {done.stderr.strip()}")
    return done.stdout.strip()


def main():
    scheduler, count, folder, *command = sys.argv[1:]
    where = {"scheduler_file": scheduler} if os.path.exists(scheduler) else {"address": scheduler}
    with Client(**where) as client:
        shards = [f"{index}/{count}" for index in range(1, int(count) + 1)]
        # The same shard has the same key, so it is asked for once.
        tasks = client.map(do_shard, [command] * len(shards), [folder] * len(shards), shards, key=[f"shard {shard}" for shard in shards], retries=3)
        for task in as_completed(tasks):
            print(task.result(), flush=True)
    sys.exit(subprocess.run([*command, "--merge", folder]).returncode)


if __name__ == "__main__":
    main()
