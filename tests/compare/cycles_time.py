#!/usr/bin/env python3
"""Error of Cycles against its run time, on Kiln's texels and against Kiln's reference.

    python3 tests/compare/cycles_time.py SCENE.glb --reference HALF0 HALF1 [--SETTING VALUE ...]

The halves are what `kiln bench SCENE.glb --only-reference` names. Settings are those of `kiln bake` that make the layout;
SCENE.kiln.json is read as well. Prints the median of the seconds and of relMSE for every number of samples; with --json
for tests/bench/error_vs_time.py. The time is that of Blender's bake operator alone, without start and import of the scene.
Scenes are to be Lambert, lit by lamps, surfaces, a constant sky and a sun. Needs Debian's blender and python3-numpy:
without them it says so and exits with 77.
"""
import argparse
import json
import os
import shutil
import statistics
import subprocess
import sys
import tempfile

import cycles

GOOD_ENOUGH = 5e-4  # relMSE at which a ladder ends


def settings_of(scene, more):
    settings = {}
    job = os.path.splitext(scene)[0] + ".kiln.json"
    if os.path.exists(job):
        with open(job) as file:
            settings = json.load(file)
    for i in range(0, len(more) - 1, 2):
        settings[more[i].lstrip("-")] = more[i + 1]
    return settings


def light_of(settings):
    light = {"sun_angle": float(settings.get("sun-angle", 0)), "environment": None, "sun": None}
    if "environment" in settings:
        light["environment"] = [float(x) for x in settings["environment"].split(",")]
    if "sun" in settings:
        to_light, irradiance = settings["sun"].split(":")
        light["sun"] = {"to_light": [float(x) for x in to_light.split(",")],
                        "irradiance": [float(x) for x in irradiance.split(",")]}
    return light


def measure(options, more, work):
    settings = settings_of(options.scene, more)
    out = os.path.join(work, "kiln")
    # The layout and scene.glb: light is not asked for here.
    layout = [word for key, value in settings.items() for word in ("--" + key, str(value))]
    log = os.path.join(work, "kiln.log")
    if cycles.run([options.kiln, "bake", options.scene, "-o", out, "--encode", "none", "--basis", "irradiance", "--min-samples",
                   "1", "--quiet", *layout, "--max-samples", "1"], log):
        sys.exit("Kiln: " + cycles.tail(log))
    job = {"scene": os.path.join(out, "scene.glb"), "kiln": out, "mode": "lambert", "folder": work, "seeds": options.seeds,
           "ladder": options.ladder, "threads": options.threads, "max_bounces": 64, "most_seconds": options.most_seconds,
           "result": os.path.join(work, "result.json"), **light_of(settings)}
    with open(os.path.join(work, "job.json"), "w") as file:
        json.dump(job, file)
    log = os.path.join(work, "blender.log")
    script = os.path.join(cycles.HERE, "cycles_bake.py")
    if cycles.run([options.blender, "-b", "--factory-startup", "--python", script, "--", os.path.join(work, "job.json")],
                  log) or not os.path.exists(job["result"]):
        sys.exit("Blender: " + cycles.tail(log))
    with open(job["result"]) as file:
        return json.load(file)


def main():
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("scene")
    parser.add_argument("--reference", nargs=2, required=True, metavar="HALF")
    parser.add_argument("--ladder", type=lambda s: [int(x) for x in s.split(",")], default=[64, 256, 1024, 4096, 16384],
                        help="samples of a texel; Cycles spreads them over 16 parts of it")
    parser.add_argument("--most-seconds", type=float, default=60, help="a bake beyond this is the last")
    parser.add_argument("--quick", action="store_true", help="two numbers of samples, one seed")
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--kiln", default=os.path.join(cycles.ROOT, "build/bin/kiln"))
    parser.add_argument("--blender", default=shutil.which("blender"))
    parser.add_argument("--json", action="store_true")
    options, more = parser.parse_known_args()
    options.seeds = [1, 2, 3]
    if options.quick:
        options.ladder, options.seeds = [16, 64], [1]
    if not options.blender:
        print("skipped: blender is not installed (apt-get install blender python3-numpy)")
        return cycles.SKIPPED
    with tempfile.TemporaryDirectory(prefix="kiln-cycles-") as work:
        runs = measure(options, more, work)
        for run in runs:
            found = subprocess.run([options.kiln, "compare", run["map"], *options.reference, "--json"], capture_output=True,
                                   text=True, check=False)
            if found.returncode:
                sys.exit(found.stderr)
            run.update(json.loads(found.stdout))
    points = []
    for samples in sorted({run["samples"] for run in runs}):
        same = [run for run in runs if run["samples"] == samples]
        points.append([statistics.median(run["seconds"] for run in same),
                       statistics.median(run["rel_mse"] for run in same)])
        if not options.json:
            print("%6d samples  %8.2f s  relMSE %.3g  bias %+.2f %%  %d texels" % (
                samples, *points[-1], 100 * same[0]["bias"] / same[0]["mean_b"], same[0]["texels"]))
        if points[-1][1] < GOOD_ENOUGH:
            break
    if options.json:
        print(json.dumps({"points": points, "runs": [{k: r[k] for k in ("samples", "seed", "seconds", "rel_mse", "bias")}
                                                     for r in runs]}))
    return 0


if __name__ == "__main__":
    sys.exit(main())
