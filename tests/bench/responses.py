#!/usr/bin/env python3
"""Errors that responses report on real scenes, against references of 1,024 samples.

    python3 tests/bench/responses.py BUILD SCENES [--samples 2,8,64] [--texels-per-metre 8] [--work DIR]

Bakes ao, sky and bent of the staircase, the living room and the modular room in folder SCENES with fixed samples and
prints the rows of response_error (tests/bench/response_error.cpp) for docs/responses.md. Python 3, no packages.
"""
import argparse
import pathlib
import subprocess
import tempfile

NAMES = ["staircase", "living-room", "godot_room"]


def bake(args, name, samples, seed, out):
    subprocess.run([args.build / "bin/kiln", "bake", args.scenes / (name + ".glb"), "-o", out, "--quantities",
                    "ao,sky,bent", "--texels-per-metre", args.texels_per_metre, "--min-samples", str(samples),
                    "--max-samples", str(samples), "--seed", str(seed), "--encode", "none", "--preview", "off",
                    "--quiet"], check=True)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("build", type=pathlib.Path)
    parser.add_argument("scenes", type=pathlib.Path)
    parser.add_argument("--samples", default="2,8,64")
    parser.add_argument("--texels-per-metre", default="8")
    parser.add_argument("--work", type=pathlib.Path, default=None)
    args = parser.parse_args()
    work = args.work or pathlib.Path(tempfile.mkdtemp())
    print("| bake | response | texels | rms error | true / reported | within the interval |")
    print("|---|---|---|---|---|---|", flush=True)
    for name in NAMES:
        reference = work / (name + "-reference")
        bake(args, name, 1024, 2, reference)
        for samples in args.samples.split(","):
            out = work / (name + "-" + samples)
            bake(args, name, int(samples), 1, out)
            subprocess.run([args.build / "bin/response_error", out, reference], check=True)


if __name__ == "__main__":
    main()
