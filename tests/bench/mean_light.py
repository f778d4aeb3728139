#!/usr/bin/env python3
"""Where light is lost: sums of E by brightness, of sets of bakes over those of the first set.

    python3 tests/bench/mean_light.py EXACT1,EXACT2 BAKE1,BAKE2,BAKE3 [...] [--before-denoiser]

A set is folders of bakes of one layout that differ in their seed alone, with commas between them; the first, made without the cache
and with a fixed count of samples, is what the others should be. A row is a range of E over the map's mean, a factor of 3 wide. Texels
are sorted by the second set, best one of low noise: where the first one's sorted them, those that it has too bright would fill the
bright rows. (All rows together do not depend on that.) ±: the standard error of a set's mean by its bakes, with that of the first set.
"""
import math
import os
import statistics
import sys

from by_brightness import STEP, in_folder, luminance, measured


def light_of(folder, before_denoiser):
    if before_denoiser and os.path.exists(os.path.join(folder, "measured.exr")):
        return luminance(in_folder(folder, "measured.exr"), "E.")
    return luminance(in_folder(folder, "irradiance.exr"))


def relative_error(sums):
    return statistics.stdev(sums) / math.sqrt(len(sums)) / statistics.mean(sums) if len(sums) > 1 else 0


def main():
    before_denoiser = "--before-denoiser" in sys.argv
    sets = [word.split(",") for word in sys.argv[1:] if word != "--before-denoiser"]
    if len(sets) < 2:
        sys.exit(__doc__)
    valid = [all(v) for v in zip(*(measured(folder) for one in sets for folder in one))]
    maps = [[light_of(folder, before_denoiser) for folder in one] for one in sets]
    sorting = [sum(e) / len(e) for e in zip(*maps[1])]
    mean = sum(e for e, v in zip(sorting, valid) if v) / sum(valid)
    rows = {}
    for texel, is_valid in enumerate(valid):
        if is_valid:
            rows.setdefault(math.floor(math.log(max(sorting[texel] / mean, 1e-4), STEP)), []).append(texel)
    everything = [texel for row in rows.values() for texel in row]
    print("| E over the mean | texels | share of the light |%s\n|---|---|---|%s" % (
        "".join(" %s |" % one[0] for one in sets[1:]), "---|" * (len(sets) - 1)))
    for key, texels in [*sorted(rows.items()), (None, everything)]:
        sums = [[sum(e[texel] for texel in texels) for e in one] for one in maps]
        first = statistics.mean(sums[0])
        print("| %s | %d | %.1f %% | %s |" % (
            "all" if key is None else "%.3g to %.3g" % (STEP**key, STEP**(key + 1)), len(texels),
            100 * sum(sorting[texel] for texel in texels) / (mean * len(everything)),
            " | ".join("%+.2f ± %.2f %%" % (100 * (statistics.mean(s) / first - 1),
                                            100 * math.hypot(relative_error(s), relative_error(sums[0]))) for s in sums[1:])))


if __name__ == "__main__":
    main()
