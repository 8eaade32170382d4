#!/bin/sh
# A BOP data set on a Slurm cluster: one shard of its images a task, joined at the end.
#
#   sbatch --array=0-15 bop_array.sh DATASET OUT [options of tribin bop]
#   sbatch --dependency=afterok:JOB --wrap 'tribin merge OUT/shard_*.csv -o OUT/results.csv'
#
# DATASET and OUT lie where all nodes see them. A task that was killed or requeued goes on with the images that it has
# not done yet; more or fewer tasks give the same joined result (with --no-times to the byte).
#SBATCH --job-name=tribin-bop
#SBATCH --array=0-15
#SBATCH --cpus-per-task=2
#SBATCH --requeue
set -eu
dataset=$1
out=$2
shift 2
mkdir -p "$out"
exec tribin bop "$dataset" "$@" --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT" \
  --threads "${SLURM_CPUS_PER_TASK:-1}" -o "$out/shard_$SLURM_ARRAY_TASK_ID.csv"
