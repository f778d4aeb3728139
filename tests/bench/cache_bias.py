#!/usr/bin/env python3
"""What ending paths at the irradiance cache does to the mean of a map, by material.

    python3 tests/bench/cache_bias.py [NAME ...] [--materials lambert,default,as-is] [--samples 256] [--seeds 4]
        [--density D] [--folder FOLDER] [--work DIR]

Names: those of error_scenes.py (cornell, courtyard, ...), arcade, and .glb files of FOLDER (or $KILN_SCENES, or
../shared/scenes beside the checkout). `lambert`: no layer; `default`: glTF's default dielectric of roughness 1 over the
same base colours; `as-is`: the file's. Each scene is baked with `--cache on` and `--cache off` from the same seeds; the
spread over seeds gives the error. Prints a Markdown table. Python 3, no packages.
"""
import argparse
import json
import math
import os
import pathlib
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import error_scenes  # noqa: E402
import real_scenes  # noqa: E402
from error_scenes import scenes  # noqa: E402  (tests/compare/scenes.py)

ROOT = pathlib.Path(__file__).resolve().parents[2]
COMMON = ["--denoise", "off", "--seams", "off", "--preview", "off", "--layout", "pack"]


def sources(names, folder, work):
    """Path and options of each scene."""
    known = real_scenes.find_scenes(folder)
    made = error_scenes.write(str(work / "made"), [n for n in names if n in error_scenes.ROSTER])
    found = {}
    for name in names:
        if name in made:
            path = pathlib.Path(made[name])
            settings = json.loads(path.with_name(name + ".kiln.json").read_text())
            found[name] = path, [w for key, value in settings.items() for w in ("--" + key, str(value))]
        elif name in known:
            found[name] = known[name]
        else:
            sys.exit("there is no scene %s; known: %s" % (name, ", ".join([*error_scenes.ROSTER, *known])))
    return found


def of_materials(path, folder, materials):
    """The scene with those materials."""
    if materials == "as-is":
        return path
    folder.mkdir(parents=True, exist_ok=True)
    made = scenes.variant(str(path), str(folder), "lambert")
    if materials == "default":
        doc, binary = scenes.read(made)
        for material in doc.get("materials", []):
            material.get("extensions", {}).pop("KHR_materials_specular", None)
        if binary is None:
            pathlib.Path(made).write_text(json.dumps(doc))
        else:
            scenes.write(made, doc, binary)
    return pathlib.Path(made)


def bake(args, scene, options, out, cache, seed):
    if not (out / "report.json").exists():
        command = [str(args.kiln), "bake", str(scene), "-o", str(out), *options, *COMMON, "--cache", cache, "--seed",
                   str(seed), "--min-samples", str(args.samples), "--max-samples", str(args.samples)]
        if args.density:
            command += ["--texels-per-metre", str(args.density)]
        done = subprocess.run(command, capture_output=True, text=True)
        if done.returncode not in (0, 3):
            sys.exit("%s\n%s" % (" ".join(command), done.stderr[-2000:]))
    return out


def difference(args, name, materials, path, options):
    """Relative difference of the means, cache on to off, over the seeds; and its standard error."""
    folder = args.work / name / materials
    scene = of_materials(path, folder / "scene", materials)
    found = []
    for seed in range(1, args.seeds + 1):
        on, off = (bake(args, scene, options, folder / ("%s-%d-%d" % (cache, args.samples, seed)), cache, seed)
                   for cache in ("on", "off"))
        compared = subprocess.run([str(args.kiln), "compare", str(on), str(off), "--json"], capture_output=True,
                                  text=True, check=True)
        result = json.loads(compared.stdout)
        found.append(result["mean_a"] / result["mean_b"] - 1)
    mean = sum(found) / len(found)
    spread = math.sqrt(sum((x - mean) ** 2 for x in found) / max(1, len(found) - 1) / len(found))
    return mean, spread


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", default=["cornell", "courtyard", "arcade"])
    parser.add_argument("--materials", default="lambert,default")
    parser.add_argument("--samples", type=int, default=256)
    parser.add_argument("--seeds", type=int, default=4)
    parser.add_argument("--density", type=float)
    parser.add_argument("--folder", default=os.environ.get("KILN_SCENES", str(ROOT.parent / "shared/scenes")))
    parser.add_argument("--work", default=str(ROOT / "build/cache_bias"))
    parser.add_argument("--kiln", default=str(ROOT / "build/bin/kiln"))
    args = parser.parse_args()
    args.work = pathlib.Path(args.work)
    print("| scene | materials | samples | seeds | mean, cache on / off |\n|---|---|---|---|---|")
    for name, (path, options) in sources(args.names or ["cornell"], pathlib.Path(args.folder), args.work).items():
        for materials in args.materials.split(","):
            mean, spread = difference(args, name, materials, pathlib.Path(path), options)
            print("| %s | %s | %d | %d | %+.3f ± %.3f %% |" % (name, materials, args.samples, args.seeds, 100 * mean,
                                                          100 * spread), flush=True)


if __name__ == "__main__":
    main()
