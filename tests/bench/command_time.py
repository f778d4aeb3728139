#!/usr/bin/env python3
"""Time and memory of a command that sees no image: command_time.py [PROGRAM ...] (default build/bin/kiln).

`kiln plan` of tests/scenes/flat, 20 times each, in turn; prints medians. Python 3, no packages.
"""
import os
import statistics
import subprocess
import sys
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
SCENE = os.path.join(ROOT, "tests/scenes/flat/flat.glb")
STARTS = 20


def main():
    programs = sys.argv[1:] or [os.path.join(ROOT, "build/bin/kiln")]
    seconds, kilobytes = {p: [] for p in programs}, {p: [] for p in programs}
    for _ in range(STARTS):
        for program in programs:
            start = time.perf_counter()
            child = subprocess.Popen([program, "plan", SCENE], stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)
            _, status, usage = os.wait4(child.pid, 0)
            if status:
                sys.exit("%s plan %s: status %d" % (program, SCENE, status))
            seconds[program].append(time.perf_counter() - start)
            kilobytes[program].append(usage.ru_maxrss)
    for program in programs:
        print("%s: %.3f s, %.0f MB" % (program, statistics.median(seconds[program]), statistics.median(kilobytes[program]) / 1000))


if __name__ == "__main__":
    main()
