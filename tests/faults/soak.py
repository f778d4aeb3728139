#!/usr/bin/env python3
"""A farm of real processes among many faults at once, for as long as told: README.md.

usage: soak.py [--minutes M] [--seed N] [--plot FILE.svg] [--bin DIR] [--keep DIR]

`kiln serve` on a disk of its own and six stub workers bake job after job, each with --quorum 2, while every few
seconds something happens: a worker is killed, stopped or cut off, a link flips bits or is slow, somebody lies, the
disk is full, a bit of a stored file flips, and in the first third of the time the coordinator is killed or stopped.
Every job must end with the digest of an undisturbed bake, or say why not, and then end with it when it is retried.
Exit status: 0 all of that held, 1 it did not, 77 this machine cannot.
"""
import argparse
import os
import random
import shutil
import signal
import subprocess
import sys
import tempfile
import time
from collections import Counter
from pathlib import Path
from types import SimpleNamespace

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))
import run  # noqa: E402
from farm import Failed, Lab  # noqa: E402
from net import command  # noqa: E402
from rows_service import fill  # noqa: E402
from service import Service  # noqa: E402

VARIANTS = ((), ("--texels-per-metre", 6), ("--tile-texels", 8))
ATTEMPTS = 6  # a job may be hit again while it is retried
PAUSE_S = 2.5  # between faults, on average


class Machine:
    """A worker that is started again whenever it has ended."""

    def __init__(self, soak, name, stub="slow=120", through=None):
        self.soak, self.name, self.stub, self.through = soak, name, stub, through
        self.host = soak.lab.host()
        self.process, self.farm, self.stopped_until = None, None, 0
        self.start()

    def start(self):
        lab, service = self.soak.lab, self.soak.service
        self.process = lab.worker(self.host, self.farm or service, stub=self.stub, threads=2, through=self.through,
                                  name=self.name, patience=600, token=service.worker_token)
        if self.through:  # the relay goes on when the worker dies
            self.farm = SimpleNamespace(address=f"127.0.0.1:{20000 + lab.workers}")
            self.through = None

    def look(self, now):
        if self.stopped_until and now > self.stopped_until:
            self.process.signal(signal.SIGCONT)
            self.stopped_until = 0
        if self.process.ended():
            self.start()


