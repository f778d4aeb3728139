#!/usr/bin/env python3
"""Measures what docs/error_vs_time.md says and writes it there.

    python3 tests/bench/error_vs_time.py                                    # everything: hours, most of them for `rooms`
    python3 tests/bench/error_vs_time.py --only calibration --scenes ajar   # parts: bias calibration foretold curves texel others rooms limits
    python3 tests/bench/error_vs_time.py --only rooms --scenes flat corridor   # furnished rooms at the density of production
    python3 tests/bench/error_vs_time.py --quick --page /tmp/page.md        # minutes, to see that all of it works
    python3 tests/bench/error_vs_time.py --only none                        # the page again, from what was measured

Every result is kept as JSON in the work folder, so that parts can be measured again one by one; the page is made of all
that is there, and a table of which nothing was measured stays as it is. Calibration keeps a set of results for every
--label: `before` is the same command with --bakes-with the kiln of an earlier build (settings it does not have are left
out). Real scenes are looked for in $KILN_SCENES or ../shared/scenes and left out, saying so, where absent.
"""
import argparse
import json
import math
import os
import pathlib
import shutil
import statistics
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
COMPARE = os.path.join(ROOT, "tests/compare")
sys.path.insert(0, HERE)
import by_brightness  # noqa: E402
import cache_bias  # noqa: E402
import error_scenes  # noqa: E402
import real_rooms  # noqa: E402

SKIPPED = 77
ARCADE = os.path.join(ROOT, "tests/scenes/arcade/arcade.gltf")
PARTS = ("bias", "calibration", "foretold", "curves", "texel", "others", "rooms", "limits")
TARGETS = (1e-3, 1e-4)
FLUX_CORE_MS = 86  # 200 core hours for 8 Mtexel, as published

# Samples of each half of the reference: the harder the light, the more.
REFERENCE = {"cornell": 4096, "ajar": 8192, "keyhole": 16384, "lights1000": 4096, "courtyard": 8192, "caustic": 8192,
             "furnace": 1024, "arcade": 2048, "staircase": 4096, "living-room": 4096}
# Light that whole paths hardly find: their references end at measured surfaces too. How far from the truth that is, is a
# part of its own (bias), against so many whole paths.
CACHED_REFERENCE = ("ajar", "keyhole", "caustic", "staircase", "living-room")
EXACT = {"cornell": 4096, "ajar": 4096, "keyhole": 8192, "lights1000": 4096, "courtyard": 8192, "caustic": 4096,
         "furnace": 1024, "arcade": 2048, "staircase": 1024, "living-room": 1024}
REAL = {"staircase": 2, "living-room": 3}  # texels per metre
ARCADE_DENSITY = 1
CALIBRATED = {"plain": {"cache": "off", "denoise": "off"}, "cache": {"cache": "on", "denoise": "off"},
              "all": {"cache": "on", "denoise": "on"}}
FORETOLD_AT = 0.1  # of the time that was taken
OF_THE_TEXEL_TABLE = ("arcade", *REAL)
OF_OTHERS = ("cornell", "courtyard", "ajar")
# Part `rooms`: of real_rooms.py, and files; brute force and Kiln as it is without settings, for the same norm.
MADE_ROOMS = ("flat", "corridor")
ROOMS = (*MADE_ROOMS, "living-room", "dining-room", "staircase", "classroom", "dungeon", "sponza", "arcade")
ROOM_DENSITIES = (8, 16)  # texels per metre
ROOM_MATERIALS = ("default", "lambert")
ROOM_ERRORS = "0.4,0.2,0.1,0.05"  # the last is a relMSE of 6.5e-4, if what is stated is true
ROOM_REFERENCE, ROOM_REFERENCE_ERROR = 16384, 0.05  # at most, and of each half
# The share of a room's texels at 8 a metre that is compared, against whole paths; at 16 a metre it is a quarter of this. Of
# the others all are, against paths that end at the cache.
ROOM_SHARE = {"living-room": 0.25, "dining-room": 0.12, "arcade": 0.2, "sponza": 0.08, "dungeon": 0.02, "classroom": 0.02}
# Part `limits`: seconds, and nothing else is said of the bake; rooms with their texels per metre.
LIMITS = (30, 100, 300)
LIMITED = {"flat": 16, "living-room": 8, "dining-room": 8}
DARK = range(-5, -2)  # rows of by_brightness.py: 0.41 to 11 % of the mean
# Brute force errs as 1 / time, so that its run may end early; Kiln's goes on until it is there.
ROOM_SETS = ("brute:ladder=samples,sampler=halton,cache=off,denoise=off,error-norm=mean-square",
             "default:error-norm=mean-square")


