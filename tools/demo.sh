#!/bin/sh
# What `make demo` runs: an imperfect robot with a stereo camera grasps, is calibrated on some grasps, judged on others.
# SEED=1 make demo does the same with another robot and other grasps. Interrupted, the same call goes on where it stopped.
set -eu
SEED=${SEED:-0}
OUT=${OUT:-demo-output/seed-$SEED}
JOBS=$(getconf _NPROCESSORS_ONLN)
unset VTGTSAM_YCB # the demo needs nothing but the built-in objects
export OMP_NUM_THREADS=1
START=$(date +%s)

say() { printf '\n[%3d s] %s\n' "$(($(date +%s) - START))" "$*"; }

grasps() { # NAME OBJECTS: recordings of a grasp of each
    python -m sim generate --dataset vary --objects "$2" --grasps 1 --seed "$SEED" --robot "$SEED" \
        --camera stereo --friction dry --tracker depth-hand --jobs "$JOBS" --out "$OUT/$1"
}

say "a robot whose camera is 2 mm and 1 degree off, and each joint's zero 1 degree, grasps five objects, 12 s each:" \
    "physics, a stereo camera's two infrared images matched, a tracker that knows the hand's shape"
grasps calibrating bottle,pear,brick,baseball,gelatin_box

say "calibrating it on these grasps, without any truth"
vtgtsam calibrate "$OUT/calibrating" --out "$OUT/calibration.yaml" --force

say "the same robot grasps four other objects"
grasps judging can,box,banana,mug

say "estimating: vision alone, with non-penetration, with touch, with memory as well"
vtgtsam evaluate "$OUT/judging" --calibration "$OUT/calibration.yaml" --out "$OUT/evaluation" --jobs "$JOBS"

FILM=$OUT/box.webp
if python -m sim look "$OUT/judging/vary/box_0.mcap" --out "$FILM" --estimates "$OUT/evaluation" --force \
    --methods tracker=vis,fused=vis+tac+pen+mem --size 400x320 --speed 1.5 2> "$OUT/film.log"; then
    say "done; the film $FILM shows where tracker and fused pose have the box, beside the truth, and how sure they are"
else
    say "done; no film, $(head -n 1 "$OUT/film.log")"
fi
