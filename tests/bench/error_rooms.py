"""Parts of error_vs_time.py in furnished rooms at the density of production: `rooms`, `limits`, `texel`."""
import argparse
import json
import math
import os
import pathlib
import statistics
import sys

from error_common import (ARCADE, HERE, ROOT, TARGETS, arguments_of, crossing, keep, kept, mean_and_range, percent, points_of,
                          real_options, root_mean, run, time_text)

sys.path.insert(0, HERE)
import by_brightness  # noqa: E402
import cache_bias  # noqa: E402
import real_rooms  # noqa: E402

FLUX_CORE_MS = 86  # 200 core hours for 8 Mtexel, as published
# Part `texel`: bakes to 5 % at 95 % without a limit.
OF_THE_TEXEL_TABLE = ("arcade", "living-room", "staircase", "sponza")
TEXEL_DENSITIES = (4, 8)
TEXEL_SAMPLES = 262144  # at most; the norm's default is 16,384
# Part `rooms`: of real_rooms.py, and files; brute force and Kiln as it is without settings, for the same norm.
MADE_ROOMS = ("flat", "corridor")
ROOMS = (*MADE_ROOMS, "living-room", "dining-room", "staircase", "classroom", "dungeon", "sponza", "arcade")
ROOM_DENSITIES = (8, 16)  # texels per metre
ROOM_MATERIALS = ("default", "lambert")
ROOM_ERRORS = "0.4,0.2,0.1,0.05"  # the last is a relMSE of 6.5e-4, if what is stated is true
ROOM_REFERENCE, ROOM_REFERENCE_ERROR = 16384, 0.05  # at most, and of each half
# The share of a room's texels that is compared with whole paths at the first of its densities: about 2,000 of them, 7,900 of
# the living room, and of the classroom 9,700, because a few of its texels have most of the error: of 2,087 (at 8 a metre)
# relMSE is known to 43 %, of 8,438 to 14 %. At twice that density it is a quarter of this.
ROOM_SHARE = {"flat": 0.06, "corridor": 0.045, "living-room": 0.25, "dining-room": 0.03, "staircase": 0.02, "classroom": 0.04,
              "dungeon": 0.012, "sponza": 0.003, "arcade": 0.01}
# Unless others are asked for. At 8 a metre these two have three million texels each: minutes a bake in the classroom, probably
# hours in the dungeon.
ROOM_OWN_DENSITIES = {"classroom": (2, 8), "dungeon": (2,)}
# Part `limits`: seconds, and nothing else is said of the bake; rooms with their texels per metre and the share that is
# compared.
LIMITS = (30, 100, 300)
LIMITED = {"flat": (16, 0.25), "living-room": (8, 0.25), "dining-room": (8, 0.12)}
DARK = range(-5, -2)  # rows of by_brightness.py: 0.41 to 11 % of the mean
# Brute force errs as 1 / time, so that its run may end early; Kiln's goes on until it is there.
ROOM_SETS = ("brute:ladder=samples,sampler=halton,cache=off,denoise=off,error-norm=mean-square",
             "default:error-norm=mean-square")


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
            for density in options.densities or densities_of(name):
                yield name, materials, density, str(path), {**own, "texels-per-metre": 1 if options.quick else density}


def densities_of(room):
    return ROOM_OWN_DENSITIES.get(room, ROOM_DENSITIES)


def share_of(room, density):
    return ROOM_SHARE[room] * min(1, (densities_of(room)[0] / density)**2)


def rooms(bench):
    for name, materials, density, path, own in rooms_of(bench.options):
        entry = "%s %s %g" % (name, materials, density)
        quick = ["--errors", "0.4", "--samples", 16, "--repeats", 1, "--reference-samples", 64]
        # Without enough samples in the darkest texels a reference misses the few paths that light them, and calls right
        # maps wrong there.
        full = ["--repeats", bench.options.repeats, "--reference-samples", bench.options.room_reference, "--reference-error",
                ROOM_REFERENCE_ERROR, "--errors", ROOM_ERRORS]
        how = ["--reference-share", 1 if bench.options.quick else share_of(name, density)]
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
    for room, (density, share) in LIMITED.items():
        if options.scenes is not None and room not in options.scenes:
            continue
        chosen = argparse.Namespace(**{**vars(options), "scenes": [room], "densities": [density]})
        for _, materials, density, path, own in rooms_of(chosen):
            out = os.path.join(options.work, "reference")
            folder = json.loads(run([options.kiln, "bench", path, "-o", out, "--only-reference", "--json", "--reference-samples",
                                     64 if options.quick else options.room_reference, "--reference-error",
                                     ROOM_REFERENCE_ERROR, "--reference-share", share,
                                     *arguments_of(own)]))["reference"]["folder"]
            halves = [os.path.join(folder, "half0"), os.path.join(folder, "half1")]
            label = "before" if options.bakes_with else "now"
            result = {"room": room, "materials": materials, "density": density, "version": label,
                      "kiln": [limited_bake(bench, path, {**own, "time-limit": limit, "seed": seed + 1}, halves)
                               for limit in ((10, 20) if options.quick else LIMITS) for seed in range(options.repeats)]}
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