def real_options(path):
    """Light of a real scene, from the .json beside it."""
    name = os.path.splitext(path)[0] + ".json"
    if not os.path.exists(name):
        return {}
    with open(name) as file:
        side = json.load(file)
    options = {}
    if side.get("environment"):
        options["environment"] = ",".join("%g" % x for x in side["environment"]["radiance"])
    if side.get("sun"):
        options["sun"] = ",".join("%.9g" % x for x in side["sun"]["to_light"]) + ":" + \
            ",".join("%.9g" % x for x in side["sun"]["irradiance"])
    return options


def scenes_of(options):
    """Name -> (path, settings of its own). Generated scenes say theirs in NAME.kiln.json."""
    folder = os.path.join(options.work, "scenes")
    scenes = {name: (path, {}) for name, path in error_scenes.write(folder).items()}
    scenes["arcade"] = (ARCADE, {"texels-per-metre": ARCADE_DENSITY, "max-samples": 262144})
    shared = os.environ.get("KILN_SCENES") or os.path.join(ROOT, "../shared/scenes")
    for name, density in REAL.items():
        path = os.path.join(shared, name + ".glb")
        if os.path.exists(path):
            scenes[name] = (path, {"layout": "pack", "texels-per-metre": density, **real_options(path)})
        elif options.scenes is None or name in options.scenes:
            print("%s: left out, %s is absent" % (name, path))
    unknown = [name for name in options.scenes or [] if name not in scenes]
    if unknown:
        sys.exit("there is no scene %s; there are %s" % (unknown[0], ", ".join(scenes)))
    chosen = {name: scenes[name] for name in scenes if options.scenes is None or name in options.scenes}
    if options.quick:
        for name, (path, own) in chosen.items():
            own["texels-per-metre"] = 0.4 * density_of(path, own)
    return chosen


def density_of(path, own):
    if "texels-per-metre" in own:
        return own["texels-per-metre"]
    with open(os.path.splitext(path)[0] + ".kiln.json") as file:
        return json.load(file)["texels-per-metre"]


def arguments_of(settings):
    return [word for key, value in settings.items() for word in ("--" + key, str(value))]


def run(command):
    done = subprocess.run([str(word) for word in command], capture_output=True, text=True, check=False)
    if done.returncode:
        sys.exit("%s\nfailed with %d: %s" % (" ".join(map(str, command)), done.returncode, done.stderr[-2000:]))
    return done.stdout


def keep(options, part, name, result):
    path = os.path.join(options.work, part, name + ".json")
    os.makedirs(os.path.dirname(path), exist_ok=True)
    with open(path, "w") as file:
        json.dump(result, file, indent=1)
    print("%s %s: measured" % (part, name), flush=True)


def kept(options, part):
    folder = os.path.join(options.work, part)
    results = {}
    for name in sorted(os.listdir(folder)) if os.path.isdir(folder) else []:
        if name.endswith(".json"):
            with open(os.path.join(folder, name)) as file:
                results[name[:-5]] = json.load(file)
    return results


class Bench:
    """The programs with what is common to all of their runs."""

    def __init__(self, options):
        self.options = options
        self.limit = 0.5 if options.quick else options.most_seconds

    def reference(self, name, path, own, samples=None, cache=None):
        samples = 256 if self.options.quick else samples or REFERENCE[name]
        cache = name in CACHED_REFERENCE if cache is None else cache
        out = os.path.join(self.options.work, "reference")
        text = run([self.options.kiln, "bench", path, "-o", out, "--only-reference", "--json", "--reference-samples", samples,
                    *(["--reference-cache"] if cache else []), *arguments_of(own)])
        folder = json.loads(text)["reference"]["folder"]
        return [os.path.join(folder, "half0"), os.path.join(folder, "half1")]

    def compare(self, folder, halves):
        return json.loads(run([self.options.kiln, "compare", folder, *halves, "--json", "--error", 0.05,
                               "--confidence", 0.95]))

    def bake(self, path, settings, program=None):
        out = os.path.join(self.options.work, "bake")
        report = json.loads(run([program or self.options.kiln, "bake", path, "-o", out, "--json", "--encode", "none",
                                 *arguments_of(settings)]))
        return out, report


