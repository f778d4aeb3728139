"""Faults of the coordinator and its data folder, and faults of workers as a person sees them: `kiln serve`."""
import os
import re
import signal
import subprocess
import time

from farm import Failed, false_clock, wait_until
from net import command
from rows_certificates import authority, issue, kiln
from service import BAKE, ENDED, Service, digest_of

LEASE_S = 15
ROWS = []


def row(name, what, quick=False):
    def add(function):
        ROWS.append((name, what, quick, function))
        return function

    return add


@row("serve", "nothing: submit, wait, fetch", quick=True)
def undisturbed(lab):
    service = Service(lab)
    service.worker(lab.host(), stub="slow=5")
    job = service.submit()
    service.finish(job)
    return "the digest that the other rows must reach, by one worker instead of two"


def kill_at_random(lab, service, job):
    """One of three moments: any, while results come in, while the job is published."""
    rng, folder = lab.rng, service.data / "work" / str(job) / "out"
    moment = rng.choice(("any", "results", "results", "publish"))
    if moment == "any":
        time.sleep(rng.uniform(0, 1.5))
    elif moment == "results":
        before = service.units_done(job)
        wait_until("results", lambda: service.units_done(job) > min(before, ENDED - 1) or folder.exists(), 60)
        time.sleep(rng.uniform(0, 0.5))
    else:
        wait_until("the publishing", lambda: folder.exists() or service.units_done(job) == ENDED, 120)
        time.sleep(rng.uniform(0, 0.15))
    service.process.kill()
    return moment


@row("coordinator-kill", "the coordinator killed (SIGKILL) at random moments, also while it commits and publishes",
     quick=True)
def coordinator_kill(lab):
    service = Service(lab)
    for _ in range(3):
        service.worker(lab.host(), stub="slow=60", threads=2)
    truth = service.truth()
    moments, jobs, job = {}, 0, None
    for _ in range(lab.kills):
        if job is None:
            job = service.submit()
            jobs += 1
        moment = kill_at_random(lab, service, job)
        moments[moment] = moments.get(moment, 0) + 1
        service.start()
        record = service.record(job)
        if record["state"] == "failed":
            if "died" not in record["reason"]:
                raise Failed(f"job {job} failed: {record['reason']}")
            moments["retried after ten deaths in a row"] = 1 + moments.get("retried after ten deaths in a row", 0)
            service.kiln("retry", job)
        if record["state"] == "queued" and record.get("paused"):
            moments["kept after ten failures to finish"] = 1 + moments.get("kept after ten failures to finish", 0)
            service.kiln("retry", job)
        if record["state"] == "done":
            if service.fetch(job) != truth:
                raise Failed(f"job {job}: another digest")
            job = None
    if job is not None:
        service.wait_state(job, "done")
    else:
        job = service.submit()
        jobs += 1
    record = service.finish(job, truth)
    read_back = [e["text"] for e in record["events"] if "are already stored" in e["text"]]
    counts = ", ".join(f"{count} {moment}" for moment, count in sorted(moments.items()))
    return f"{lab.kills} deaths ({counts}) over {jobs} jobs, every digest equal; {'; '.join(read_back[-1:])}"


def fill(file):
    """To the last page of its file system."""
    with open(file, "wb", buffering=0) as filler:
        for piece in (1 << 20, 4096):
            try:
                while filler.write(b"\0" * piece) == piece:
                    pass
            except OSError:
                pass


def with_full_disk(lab, stub, reached):
    data = lab.folder / "data"
    data.mkdir()
    command("mount", "-t", "tmpfs", "-o", "size=1200m", "none", data)
    service = Service(lab, data=data)
    for _ in range(2):
        service.worker(lab.host(), stub=stub)
    job = service.submit()
    reached(service, job)
    fill(data / "filler")

    def reason():
        record = service.job(job)
        if record is None:
            return None
        if record["state"] in ("done", "failed", "cancelled"):
            raise Failed(f"the job did not wait: {record['state']}, {record['reason']}")
        return record if "disk" in record["reason"] or "space" in record["reason"] else None

    held = wait_until("the reason", reason, 60)
    time.sleep(3)
    waiting = service.record(job)
    if waiting["state"] in ("done", "failed", "cancelled"):
        raise Failed(f"the job did not wait: {waiting['state']}, {waiting['reason']}")
    os.remove(data / "filler")
    service.finish(job)
    return f"the job, {held['state']}, says: {held['reason']}; with space again it goes on by itself"


