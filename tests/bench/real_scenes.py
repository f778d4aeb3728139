#!/usr/bin/env python3
"""Bakes scenes that others made, within time limits and at fixed samples, and writes docs/real_scenes.md.

    python3 tests/bench/real_scenes.py [FOLDER] [--work DIR] [--parts limits,calibration,seams] [--scenes A,B]
        [--densities 8,16] [--limits 5,20,60] [--samples 2,8,32,128] [--loaded] [--only-write]

FOLDER (or $KILN_SCENES, or ../shared/scenes beside the checkout) holds the .glb files and their sidecar .json with
lighting; the demo, tests/scenes/arcade, is always one of the scenes. Every run is kept as a JSON file in the work folder
and is not made again: a run of everything takes hours and can be stopped at any time. --loaded: one processor is taken
by another process meanwhile; kept apart. --only-write: writes the page from what is kept. Python 3, no packages.
"""
import argparse
import json
import math
import os
import pathlib
import shutil
import subprocess
import sys
import time

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import small_png  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
PAGE, PICTURES = ROOT / "docs/real_scenes.md", ROOT / "docs/images/real_scenes"
PREVIEW_WIDTH = 480


def lighting(sidecar):
    """Options for what a file cannot hold."""
    options = []
    environment = sidecar.get("environment")
    if environment and environment.get("type") == "constant":
        options += ["--environment", ",".join("%g" % v for v in environment["radiance"])]
    sun = sidecar.get("sun")
    if sun:
        options += ["--sun", "%s:%s" % tuple(",".join("%g" % v for v in sun[k]) for k in ("to_light", "irradiance"))]
    if sidecar.get("sun_angular_diameter_rad"):
        options += ["--sun-angle", "%.4g" % math.degrees(sidecar["sun_angular_diameter_rad"])]
    return options


def find_scenes(folder):
    found = {"arcade": (ROOT / "tests/scenes/arcade/arcade.gltf", [])}
    for path in sorted(folder.glob("*.glb")) if folder and folder.is_dir() else []:
        sidecar = path.with_suffix(".json")
        found[path.stem] = (path, lighting(json.loads(sidecar.read_text())) if sidecar.exists() else [])
    return found


class Runner:
    def __init__(self, args):
        self.kiln, self.work = ROOT / args.build / "bin/kiln", pathlib.Path(args.work)
        self.args = args
        (self.work / "results").mkdir(parents=True, exist_ok=True)

    def kept(self, key):
        path = self.work / "results" / (key + ".json")
        return json.loads(path.read_text()) if path.exists() else None

    def keep(self, key, result):
        path = self.work / "results" / (key + ".json")
        path.with_suffix(".part").write_text(json.dumps(result, indent=1))
        path.with_suffix(".part").rename(path)
        return result

    def call(self, *arguments):
        began = time.monotonic()
        done = subprocess.run([str(self.kiln), *map(str, arguments)], capture_output=True, text=True)
        return done, time.monotonic() - began

    def bake(self, key, scene, options, keep_folder=False, preview=None):
        """One bake: its wall time, exit status and what its report says. `keep_folder`: for compare."""
        result, folder = self.kept(key), self.work / "bakes" / key
        if result and (not keep_folder or folder.exists() or result["status"] != 0):
            return result, folder
        shutil.rmtree(folder, ignore_errors=True)
        print("bake", key, flush=True)
        done, seconds = self.call("bake", scene, "-o", folder, *options)
        result = {"seconds": seconds, "status": done.returncode, "last_line": (done.stderr.strip() or "-").split("\n")[-1]}
        report = folder / "report.json"
        if report.exists():
            result.update(headline(json.loads(report.read_text())))
        if preview and (folder / "preview.png").exists():
            picture = small_png.read(folder / "preview.png")
            PICTURES.mkdir(parents=True, exist_ok=True)
            small_png.write(PICTURES / (preview + ".png"),
                            small_png.shrunk(picture, max(1, round(picture[0] / PREVIEW_WIDTH))))
        if not keep_folder:
            shutil.rmtree(folder, ignore_errors=True)
        return self.keep(key, result), folder

    def reference(self, key, scene, options):
        kept = self.kept(key)
        if kept and pathlib.Path(kept["folder"]).exists():
            return pathlib.Path(kept["folder"])
        print("reference", key, flush=True)
        done, seconds = self.call("bench", scene, "-o", self.work / "bench", *options, "--only-reference",
                                  "--reference-share", self.args.reference_share, "--reference-samples",
                                  self.args.reference_samples, "--references", self.work / "references")
        if done.returncode != 0:
            print("  ", done.stderr.strip(), flush=True)
            return None
        folder = done.stdout.split()[-1]
        self.keep(key, {"folder": folder, "seconds": seconds})
        return pathlib.Path(folder)

    def compare(self, folder, reference):
        done, _ = self.call("compare", folder, reference / "half0", reference / "half1", "--json", "--worst", 1)
        return json.loads(done.stdout) if done.returncode == 0 else {"trouble": done.stderr.strip()}


