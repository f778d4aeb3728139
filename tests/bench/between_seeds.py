#!/usr/bin/env python3
"""True and stated error by brightness, of bakes that differ in their seed alone, without a reference.

    for s in 1 2 3; do kiln bake scene.glb -o out$s --seed $s ...; done
    python3 tests/bench/between_seeds.py out1 out2 out3 [...]

Half of the squared difference of two bakes is expected to be their squared error, without what they have in common: the bias of the
cache and of the denoiser. by_brightness.py has that in it, and the noise of a reference. A row is a range of the bakes' mean over
the map's, a factor of 3 wide; relMSE is relative to that mean.
"""
import itertools
import math
import sys

from by_brightness import STEP, in_folder, luminance, measured


def rows_of(folders):
    """By row k, of E from STEP^k to STEP^(k + 1) of the map's mean: the number of texels and the sums of their true and stated relMSE."""
    maps = [luminance(in_folder(folder, "irradiance.exr")) for folder in folders]
    stated = [in_folder(folder, "error.exr")["Y"] for folder in folders]
    valid = [all(v) for v in zip(*(measured(folder) for folder in folders))]
    texels = [(e, s) for e, s, v in zip(zip(*maps), zip(*stated), valid) if v]
    mean = sum(sum(e) for e, _ in texels) / len(maps) / len(texels)
    pairs = list(itertools.combinations(range(len(maps)), 2))
    rows = {}
    for e, s in texels:
        own = sum(e) / len(e)
        floor = own**2 + (mean / 100)**2
        row = rows.setdefault(math.floor(math.log(max(own / mean, 1e-4), STEP)), [0, 0, 0])
        row[0] += 1
        row[1] += sum((e[i] - e[j])**2 / 2 for i, j in pairs) / len(pairs) / floor
        row[2] += sum(x * x for x in s) / len(s) / floor
    return rows


def main():
    if len(sys.argv) < 3:
        sys.exit(__doc__)
    rows = rows_of(sys.argv[1:])
    print("| E over the mean | texels | relMSE | stated | true / stated |\n|---|---|---|---|---|")
    line = "| %s | %d | %.2g | %.2g | %.2f |"
    for key in sorted(rows):
        n, true, said = rows[key]
        print(line % ("%.3g to %.3g" % (STEP**key, STEP**(key + 1)), n, true / n, said / n, math.sqrt(true / said) if said else 0))
    n, true, said = map(sum, zip(*rows.values()))
    print(line % ("all", n, true / n, said / n, math.sqrt(true / said)))


if __name__ == "__main__":
    main()
