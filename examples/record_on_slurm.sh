#!/bin/bash
# Record one store of impulse responses with a Slurm job array:
#
#     STORE=/shared/cube.zarr sbatch record_on_slurm.sh
#
# Each task writes every 16th shard. A shard is written at once or not at all, and an existing shard is kept: submit the
# same array (1 to N, whole) again after a time limit or a lost node, and only missing shards are computed. STORE may be
# s3://BUCKET/PREFIX (AWS_ACCESS_KEY_ID, AWS_SECRET_ACCESS_KEY and AWS_REGION in the environment). Without Slurm:
#
#     for i in 1 2 3; do SLURM_ARRAY_TASK_ID=$i SLURM_ARRAY_TASK_COUNT=3 STORE=cube.zarr ./record_on_slurm.sh; done
#
#SBATCH --job-name=palpate
#SBATCH --array=1-16
#SBATCH --cpus-per-task=8
#SBATCH --mem=16G
#SBATCH --time=04:00:00
#SBATCH --requeue
#SBATCH --output=palpate-%A_%a.log
set -euo pipefail

: "${STORE:?set STORE to the store to write, a folder that all nodes share or s3://BUCKET/PREFIX}"
: "${SLURM_ARRAY_TASK_ID:?is set by sbatch for a job array, from 1 to the number of tasks}"
: "${SLURM_ARRAY_TASK_COUNT:?is set by sbatch for a job array}"

# Number of threads that Slurm assigned, not that of the node.
if [[ -n "${SLURM_CPUS_PER_TASK:-}" ]]; then export RAYON_NUM_THREADS="$SLURM_CPUS_PER_TASK"; fi

# Body and parameters of the recording: the paper's cube, or the content of BODY.
CUBE="box:0.1x0.1x0.1/12x12x12 --order 1 --young 2000 --poisson 0.49 --density 110 --rayleigh 2,2e-4"
read -ra BODY <<< "${BODY:-$CUBE}"

"${PALPATE:-palpate}" record "${BODY[@]}" --method transient --dense "$STORE" \
    --shard "$SLURM_ARRAY_TASK_ID/$SLURM_ARRAY_TASK_COUNT"

# The log ends with the shards that are still missing.
"${PALPATE:-palpate}" inspect --quick "$STORE"