@row("disk-full", "the data folder's file system (tmpfs) full while results come in", quick=True)
def disk_full(lab):
    return with_full_disk(lab, "slow=150", lambda service, job: service.wait_units(job, 10))


@row("disk-full-publish", "the same, full from when the results are merged and written")
def disk_full_publish(lab):
    def nearly(service, job):
        work = service.data / "work" / str(job)
        wait_until("the last units", lambda: service.units_done(job) > 380 or (work / "out").exists(), 60)

    return with_full_disk(lab, "slow=20", nearly)


@row("disk-full-start", "killed (SIGKILL) while it bakes, then started on a disk that is full to the last byte")
def disk_full_start(lab):
    data = lab.folder / "data"
    data.mkdir()
    command("mount", "-t", "tmpfs", "-o", "size=1200m", "none", data)
    service = Service(lab, data=data)
    truth = service.truth()
    for _ in range(2):
        service.worker(lab.host(), stub="slow=40")
    first = service.submit()
    service.wait_state(first, "done")
    second = service.submit()
    service.wait_units(second, 10)
    service.process.kill()
    fill(data / "filler")
    service.start()
    if service.fetch(first) != truth:
        raise Failed("what is fetched from the full disk is another map")
    if "takes nothing until there is space" not in service.process.log():
        raise Failed(f"the disk was not full: {service.process.log()[-300:]}")
    fillers = [data / "filler"]

    def refusal():
        # The store empties its log into the database, which gives some space back: that goes too.
        fillers.append(data / f"filler-{len(fillers)}")
        fill(fillers[-1])
        status, _, words = service.kiln("submit", service.scene(), *BAKE, check=False)
        return words if status else None

    refusal = wait_until("a refusal", refusal, 60)
    held = wait_until("the reason", lambda: (record := service.job(second)) and record["reason"] and record, 60)
    if "cannot be written" not in held["reason"] and "space" not in held["reason"]:
        raise Failed(f"the job's reason is '{held['reason']}'")
    for filler in fillers:
        os.remove(filler)
    service.finish(second, truth)
    return f"results are listed and fetched; a new job: {refusal.strip()}; the other, {held['state']}, says: " \
           f"{held['reason']}; with space again it goes on by itself"


@row("two-coordinators", "a second kiln serve on one data folder", quick=True)
def two_coordinators(lab):
    service = Service(lab)
    service.worker(lab.host(), stub="slow=10")
    job = service.submit()
    done = subprocess.run([lab.programs / "kiln", "serve", "--data", service.data, "--listen", "127.0.0.1:0"],
                          capture_output=True, text=True, timeout=30)
    if done.returncode == 0:
        raise Failed("the second one serves as well")
    service.finish(job)
    return f"it ends with status {done.returncode}: {done.stderr.strip()}"


def with_real_workers(lab, disturb):
    service = Service(lab)
    workers = [service.worker(lab.host(), program="kiln-worker", stub="", threads=1) for _ in range(2)]
    job = service.submit("--min-samples", 4096, "--max-samples", 4096)
    service.wait_units(job, 5)
    disturb(service, workers)
    kiln(lab, "bake", service.scene(), *BAKE, "--min-samples", 4096, "--max-samples", 4096, "--quiet", "-o",
         lab.folder / "local")
    service.finish(job, digest_of(lab.folder / "local"))
    return "the files of a local `kiln bake`"


@row("real-worker-kill", "one of two kiln-worker with Embree killed; against a local bake")
def real_worker_kill(lab):
    return with_real_workers(lab, lambda service, workers: workers[0].signal(signal.SIGKILL))


@row("real-coordinator-kill", "the coordinator of two kiln-worker with Embree killed; against a local bake")
def real_coordinator_kill(lab):
    def disturb(service, workers):
        service.process.kill()
        service.start()

    return with_real_workers(lab, disturb)


@row("serve-worker-kill", "worker killed; kiln serve")
def serve_worker_kill(lab):
    service = Service(lab)
    workers = [service.worker(lab.host(), stub="slow=150") for _ in range(2)]
    job = service.submit()
    service.wait_units(job, 10)
    workers[0].signal(signal.SIGKILL)
    return service.said(service.finish(job), "worker-1", "lost")