def bias(bench, name, path, own):
    exact = bench.reference(name, path, own, EXACT[name], False)
    cached = bench.reference(name, path, own, REFERENCE[name], True)
    halves = [bench.compare(half, exact) for half in cached]
    keep(bench.options, "bias", name, {
        "mean": halves[0]["mean_b"], "bias": statistics.mean(h["bias"] for h in halves),
        "halves": abs(halves[0]["bias"] - halves[1]["bias"]) / 2, "bias_error": halves[0]["bias_error"],
        "rel_mse": statistics.mean(h["rel_mse"] for h in halves)})


def calibration(bench, name, path, own):
    halves = bench.reference(name, path, own)
    earlier = bench.options.bakes_with
    result = {}
    for label, more in CALIBRATED.items():
        if earlier and label != "plain":
            continue
        runs = []
        for seed in range(bench.options.repeats):
            out, report = bench.bake(path, {**own, "basis": "irradiance", "seams": "off", "dilate": 0, "error": 0.05,
                                            "confidence": 0.95, "seed": seed + 1, "time-limit": 4 * bench.limit,
                                            **({} if earlier else more)}, earlier)
            runs.append({**bench.compare(out, halves), "complete": report["complete"]})
        result[label] = runs
    keep(bench.options, os.path.join("calibration", bench.options.label), name, result)


def foretold(bench, name, path, own):
    """What bakes to 5 % say of their own time, at the first point after a tenth of it."""
    result = {}
    for label, more in CALIBRATED.items():
        if label == "plain" and name in CACHED_REFERENCE:
            continue  # would take hours
        ratios, seconds = [], []
        for seed in range(bench.options.repeats):
            _, report = bench.bake(path, {**own, "error": 0.05, "confidence": 0.95, "seed": seed + 1, **more})
            stages = {s["name"]: s["seconds"] for s in report["stages"]}
            names = list(stages)
            taken = sum(stages[n] for n in names[names.index("bake"):])
            said = [p["seconds"] + p["seconds_left"] for p in report["passes"]
                    if p["seconds"] >= FORETOLD_AT * taken and p["seconds_left"] >= 0]
            seconds.append(taken)
            if said:
                ratios.append(said[0] / taken)
        result[label] = {"taken": statistics.median(seconds), "ratios": sorted(ratios)}
    keep(bench.options, "foretold", name, result)


def curves(bench, name, path, own):
    quick = ["--errors", "0.4,0.2", "--samples", "16,64", "--repeats", 1, "--reference-samples", 256]
    full = ["--repeats", bench.options.repeats, "--reference-samples", REFERENCE[name],
            *(["--reference-cache"] if name in CACHED_REFERENCE else [])]
    out = os.path.join(bench.options.work, "bench", name)
    result = json.loads(run([bench.options.kiln, "bench", path, "-o", out, "--json", "--most-seconds", bench.limit,
                             *(quick if bench.options.quick else full), *arguments_of(own)]))
    keep(bench.options, "curves", name, result)


def texel(bench, name, path, own):
    if name not in OF_THE_TEXEL_TABLE:
        return
    _, r = bench.bake(path, {**own, "error": 0.05, "confidence": 0.95, "cache": "on", "denoise": "on",
                             "time-limit": 40 * bench.limit})
    keep(bench.options, "texel", name, {
        "texels": r["atlas"]["valid_texels"], "core_seconds": r["farm"]["worker_seconds"], "rays": r["farm"]["rays"],
        "complete": r["complete"], "converged": r["passes"][-1]["converged_share"]})


