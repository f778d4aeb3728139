"""Who may come: certificates of `kiln cert`, with TLS between the machines."""
import subprocess

from farm import Failed, FaultFarm, Skipped, clean_environment, false_clock
from rows_workers import finish

ROWS = []


def row(name, what, quick=False):
    def add(function):
        ROWS.append((name, what, quick, function))
        return function

    return add


def kiln(lab, *words, environment=None):
    program = lab.programs / "kiln"
    if not program.exists():
        raise Skipped("kiln is not built")
    done = subprocess.run([str(program), *map(str, words)], capture_output=True, text=True, cwd=lab.folder,
                          env={**clean_environment(), **(environment or {})})
    if done.returncode:
        raise Failed(f"kiln {' '.join(map(str, words))}: {done.stderr.strip()}")
    return done.stdout


def authority(lab, name="ca", environment=None):
    kiln(lab, "cert", "ca", "--dir", lab.folder / name, environment=environment)


def issue(lab, role, name, ca="ca", environment=None, **options):
    words = [x for key, value in options.items() for x in (f"--{key}", value)]
    kiln(lab, "cert", "issue", "--dir", lab.folder / ca, "--role", role, "--name", name, "-o", lab.folder / name,
         *words, environment=environment)
    return lab.folder / name


def tls_farm(lab, environment=None):
    authority(lab, environment=environment)
    own = issue(lab, "coordinator", "certified", host=lab.network.center.address, environment=environment)
    return FaultFarm(lab, tls=own), issue(lab, "worker", "good", environment=environment)


def refused(lab, farm, good, bad, words, environment=None):
    worker = lab.worker(lab.host(), farm, tls=bad, name="refused", patience=3, environment=environment)
    code = worker.status(60)
    log = worker.log() + farm.process.log()
    said = next((line for line in log.splitlines() if all(w in line for w in words)), None)
    if code == 0 or not said:
        raise Failed(f"status {code}, said: {worker.log()[-300:]} coordinator: {farm.process.log()[-200:]}")
    lab.worker(lab.host(), farm, tls=good)
    finish(farm)
    return f"the worker ends with status {code}: {said.split('] ')[-1]}"


@row("tls", "certificates on both sides", quick=True)
def tls(lab):
    farm, good = tls_farm(lab)
    lab.worker(lab.host(), farm, tls=good)
    outcome = finish(farm)
    return f"{outcome['units']} units over TLS 1.3"


def old_farm(lab):
    """A farm of three days ago, and a worker's certificate that ended two days ago."""
    past, clock = false_clock(lab.folder, "past")
    clock.write_text("-3d\n")
    farm, good = tls_farm(lab, past)
    return farm, good, issue(lab, "worker", "old", days=1, environment=past), past


@row("expired", "the worker's certificate ended two days ago", quick=True)
def expired(lab):
    farm, good, bad, _ = old_farm(lab)
    return refused(lab, farm, good, bad, ["expired"])


@row("expired-late", "the same, on a machine whose clock is three days late", quick=True)
def expired_late(lab):
    farm, good, bad, past = old_farm(lab)
    return refused(lab, farm, good, bad, ["finds", "expired"], environment=past)


@row("wrong-authority", "the worker's certificate is another authority's", quick=True)
def wrong_authority(lab):
    farm, good = tls_farm(lab)
    authority(lab, "other")
    return refused(lab, farm, good, issue(lab, "worker", "stranger", ca="other"), ["authority"])


@row("wrong-role", "a person's certificate in a worker's place", quick=True)
def wrong_role(lab):
    farm, good = tls_farm(lab)
    return refused(lab, farm, good, issue(lab, "submit", "ada"), ["worker"])


@row("plain-to-tls", "a worker without certificates at a farm with them", quick=True)
def plain_to_tls(lab):
    farm, good = tls_farm(lab)
    return refused(lab, farm, good, None, ["TLS"])
