#!/bin/sh
# Puts the shards together: refused, with exit status 3, while anything is missing.
#SBATCH --job-name=merge
sh work.sh --merge losses
