#!/bin/sh
# One shard of the work, as a task of a job array.
#SBATCH --job-name=shard
#SBATCH --cpus-per-task=1
sh work.sh --out losses --shard auto --threads "${SLURM_CPUS_PER_TASK:-1}"
