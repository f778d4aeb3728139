#!/usr/bin/env python3
"""Bakes hostile scenes (scenes.py): each is refused with a sentence, or baked, within limits of memory and time.

    python3 tests/hostile/run.py                     # 200 scenes, kiln bake
    python3 tests/hostile/run.py --scenes 40 --verb plan --seed 7
    python3 tests/hostile/run.py --only 17 --keep    # one of them again; its files stay

Prints a line for each that fails and a table of the outcomes; exit status 0 if there is none."""
import argparse, collections, os, shutil, signal, sys, tempfile, time
sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import scenes

p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
p.add_argument("--bin", default="build/bin")
p.add_argument("--scenes", type=int, default=200)
p.add_argument("--seed", type=int, default=1)
p.add_argument("--verb", choices=["bake", "plan"], default="bake", help="plan imports and lays out alone")
p.add_argument("--only", type=int, help="the number of one scene")
p.add_argument("--keep", action="store_true", help="leave the files")
p.add_argument("--memory-mib", type=int, default=2048)
p.add_argument("--seconds", type=float, default=60, help="0: no limit")
a = p.parse_args()
work = tempfile.mkdtemp(prefix="kiln-hostile-")


def write(folder, files):
    os.mkdir(folder)
    for name, data in files.items():
        with open(os.path.join(folder, name), "wb") as f:
            f.truncate(data) if isinstance(data, int) else f.write(data)
    return os.path.join(folder, "scene.glb" if "scene.glb" in files else "scene.gltf")


def measured(command, log):
    """Exit status (negative: signal), peak resident MiB, and seconds: of the program and its children.

    Processor time over the number of processors: what it would take on an idle machine."""
    begin, most = time.monotonic(), 0
    pid = os.fork()
    if pid == 0:
        os.setsid()
        out = os.open(log, os.O_CREAT | os.O_WRONLY | os.O_TRUNC)
        os.dup2(out, 1), os.dup2(out, 2)
        os.environ["KILN_THREADS"] = "2"
        os.execv(command[0], command)
    while True:
        done, status, usage = os.wait4(pid, os.WNOHANG)
        seconds = time.monotonic() - begin
        if done:
            used = (usage.ru_utime + usage.ru_stime) / len(os.sched_getaffinity(0))
            return os.waitstatus_to_exitcode(status), usage.ru_maxrss >> 10, used
        if a.seconds and seconds > 10 * a.seconds:
            os.killpg(pid, signal.SIGKILL)  # the group that this script made
            os.wait4(pid, 0)
            return None, 0, seconds
        time.sleep(0.02)


def judge(number):
    name, files = scenes.scene(number, a.seed)
    folder = os.path.join(work, str(number))
    path, log = write(folder, files), os.path.join(folder, "log")
    command = [os.path.join(a.bin, "kiln"), a.verb, path, "--texels-per-metre", "1", "--unwrap-cache", "off"]
    if a.verb == "bake":
        command += ["-o", os.path.join(folder, "out"), "--quiet", "--min-samples", "4", "--max-samples", "8",
                    "--max-texels", "65536"]
    status, mib, seconds = measured(command, log)
    words = open(log, errors="replace").read()
    sentence = next((l for l in words.splitlines() if l.startswith("kiln: ")), "")
    wrong = (f"took more than {a.seconds} s" if status is None or (a.seconds and seconds > a.seconds) else
             f"ended by signal {-status}" if status < 0 else
             f"took {mib} MiB" if mib > a.memory_mib else
             f"has the exit status {status}" if status not in (0, 2, 3, 4) and not (status == 1 and sentence) else
             "was refused without a sentence" if status and not sentence else "")
    outcome = "baked" if status in (0, 3) else "refused"
    if a.keep:
        print(f"{number:4} {name:32} {outcome:8} {mib:5} MiB {seconds:6.1f} s  {sentence[:160]}  {folder}")
    else:
        shutil.rmtree(folder)
    if wrong:
        print(f"scene {number} (seed {a.seed}, {name}) {wrong}: {sentence or words[-300:]}", flush=True)
    return ("wrong" if wrong else outcome), mib, seconds


outcomes, most, longest = collections.Counter(), 0, 0
for number in [a.only] if a.only is not None else range(a.scenes):
    outcome, mib, seconds = judge(number)
    outcomes[outcome] += 1
    most, longest = max(most, mib), max(longest, seconds)
if not a.keep:
    shutil.rmtree(work)
print(f"{sum(outcomes.values())} scenes: {outcomes['baked']} baked, {outcomes['refused']} refused, {outcomes['wrong']} wrong; "
      f"at most {most} MiB and {longest:.1f} s")
sys.exit(1 if outcomes["wrong"] else 0)
