#!/usr/bin/env python3
"""Whether bakes of an earlier build and of this one are the same, to the byte.

    python3 tests/bench/same_as_before.py --before OTHER/build/bin/kiln
    python3 tests/bench/same_as_before.py --before OTHER/build/bin/kiln --rooms staircase sponza   # these too, at production density
    python3 tests/bench/same_as_before.py --before OTHER/build/bin/kiln --denoised --rooms flat         # what a user gets

Bakes the scenes of error_vs_time.py with `--cache off --denoise off` and 64 samples for every texel, and compares irradiance.exr
and samples.exr. With `--denoised` the cache and the denoiser are on, the map is baked to `--error 0.4`, and error.exr is compared too.
Exit status 1: a file differs. `--seed 2` shows that it can.
"""
import argparse
import filecmp
import os
import sys
import tempfile

import error_rooms
import error_vs_time
from error_common import ROOT, arguments_of, run

ALL = {"encode": "none", "preview": "off"}
EXACT = {**ALL, "basis": "irradiance", "seams": "off", "cache": "off", "denoise": "off", "min-samples": 64, "max-samples": 64}
DENOISED = {**ALL, "error": 0.4, "error-norm": "mean-square"}


def scenes_in(work, rooms):
    """(label, path, settings)."""
    options = argparse.Namespace(work=work, scenes=None, quick=False, materials=["default"], densities=[8])
    for name, (path, own) in error_vs_time.scenes_of(options).items():
        yield name, path, own
    options.scenes = rooms
    for name, _, density, path, own in error_rooms.rooms_of(options):
        yield "%s at %g texels a metre" % (name, density), path, own


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--before", required=True, metavar="KILN")
    parser.add_argument("--kiln", default=os.path.join(ROOT, "build/bin/kiln"))
    parser.add_argument("--seed", type=int, default=1, help="of --kiln; the other has 1")
    parser.add_argument("--denoised", action="store_true", help="with the cache and the denoiser")
    parser.add_argument("--rooms", nargs="*", default=[], choices=error_rooms.ROOMS, metavar="ROOM")
    options = parser.parse_args()
    settings, files = EXACT, ["irradiance.exr", "samples.exr"]
    if options.denoised:
        settings, files = DENOISED, [*files, "error.exr"]
    differ = 0
    with tempfile.TemporaryDirectory(prefix="kiln-same-") as work:
        before, now = os.path.join(work, "before"), os.path.join(work, "now")
        for label, path, own in scenes_in(work, options.rooms):
            for kiln, out, seed in ((options.before, before, 1), (options.kiln, now, options.seed)):
                run([kiln, "bake", path, "-o", out, "--quiet", *arguments_of({**own, **settings, "seed": seed})])
            different = [f for f in files
                         if not filecmp.cmp(os.path.join(before, f), os.path.join(now, f), shallow=False)]
            print("%s: %s" % (label, ", ".join(different) + " differ" if different else "the same bytes"), flush=True)
            differ += len(different)
    return 1 if differ else 0


if __name__ == "__main__":
    sys.exit(main())