def crossing(points, target):
    """(sign, seconds): as `kiln bench` finds it; an unbiased method that did not get there is continued by 1 / time."""
    for i, (seconds, error) in enumerate(points):
        if error > target:
            continue
        if i == 0:
            return "< ", seconds
        before, worse = points[i - 1]
        part = math.log(worse / target) / math.log(worse / max(error, 0.1 * target))
        return "", before * (seconds / before) ** part
    return "≈ ", points[-1][0] * points[-1][1] / target


def others(bench, name, path, own):
    if name not in OF_OTHERS:
        return
    halves = bench.reference(name, path, own)
    tracer = os.path.join(os.path.dirname(bench.options.kiln), "plain_tracer")
    points, rate = [], []
    for samples in (16, 64) if bench.options.quick else (64, 256, 1024, 4096, 16384, 65536):
        out = os.path.join(bench.options.work, "plain")
        runs = []
        for repeat in range(1 if bench.options.quick else 3):
            r = json.loads(run([tracer, path, out, samples, "--seed", repeat + 1, *arguments_of(own)]))
            runs.append((r["seconds"], bench.compare(out, halves)["rel_mse"]))
            rate.append(r["rays"] / r["seconds"] / r["threads"])
        points.append([statistics.median(x) for x in zip(*runs)])
        if points[-1][0] > bench.limit or points[-1][1] < 0.5 * TARGETS[0]:
            break
    result = {"plain": {"points": points, "rays_per_second_and_thread": statistics.median(rate)}}
    command = [sys.executable, os.path.join(COMPARE, "cycles_time.py"), path, "--reference", *halves, "--kiln",
               bench.options.kiln, "--json", "--most-seconds", str(bench.limit)]
    done = subprocess.run(command + (["--quick"] if bench.options.quick else []) + arguments_of(own), capture_output=True,
                          text=True, check=False)
    if done.returncode == 0:
        result["cycles"] = json.loads(done.stdout)
    else:
        print("cycles on %s: %s" % (name, (done.stdout + done.stderr).strip().split("\n")[-1]))
    keep(bench.options, "others", name, result)


def rooms_of(options):
    """(name, materials, density, path, settings)."""
    folder = os.path.join(options.work, "scenes")
    shared = os.environ.get("KILN_SCENES") or os.path.join(ROOT, "../shared/scenes")
    for name in ROOMS:
        if options.scenes is not None and name not in options.scenes:
            continue
        for materials in options.materials:
            if name == "arcade":
                path, own = ARCADE, {"max-samples": 262144}
                path = cache_bias.of_materials(pathlib.Path(path), pathlib.Path(folder) / materials, materials)
            elif name in MADE_ROOMS:
                path, own = real_rooms.write(os.path.join(folder, materials), [name], materials)[name], {}
            else:
                path = os.path.join(shared, name + ".glb")
                if not os.path.exists(path):
                    print("%s: left out, %s is absent" % (name, path))
                    break
                own = {"layout": "pack", **real_options(path)}
                path = cache_bias.of_materials(pathlib.Path(path), pathlib.Path(folder) / materials, materials)
            for density in options.densities:
                yield name, materials, density, str(path), {**own, "texels-per-metre": 1 if options.quick else density}


def share_of(room, density):
    return ROOM_SHARE.get(room, 1) * min(1, (8 / density)**2)


def rooms(bench):
    for name, materials, density, path, own in rooms_of(bench.options):
        entry = "%s %s %g" % (name, materials, density)
        quick = ["--errors", "0.4", "--samples", 16, "--repeats", 1, "--reference-samples", 64]
        # Without enough samples in the darkest texels a reference misses the few paths that light them, and calls right
        # maps wrong there.
        full = ["--repeats", bench.options.repeats, "--reference-samples", bench.options.room_reference, "--reference-error",
                ROOM_REFERENCE_ERROR, "--errors", ROOM_ERRORS]
        share = share_of(name, density)
        how = ["--reference-share", share] if share < 1 else ["--reference-cache"]
        curves, limits = [], (bench.limit, bench.limit if bench.options.quick else bench.options.room_seconds)
        for one, limit in zip(ROOM_SETS, limits):  # the second finds the first one's reference
            result = json.loads(run([bench.options.kiln, "bench", path, "-o",
                                     os.path.join(bench.options.work, "rooms_bench", entry), "--json", "--most-seconds", limit,
                                     *how, "--set", one, *(quick if bench.options.quick else full),
                                     *arguments_of(own)]))
            curves += result["curves"]
        keep(bench.options, "rooms", entry,
             {"name": name, "materials": materials, "density": density, **result, "curves": curves})