@row("serve-worker-stop", "worker stopped for 20 s, 5 s beyond its lease, then continued; kiln serve")
def serve_worker_stop(lab):
    service = Service(lab)
    workers = [service.worker(lab.host(), stub="slow=300") for _ in range(2)]
    job = service.submit()
    service.wait_units(job, 10)
    workers[0].signal(signal.SIGSTOP)
    time.sleep(LEASE_S + 5)
    why = service.kiln("why", "worker", "worker-1", check=False)[1].strip().replace("\n", "; ")
    workers[0].signal(signal.SIGCONT)
    record = service.finish(job)
    return f"{service.said(record, 'worker-1', 'silent')}; meanwhile `kiln why worker worker-1`: {why}"


@row("serve-partition", "partition of a worker for its lease and 4 s; kiln serve")
def serve_partition(lab):
    service = Service(lab)
    hosts = [lab.host(), lab.host()]
    for host in hosts:
        service.worker(host, stub="slow=300")
    job = service.submit()
    service.wait_units(job, 10)
    lab.network.cut(hosts[0])
    time.sleep(LEASE_S + 4)
    lab.network.heal()
    return service.said(service.finish(job), "worker-1", "silent")


@row("serve-liar", "wrong radiance for every 7th unit; kiln serve --audit-first 10")
def serve_liar(lab):
    service = Service(lab, audit_first=10)
    liar = service.worker(lab.host(), stub="slow=40;wrong=%7", name="liar")
    wait_until("the liar", lambda: "connected" in liar.log(), 30)
    for _ in range(3):
        service.worker(lab.host(), stub="slow=40")
    job = service.submit()
    service.wait_state(job, "done")
    workers = service.kiln("workers")[1]
    quarantined = next((line for line in workers.splitlines() if "quarantined" in line), None)
    if not quarantined:
        raise Failed(f"nobody is quarantined: {workers}")
    service.finish(job)
    return quarantined


@row("serve-poison", "a unit that kills every worker; kiln submit --on-poison skip")
def serve_poison(lab):
    service = Service(lab)
    hosts = [lab.host() for _ in range(4)]
    workers = {host: service.worker(host, stub="slow=20;crash=5") for host in hosts}
    job = service.submit("--on-poison", "skip")
    deaths, ended = 0, None
    while not ended:
        for host, worker in list(workers.items()):
            if worker.ended():
                deaths += 1
                if deaths > 20:
                    raise Failed("the poisonous unit goes on killing")
                workers[host] = service.worker(host, stub="slow=20;crash=5")
        record = service.job(job)
        ended = record if record and record["state"] in ("done", "failed") else None
        time.sleep(0.2)
    if ended["state"] != "done":
        raise Failed(f"{ended['state']}: {ended['reason']}")
    return f"{deaths} deaths; {service.said(ended, 'unit 5')}"


@row("serve-clock", "the clock of kiln serve moved an hour ahead and back")
def serve_clock(lab):
    environment, clock = false_clock(lab.folder, "serve")
    service = Service(lab, environment=environment)
    for _ in range(2):
        service.worker(lab.host(), stub="slow=40")
    job = service.submit()
    service.wait_units(job, 10)
    clock.write_text("+1h\n")
    time.sleep(2)
    clock.write_text("-1h\n")
    record = service.finish(job)
    lost = [e["text"] for e in record["events"] if "silent" in e["text"] or "lost" in e["text"]]
    if lost:
        raise Failed(f"a lease ended: {lost[0]}")
    return "no lease ended, no worker was lost"


@row("serve-descriptors", "256 file descriptors for kiln serve, 300 workers")
def serve_descriptors(lab):
    service = Service(lab, descriptors=256)
    host = lab.host()
    first = [service.worker(host, threads=1, stub="slow=400") for _ in range(20)]
    job = service.submit()
    service.wait_units(job, 20)
    late = [service.worker(host, threads=1, stub="slow=400") for _ in range(280)]
    wait_until("a word of the coordinator", lambda: "file descriptors" in service.process.log(), 120)
    time.sleep(5)  # those that were turned away try again and again
    log = service.process.log()
    if " was lost" in log or any(worker.ended() for worker in first):
        raise Failed("a worker was lost")
    for worker in late:  # people are turned away as well: make room for their questions
        worker.kill()
    service.finish(job)
    said = next(line for line in log.splitlines() if "file descriptors" in line)
    return f"{log.count(' joined with ')} workers are in and stay, others are turned away; {said.split('warning: ')[-1]}"


