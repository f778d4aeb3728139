"""What error_vs_time.py and its parts share: programs, kept results, targets, words of tables."""
import json
import math
import os
import statistics
import subprocess
import sys

HERE = os.path.dirname(os.path.abspath(__file__))
ROOT = os.path.dirname(os.path.dirname(HERE))
COMPARE = os.path.join(ROOT, "tests/compare")
ARCADE = os.path.join(ROOT, "tests/scenes/arcade/arcade.gltf")
TARGETS = (1e-3, 1e-4)

# Samples of each half of the reference: the harder the light, the more.
REFERENCE = {"cornell": 4096, "ajar": 8192, "keyhole": 16384, "lights1000": 4096, "courtyard": 8192, "caustic": 8192,
             "furnace": 1024, "arcade": 2048, "staircase": 4096, "living-room": 4096}
# Light that whole paths hardly find: their references end at measured surfaces too. How far from the truth that is, is a
# part of its own (bias), against so many whole paths.
CACHED_REFERENCE = ("ajar", "keyhole", "caustic", "staircase", "living-room")


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


def points_of(curve):
    return [(p["seconds"], p["rel_mse"]) for p in curve["points"]]


def time_text(found):
    return "%s%.3g" % found


def percent(x):
    return "%.1f %%" % (100 * x)


def root_mean(values):
    return math.sqrt(statistics.mean(x * x for x in values))


def mean_and_range(values):
    """Root of the mean square; of several also the least and the most."""
    text = "%.2f" % root_mean(values)
    return text + " (%.2f to %.2f)" % (min(values), max(values)) if len(values) > 1 else text