def limits(bench):
    """Furnished rooms within a time limit: what bakes state, early and late, in the dark too, beside brute force and, of Lambert
    surfaces, the plain tracer."""
    options = bench.options
    for room, density in LIMITED.items():
        if options.scenes is not None and room not in options.scenes:
            continue
        chosen = argparse.Namespace(**{**vars(options), "scenes": [room], "densities": [density]})
        for _, materials, density, path, own in rooms_of(chosen):
            out = os.path.join(options.work, "reference")
            folder = json.loads(run([options.kiln, "bench", path, "-o", out, "--only-reference", "--json", "--reference-samples",
                                     64 if options.quick else options.room_reference, "--reference-error",
                                     ROOM_REFERENCE_ERROR, "--reference-share", share_of(room, density),
                                     *arguments_of(own)]))["reference"]["folder"]
            halves = [os.path.join(folder, "half0"), os.path.join(folder, "half1")]
            label = "before" if options.bakes_with else "now"
            result = {"room": room, "materials": materials, "density": density, "version": label,
                      "kiln": [limited_bake(bench, path, {**own, "time-limit": limit, "seed": seed + 1}, halves)
                               for limit in ((5, 10) if options.quick else LIMITS) for seed in range(options.repeats)]}
            if not options.bakes_with:
                result["others"] = floor_of(bench, path, own, halves, materials == "lambert" and room in MADE_ROOMS)
            keep(options, "limits", "%s %s %g %s" % (room, materials, density, label), result)


def limited_bake(bench, path, settings, halves):
    out, report = bench.bake(path, settings, bench.options.bakes_with)
    compared = bench.compare(out, halves)
    dark = [row for key, row in by_brightness.rows_of(out, *halves).items() if key in DARK]
    return {"limit": settings["time-limit"], "seconds": sum(s["seconds"] for s in report["stages"]),
            "texels": report["atlas"]["valid_texels"], "rel_mse": compared["rel_mse"], "calibration": compared["calibration"],
            "dark": [sum(row[k] for row in dark) for k in (4, 5, 6)]}  # texels, true and stated relMSE, summed


def floor_of(bench, path, own, halves, lambert):
    """(program, samples, seconds, relMSE) of those that err as 1 / time. Of the plain tracer its tracing alone is timed."""
    rows = []
    for samples in (4, 8) if bench.options.quick else (64, 256):
        out, report = bench.bake(path, {**own, "min-samples": samples, "max-samples": samples, "sampler": "halton",
                                        "cache": "off", "denoise": "off"})
        rows.append(["brute force", samples, sum(s["seconds"] for s in report["stages"]),
                     bench.compare(out, halves)["rel_mse"]])
    if lambert:
        tracer, out = os.path.join(os.path.dirname(bench.options.kiln), "plain_tracer"), os.path.join(bench.options.work, "plain")
        for samples in (4, 8) if bench.options.quick else (64, 256):
            r = json.loads(run([tracer, path, out, samples, *arguments_of(own)]))
            rows.append(["plain Embree", samples, r["seconds"], bench.compare(out, halves)["rel_mse"]])
    return rows


