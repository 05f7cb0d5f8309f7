#!/bin/bash
# An experiment on Slurm: each node of the job is a node of a Ray cluster, which ends with the experiment.
#
#     sbatch --nodes 4 slurm.sh my_grid.yaml
#
# Submit it from a directory that all nodes see, with an environment in which `pip install 'khala-sc2[ray]'` was done.
# Submitted again after its time was up, it plays what is missing.
#SBATCH --job-name=khala
#SBATCH --ntasks-per-node=1
#SBATCH --cpus-per-task=16
#SBATCH --mem-per-cpu=1G
#SBATCH --time=08:00:00
set -euo pipefail

file=${1:?name an experiment, or its file: sbatch slurm.sh my_grid.yaml}
first=$(scontrol show hostnames "$SLURM_JOB_NODELIST" | head --lines 1)
address=$first:$((20000 + SLURM_JOB_ID % 20000)) # so that two jobs on a node do not meet

srun --nodes "$SLURM_JOB_NUM_NODES" --ntasks "$SLURM_JOB_NUM_NODES" \
  ray symmetric-run --address "$address" --min-nodes "$SLURM_JOB_NUM_NODES" --num-cpus "$SLURM_CPUS_PER_TASK" -- \
  khala experiment run "$file" --on ray --address "$address" --out experiments