def headline(report):
    """What the tables show of a report; None where this release does not say it."""
    passes, atlas = report.get("passes") or [{}], report.get("atlas", {})
    figures = {f["name"]: f["value"] for f in report.get("post", [])}
    texels, never = atlas.get("valid_texels"), report.get("never_sampled")
    if never is None and texels:  # without the field: those that hold nothing of their own, a little more
        classes = atlas.get("texels_by_class", {})
        never = max(0, texels - sum(classes.get(c, 0) for c in ("measured", "pushed", "inside")))
    return {"texels": texels, "never_sampled": never, "few_samples": report.get("few_samples"),
            "median": report.get("median_relative_error"), "p95": report.get("p95_relative_error"),
            "within": report.get("within_target", passes[-1].get("converged_share")),
            "samples": passes[-1].get("samples"), "complete": report.get("complete"), "post": figures}


def percent(value, digits=1):
    return "-" if value is None else "%.*f" % (digits, 100 * value)


def share(part, whole):
    """Of a count, or of what is a share already."""
    if part is None or not whole:
        return None
    return part if isinstance(part, float) and part <= 1 else part / whole


def run_limits(r, scenes, args):
    rows = []
    for name, (path, light) in scenes.items():
        for density in args.densities:
            for limit in args.limits:
                key = "limit-%s-%g-%g%s" % (name, density, limit, "-loaded" if args.loaded else "")
                preview = "%s-%g-%g" % (name, density, limit) if limit == args.limits[-1] else None
                options = ["--texels-per-metre", density, "--time-limit", limit, "--denoise", "on", *light]
                result = r.kept(key) if args.only_write else r.bake(key, path, options, preview=preview)[0]
                if not result:
                    continue
                rows.append("| %s | %g | %s | %g | %.1f | %s | %s | %s | %s | %s | %s |" % (
                    name, density, result.get("texels") or "-", limit, result["seconds"], result["status"],
                    percent(share(result.get("never_sampled"), result.get("texels"))), percent(result.get("median")),
                    percent(result.get("p95")), percent(result.get("within")),
                    "-" if result.get("samples") is None else "%.0f" % result["samples"]))
    return ["| scene | texels/m | texels | limit, s | wall, s | exit | never sampled, % | median stated, % | p95 stated, % "
            "| within target, % | samples |", "|---|" + "---|" * 10, *rows]


def run_calibration(r, scenes, args):
    rows = []
    density = args.densities[0]
    for name, (path, light) in scenes.items():
        options = ["--texels-per-metre", density, *light]
        reference = None if args.only_write else r.reference("reference-%s-%g" % (name, density), path, options)
        for samples in args.samples:
            both = {}
            for denoise in ("off", "on"):
                key = "calibration-%s-%g-%g-%s" % (name, density, samples, denoise)
                both[denoise] = r.kept(key)
                if args.only_write or both[denoise] or not reference:
                    continue
                bake, folder = r.bake("bake-" + key, path, [*options, "--min-samples", samples, "--max-samples", samples,
                                                           "--denoise", denoise, "--basis", "irradiance", "--encode",
                                                           "none"], keep_folder=True)
                if bake["status"] == 0:
                    both[denoise] = r.keep(key, r.compare(folder, reference))
                shutil.rmtree(folder, ignore_errors=True)
            rows += calibration_rows(name, samples, both)
    return ["| scene | samples | | texels | true / stated | covered, % | largest stated / brightest | relMSE | SSIM | gain in "
            "relMSE |", "|---|" + "---|" * 9, *rows]


def calibration_rows(name, samples, both):
    rows = []
    for denoise, c in both.items():
        if not c or "calibration" not in c:
            continue
        k, raw = c["calibration"], both.get("off") or {}
        gain = "%.1f" % (raw["rel_mse"] / c["rel_mse"]) if denoise == "on" and raw.get("rel_mse") and c["rel_mse"] > 0 else ""
        rows.append("| %s | %g | %s | %d | %.2f | %s | %s | %.3g | %s | %s |" % (
            name, samples, "denoised" if denoise == "on" else "raw", c["texels"], k["error_ratio"],
            percent(k["coverage"]), "%.3g" % k["largest_stated"] if "largest_stated" in k else "-", c["rel_mse"],
            "%.4f" % c["ssim"] if "ssim" in c else "-", gain))
    return rows