class Soak:
    def __init__(self, options, folder):
        self.rng = random.Random(options.seed)
        self.end = time.monotonic() + options.minutes * 60
        self.deaths_until = time.monotonic() + options.minutes * 20
        self.lab = Lab("soak", 0, options.bin, folder / "soak", self.rng)
        self.data = self.lab.folder / "data"
        self.data.mkdir()
        command("mount", "-t", "tmpfs", "-o", "size=3000m", "none", self.data)
        self.done, self.said, self.faults, self.wrong = Counter(), Counter(), Counter(), []
        self.lives, self.began = [[]], time.monotonic()
        self.full_until = self.healed_at = 0
        self.sampled, self.stored = 0.0, 0

    def truths(self):
        """The digests of all variants, by a farm that nothing disturbs."""
        lab = Lab("truth", 1, self.lab.programs, self.lab.folder / "truth", self.rng)
        try:
            calm, found = Service(lab), []
            for _ in range(2):
                calm.worker(lab.host(), stub="")
            for variant in VARIANTS:
                job = calm.submit(*variant)
                calm.wait_state(job, "done")
                found.append(calm.fetch(job))
            return found
        finally:
            lab.end()

    # ---- faults

    def kill_worker(self):
        self.rng.choice(self.machines).process.kill()

    def stop_worker(self):
        machine = self.rng.choice(self.machines)
        if not machine.stopped_until:
            machine.process.signal(signal.SIGSTOP)
            machine.stopped_until = time.monotonic() + self.rng.uniform(2, 25)

    def cut_link(self):
        if not self.healed_at:
            self.lab.network.cut(self.rng.choice(self.machines).host, self.rng.choice(("both", "in", "out")))
            self.healed_at = time.monotonic() + self.rng.uniform(2, 25)

    def kill_coordinator(self):
        self.service.process.kill()
        self.restart()

    def stop_coordinator(self):
        self.service.process.signal(signal.SIGTERM)
        self.service.process.status(90)
        self.restart()

    def restart(self):
        self.service.start()
        self.lives.append([])

    def fill_disk(self):
        if not self.full_until:
            fill(self.data / "filler")
            self.full_until = time.monotonic() + self.rng.uniform(2, 12)

    def flip_stored_bit(self):
        """In an input, a unit's result or a published file; `kiln backup` is what there is against a rotten database."""
        files = sorted(f for folder in ("blobs", "spool") for f in (self.data / folder).rglob("*")
                       if f.is_file() and f.stat().st_size)
        if not files:
            return
        file = self.rng.choice(files)
        try:
            with open(file, "r+b", buffering=0) as stored:
                at = self.rng.randrange(file.stat().st_size)
                stored.seek(at)
                byte = stored.read(1)
                stored.seek(at)
                stored.write(bytes([byte[0] ^ 1 << self.rng.randrange(8)]))
        except (OSError, ValueError, IndexError):
            pass  # gone by now

    def disturb(self, now):
        kinds = [(self.kill_worker, 6), (self.stop_worker, 3), (self.cut_link, 3), (self.fill_disk, 1),
                 (self.flip_stored_bit, 4)]
        if now < self.deaths_until:
            kinds += [(self.kill_coordinator, 2), (self.stop_coordinator, 1)]
        (kind, _), = self.rng.choices(kinds, [weight for _, weight in kinds])
        self.faults[kind.__name__.replace("_", " ")] += 1
        kind()

    def mend(self, now, all_of_it=False):
        if self.healed_at and (all_of_it or now > self.healed_at):
            self.lab.network.heal()
            self.healed_at = 0
        if self.full_until and (all_of_it or now > self.full_until):
            (self.data / "filler").unlink(missing_ok=True)
            self.full_until = 0
        for machine in self.machines:
            machine.look(float("inf") if all_of_it else now)

    # ---- jobs

    def submit(self):
        variant = self.rng.randrange(len(VARIANTS))
        status, out, words = self.service.kiln("submit", self.service.scene(), *map(str, run.rows_service.BAKE),
                                               *map(str, VARIANTS[variant]), "--quorum", 2, check=False)
        if status:
            self.said["submit: " + sentence(words)] += 1
            return
        number = next(word for word in out.replace(",", " ").replace(":", " ").split() if word.isdigit())
        self.open[int(number)] = [variant, 0]

    def look_at_job(self, job):
        record = self.service.job(job)
        if record is None or record["state"] not in ("done", "failed", "cancelled") and not record.get("paused"):
            return
        variant, attempts = self.open[job]
        said = record["reason"]
        if record["state"] == "done":
            folder = self.lab.folder / f"fetched-{job}"
            shutil.rmtree(folder, ignore_errors=True)
            status, _, said = self.service.kiln("fetch", job, "-o", folder, check=False)
            if status == 0:
                if run.rows_service.digest_of(folder) != self.truth[variant]:
                    self.wrong.append(f"job {job} is done, and its map is another one")
                shutil.rmtree(folder)
                self.done["at once" if not attempts else "after a retry"] += 1
                del self.open[job]
                return
        if not said.strip():
            self.wrong.append(f"job {job} is {record['state']} and does not say why")
        self.said[f"{record['state']}: {sentence(said)}"] += 1
        if attempts == ATTEMPTS:
            self.wrong.append(f"job {job} does not come to an end: {said}")
            del self.open[job]
            return
        if "submit the scene again" in said:  # a stored input has rotted; a new submission sends it
            self.submit()
        status, _, words = self.service.kiln("retry", job, check=False)
        if status == 0:
            self.open[job][1] += 1
        elif "is not here" in words or "upload" in words or "submit" in words:  # an input is gone: a new job
            self.said[f"retry: {sentence(words)}"] += 1
            del self.open[job]
        else:
            self.said[f"retry: {sentence(words)}"] += 1

    def sample_memory(self, now):
        if now - self.sampled < 5:
            return
        self.sampled = now
        try:
            status = Path(f"/proc/{self.service.process.process.pid}/status").read_text()
        except OSError:
            return
        kib = next((int(line.split()[1]) for line in status.splitlines() if line.startswith("VmRSS")), None)
        if kib:
            self.lives[-1].append(((now - self.began) / 60, kib / 1024))

    def go(self):
        self.truth = self.truths()
        self.service = Service(self.lab, data=self.data, audit_first=10, keep_days=1)
        self.machines = [Machine(self, f"machine{i}") for i in range(4)]
        self.machines.append(Machine(self, "liar", "slow=120;wrong=%9"))
        self.machines.append(Machine(self, "damaged-link", through=["--flip-every", "200000"]))
        slow = Machine(self, "slow-link")
        self.lab.network.slow(slow.host, "4mbit")
        self.machines.append(slow)
        self.open, next_fault = {}, time.monotonic() + 10
        told = time.monotonic()
        while time.monotonic() < self.end:
            now = time.monotonic()
            self.mend(now)
            if self.service.process.ended():
                raise Failed(f"the coordinator ended by itself: {self.service.process.log()[-500:]}")
            if now > next_fault:
                self.disturb(now)
                next_fault = time.monotonic() + self.rng.expovariate(1 / PAUSE_S)
            if len(self.open) < 3 and not self.full_until:
                self.submit()
            for job in list(self.open):
                self.look_at_job(job)
            self.sample_memory(now)
            if now - told > 60:
                told = now
                print(f"{(now - self.began) / 60:5.1f} min  {sum(self.done.values())} jobs done, {len(self.open)} open, "
                      f"{sum(self.faults.values())} faults, {len(self.wrong)} wrong", flush=True)
            time.sleep(0.2)
        patience = time.monotonic() + 300
        while self.open and time.monotonic() < patience:
            self.mend(time.monotonic(), all_of_it=True)
            for job in list(self.open):
                self.look_at_job(job)
            self.sample_memory(time.monotonic())
            time.sleep(0.2)
        self.stored = sum(file.stat().st_size for file in self.data.rglob("*") if file.is_file())
        self.wrong += [f"job {job} does not end: {(self.service.job(job) or {}).get('state')}, "
                       f"{(self.service.job(job) or {}).get('reason')}" for job in self.open]


