#!/bin/sh
# What `make demo` runs: simulated grasps, a visual tracker on their depth images, all methods, a table.
# SEED=1 make demo does the same with other grasps. Interrupted, the same call goes on where it stopped.
set -eu
SEED=${SEED:-0}
OUT=${OUT:-demo-output/seed-$SEED}
JOBS=$(getconf _NPROCESSORS_ONLN)
unset VTGTSAM_YCB # the demo needs nothing but the built-in objects
export OMP_NUM_THREADS=1
START=$(date +%s)

say() { printf '\n[%3d s] %s\n' "$(($(date +%s) - START))" "$*"; }

# The same grasps, once seen by a tracker that knows nothing of the hand and once by one that knows its shape.
for TRACKER in depth depth-hand; do
    say "simulating 8 grasps, 12 s each: physics, ray-cast depth images at 30 Hz, tracker '$TRACKER';" \
        "camera 2 mm and 1 degree off, joints 1 degree off, as on a real setup"
    python -m sim generate --dataset vary --objects can,box,banana,mug --grasps 2 --seed "$SEED" \
        --tracker "$TRACKER" --calibration-error --jobs "$JOBS" --out "$OUT/recordings/$TRACKER"
done

say "estimating: vision alone, with non-penetration, with touch, with memory as well"
vtgtsam evaluate "$OUT/recordings" --out "$OUT/evaluation" --jobs "$JOBS"
say "done; look into a recording with: vtgtsam inspect $OUT/recordings/depth/vary/can_0.mcap"