def limits_table(options):
    rows = ["| room | materials | version | limit, s | texels | taken, s | relMSE | stated, rms | true / stated | in the dark | "
            "coverage of 95 % | brute force's relMSE x seconds, over Kiln's | plain Embree's |",
            "|---|---|---|---|---|---|---|---|---|---|---|---|---|"]
    results = {name: r for name, r in kept(options, "limits").items() if "room" in r}  # others: of earlier releases
    for r in results.values():
        entry = "%s at %g | %s" % (r["room"], r["density"], r["materials"])
        now = results.get("%s %s %g now" % (r["room"], r["materials"], r["density"]), r)
        floors = {name: seconds * error for name, _, seconds, error in now.get("others", [])}  # the last of each
        for limit in sorted({k["limit"] for k in r["kiln"]}):
            runs = [k for k in r["kiln"] if k["limit"] == limit]
            c = [k["calibration"] for k in runs]
            work = statistics.median(k["rel_mse"] * k["seconds"] for k in runs)
            gains = ["%.0f" % (floors[name] / work) if name in floors else "" for name in ("brute force", "plain Embree")]
            rows.append("| %s | %s | %g | %d | %.0f | %.2g | %s | %s | %s | %s | %s |" % (
                entry, r["version"], limit, runs[0]["texels"], statistics.median(k["seconds"] for k in runs),
                statistics.median(k["rel_mse"] for k in runs), percent(root_mean([x["stated_rms"] for x in c])),
                mean_and_range([x["error_ratio"] for x in c]), dark_ratio(runs),
                percent(statistics.mean(x["coverage"] for x in c)), " | ".join(gains)))
        for name, samples, seconds, error in r.get("others", []):
            rows.append("| %s | %s, %d samples | | | %.1f | %.2g | | | | | | |" % (entry, name, samples, seconds, error))
    return rows


def dark_ratio(runs):
    """True over stated, of the rows DARK of all runs together."""
    true, stated = (sum(k["dark"][i] for k in runs) for i in (1, 2))
    return "%.2f" % math.sqrt(max(0, true) / stated) if stated > 0 else ""


def mean_and_range(values):
    """Root of the mean square; of several also the least and the most."""
    text = "%.2f" % root_mean(values)
    return text + " (%.2f to %.2f)" % (min(values), max(values)) if len(values) > 1 else text


def rooms_table(options):
    """Brute force's time to 1e-3 and, which is not continued for Kiln, to the error at the end of Kiln's ladder."""
    rows = ["| room | materials | texels per metre | texels | brute, s to 1e-3 | Kiln, s to 1e-3 | ratio | Kiln's last point | "
            "brute / Kiln there |",
            "|---|---|---|---|---|---|---|---|---|"]
    for r in kept(options, "rooms").values():
        brute, kiln = (points_of(c) for c in r["curves"])
        found = [crossing(points, TARGETS[0]) for points in (brute, kiln)]
        seconds, error = kiln[-1]
        rows.append("| %s | %s | %g | %d | %s | %s | %s%.1f | relMSE %.2g in %.3g s | %.1f |" % (
            r["name"], r["materials"], r["density"], r["texels"], time_text(found[0]), time_text(found[1]),
            "≈ " if "≈ " in (found[0][0], found[1][0]) else "", found[0][1] / found[1][1], error, seconds,
            crossing(brute, error)[1] / seconds))
    return rows


def percent(x):
    return "%.1f %%" % (100 * x)


def root_mean(values):
    return math.sqrt(statistics.mean(x * x for x in values))


def calibration_table(options):
    rows = ["| scene | settings | version | texels | stated, rms | true / stated | coverage of 95 % | promised 5 % | kept | "
            "reference |",
            "|---|---|---|---|---|---|---|---|---|---|"]
    folder = os.path.join(options.work, "calibration")
    labels = sorted(os.listdir(folder), key=lambda x: (x != "before", x)) if os.path.isdir(folder) else []
    results = {label: kept(options, os.path.join("calibration", label)) for label in labels}
    for name in REFERENCE:
        for settings in CALIBRATED:
            for label in labels:
                runs = results[label].get(name, {}).get(settings)
                if not runs:
                    continue
                c = [r["calibration"] for r in runs]
                texels = sum(r["texels"] for r in runs)
                promised = sum(x["promised"] for x in c)
                ratios = sorted(x["error_ratio"] for x in c)
                rows.append("| %s | %s | %s | %d | %s | %.2f (%.2f to %.2f) | %s | %s | %s | %s |" % (
                    name, settings, label, texels / len(runs), percent(root_mean([x["stated_rms"] for x in c])),
                    root_mean(ratios), ratios[0], ratios[-1], percent(statistics.mean(x["coverage"] for x in c)),
                    percent(promised / texels),
                    percent(sum(x["promised"] * x["promise_kept"] for x in c if x["promised"]) / promised) if promised else "",
                    percent(statistics.mean(x["reference_part"] for x in c))))
    return rows