def run_seams(r, scenes, args):
    """From the reports of the longest limits, and maps with and without joining against the reference."""
    rows, density = [], args.densities[0]
    for name, (path, light) in scenes.items():
        options = ["--texels-per-metre", density, *light]
        reference = None if args.only_write else r.reference("reference-%s-%g" % (name, density), path, options)
        both = {}
        for seams in ("off", "on"):
            key = "seams-%s-%g-%s" % (name, density, seams)
            both[seams] = r.kept(key)
            if args.only_write or both[seams] or not reference:
                continue
            bake, folder = r.bake("bake-" + key, path, [*options, "--min-samples", 64, "--max-samples", 64, "--denoise",
                                                       "on", "--basis", "irradiance", "--encode", "none", "--seams",
                                                       seams], keep_folder=True)
            if bake["status"] == 0:
                both[seams] = r.keep(key, {**r.compare(folder, reference), "post": bake.get("post", {})})
            shutil.rmtree(folder, ignore_errors=True)
        if not all(both.values()):
            continue
        steps = both["on"]["post"]
        figure = lambda what, when: steps.get("%s of E across %s %s" % (what, "seams" if "percentile" in what else
                                                                        "a seam", when))
        rows.append("| %s | %s | %s | %s | %s | %.5g | %.5g |" % (
            name, *("-" if v is None else "%.2f" % v for v in (
                figure("99th percentile of steps", "before"), figure("99th percentile of steps", "after"),
                figure("largest step", "before"), figure("largest step", "after"))),
            both["off"].get("rel_mse", math.nan), both["on"].get("rel_mse", math.nan)))
    return ["| scene | 99th percentile of steps before, % | after, % | largest before, % | after, % | relMSE of the map apart "
            "| joined |", "|---|" + "---|" * 6, *rows]


def write_part(part, lines):
    begin, end = "<!-- %s -->" % part, "<!-- end of %s -->" % part
    page = PAGE.read_text()
    if begin not in page or end not in page:
        sys.exit("%s has no place for %s: it wants the lines '%s' and '%s'" % (PAGE, part, begin, end))
    head, rest = page.split(begin, 1)
    PAGE.write_text(head + begin + "\n" + "\n".join(lines) + "\n" + end + rest.split(end, 1)[1])


def numbers(text):
    return [float(v) for v in text.split(",")]


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder", nargs="?", default=os.environ.get("KILN_SCENES", ROOT / "../shared/scenes"))
    parser.add_argument("--work", default="real_scenes_work", help="keeps every run [real_scenes_work]")
    parser.add_argument("--build", default="build", help="build folder below the checkout [build]")
    parser.add_argument("--parts", default="limits,calibration,seams")
    parser.add_argument("--scenes", default="", help="names, without .glb; all")
    parser.add_argument("--densities", type=numbers, default=[8, 16], help="texels a metre; the first calibrates")
    parser.add_argument("--limits", type=numbers, default=[5, 20, 60], help="seconds")
    parser.add_argument("--samples", type=numbers, default=[2, 8, 32, 128], help="of calibration")
    parser.add_argument("--reference-share", type=float, default=0.03)
    parser.add_argument("--reference-samples", type=int, default=4096)
    parser.add_argument("--loaded", action="store_true", help="one processor is taken by another process")
    parser.add_argument("--only-write", action="store_true", help="bake nothing")
    args = parser.parse_args()
    scenes = find_scenes(pathlib.Path(args.folder))
    if args.scenes:
        unknown = [n for n in args.scenes.split(",") if n not in scenes]
        if unknown:
            sys.exit("no scene %s in %s: there are %s" % (", ".join(unknown), args.folder, ", ".join(scenes)))
        scenes = {n: scenes[n] for n in args.scenes.split(",")}
    parts = {"limits": run_limits, "calibration": run_calibration, "seams": run_seams}
    chosen = args.parts.split(",")
    if any(p not in parts for p in chosen):
        sys.exit("--parts is made of " + ", ".join(parts))
    runner = Runner(args)
    load = subprocess.Popen([sys.executable, "-c", "while True: pass"]) if args.loaded and not args.only_write else None
    try:
        for part in chosen:
            lines = parts[part](runner, scenes, args)
            write_part("loaded" if part == "limits" and args.loaded else part, lines)
    finally:
        if load:
            load.kill()


if __name__ == "__main__":
    main()