@row("serve-token", "a person with a wrong token, a person with a worker's token, a worker with a person's",
     quick=True)
def serve_token(lab):
    service = Service(lab)
    (service.data / "guessed").write_text("a-token-that-was-guessed\n")
    answers = []
    for token in ("guessed", "worker.token"):
        status, _, words = service.kiln("jobs", token=token, check=False)
        if status == 0:
            raise Failed(f"{token} lets a person in")
        answers.append(words.strip())
    worker = service.lab.worker(lab.host(), service, token=(service.data / "submit.token").read_text().strip(),
                                name="refused", patience=5)
    if worker.status(30) == 0:
        raise Failed("a person's token lets a worker in")
    service.worker(lab.host(), stub="slow=5")
    service.finish(service.submit())
    return f"{answers[0]} | {answers[1]} | {worker.log().strip().splitlines()[-1]}"


@row("serve-join", "a machine and a person join a farm by token; the worker's token a second time", quick=True)
def serve_join(lab):
    authority(lab)
    own = issue(lab, "coordinator", "certified", host=lab.network.center.address)
    service = Service(lab, tls=own, person=issue(lab, "admin", "root"), authority=lab.folder / "ca")

    def join(file, name):
        return service.kiln("cert", "join", "--server", service.address, "--token-file", file, "--name", name, "-o",
                            lab.folder / name, check=False)

    for role, name in (("worker", "render1"), ("submit", "ada")):
        file = lab.folder / f"{name}.token"
        file.write_text(kiln(lab, "cert", "token", "--dir", lab.folder / "ca", "--role", role))
        status, _, words = join(file, name)
        if status:
            raise Failed(f"{name} cannot join: {words}")
    status, _, words = join(lab.folder / "render1.token", "render2")
    if status == 0:
        raise Failed("a token of one use was good twice")
    service.person = lab.folder / "ada"
    service.worker(lab.host(), stub="slow=5", tls=lab.folder / "render1")
    service.finish(service.submit())
    return f"the bake ends; the second time: {words.strip()}"


@row("serve-tls", "kiln serve with certificates; a worker's certificate in a person's place", quick=True)
def serve_tls(lab):
    authority(lab)
    own = issue(lab, "coordinator", "certified", host=lab.network.center.address)
    worker, person = issue(lab, "worker", "render1"), issue(lab, "submit,read", "ada")
    service = Service(lab, tls=own, person=person)
    service.worker(lab.host(), stub="slow=5", tls=worker)
    job = service.submit()
    service.person = worker
    status, _, words = service.kiln("jobs", check=False)
    if status == 0:
        raise Failed("a worker's certificate may list jobs")
    service.person = person
    service.finish(job)
    return f"the bake ends; with the worker's certificate: {words.strip()}"


@row("serve-revoked", "a worker's and a person's certificate revoked while they are connected", quick=True)
def serve_revoked(lab):
    authority(lab)
    own = issue(lab, "coordinator", "certified", host=lab.network.center.address)
    stolen, worker, ada = issue(lab, "worker", "stolen"), issue(lab, "worker", "render1"), issue(lab, "submit", "ada")
    service = Service(lab, tls=own, person=issue(lab, "admin", "root"), authority=lab.folder / "ca")
    thief = service.worker(lab.host(), stub="slow=60", tls=stolen, name="thief")
    job = service.submit()
    service.wait_units(job, 3)
    kiln(lab, "cert", "revoke", "stolen", "--dir", lab.folder / "ca")
    kiln(lab, "cert", "revoke", "ada", "--dir", lab.folder / "ca")
    status = thief.status(30)
    if status != 2 or "revoked" not in thief.log():
        raise Failed(f"the revoked worker: status {status}, {thief.log()[-200:]}")
    service.worker(lab.host(), stub="slow=5", tls=worker)
    root, service.person = service.person, ada
    status, _, words = service.kiln("jobs", check=False)
    if status == 0:
        raise Failed("a revoked person may list jobs")
    service.person = root
    record = service.finish(job)
    return f"{service.said(record, 'stolen', 'revoked')}; the person: {words.strip()}"
