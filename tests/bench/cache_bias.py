#!/usr/bin/env python3
"""What ending paths at the irradiance cache does to the mean of a map, by material.

    python3 tests/bench/cache_bias.py [NAME ...] [--materials lambert,default,as-is] [--samples 256] [--seeds 4]
        [--density D] [--folder FOLDER] [--work DIR]

Names: those of error_scenes.py (cornell, courtyard, ...), arcade, and .glb files of FOLDER (or $KILN_SCENES, or
../shared/scenes beside the checkout). `lambert`: no layer; `default`: glTF's default dielectric of roughness 1 over the
same base colours; `as-is`: the file's. Each scene is baked with `--cache on` and `--cache off` from the same seeds; the
spread over seeds gives the error. "Light where none": what the cache adds, of the map's mean, to texels that met no light
without it (in the bakes of other seeds), and their number. Prints a Markdown table. Python 3, no packages.
"""
import argparse
import itertools
import json
import math
import os
import pathlib
import struct
import subprocess
import sys
import zlib

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


def read_exr(path):
    """The planes of a master, by channel: scan lines of 32-bit floats, ZIP or plain."""
    data = path.read_bytes()
    at, attributes = 8, {}
    while data[at]:
        name, kind, _ = data[at:at + 600].split(b"\0", 2)  # names have at most 255 characters
        at += len(name) + len(kind) + 2
        size, = struct.unpack_from("<i", data, at)
        attributes[name.decode()] = data[at + 4:at + 4 + size]
        at += 4 + size
    x0, y0, x1, y1 = struct.unpack("<4i", attributes["dataWindow"])
    width, height = x1 - x0 + 1, y1 - y0 + 1
    names, rest = [], attributes["channels"]
    while rest[0]:
        name, rest = rest.split(b"\0", 1)
        names.append(name.decode())
        assert struct.unpack_from("<i", rest)[0] == 2, "%s is not of 32-bit floats" % path
        rest = rest[16:]
    lines = {0: 1, 2: 1, 3: 16}[attributes["compression"][0]]
    planes = {name: [] for name in names}
    for offset in struct.unpack_from("<%dQ" % -(-height // lines), data, at + 1):
        y, size = struct.unpack_from("<2i", data, offset)
        count = min(lines, y1 + 1 - y)
        block = data[offset + 8:offset + 8 + size]
        if size < count * width * len(names) * 4:
            sums = bytes(itertools.accumulate(zlib.decompress(block), lambda a, b: (a + b - 128) & 255))
            block = bytearray(len(sums))
            block[0::2], block[1::2] = sums[:(len(sums) + 1) // 2], sums[(len(sums) + 1) // 2:]
        values = struct.unpack("<%df" % (count * width * len(names)), block)
        for line in range(count):
            for k, name in enumerate(names):
                begin = (line * len(names) + k) * width
                planes[name] += values[begin:begin + width]
    return planes


def mean_and_error(values):
    mean = sum(values) / len(values)
    return mean, math.sqrt(sum((v - mean) ** 2 for v in values) / max(1, len(values) - 1) / len(values))


def light_where_none(pairs):
    """What the cache adds, of the map's mean, to texels that are black in the bakes of the other seeds without it; the
    error of that; their number. A texel that rare light reaches may be black in a few bakes: those that chose it do
    not judge it."""
    offs = [read_exr(off / "irradiance.exr")["G"] for _, off in pairs]
    ons = [read_exr(on / "irradiance.exr")["G"] for on, _ in pairs]
    measured = [i for i, v in enumerate(read_exr(pairs[0][1] / "samples.exr")["Y"]) if v > 0]
    found, count = [], 0
    for k, (on, off) in enumerate(zip(ons, offs)):
        others = [plane for j, plane in enumerate(offs) if j != k]
        black = [i for i in measured if all(plane[i] == 0 for plane in others)] if others else []
        mean = sum(off[i] for i in measured) / len(measured)
        found.append(sum(on[i] - off[i] for i in black) / len(black) / mean if black else 0.0)
        count = max(count, len(black))
    return (*mean_and_error(found), count)


def difference(args, name, materials, path, options):
    """Relative difference of the means, cache on to off, over the seeds; its standard error; light_where_none."""
    folder = args.work / name / materials
    scene = of_materials(path, folder / "scene", materials)
    found, pairs = [], []
    for seed in range(1, args.seeds + 1):
        on, off = (bake(args, scene, options, folder / ("%s-%d-%d" % (cache, args.samples, seed)), cache, seed)
                   for cache in ("on", "off"))
        compared = subprocess.run([str(args.kiln), "compare", str(on), str(off), "--json"], capture_output=True,
                                  text=True, check=True)
        result = json.loads(compared.stdout)
        pairs.append((on, off))
        found.append(result["mean_a"] / result["mean_b"] - 1)
    return (*mean_and_error(found), *light_where_none(pairs))


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
    print("| scene | materials | samples | seeds | mean, cache on / off | light where none |")
    print("|---|---|---|---|---|---|")
    for name, (path, options) in sources(args.names or ["cornell"], pathlib.Path(args.folder), args.work).items():
        for materials in args.materials.split(","):
            mean, spread, *dark = difference(args, name, materials, pathlib.Path(path), options)
            print("| %s | %s | %d | %d | %+.3f ± %.3f %% | %+.1e ± %.0e in %d |" % (
                name, materials, args.samples, args.seeds, 100 * mean, 100 * spread, *dark), flush=True)


if __name__ == "__main__":
    main()
