#!/usr/bin/env python3
"""Do compressed copies of scenes bake like the scenes?

    npm ci --prefix tests/node/compress
    python3 tests/bench/compressed_scenes.py FOLDER [--build build] [--work DIR] [--scenes A,B] [--samples 64]

FOLDER has scenes that others made, with sidecars for their light. Copies are made by tests/node/compress/compress.mjs.
Where it changes no bit of the geometry (meshopt), the SHA-256 of every master has to be that of the scene's. Where
positions are rounded to 14 bits (draco, quantized) or triangles begin elsewhere (triangles), layouts differ, so no
texel has a counterpart: the mean of E over all measured texels, which is over the area, has to agree within the error that
error.exr states for a texel in the mean; two seeds of the scene itself show what chance does. Prints a table for
docs/gltf.md; exits with 1 where one does not hold. Python 3, no packages.
"""
import argparse
import json
import math
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
from cache_bias import read_exr  # noqa: E402
from masters import sidecar  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
# Texels per metre that give some ten thousand texels.
SCENES = {"pc_house": 2, "MixedLightingExample": 6, "veach-bidir": 3, "bevy_CornellBox": 0.15, "living-room": 6}
EXACT, ROUNDED = ["meshopt"], ["triangles", "quantized", "draco", "sequential"]


def bake(args, scene, options, out, seed=1):
    subprocess.run([str(pathlib.Path(args.build) / "bin/kiln"), "bake", str(scene), "-o", str(out), "--layout", "pack",
                    "--encode", "none", "--preview", "off", "--embed-basecolor", "off", "--seed", str(seed),
                    "--min-samples", str(args.samples), "--max-samples", str(args.samples), *options],
                   check=True, stdout=subprocess.DEVNULL)
    report = json.loads((out / "report.json").read_text())
    return {f["file"]: f["sha256"] for f in report["outputs"] if f["master"]}


def means(out):
    """Mean luminance of E and of its stated error over measured texels."""
    e, error, validity = (read_exr(out / (name + ".exr")) for name in ("irradiance", "error", "validity"))
    measured = [i for i, v in enumerate(validity["Y"]) if v == 1]
    light = sum(0.2126 * e["R"][i] + 0.7152 * e["G"][i] + 0.0722 * e["B"][i] for i in measured)
    return light / len(measured), sum(error["Y"][i] for i in measured) / len(measured)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", type=pathlib.Path)
    parser.add_argument("--build", default=str(ROOT / "build"))
    parser.add_argument("--work", type=pathlib.Path, default=ROOT / "build/compressed_scenes")
    parser.add_argument("--scenes", default=",".join(SCENES))
    parser.add_argument("--samples", type=int, default=64)
    args = parser.parse_args()
    args.work.mkdir(parents=True, exist_ok=True)
    held = True
    print("| scene | copy | bytes | masters | mean E | difference | stated error |\n|---|---|---|---|---|---|---|", flush=True)
    for name in args.scenes.split(","):
        plain = args.folder / (name + ".glb")
        options = ["--texels-per-metre", "%g" % SCENES[name]] + sidecar(plain.with_suffix(".json"))
        digests = bake(args, plain, options, args.work / name)
        mean, error = means(args.work / name)
        print("| `%s` | | %d | | %.5g | | %.2g |" % (name, plain.stat().st_size, mean, error), flush=True)
        bake(args, plain, options, args.work / (name + "-seed"), seed=2)
        other, _ = means(args.work / (name + "-seed"))
        print("| | another seed | | | %.5g | %.2g | |" % (other, abs(other - mean)), flush=True)
        for method in EXACT + ROUNDED:
            copy = args.work / ("%s-%s.glb" % (name, method))
            subprocess.run(["node", str(ROOT / "tests/node/compress/compress.mjs"), method, str(plain), str(copy)],
                           check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            out = args.work / ("%s-%s" % (name, method))
            same = bake(args, copy, options, out) == digests
            found, own = means(out)
            within = math.isfinite(found) and abs(found - mean) <= max(error, own)
            held &= same if method in EXACT else within
            print("| | %s | %d | %s | %.5g | %.2g | %.2g |%s" % (
                method, copy.stat().st_size, "same" if same else "differ", found, abs(found - mean), own,
                "" if (same if method in EXACT else within) else " **no**"), flush=True)
    return 0 if held else 1


if __name__ == "__main__":
    sys.exit(main())