def bias_table(options):
    rows = ["| scene | samples, cached | whole paths | mean E | bias of the mean | error of that | local rms, noise included |",
            "|---|---|---|---|---|---|---|"]
    results = kept(options, "bias")
    for name in [s for s in REFERENCE if s in results]:
        r = results[name]
        rows.append("| %s | 2 x %d | 2 x %d | %.4g | %+.3f %% | %.3f %% | %.2f %% |" % (
            name, REFERENCE[name], EXACT[name], r["mean"], 100 * r["bias"] / r["mean"],
            100 * math.hypot(r["bias_error"], r["halves"]) / r["mean"], 100 * math.sqrt(max(0, r["rel_mse"]))))
    return rows


def foretold_table(options):
    rows = ["| scene | settings | seconds taken | foretold / taken, least | median | most |", "|---|---|---|---|---|---|"]
    results = kept(options, "foretold")
    for name in [s for s in REFERENCE if s in results]:
        for settings in [s for s in CALIBRATED if s in results[name]]:
            r = results[name][settings]
            low, middle, high = (("%.2f" % x for x in (r["ratios"][0], statistics.median(r["ratios"]), r["ratios"][-1]))
                                 if r["ratios"] else ("", "", ""))
            rows.append("| %s | %s | %.1f | %s | %s | %s |" % (name, settings, r["taken"], low, middle, high))
    return rows


def points_of(curve):
    return [(p["seconds"], p["rel_mse"]) for p in curve["points"]]


def time_text(found):
    return "%s%.3g" % found


def gain(found, name):
    """Brute force's time over that of a configuration; only what got there itself is held against it."""
    if name not in found or "brute" not in found or found[name][0] == "≈ ":
        return ""
    sign = {"": "", "≈ ": "≈ ", "< ": "? "}[found["brute"][0]]
    return "%s%s%.1f" % ("> " if found[name][0] == "< " else "", sign, found["brute"][1] / found[name][1])


def times_table(options):
    results = kept(options, "curves")
    names = []
    for r in results.values():
        names += [c["configuration"] for c in r["curves"] if c["configuration"] not in names]
    held = [n for n in names if n not in ("brute", "owen")]
    rows = ["| scene | relMSE | " + " | ".join(names + ["brute / " + n for n in held]) + " |",
            "|---" * (len(names) + len(held) + 2) + "|"]
    for scene in [s for s in REFERENCE if s in results]:
        for target in TARGETS:
            found = {c["configuration"]: crossing(points_of(c), target) for c in results[scene]["curves"]}
            times = [time_text(found[n]) if n in found else "" for n in names]
            rows.append("| %s | %.0e | %s |" % (scene, target, " | ".join(times + [gain(found, n) for n in held])))
    return rows


def curves_section(options, page_folder):
    rows = []
    images = os.path.join(page_folder, "images/error")
    results = kept(options, "curves")
    for scene in [s for s in REFERENCE if s in results]:
        source = os.path.join(options.work, "bench", scene, "bench.svg")
        if not os.path.exists(source):
            continue
        os.makedirs(images, exist_ok=True)
        shutil.copyfile(source, os.path.join(images, scene + ".svg"))
        rows += ["![relMSE of %s against seconds and rays](images/error/%s.svg)" % (scene, scene), ""]
    return rows[:-1]


def texel_table(options):
    rows = ["| scene | texels | core-ms a texel | rays a texel | texels within 5 % at 95 %, stated |", "|---|---|---|---|---|"]
    for name, r in kept(options, "texel").items():
        rows.append("| %s | %d | %.1f | %.0f | %s%s |" % (
            name, r["texels"], 1000 * r["core_seconds"] / r["texels"], r["rays"] / r["texels"], percent(r["converged"]),
            "" if r["complete"] else " (time was up)"))
    return rows + ["| Flux, as published | 8 M | %d | 100,000 | |" % FLUX_CORE_MS]


