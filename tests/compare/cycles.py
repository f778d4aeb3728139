#!/usr/bin/env python3
"""Kiln against Cycles: the same atlas, the same light, both bakes of irradiance held against each other.

    python3 tests/compare/cycles.py                     # calibration, generated and real scenes; both modes, about ten minutes
    python3 tests/compare/cycles.py calibration         # a group: calibration, generated, real
    python3 tests/compare/cycles.py SCENE.glb ...       # files; light from SCENE.json beside it, if it is there

Needs Debian's blender (3.4) and its python3-numpy; without it says so and exits with 77. docs/comparison.md tells how
the two are made equal and what was found. Exit status 1: a mean that noise does not explain.
"""
import argparse
import json
import math
import os
import shutil
import subprocess
import sys
import tempfile

import scenes

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
SKIPPED = 77

# The mean of Kiln over that of Cycles may differ by this beside three standard errors: what Kiln promises of means
# (docs/testing.md). A check of means only; the column "rest" shows what noise leaves over in single texels.
ALLOWANCE = 0.005

# Texels per metre of the real scenes, for a few thousand texels each.
REAL = [("bevy_CornellBox", 0.06, {}), ("MixedLightingExample", 8, {"environment": [300, 300, 300]}),
        ("pc_house", 16, {"sun_angle": 0.53}), ("zdm2", 0.3, {"sun_angle": 0.53}), ("veach-bidir", 3, {}),
        ("living-room", 4, {}), ("staircase", 3, {})]


def sidecar(path):
    name = os.path.splitext(path)[0] + ".json"
    if not os.path.exists(name):
        return {}
    with open(name) as file:
        side = json.load(file)
    light = {}
    if side.get("environment"):
        light["environment"] = side["environment"]["radiance"]
    if side.get("sun"):
        light["sun"] = side["sun"]
    return light


def cases_of(names, folder, density):
    cases = []
    for name in names or ["calibration", "generated", "real"]:
        if name == "calibration":
            cases += scenes.calibration(folder)
        elif name == "generated":
            cases += scenes.generated(folder)
        elif name == "real":
            for scene, texels, more in REAL:
                path = os.path.join(ROOT, "..", "shared", "scenes", scene + ".glb")
                if os.path.exists(path):
                    cases.append({"name": scene, "path": path, "density": texels, **sidecar(path), **more})
                else:
                    print("%s: skipped, %s is absent" % (scene, os.path.relpath(path, ROOT)))
            arcade = os.path.join(ROOT, "tests/scenes/arcade")
            cases.append({"name": "arcade", "path": os.path.join(arcade, "arcade.gltf"), "density": 2,
                          "environment_image": os.path.join(arcade, "sky.hdr"), "sun_angle": 0.53})
        else:
            path = os.path.abspath(name)
            cases.append({"name": os.path.splitext(os.path.basename(name))[0], "path": path, "density": 4,
                          **sidecar(path)})
    for case in cases:
        if density and "density" in case:
            case["density"] = density
    return cases


def run(command, log):
    # Blender looks for its Python beside the first python3 of the path, which may be another one than Debian's.
    environment = {**os.environ, "PATH": "/usr/bin:/bin:" + os.environ.get("PATH", "")}
    with open(log, "w") as file:
        return subprocess.run(command, stdout=file, stderr=subprocess.STDOUT, env=environment, check=False).returncode


def tail(log):
    with open(log, errors="replace") as file:
        return "".join(file.readlines()[-15:])


def kiln_bake(case, scene, out, options):
    # Without the cache: a texel that a lamp hides in part would shine out of its other part.
    command = [options.kiln, "bake", scene, "-o", out, "--basis", "irradiance", "--dilate", "0", "--error", "1e-6",
               "--min-samples", str(options.samples), "--max-samples", str(options.samples), "--quiet", "--cache", "off",
               "--max-bounces", str(options.max_bounces), "--threads", str(options.threads),
               "--sun-angle", str(case.get("sun_angle", 0))]
    if case.get("layout") == "atlas":
        command += ["--layout", "atlas", "--resolution", "24"]
    else:
        command += ["--layout", "pack", "--texels-per-metre", str(case["density"])]
    if case.get("environment"):
        command += ["--environment", ",".join("%g" % x for x in case["environment"])]
    if case.get("sun"):
        command += ["--sun", ",".join("%.9g" % x for x in case["sun"]["to_light"]) + ":" +
                    ",".join("%.9g" % x for x in case["sun"]["irradiance"])]
    log = out + ".kiln.log"
    if run(command, log):
        return tail(log)
    if not os.path.exists(os.path.join(out, "irradiance.exr")):
        return "the map has more than one page: give a lower --density\n"
    return None


