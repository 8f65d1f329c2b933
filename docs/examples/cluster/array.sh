#!/bin/sh
# One shard of a campaign, as a task of a job array:
#
#     shards=$(sbatch --parsable --array=1-8 array.sh)
#     sbatch --dependency=afterok:$shards merge.sh
#
#SBATCH --job-name=shard
#SBATCH --cpus-per-task=1
. ./work.sh
cohaptic $work --out losses --shard auto --threads "${SLURM_CPUS_PER_TASK:-1}"
