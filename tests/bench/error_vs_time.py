#!/usr/bin/env python3
"""Measures what docs/error_vs_time.md says and writes it there.

    python3 tests/bench/error_vs_time.py                                    # everything: hours, most of them for `rooms`
    python3 tests/bench/error_vs_time.py --only calibration --scenes ajar   # a part; they are PARTS
    python3 tests/bench/error_vs_time.py --only rooms --scenes flat corridor   # furnished rooms at the density of production
    python3 tests/bench/error_vs_time.py --only texel --densities 4            # whole bakes to 5 %
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
import shutil
import statistics
import subprocess
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import by_brightness  # noqa: E402
import error_scenes  # noqa: E402
from error_common import (ARCADE, CACHED_REFERENCE, COMPARE, REFERENCE, ROOT, TARGETS, Bench, arguments_of,  # noqa: E402
                          crossing, keep, kept, percent, points_of, real_options, root_mean, run, time_text)
from error_rooms import (ROOM_MATERIALS, ROOM_REFERENCE, TEXEL_SAMPLES, limits, limits_table, rooms,  # noqa: E402
                         rooms_table, statements_table, texel, texel_table)

PARTS = ("bias", "light", "calibration", "foretold", "curves", "texel", "others", "rooms", "limits")
OF_ROOMS = {"texel": texel, "rooms": rooms, "limits": limits}  # error_rooms.py
# Samples of the whole paths that the part `bias` holds against references.
EXACT = {"cornell": 4096, "ajar": 4096, "keyhole": 8192, "lights1000": 4096, "courtyard": 8192, "caustic": 4096,
         "furnace": 1024, "arcade": 2048, "staircase": 1024, "living-room": 1024}
REAL = {"staircase": 2, "living-room": 3}  # texels per metre
ARCADE_DENSITY = 1
CALIBRATED = {"plain": {"cache": "off", "denoise": "off"}, "cache": {"cache": "on", "denoise": "off"},
              "all": {"cache": "on", "denoise": "on"}}
LIGHT_SEEDS = 8  # for each repeat, so that a bias of 0.2 % shows
FORETOLD_AT = 0.1  # of the time that was taken
OF_OTHERS = ("cornell", "courtyard", "ajar")


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


def bias(bench, name, path, own):
    exact = bench.reference(name, path, own, EXACT[name], False)
    cached = bench.reference(name, path, own, REFERENCE[name], True)
    halves = [bench.compare(half, exact) for half in cached]
    keep(bench.options, "bias", name, {
        "mean": halves[0]["mean_b"], "bias": statistics.mean(h["bias"] for h in halves),
        "halves": abs(halves[0]["bias"] - halves[1]["bias"]) / 2, "bias_error": halves[0]["bias_error"],
        "rel_mse": statistics.mean(h["rel_mse"] for h in halves)})


def light(bench, name, path, own):
    """Mean E of bakes to 5 % over that of the reference, less one, before and after the denoiser."""
    halves = bench.reference(name, path, own)
    maps = [by_brightness.luminance(by_brightness.in_folder(half, "irradiance.exr")) for half in halves]
    result = {"measured": [], "denoised": []}
    for seed in range(2 if bench.options.quick else LIGHT_SEEDS * bench.options.repeats):
        out, _ = bench.bake(path, {**own, "basis": "irradiance", "seams": "off", "dilate": 0, "error": 0.05, "seed": seed + 1,
                                   "cache": "on", "denoise": "on"})
        valid = [all(v) for v in zip(*(by_brightness.measured(folder) for folder in (out, *halves)))]
        truth = sum((a + b) / 2 for a, b, v in zip(*maps, valid) if v)
        for kind, file, prefix in (("measured", "measured.exr", "E."), ("denoised", "irradiance.exr", "")):
            values = by_brightness.luminance(by_brightness.in_folder(out, file), prefix)
            result[kind].append(sum(e for e, v in zip(values, valid) if v) / truth - 1)
    keep(bench.options, "light", name, result)


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


def light_table(options):
    rows = ["| scene | seeds | before the denoiser | after it |", "|---|---|---|---|"]
    results = kept(options, "light")
    for name in [s for s in REFERENCE if s in results]:
        errors = [results[name][kind] for kind in ("measured", "denoised")]
        rows.append("| %s | %d | %s |" % (name, len(errors[0]), " | ".join(
            "%+.2f ± %.2f %%" % (100 * statistics.mean(e), 100 * statistics.stdev(e) / math.sqrt(len(e))) for e in errors)))
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
    sections = {"machine": machine_line(options), "bias": bias_table(options), "light": light_table(options),
                "calibration": calibration_table(options), "foretold": foretold_table(options),
                "curves": curves_section(options, folder), "times": times_table(options), "texel": texel_table(options),
                "others": others_table(options), "rooms": rooms_table(options),
                "statements": statements_table(options), "limits": limits_table(options)}
    measured = {"machine": "curves", "times": "curves", "statements": "rooms"}
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
    parser.add_argument("--densities", type=float, nargs="*", help="of parts rooms [8 16] and texel [4 8]")
    parser.add_argument("--texel-samples", type=int, default=TEXEL_SAMPLES, help="of part texel: --max-samples")
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
    scenes = scenes_of(options) if set(options.only) - {"none", *OF_ROOMS} else {}
    for part in PARTS:
        if part not in options.only:
            continue
        if part in OF_ROOMS:
            OF_ROOMS[part](bench)
            continue
        for name, (path, own) in scenes.items():
            globals()[part](bench, name, path, own)
    write_page(options)


if __name__ == "__main__":
    main()