def texel(bench):
    """Bakes of rooms until every texel is within 5 % at 95 %, or has all samples that it may have: what each texel took."""
    options = bench.options
    for room in OF_THE_TEXEL_TABLE:
        if options.scenes is not None and room not in options.scenes:
            continue
        chosen = argparse.Namespace(**{**vars(options), "scenes": [room], "materials": ["default"],
                                       "densities": options.densities or TEXEL_DENSITIES})
        for _, _, density, path, own in rooms_of(chosen):
            limit = {"time-limit": 20} if options.quick else {}
            most = options.texel_samples
            _, r = bench.bake(path, {**own, "error": 0.05, "confidence": 0.95, "error-norm": "max", "max-samples": most, **limit})
            keep(options, "texel", "%s %g %d" % (room, density, most), {
                "room": room, "density": density, "max_samples": most, "texels": r["atlas"]["valid_texels"],
                "core_seconds": r["farm"]["worker_seconds"], "rays": r["farm"]["rays"], "complete": r["complete"],
                "converged": r["passes"][-1]["converged_share"], "seconds": sum(s["seconds"] for s in r["stages"])})


def rooms_table(options):
    """Brute force's time to 1e-3 and, which is not continued for Kiln, to the error at the end of Kiln's ladder."""
    rows = ["| room | materials | texels per metre | texels | compared | brute, s to 1e-3 | Kiln, s to 1e-3 | ratio | "
            "Kiln's last point | brute / Kiln there | true / stated there |",
            "|---|---|---|---|---|---|---|---|---|---|---|"]
    for r in kept(options, "rooms").values():
        brute, kiln = (points_of(c) for c in r["curves"])
        found = [crossing(points, TARGETS[0]) for points in (brute, kiln)]
        seconds, error = kiln[-1]
        last = [run for run in r["runs"] if run["budget"] == r["curves"][1]["points"][-1]["budget"]]
        # A true error that is found negative, as 0: the reference errs by more than the bake.
        is_known = all(run["error_ratio"] > 0 for run in last)
        rows.append("| %s | %s | %g | %d | %d | %s | %s | %s%.1f | relMSE %.2g in %.3g s | %.1f | %s |" % (
            r["name"], r["materials"], r["density"], last[0]["texels"], r["texels"], time_text(found[0]), time_text(found[1]),
            "≈ " if "≈ " in (found[0][0], found[1][0]) else "", found[0][1] / found[1][1], error, seconds,
            crossing(brute, error)[1] / seconds, mean_and_range([run["error_ratio"] for run in last]) if is_known else ""))
    return rows


def statements_table(options):
    """True error over stated at each error asked for: of the texels, each by its own, and of the map (relMSE and the stated one)."""
    errors = ROOM_ERRORS.split(",")
    rows = ["| room | seeds | %s | promises kept |" % " | ".join("%s %s" % (of, e) for of in ("texels,", "map,") for e in errors),
            "|---" * (2 * len(errors) + 3) + "|"]
    for r in kept(options, "rooms").values():
        runs = [run for run in r["runs"] if run.get("stated_rel_mse", 0) > 0]
        if not runs:
            continue
        cells = []
        for of in (lambda run: run["error_ratio"], lambda run: math.sqrt(max(0, run["rel_mse"]) / run["stated_rel_mse"])):
            for error in errors:
                ratios = [of(run) for run in runs if run["value"] == float(error) and run["rel_mse"] > 2 * r["reference"]["rel_mse"]]
                cells.append(mean_and_range(ratios) if ratios else "")
        last = [run for run in runs if run["value"] == runs[-1]["value"]]
        rows.append("| %s, %s, %g a metre | %d | %s | %s |" % (
            r["name"], r["materials"], r["density"], len(last), " | ".join(cells),
            percent(statistics.mean(run["promise_kept"] for run in last))))
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


def texel_table(options):
    rows = ["| room | texels per metre | texels | samples, at most | seconds | core-ms a texel | rays a texel | "
            "texels within 5 % at 95 %, stated |",
            "|---|---|---|---|---|---|---|---|"]
    results = [r for r in kept(options, "texel").values() if "max_samples" in r]  # others: of earlier releases
    for r in results:
        rows.append("| %s | %g | %d | %d | %.0f | %.1f | %.0f | %s%s |" % (
            r["room"], r["density"], r["texels"], r["max_samples"], r["seconds"], 1000 * r["core_seconds"] / r["texels"],
            r["rays"] / r["texels"], percent(r["converged"]), "" if r["complete"] else " (time was up)"))
    return rows + ["| Flux, as published | | 8 M | | | %d | 100,000 | |" % FLUX_CORE_MS]
