#!/usr/bin/env python3
"""Most memory that a texel takes: memory.py BUILD_FOLDER [SCENE]. Bakes at two densities, without and with the
denoiser, and prints the slope of the peak resident set of coordinator and worker over sampled texels: what
texel_memory() in coordinator/bake/plan/plan.cpp says."""
import json
import os
import subprocess
import sys
import tempfile
import time


def peak(pid):
    try:
        with open("/proc/%d/status" % pid) as status:
            for line in status:
                if line.startswith("VmHWM"):
                    return int(line.split()[1]) * 1024
    except OSError:
        pass
    return 0


def children(pid):
    found = []
    try:
        for task in os.listdir("/proc/%d/task" % pid):  # any thread may have started them
            with open("/proc/%d/task/%s/children" % (pid, task)) as listing:
                found += [int(word) for word in listing.read().split()]
    except OSError:
        pass
    return found


def bake(build, scene, density, denoise):
    with tempfile.TemporaryDirectory() as folder:
        command = [os.path.join(build, "bin", "kiln"), "bake", scene, "-o", folder, "--quiet", "--layout", "pack",
                   "--texels-per-metre", str(density), "--min-samples", "2", "--max-samples", "2",
                   "--denoise", denoise, "--preview", "off", "--environment", "1,1,1"]
        run = subprocess.Popen(command, stdout=subprocess.DEVNULL)
        own = worker = 0
        while run.poll() is None:
            own = max(own, peak(run.pid))
            for child in children(run.pid):
                worker = max(worker, peak(child))
            time.sleep(0.01)
        if run.returncode:
            sys.exit("the bake at %s texels per metre ended with status %d" % (density, run.returncode))
        with open(os.path.join(folder, "report.json")) as report:
            plan = json.load(report)
        texels = sum(o["valid_texels"] for o in plan["objects"])
        return texels, own, worker


def main():
    build = sys.argv[1] if len(sys.argv) > 1 else "build"
    here = os.path.dirname(os.path.abspath(__file__))
    scene = sys.argv[2] if len(sys.argv) > 2 else os.path.join(here, "../scenes/arcade/arcade.gltf")
    densities = [float(d) for d in sys.argv[3:]] or [8, 16]
    print("denoise  texels               coordinator, worker MiB      bytes a texel")
    for denoise in ("off", "on"):
        low, high = [bake(build, scene, d, denoise) for d in densities]
        step = high[0] - low[0]
        print("%-7s  %8d to %8d  %5d, %4d to %5d, %4d  coordinator %4d, worker %4d" % (
            denoise, low[0], high[0], low[1] >> 20, low[2] >> 20, high[1] >> 20, high[2] >> 20,
            (high[1] - low[1]) // step, (high[2] - low[2]) // step))


if __name__ == "__main__":
    main()