def compare(case, mode, work, options):
    label = "%s, %s" % (case["name"], mode)
    stem = os.path.join(work, label.replace(", ", "-").replace(" ", "_"))
    scene = scenes.variant(case["path"], stem, mode)
    out = stem + "-kiln"
    shutil.rmtree(out, ignore_errors=True)
    trouble = kiln_bake(case, scene, out, options)
    if trouble:
        return {"error": "Kiln: " + trouble}
    job = {"scene": os.path.join(out, "scene.glb"), "kiln": out, "mode": mode, "samples": options.samples,
           "seeds": [1, 2], "threads": options.threads, "max_bounces": options.max_bounces,
           "sun_angle": case.get("sun_angle", 0), "result": stem + ".json", "picture": stem + ".png"}
    for key in ("environment", "environment_image", "sun", "truth"):
        job[key] = case.get(key)
    with open(stem + ".job.json", "w") as file:
        json.dump(job, file)
    log = stem + ".blender.log"
    if os.path.exists(job["result"]):
        os.remove(job["result"])
    if run([options.blender, "-b", "--factory-startup", "--python", os.path.join(HERE, "cycles_bake.py"), "--",
            stem + ".job.json"], log) or not os.path.exists(job["result"]):
        return {"error": "Blender: " + tail(log)}
    with open(job["result"]) as file:
        return json.load(file)


def verdict(r):
    bound = 3 * r["ratio_sigma"] + ALLOWANCE
    good = abs(r["ratio"] - 1) <= bound
    if "truth_mean" in r:
        good = good and abs(r["kiln_over_truth"] - 1) <= bound and abs(r["cycles_over_truth"] - 1) <= bound
    return good


def row(name, mode, r):
    rest = math.sqrt(max(r["rel_mse"] - r["rel_mse_noise"], 0))
    w = r["worst"]
    return "| %s | %s | %d | %.4f ± %.4f | %.4f | %.3g | %.3g | %.1f %% | %s | (%d, %d): %.4g, %.4g |" % (
        name, mode, r["texels"], r["ratio"], r["ratio_sigma"], r["median_ratio"], r["rel_mse"], r["rel_mse_noise"],
        100 * rest, "yes" if verdict(r) else "**no**", w["x"], w["y"], w["kiln"], w["cycles"])


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("scenes", nargs="*", help="files, or calibration, generated, real")
    parser.add_argument("--samples", type=int, default=256, help="of Kiln, and of each of the two runs of Cycles")
    parser.add_argument("--density", type=float, help="texels per metre of all scenes")
    parser.add_argument("--mode", choices=["lambert", "as-is", "both"], default="both",
                        help="lambert takes the specular layer from all materials; calibration is lambert always")
    parser.add_argument("--max-bounces", type=int, default=64)
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--kiln", default=os.path.join(ROOT, "build/bin/kiln"))
    parser.add_argument("--blender", default=shutil.which("blender"))
    parser.add_argument("--work", help="folder for bakes, logs and pictures [a new one under /tmp]")
    options = parser.parse_args()
    if not options.blender:
        print("skipped: blender is not installed (apt-get install blender python3-numpy)")
        return SKIPPED
    work = options.work or tempfile.mkdtemp(prefix="kiln-cycles-")
    os.makedirs(work, exist_ok=True)
    version = subprocess.run([options.blender, "--version"], capture_output=True, text=True, check=True).stdout
    print("%s, %d samples, %d bounces, bakes and pictures in %s\n" %
          (version.split("\n")[0], options.samples, options.max_bounces, work))
    print("| scene | materials | texels | mean Kiln / Cycles | median | relMSE | of noise | rest | mean explained | worst "
          "texel: Kiln, Cycles |\n|---|---|---|---|---|---|---|---|---|---|")
    failed, truths = False, []
    for case in cases_of(options.scenes, work, options.density):
        lambert_only = "truth" in case or options.mode == "lambert"
        for mode in ["lambert"] if lambert_only else ["as-is"] if options.mode == "as-is" else ["lambert", "as-is"]:
            result = compare(case, mode, work, options)
            if "error" in result or not result["texels"]:
                failed = True
                print("%s, %s: %s" % (case["name"], mode, result.get("error", "no texel is valid in both")))
                continue
            failed |= not verdict(result)
            print(row(case["name"], mode, result), flush=True)
            if "truth_mean" in result:
                truths.append((case["name"], result))
    if truths:
        print("\n| calibration | closed form, mean | Kiln | Cycles |\n|---|---|---|---|")
        for name, r in truths:
            print("| %s | %.5f | %.5f (%+.3f %%) | %.5f (%+.3f %%) |" %
                  (name, r["truth_mean"], r["mean_kiln"], 100 * (r["kiln_over_truth"] - 1), r["mean_cycles"],
                   100 * (r["cycles_over_truth"] - 1)))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
