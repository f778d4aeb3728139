"""A farm that goes from one release to the next while it bakes."""
import json
import subprocess

from farm import Failed, Lab, Skipped, wait_until
from service import Service

ROWS = []


def next_release(programs):
    """Programs of the same sources that state another number (CMakeLists.txt), and both numbers."""
    folder = programs / "next"
    if not (folder / "kiln").exists() or not (folder / "kiln-stub-worker").exists():
        raise Skipped("the next release (bin/next) is not built")

    def number(program):
        return subprocess.run([program, "--version"], capture_output=True, text=True, check=True).stdout.split()[1].strip(",")

    here, there = number(programs / "kiln"), number(folder / "kiln")
    if here == there:
        raise Failed(f"both releases call themselves {here}")
    return folder, here, there


def undisturbed(lab, programs):
    """What a farm of one release publishes; an EXR file names the release that wrote it."""
    calm = Lab("truth-next", 991, programs, lab.folder / "truth-next", lab.rng)
    try:
        service = Service(calm)
        for _ in range(2):
            service.worker(calm.host(), stub="")
        job = service.submit()
        service.wait_state(job, "done")
        return service.fetch(job)
    finally:
        calm.end()


def releases(service):
    """Of the connected workers, by name."""
    status, out, _ = service.kiln("workers", "--json", check=False)
    return {w["name"]: w["release"] for w in json.loads(out)["workers"]} if status == 0 else {}


def rolling_upgrade(lab):
    folder, here, there = next_release(lab.programs)
    truth = undisturbed(lab, folder)
    service, host, stub = Service(lab), lab.host(), "slow=400"
    workers = [service.worker(host, stub=stub, name=f"old-{i}") for i in range(2)]
    job = service.submit()
    service.wait_units(job, 5)

    old = service.process  # first the coordinator, on the same folder; workers stay
    old.signal(15)
    if old.status(60) != 0:
        raise Failed(f"the coordinator ended with {old.status(60)}")
    service.words[0] = folder / "kiln"
    service.start()
    wait_until("both workers again", lambda: list(releases(service).values()).count(here) == 2, 90)
    stored = service.said(service.record(job), "unit results are already stored")
    with_status = json.loads(service.kiln("status", "--json")[1])
    if with_status["release"] != there:
        raise Failed(f"the coordinator is of release {with_status['release']}")
    service.wait_units(job, 5)

    lab.programs, programs = folder, lab.programs  # then the workers, one by one: SIGTERM drains
    try:
        for i, worker in enumerate(workers):
            service.worker(host, stub=stub, name=f"new-{i}")
            wait_until(f"worker new-{i}", lambda i=i: list(releases(service).values()).count(there) == i + 1, 60)
            worker.signal(15)
            if worker.status(60) != 0:
                raise Failed(f"a drained worker ended with {worker.status(60)}: {worker.log()[-200:]}")
        if service.record(job)["state"] == "done":
            raise Failed("the job ended before all was replaced")
        mixed = sorted(set(releases(service).values()))
        if mixed != [there]:
            raise Failed(f"workers of {mixed}")
    finally:
        lab.programs = programs
    service.finish(job, truth)
    return f"{stored.split(': ')[-1]} when the coordinator of {there} began; two workers of {here} drained; digest as undisturbed"


ROWS.append(("rolling-upgrade",
             "coordinator stopped (SIGTERM) and replaced by the next release on its folder, then workers one by one",
             False, rolling_upgrade))
