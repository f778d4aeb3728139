#!/usr/bin/env python3
"""Whether an earlier build and this one write the same maps, to the byte, where nothing trades exactness for time.

    python3 tests/bench/same_as_before.py --before OTHER/build/bin/kiln [--kiln build/bin/kiln] [--scenes cornell staircase ...]

64 samples for every texel of the scenes of error_vs_time.py, of the corridor and of Sponza, with `--cache off --denoise off`.
Compares irradiance.exr and samples.exr. Exit status 1: one differs, as irradiance.exr does with `--seed 2`.
"""
import argparse
import filecmp
import os
import subprocess
import sys
import tempfile

import error_scenes
import real_rooms
from error_common import ARCADE, ROOT, real_options

EXACT = ["--encode", "none", "--basis", "irradiance", "--seams", "off", "--cache", "off", "--denoise", "off",
         "--min-samples", "64", "--max-samples", "64", "--preview", "off", "--quiet"]
REAL = {"staircase": 3, "living-room": 3, "sponza": 1}  # texels per metre


def scenes_in(folder):
    """(name, path, settings)."""
    for name, path in error_scenes.write(folder).items():
        yield name, path, []
    yield "corridor", real_rooms.write(folder, ["corridor"], "default")["corridor"], ["--texels-per-metre", "4"]
    yield "arcade", ARCADE, ["--texels-per-metre", "1"]
    for name, density in REAL.items():
        path = os.path.join(os.environ.get("KILN_SCENES") or os.path.join(ROOT, "../shared/scenes"), name + ".glb")
        if not os.path.exists(path):
            print("%s: left out, %s is absent" % (name, path))
            continue
        light = [word for key, value in real_options(path).items() for word in ("--" + key, value)]
        yield name, path, ["--layout", "pack", "--texels-per-metre", str(density), *light]


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--before", required=True)
    parser.add_argument("--kiln", default=os.path.join(ROOT, "build/bin/kiln"))
    parser.add_argument("--seed", default="1", help="of --kiln; the other has 1")
    parser.add_argument("--scenes", nargs="*")
    options = parser.parse_args()
    different = 0
    with tempfile.TemporaryDirectory(prefix="kiln-same-") as work:
        for name, path, settings in scenes_in(work):
            if options.scenes and name not in options.scenes:
                continue
            outs = [os.path.join(work, name + end) for end in ("-before", "-now")]
            for kiln, out, seed in zip((options.before, options.kiln), outs, ("1", options.seed)):
                subprocess.run([kiln, "bake", path, "-o", out, "--seed", seed, *EXACT, *settings], check=True,
                               stdout=subprocess.DEVNULL)
            differs = [f for f in ("irradiance.exr", "samples.exr")
                       if not filecmp.cmp(*[os.path.join(out, f) for out in outs], shallow=False)]
            print("%s: %s" % (name, ", ".join(differs) + " differ" if differs else "the same bytes"), flush=True)
            different += bool(differs)
    return 1 if different else 0


if __name__ == "__main__":
    sys.exit(main())
