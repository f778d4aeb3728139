#!/usr/bin/env python3
"""Whether a part of a map is too bright or too dark as a whole, in bakes of several seeds, against what they state.

    kiln bench scene.glb -o bench --only-reference              # prints the folder of the halves
    python3 tests/bench/levels.py REFERENCE LOW HIGH OUT [OUT ...]

The part is the texels that the reference has between LOW and HIGH times the mean. *Level*: their sum over the reference's, less 1.
*Stated*: the root mean square of their relative errors. What texels share is one draw in each bake, so only the root mean squares over
seeds can be compared; the noise of single texels is in the second one alone.
"""
import math
import os
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
from by_brightness import in_folder, luminance, measured  # noqa: E402


def root_mean(values):
    return math.sqrt(sum(x * x for x in values) / len(values))


def main():
    if len(sys.argv) < 5:
        sys.exit(__doc__)
    halves = [os.path.join(sys.argv[1], half) for half in ("half0", "half1")]
    low, high = float(sys.argv[2]), float(sys.argv[3])
    reference = [(a + b) / 2 for a, b in zip(*(luminance(in_folder(half, "irradiance.exr")) for half in halves))]
    valid = measured(halves[0])
    mean = sum(e for e, v in zip(reference, valid) if v) / sum(valid)
    part = [i for i, v in enumerate(valid) if v and low * mean <= reference[i] < high * mean]
    if not part:
        sys.exit("no texel is between %g and %g of the mean" % (low, high))
    print("| bake | texels | level | stated |\n|---|---|---|---|")
    levels, stated = [], []
    for out in sys.argv[4:]:
        e, error = luminance(in_folder(out, "irradiance.exr")), in_folder(out, "error.exr")["Y"]
        levels.append(sum(e[i] for i in part) / sum(reference[i] for i in part) - 1)
        stated.append(root_mean([error[i] / e[i] for i in part if e[i] > 0]))
        print("| %s | %d | %+.2f %% | %.2f %% |" % (out, len(part), 100 * levels[-1], 100 * stated[-1]))
    print("| root mean square | | %.2f %% | %.2f %% |" % (100 * root_mean(levels), 100 * root_mean(stated)))


if __name__ == "__main__":
    main()
