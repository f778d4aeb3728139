#!/usr/bin/env python3
"""Are the masters of two builds the same bytes?

    python3 tests/bench/masters.py BUILD_BEFORE BUILD_AFTER [--scenes FOLDER] [--samples 32] [--work DIR]

Bakes the demo, a Cornell box, a courtyard and, from FOLDER, the living room, veach-bidir and the modular room with
fixed samples, by the kiln of either build, and compares the SHA-256 of every master. Prints a table for
docs/performance.md; exits with 1 where one differs. Python 3, no packages.
"""
import argparse
import hashlib
import json
import pathlib
import subprocess
import sys

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parent))
import error_scenes  # noqa: E402

ROOT = pathlib.Path(__file__).resolve().parents[2]
SHARED = {"living-room": [], "veach-bidir": [], "godot_room": []}


def sidecar(path):
    """Options for the light that a .json beside the scene describes."""
    if not path.exists():
        return []
    light, options = json.loads(path.read_text()), []
    if light.get("environment"):
        options += ["--environment", ",".join("%g" % v for v in light["environment"]["radiance"])]
    if light.get("sun"):
        options += ["--sun", "%s:%s" % tuple(",".join("%g" % v for v in light["sun"][k])
                                             for k in ("to_light", "irradiance"))]
    return options


def scenes(args, work):
    error_scenes.write(str(work), ["cornell", "courtyard"])
    yield "arcade", ROOT / "tests/scenes/arcade/arcade.gltf", []
    for name in ("cornell", "courtyard"):
        yield name, work / (name + ".glb"), []
    for name in SHARED if args.scenes else []:
        path = pathlib.Path(args.scenes) / (name + ".glb")
        yield name, path, ["--texels-per-metre", "8"] + sidecar(path.with_suffix(".json"))


def masters(build, scene, options, out, samples):
    subprocess.run([str(pathlib.Path(build) / "bin/kiln"), "bake", str(scene), "-o", str(out), "--encode", "none",
                    "--preview", "off", "--min-samples", str(samples), "--max-samples", str(samples), *options],
                   check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
    report = json.loads((out / "report.json").read_text())
    return {f["file"]: f["sha256"] for f in report["outputs"] if f["master"]}


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("before")
    parser.add_argument("after")
    parser.add_argument("--scenes", help="folder of scenes that others made")
    parser.add_argument("--samples", type=int, default=32)
    parser.add_argument("--work", default="masters_work")
    args = parser.parse_args()
    work = pathlib.Path(args.work)
    work.mkdir(parents=True, exist_ok=True)
    same = True
    print("| scene | masters | SHA-256 over all, before | after |\n|---|---|---|---|")
    for name, scene, options in scenes(args, work):
        both = [masters(b, scene, options, work / (name + k), args.samples)
                for b, k in ((args.before, "-before"), (args.after, "-after"))]
        digest = [hashlib.sha256(json.dumps(m, sort_keys=True).encode()).hexdigest()[:16] for m in both]
        same &= both[0] == both[1]
        print("| %s | %d | %s | %s |" % (name, len(both[0]), *digest), flush=True)
        for file in sorted(set(both[0]) | set(both[1])):
            if both[0].get(file) != both[1].get(file):
                print("differs: %s %s" % (name, file))
    return 0 if same else 1


if __name__ == "__main__":
    sys.exit(main())
