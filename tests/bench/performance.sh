#!/bin/sh
# Every table and plot of docs/performance.md, in its order, from one command on an idle machine:
#   tests/bench/performance.sh [BUILD]
# Scenes of ../shared/scenes that are absent are passed over, saying so. About a quarter of an hour.
set -eu
root=$(CDPATH= cd -- "$(dirname -- "$0")/../.." && pwd)
bin="${1:-$root/build}/bin"
scenes="$root/../shared/scenes"
images="$root/docs/images"

ray_rate() { # SCENE OPTIONS...
  if [ -f "$1" ]; then "$bin/ray_rate" "$@" --samples 64; else echo "no $1: passed over" >&2; fi
}
echo "## Ray rate"
ray_rate "$scenes/sponza.glb" --sun 0.25,1,0.1:8,7.5,6.5 --environment 1,1,1 --sun-angle 0.53
ray_rate "$scenes/zdm2.glb" --sun 0.4,1,0.3:5,4.7,4.2 --environment 1,1,1 --sun-angle 0.53
ray_rate "$scenes/staircase.glb"
ray_rate "$scenes/living-room.glb" --environment 1,1,1
ray_rate "$root/tests/scenes/arcade/arcade.gltf" --sun-angle 0.53
echo "## Only what the scene needs"
"$bin/specialisation"
echo "## Many lights"
"$bin/many_lights" --svg "$images/many_lights.svg"
echo "## Sampling"
compared="box --sun-angle 0.53 --texels-per-metre 4 $root/tests/scenes/arcade/arcade.gltf"
if [ -f "$scenes/zdm2.glb" ]; then
  compared="$compared --sun 0.4,1,0.3:5,4.7,4.2 --environment 1,1,1 $scenes/zdm2.glb"
else
  echo "no $scenes/zdm2.glb: passed over" >&2
fi
"$bin/convergence" samplers --svg "$images/samplers.svg" $compared
"$bin/convergence" densities --svg "$images/densities.svg" $compared
echo "## Start of a worker"
python3 "$root/tests/bench/hello_time.py"