def sentence(words):
    """The first line without its numbers, so that the same sentence is counted once."""
    line = (words.strip().splitlines() or ["(nothing)"])[0]
    return "".join("N" if c.isdigit() else c for c in line)[:160]


def slope(points):
    """MiB an hour by least squares, over the second half of a life."""
    points = points[len(points) // 2:]
    mean_x, mean_y = (sum(p[i] for p in points) / len(points) for i in (0, 1))
    spread = sum((x - mean_x) ** 2 for x, _ in points)
    return 60 * sum((x - mean_x) * (y - mean_y) for x, y in points) / spread if spread else 0.0


def write_plot(path, lives):
    width, height, left, below = 720, 260, 50, 30
    last = max((p[0] for life in lives for p in life), default=1)
    most = max((p[1] for life in lives for p in life), default=1) * 1.15

    def at(minute, mib):
        return f"{left + minute / last * (width - left - 10):.1f},{height - below - mib / most * (height - below - 24):.1f}"

    step = 10 ** len(str(int(most))) / 20
    lines = [f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" font-family="sans-serif" '
             'font-size="11">', '<rect width="100%" height="100%" fill="white"/>']
    for i in range(int(most / step) + 1):
        x, y = at(0, i * step).split(",")
        lines.append(f'<path d="M{x},{y}H{width - 10}" stroke="#ddd"/><text x="{left - 6}" y="{float(y) + 4}" '
                     f'text-anchor="end">{i * step:g}</text>')
    for minute in range(0, int(last) + 1, max(1, int(last / 6))):
        x, _ = at(minute, 0).split(",")
        lines.append(f'<text x="{x}" y="{height - 14}" text-anchor="middle">{minute}</text>')
    lines.append(f'<text x="{width / 2}" y="{height - 2}" text-anchor="middle">minutes</text>')
    lines.append(f'<text x="6" y="12">resident memory of the coordinator, MiB; a line is one life of its process</text>')
    for life in lives:
        if life:
            lines.append(f'<polyline points="{" ".join(at(*p) for p in life)}" fill="none" stroke="#b5460f" '
                         'stroke-width="1.5"/>')
    Path(path).write_text("\n".join(lines + ["</svg>", ""]))


def report(soak):
    print(f"{sum(soak.done.values())} jobs published, all digests equal to the undisturbed bake: "
          + ", ".join(f"{count} {how}" for how, count in sorted(soak.done.items()))
          if not soak.wrong else f"{len(soak.wrong)} WRONG")
    print("faults: " + ", ".join(f"{count} {kind}" for kind, count in sorted(soak.faults.items()))
          + "; a liar, a link that flips bits and a link of 4 Mb/s all the time")
    for words, count in sorted(soak.said.items()):
        print(f"  {count:3} said {words}")
    print(f"the data folder: {soak.stored / 2**20:.0f} MiB")
    life = soak.lives[-1]
    if len(life) > 20:
        sizes = [mib for _, mib in life]
        print(f"the coordinator's last life: {life[-1][0] - life[0][0]:.0f} min, {life[0][1]:.0f} MiB at first, "
              f"{max(sizes):.0f} at most, {life[-1][1]:.0f} at the end; second half {slope(life):+.1f} MiB an hour")
    for words in soak.wrong:
        print(f"WRONG: {words}")


def main():
    root = Path(__file__).resolve().parents[2]
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--minutes", type=float, default=60)
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--plot", help="SVG of the coordinator's memory")
    parser.add_argument("--bin", type=Path, default=root / "build/bin")
    parser.add_argument("--keep", help="folder for logs; by default they go when all held")
    options = parser.parse_args()
    options.bin = options.bin.resolve()
    if not os.environ.get(run.INSIDE):
        run.enter()
    for words in (["mount", "-t", "tmpfs", "none", "/run"], ["ip", "link", "set", "lo", "up"]):
        subprocess.run(words, check=True)
    os.makedirs("/run/netns")
    folder = Path(options.keep or tempfile.mkdtemp(prefix="kiln-soak-"))
    soak = Soak(options, folder)
    try:
        soak.go()
    except Failed as error:
        soak.wrong.append(str(error))
    finally:
        soak.lab.end()
        if options.plot:
            write_plot(options.plot, soak.lives)
        report(soak)
    if soak.wrong or options.keep:
        print(f"logs: {folder}")
    else:
        subprocess.run(["umount", soak.data])
        shutil.rmtree(folder, ignore_errors=True)
    return 1 if soak.wrong else 0


if __name__ == "__main__":
    sys.exit(main())
