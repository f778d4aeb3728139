#!/usr/bin/env python3
"""What the farm costs on one machine: `kiln bake` with two workers of one thread against the same bake in one process
with two threads (in_process_bake), whole programs by the wall clock, interleaved; medians and their ratio.

usage: overhead.py [--bin build/bin] [--rounds 3] [--scene tests/scenes/arcade/arcade.gltf] [NAME=VALUE ...]

Settings are those of the job file; both sides get the same and must give the same files. Run it on a quiet machine.
"""
import argparse
import hashlib
import os
import statistics
import subprocess
import sys
import tempfile
import time
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
# About a minute on two threads.
SETTINGS = ["texels-per-metre=4", "min-samples=256", "max-samples=256", "sun-angle=0.53"]


def timed(words):
    begun = time.monotonic()
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True)
    if done.returncode:
        sys.exit(f"{words[0]}: {done.stderr.strip()}")
    return time.monotonic() - begun


def digest(folder):
    total = hashlib.sha256()
    for file in sorted(folder.glob("*.exr")) + sorted(folder.glob("*.glb")):
        total.update(file.name.encode() + file.read_bytes())
    return total.hexdigest()


def main():
    parser = argparse.ArgumentParser()
    parser.add_argument("--bin", type=Path, default=ROOT / "build/bin")
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--scene", type=Path, default=ROOT / "tests/scenes/arcade/arcade.gltf")
    parser.add_argument("settings", nargs="*", default=SETTINGS)
    options = parser.parse_args()
    print(f"load before: {os.getloadavg()[0]:.2f}; settings: {' '.join(options.settings)}")
    farm, alone = [], []
    with tempfile.TemporaryDirectory() as folder:
        a, b, config = Path(folder) / "farm", Path(folder) / "alone", Path(folder) / "job.json"
        pairs = (entry.split("=", 1) for entry in options.settings)
        config.write_text("{" + ", ".join(f'"{name}": "{value}"' for name, value in pairs) + "}")
        for _ in range(options.rounds):
            farm.append(timed([options.bin / "kiln", "bake", options.scene, "-o", a, "--config", config, "--workers", 2,
                               "--threads", 1, "--quiet"]))
            alone.append(timed([options.bin / "in_process_bake", options.scene, b, 2, *options.settings]))
            print(f"kiln bake {farm[-1]:.2f} s, in process {alone[-1]:.2f} s", flush=True)
        if digest(a) != digest(b):
            sys.exit("the two bakes differ")
    print(f"medians: kiln bake {statistics.median(farm):.2f} s, in process {statistics.median(alone):.2f} s, "
          f"ratio {statistics.median(farm) / statistics.median(alone):.3f}; the same bytes; "
          f"load after: {os.getloadavg()[0]:.2f}")


if __name__ == "__main__":
    main()
