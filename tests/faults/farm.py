"""Processes of a row: the coordinator, workers, and what is read of them afterwards."""
import json
import os
import resource
import subprocess
import sys
import threading
import time
from pathlib import Path

from net import HERE, Network, command

FAKETIME = Path("/usr/lib/x86_64-linux-gnu/faketime/libfaketimeMT.so.1")
TOKEN = "token-of-the-fault-tests"


class Failed(Exception):
    """What must hold did not."""


class Skipped(Exception):
    """The row cannot run on this machine, and why."""


def wait_until(what, condition, patience_s):
    """Waits for a fact, never for a time; the patience only ends rows that hang."""
    end = time.monotonic() + patience_s
    while time.monotonic() < end:
        value = condition()
        if value:
            return value
        time.sleep(0.02)
    raise Failed(f"{what} did not come in {patience_s} s")


def clean_environment():
    return {k: v for k, v in os.environ.items() if not k.startswith("KILN_")}


def false_clock(folder, name):
    """Environment of a program whose wall clock reads what the file says, and that file."""
    if not FAKETIME.exists():
        raise Skipped("libfaketime is not installed (package faketime)")
    file = folder / f"{name}.clock"
    file.write_text("+0\n")
    return {"LD_PRELOAD": str(FAKETIME), "FAKETIME_TIMESTAMP_FILE": str(file), "FAKETIME_CACHE_DURATION": "1",
            "FAKETIME_DONT_FAKE_MONOTONIC": "1"}, file


class Process:
    def __init__(self, host, words, log, environment=None, descriptors=None):
        self.log_path = log

        def limit():
            if descriptors:
                resource.setrlimit(resource.RLIMIT_NOFILE, (descriptors, descriptors))

        with open(log, "ab") as out:
            self.process = subprocess.Popen(host.wrap(words), env={**clean_environment(), **(environment or {})},
                                            stdout=out, stderr=out, stdin=subprocess.DEVNULL, preexec_fn=limit)

    def signal(self, number):
        self.process.send_signal(number)

    def ended(self):
        return self.process.poll() is not None

    def status(self, patience_s):
        try:
            return self.process.wait(patience_s)
        except subprocess.TimeoutExpired:
            raise Failed(f"{self.log_path.stem} did not end in {patience_s} s") from None

    def kill(self):
        if not self.ended():
            self.process.kill()
            self.process.wait()

    def log(self):
        return self.log_path.read_text(errors="replace") if self.log_path.exists() else ""


class Lab:
    """A row's machines, processes and files."""

    def __init__(self, name, number, programs, folder, rng):
        self.name, self.programs, self.folder, self.rng = name, programs, folder, rng
        self.folder.mkdir(parents=True)
        self.network = Network(f"r{number}")
        self.processes = []
        self.workers = 0

    def start(self, host, words, name, **options):
        process = Process(host, words, self.folder / f"{name}.log", **options)
        self.processes.append(process)
        return process

    def host(self, **wire):
        return self.network.host(wire or None)

    def worker(self, host, farm, stub="slow=40", threads=2, through=None, program="kiln-stub-worker", token=TOKEN,
               tls=None, environment=None, patience=60, name=None):
        """`through`: options of wire.py relay, on the worker's machine."""
        self.workers += 1
        name = name or f"worker-{self.workers}"
        address = farm.address
        if through is not None:
            port = 20000 + self.workers
            self.start(host, [sys.executable, HERE / "wire.py", "relay", port, address, *through], f"relay-{name}")
            wait_until("the relay", lambda: str(port) in
                       command(*host.wrap(["ss", "-ltn"])).stdout, 20)
            address = f"127.0.0.1:{port}"
        words = [self.programs / program, "--cache", self.folder / f"cache-{name}", "--name", name,
                 "--threads", threads, "--patience", patience]
        variables = {"KILN_CONNECT": address, "KILN_STUB": stub, **(environment or {})}
        if tls:
            words += ["--ca", tls / "ca.pem", "--certificate", tls / "cert.pem", "--key", tls / "key.pem"]
        else:
            variables["KILN_TOKEN"] = token
        return self.start(host, words, name, environment=variables)

    def end(self):
        for process in self.processes:
            process.kill()
        self.network.end()


class FaultFarm:
    """kiln-fault-farm on the row's central machine: a bake of `units` units without a store."""

    _truth, _lock = {}, threading.Lock()

    def __init__(self, lab, units=200, lease_ms=3000, environment=None, descriptors=None, tls=None, **options):
        self.lab, self.units, self.folder = lab, units, lab.folder / "farm"
        self.folder.mkdir()
        (self.folder / "token").write_text(TOKEN)
        words = [lab.programs / "kiln-fault-farm", self.folder, "--listen", lab.network.center.address, "--units",
                 units, "--lease", lease_ms]
        if tls:
            options |= {"ca": tls / "ca.pem", "certificate": tls / "cert.pem", "key": tls / "key.pem"}
        for name, value in options.items():
            words += ["--" + name.replace("_", "-"), value]
        self.process = lab.start(lab.network.center, words, "coordinator", environment=environment,
                                 descriptors=descriptors)

        def listening():
            if self.process.ended():
                raise Failed(f"the coordinator ended: {self.process.log()[-300:]}")
            return (self.folder / "address").exists()

        wait_until("the coordinator's address", listening, 30)
        self.address = (self.folder / "address").read_text().strip()

    def done(self):
        file = self.folder / "done"
        return int(file.read_text() or 0) if file.exists() else 0

    def wait_done(self, count, patience_s=90):
        return wait_until(f"unit {count}", lambda: self.done() >= count or self.process.ended(), patience_s)

    def outcome(self, patience_s=120):
        self.process.status(patience_s)
        file = self.folder / "outcome.json"
        if not file.exists():
            raise Failed(f"no outcome: {self.process.log()[-300:]}")
        return Outcome(json.loads(file.read_text()))

    def truth(self):
        """The digest of a bake that nothing disturbs."""
        with FaultFarm._lock:
            if self.units not in FaultFarm._truth:
                lab = Lab("truth", 900 + len(FaultFarm._truth), self.lab.programs,
                          self.lab.folder / "truth", self.lab.rng)
                try:
                    farm = FaultFarm(lab, self.units)
                    for _ in range(2):
                        lab.worker(lab.host(), farm, stub="")
                    FaultFarm._truth[self.units] = farm.outcome()["digest"]
                finally:
                    lab.end()
            return FaultFarm._truth[self.units]

    def expect_truth(self, outcome):
        if outcome["error"]:
            raise Failed(f"the bake failed: {outcome['error']}")
        if not outcome["digest"] or outcome["digest"] != self.truth():
            raise Failed(f"digest {outcome['digest'][:16]}, undisturbed {self.truth()[:16]}")


class Outcome(dict):
    def event(self, *words):
        """The first event with all the words."""
        for line in self["events"] + self["why"]:
            if all(w in line for w in words):
                return line
        raise Failed(f"nothing was said of {words}: " + " | ".join(self["events"][-12:]))
