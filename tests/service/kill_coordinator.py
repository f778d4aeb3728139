#!/usr/bin/env python3
"""Kills a coordinator (SIGKILL) at random moments while it bakes and holds the results against a local bake.

    python3 tests/service/kill_coordinator.py --bin build/bin --kills 100

Prints the seed, the kills and what the jobs' events say; exit status 0 if every master file has the digest of
the local bake. Only processes that this script started are killed, by their ids."""
import argparse, hashlib, json, os, random, re, shutil, signal, subprocess, sys, tempfile, time

here = os.path.dirname(os.path.abspath(__file__))
p = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
p.add_argument("--bin", default="build/bin")
p.add_argument("--kills", type=int, default=100)
p.add_argument("--seed", type=int, default=None)
p.add_argument("--scene", default=os.path.join(here, "../scenes/arcade/arcade.gltf"))
p.add_argument("--longest", type=float, default=0.7, help="seconds a coordinator lives at most")
p.add_argument("options", nargs="*", help="of the bake, after --")
a = p.parse_args()
seed = a.seed if a.seed is not None else random.SystemRandom().randrange(1 << 32)
rng = random.Random(seed)
options = a.options or ["--layout", "pack", "--texels-per-metre", "2", "--min-samples", "1024",
                        "--max-samples", "4096", "--tile-texels", "4"]
kiln = os.path.join(a.bin, "kiln")
work = tempfile.mkdtemp(prefix="kiln-kill-")
data = os.path.join(work, "data")
worker_log = open(os.path.join(work, "workers.log"), "w")


def run(*command, check=True):
    env = dict(os.environ, KILN_SERVER=f"127.0.0.1:{port}", KILN_TOKEN_FILE=os.path.join(data, "admin.token"))
    r = subprocess.run([kiln, *command], capture_output=True, text=True, env=env, timeout=120)
    if check and r.returncode:
        raise SystemExit(f"seed {seed}: kiln {' '.join(command)} failed: {r.stderr}")
    return r


def serve():
    """Starts a coordinator on the same port as before and waits until it says where it is."""
    child = subprocess.Popen([kiln, "serve", "--data", data, "--listen", f"127.0.0.1:{port}", "--audit-first", "0"],
                             stdout=subprocess.PIPE, stderr=worker_log, text=True)
    line = child.stdout.readline()
    if "serves" not in line:
        raise SystemExit(f"seed {seed}: the coordinator did not start: {line}")
    return child, int(re.search(r":(\d+)", line.split(" at ")[1]).group(1))


def digests(folder):
    """Of the master files, by name."""
    report = json.load(open(os.path.join(folder, "report.json")))
    names = [f["file"] for f in report["outputs"] if f.get("master")]
    return {n: hashlib.sha256(open(os.path.join(folder, n), "rb").read()).hexdigest() for n in names}


subprocess.run([kiln, "bake", a.scene, "-o", os.path.join(work, "local"), "--quiet", *options], check=True,
               stdout=subprocess.DEVNULL)
reference = digests(os.path.join(work, "local"))
port = 0
server, port = serve()
worker = subprocess.Popen([os.path.join(a.bin, "kiln-worker"), "--connect", f"127.0.0.1:{port}", "--threads", "2",
                           "--token-file", os.path.join(data, "worker.token")],
                          stdout=worker_log, stderr=worker_log)
kills = retries = jobs = 0
status = 1
try:
    while kills < a.kills:
        jobs += 1
        job = str(json.loads(run("submit", a.scene, "--json", *options).stdout)["id"])
        while True:
            state = json.loads(run("jobs", job, "--json").stdout)
            if state["state"] == "done":
                break
            if state["state"] == "failed":
                # Ten deaths without a new result: the rule against crash loops. A person would try again.
                if "died ten times" not in state["reason"]:
                    raise SystemExit(f"seed {seed}: job {job} failed: {state['reason']}")
                run("retry", job)
                retries += 1
            if state["state"] == "queued" and state["paused"]:
                # The same rule for a job whose units are all baked: ten deaths while it is finished.
                if "failed ten times" not in state["reason"]:
                    raise SystemExit(f"seed {seed}: job {job} waits: {state['reason']}")
                run("retry", job)
                retries += 1
            if kills < a.kills:
                time.sleep(rng.uniform(0, a.longest))
                server.send_signal(signal.SIGKILL)
                server.wait()
                kills += 1
                server, port = serve()
            else:
                time.sleep(0.2)
        out = os.path.join(work, f"out{job}")
        run("fetch", job, "-o", out)
        if digests(out) != reference:
            raise SystemExit(f"seed {seed}: job {job} differs from the local bake after {kills} kills")
    server.send_signal(signal.SIGTERM)
    if server.wait(timeout=40) != 0:
        raise SystemExit(f"seed {seed}: the coordinator ended with {server.returncode} after SIGTERM")
    print(f"seed {seed}: {kills} kills, {jobs} jobs, {retries} retries, {len(reference)} master files equal")
    status = 0
finally:
    for child in (server, worker):
        if child.poll() is None:
            child.kill()
            child.wait()
    if status == 0:
        shutil.rmtree(work)
    else:
        print(f"kept: {work}", file=sys.stderr)