def others_table(options):
    rows = ["| scene | relMSE | Cycles, s | plain Embree, s | plain, M rays/s and thread | Kiln, s | plain / Kiln |",
            "|---|---|---|---|---|---|---|"]
    ours = kept(options, "curves")
    for name, r in kept(options, "others").items():
        target = TARGETS[0]
        plain = crossing(r["plain"]["points"], target)
        cycles = crossing(r["cycles"]["points"], target) if "cycles" in r else None
        kiln = crossing(points_of(ours[name]["curves"][-1]), target) if name in ours else None
        reached = kiln and kiln[0] != "≈ "
        rows.append("| %s | %.0e | %s | %s | %.2f | %s | %s |" % (
            name, target, time_text(cycles) if cycles else "skipped", time_text(plain),
            r["plain"]["rays_per_second_and_thread"] / 1e6, time_text(kiln) if kiln else "",
            "%.1f" % (plain[1] / kiln[1]) if reached else ""))
    return rows


def machine_line(options):
    machines = {r["machine"] for r in kept(options, "curves").values()}
    return ["Measured on: %s." % "; ".join(sorted(machines)) if machines else "Not measured yet."]


def write_page(options):
    with open(options.template) as file:
        text = file.read()
    folder = os.path.dirname(os.path.abspath(options.page))
    sections = {"machine": machine_line(options), "bias": bias_table(options),
                "calibration": calibration_table(options), "foretold": foretold_table(options),
                "curves": curves_section(options, folder), "times": times_table(options), "texel": texel_table(options),
                "others": others_table(options), "rooms": rooms_table(options), "limits": limits_table(options)}
    measured = {"machine": "curves", "times": "curves"}
    for name, rows in sections.items():
        if not os.path.isdir(os.path.join(options.work, measured.get(name, name))):
            continue
        begin, end = "<!-- %s -->\n" % name, "<!-- end of %s -->" % name
        if begin not in text or end not in text:
            sys.exit("%s has no place for '%s'" % (options.template, name))
        head, rest = text.split(begin, 1)
        text = head + begin + "".join(row + "\n" for row in rows) + end + rest.split(end, 1)[1]
    with open(options.page, "w") as file:
        file.write(text)
    print("written: %s" % options.page)


def main():
    page = os.path.join(ROOT, "docs/error_vs_time.md")
    cache = os.environ.get("XDG_CACHE_HOME") or os.path.expanduser("~/.cache")
    parser = argparse.ArgumentParser(description=__doc__.split("\n")[0])
    parser.add_argument("--only", nargs="*", choices=[*PARTS, "none"], default=list(PARTS), help="parts to measure")
    parser.add_argument("--scenes", nargs="*", help="of all parts")
    parser.add_argument("--quick", action="store_true", help="few texels and samples: figures that mean nothing")
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--most-seconds", type=float, default=10, help="a run beyond this is the last of its ladder")
    parser.add_argument("--room-seconds", type=float, default=900, help="of part rooms: the same for Kiln's own runs")
    parser.add_argument("--room-reference", type=int, default=ROOM_REFERENCE,
                        help="of parts rooms and limits: most samples a texel in each half of the reference")
    parser.add_argument("--densities", type=float, nargs="*", default=ROOM_DENSITIES, help="of part rooms")
    parser.add_argument("--materials", nargs="*", choices=ROOM_MATERIALS, default=ROOM_MATERIALS, help="of parts rooms and limits")
    parser.add_argument("--label", default="now", help="of the calibration: before, now")
    parser.add_argument("--kiln", default=os.path.join(ROOT, "build/bin/kiln"))
    parser.add_argument("--bakes-with", help="calibration and limits: another program for the bakes, of an earlier build")
    parser.add_argument("--work", help="folder of the results [kiln/error_vs_time in the cache folder]")
    parser.add_argument("--page", default=page)
    options = parser.parse_args()
    options.template = options.page if os.path.exists(options.page) else page
    options.work = options.work or os.path.join(cache, "kiln/error_vs_time" + ("_quick" if options.quick else ""))
    if options.quick and os.path.abspath(options.page) == page:
        sys.exit("--quick is not for docs/error_vs_time.md: give another --page")
    os.makedirs(options.work, exist_ok=True)
    bench = Bench(options)
    scenes = scenes_of(options) if set(options.only) - {"none", "rooms", "limits"} else {}
    for part in PARTS:
        if part in ("rooms", "limits"):
            if part in options.only:
                globals()[part](bench)
        elif part in options.only:
            for name, (path, own) in scenes.items():
                globals()[part](bench, name, path, own)
    write_page(options)


if __name__ == "__main__":
    main()
