"""Faults of workers' processes and networks, at leases of seconds (kiln-fault-farm)."""
import signal
import time

from farm import Failed, FaultFarm, false_clock, wait_until

LEASE_MS = 3000
ROWS = []


def row(name, what, quick=False):
    def add(function):
        ROWS.append((name, what, quick, function))
        return function

    return add


def finish(farm, patience_s=120):
    """Waits for the end, holds the digest against the undisturbed one."""
    outcome = farm.outcome(patience_s)
    farm.expect_truth(outcome)
    return outcome


def two_workers(lab, farm, **options):
    """A machine that the row disturbs and one that it does not."""
    hosts = lab.host(), lab.host()
    workers = [lab.worker(host, farm, **options) for host in hosts]
    return hosts, workers


@row("worker-kill", "worker killed (SIGKILL)", quick=True)
def worker_kill(lab):
    farm = FaultFarm(lab, lease_ms=60000)  # the death is seen by the connection; a slow machine is not silence
    _, workers = two_workers(lab, farm)
    farm.wait_done(lab.rng.randrange(20, 120))
    workers[0].signal(signal.SIGKILL)
    outcome = finish(farm)
    if outcome["workers_lost"] != 1:
        raise Failed(f"{outcome['workers_lost']} workers lost")
    return outcome.event("worker-1", "lost")


@row("worker-stop", "worker stopped (SIGSTOP) for its lease and 5 s more, then continued", quick=True)
def worker_stop(lab):
    farm = FaultFarm(lab, units=1000)  # more than the other worker bakes meanwhile
    _, workers = two_workers(lab, farm)
    farm.wait_done(lab.rng.randrange(20, 100))
    workers[0].signal(signal.SIGSTOP)
    time.sleep(LEASE_MS / 1000 + 5)
    workers[0].signal(signal.SIGCONT)
    outcome = finish(farm)
    silent, back = outcome.event("worker-1", "silent"), outcome.event("worker-1", "back")
    return f"{silent}; {back}; {outcome['duplicates']} late results were held against the committed ones and dropped"


def partition(lab, way):
    farm = FaultFarm(lab, units=500)
    hosts, _ = two_workers(lab, farm)
    farm.wait_done(lab.rng.randrange(20, 100))
    lab.network.cut(hosts[0], way)
    time.sleep(LEASE_MS / 1000 + 4)
    lab.network.heal()
    outcome = finish(farm)
    return f"{outcome.event('worker-1', 'silent')}; {outcome['reassigned']} units went to others, " \
           f"{outcome['duplicates']} came twice"


@row("partition", "partition of a worker, both ways, for its lease and 4 s", quick=True)
def partition_both(lab):
    return partition(lab, "both")


@row("partition-in", "one-way partition: what the worker says is lost", quick=True)
def partition_in(lab):
    return partition(lab, "in")


@row("partition-out", "one-way partition: what the worker is told is lost", quick=True)
def partition_out(lab):
    farm = FaultFarm(lab, units=500)
    hosts, _ = two_workers(lab, farm)
    farm.wait_done(lab.rng.randrange(20, 100))
    lab.network.cut(hosts[0], "out")
    time.sleep(LEASE_MS / 1000 + 4)
    lab.network.heal()
    outcome = finish(farm)
    return f"{outcome['reassigned']} units went to others, {outcome['duplicates']} came twice"


@row("flapping", "a worker's link down 1 s, up 1 s, eight times")
def flapping(lab):
    farm = FaultFarm(lab, units=500)
    hosts, _ = two_workers(lab, farm)
    farm.wait_done(20)
    turns = lab.network.flap(hosts[0], 1.0, 8)
    outcome = finish(farm)
    turns.join()
    return f"{outcome['reassigned']} units went to others, {outcome['duplicates']} came twice"


@row("delay-loss", "300 ms later each way and 5 % of packets lost (wire.py: this kernel may have no netem)")
def delay_loss(lab):
    farm = FaultFarm(lab, units=100)
    far = lab.host(delay_ms=300, loss=0.05, seed=lab.rng.randrange(1 << 30))
    lab.worker(far, farm, threads=4)
    lab.worker(lab.host(delay_ms=300, loss=0.05, seed=lab.rng.randrange(1 << 30)), farm, threads=4)
    outcome = finish(farm)
    return f"{outcome['units']} units by far workers alone, {outcome['reassigned']} given to others, " \
           f"{outcome['duplicates']} twice, {outcome['workers_lost']} workers lost"


@row("slow-link", "1 Mb/s each way (tbf), a scene of 512 KiB")
def slow_link(lab):
    farm = FaultFarm(lab, units=100, kilobytes=512)
    host = lab.host()
    lab.network.slow(host, "1mbit")
    lab.worker(host, farm)
    outcome = finish(farm)
    return f"{outcome['units']} units by that worker alone, {outcome['reassigned']} given to others"


@row("bit-flips", "a proxy flips a bit in every 20 kB, both ways", quick=True)
def bit_flips(lab):
    farm = FaultFarm(lab)
    host = lab.host()
    bad = lab.worker(host, farm, through=["--flip-every", 20000, "--seed", lab.rng.randrange(1 << 30)])
    lab.worker(lab.host(), farm)
    outcome = finish(farm)
    damaged = bad.log().count("checksum") + sum("checksum" in e for e in outcome["events"])
    return f"the connection was closed and made again; {outcome['workers_lost']} losses, damage named " \
           f"{damaged} times by checksum, {outcome['duplicates']} results came twice"


@row("frame-flips", "a bit flipped in every 15th frame of a worker", quick=True)
def frame_flips(lab):
    farm = FaultFarm(lab)
    lab.worker(lab.host(), farm, stub="slow=40;flip=15", through=[])
    lab.worker(lab.host(), farm)
    outcome = finish(farm)
    return outcome.event("checksum")


def refused(lab, what, words, **options):
    """A worker that must be refused in words, beside one that bakes."""
    farm = FaultFarm(lab)
    bad = lab.worker(lab.host(), farm, name="refused", **options)
    code = bad.status(60)
    log = bad.log()
    if code != 2 or not any(w in log for w in words):
        raise Failed(f"{what}: status {code}, said: {log[-300:]}")
    said = next(line for line in log.splitlines() if any(w in line for w in words))
    lab.worker(lab.host(), farm)
    finish(farm)
    return "the worker ends with status %d: %s" % (code, said.split("] ")[-1])


@row("wrong-token", "wrong token", quick=True)
def wrong_token(lab):
    return refused(lab, "wrong token", ["token"], token="guessed")


@row("wrong-version", "another version of the protocol", quick=True)
def wrong_version(lab):
    return refused(lab, "version 9", ["protocol", "same release"], stub="version=9", through=[])


@row("wrong-class", "another numeric class", quick=True)
def wrong_class(lab):
    farm = FaultFarm(lab)
    lab.worker(lab.host(), farm)
    farm.wait_done(10)
    lab.worker(lab.host(), farm, stub="class=other-machine")
    outcome = finish(farm)
    return outcome.event("class")


def misbehaving(lab, stub, words, quorum=None, audit=None, units=200, **options):
    extra = {}
    if quorum:
        extra["quorum"] = quorum
    if audit:
        extra["audit_first"] = audit
    farm = FaultFarm(lab, units=units, **extra)
    liar = lab.worker(lab.host(), farm, stub=stub, name="liar", **options)
    wait_until("the liar", lambda: "ready" in liar.log(), 30)  # it gets units before the others end the bake
    for _ in range(3):
        lab.worker(lab.host(), farm)
    outcome = finish(farm)
    return outcome, outcome.event(*words)


@row("liar-audit", "wrong radiance for every 5th unit; --audit-first 10", quick=True)
def liar_audit(lab):
    outcome, event = misbehaving(lab, "slow=40;wrong=%5", ["liar", "quarantine"], audit=10)
    return f"{event}; {outcome['verified']} verified, {outcome['unverified']} not, {outcome['rewinds']} rewinds"


@row("liar-quorum", "wrong radiance for every 5th unit; --quorum 2", quick=True)
def liar_quorum(lab):
    outcome, event = misbehaving(lab, "slow=40;wrong=%5", ["liar", "quarantine"], quorum=2)
    if outcome["unverified"]:
        raise Failed(f"{outcome['unverified']} units unverified with a quorum of 2")
    return f"{event}; {outcome['verified']} verified"


@row("liar-trusted", "the same where machines are trusted: this page must be able to see a wrong lightmap", quick=True)
def liar_trusted(lab):
    farm = FaultFarm(lab)
    lab.worker(lab.host(), farm, stub="slow=10;wrong=%5")
    outcome = farm.outcome()
    if outcome["error"] or outcome["digest"] == farm.truth():
        raise Failed("a wrong lightmap has the right digest")
    return f"nobody asks twice, {outcome['unverified']} units are unverified, and the digest differs"


@row("liar-late", "wrong radiance from the 150th unit on, after its first 10 audits agreed")
def liar_late(lab):
    outcome, event = misbehaving(lab, "slow=20;wrong=%151", ["liar", "quarantine"], quorum=2, units=400)
    return f"{event}; {outcome['verified']} verified, {outcome['rewinds']} rewinds"


@row("zeros", "all zero, in the right form; --quorum 2")
def zeros(lab):
    return misbehaving(lab, "slow=40;zeros=all", ["liar", "quarantine"], quorum=2)[1]


@row("nan", "NaN", quick=True)
def nan(lab):
    return misbehaving(lab, "slow=40;nan=%5", ["liar", "nan"])[1]


@row("someone-else", "answers in the name of another unit", quick=True)
def someone_else(lab):
    return misbehaving(lab, "slow=40;someone=%5", ["liar", "unit"])[1]


@row("duplicates", "every result sent three times", quick=True)
def duplicates(lab):
    farm = FaultFarm(lab)
    lab.worker(lab.host(), farm, stub="slow=20;copies=3", through=[])
    lab.worker(lab.host(), farm, stub="slow=20")
    outcome = finish(farm)
    if not outcome["duplicates"]:
        raise Failed("no duplicate was counted")
    return f"{outcome['units']} commits, {outcome['duplicates']} duplicates dropped"


def poison(lab, policy):
    """A unit that kills every worker that tries it; dead workers are started again, as a supervisor does."""
    farm = FaultFarm(lab, on_poison=policy)
    hosts = [lab.host() for _ in range(4)]
    workers = {host: lab.worker(host, farm, stub="slow=20;crash=77") for host in hosts}
    deaths = 0
    while not farm.process.ended():
        for host, worker in list(workers.items()):
            if worker.ended() and not farm.process.ended():
                deaths += 1
                if deaths > 20:
                    raise Failed("the poisonous unit goes on killing")
                workers[host] = lab.worker(host, farm, stub="slow=20;crash=77")
        time.sleep(0.05)
    return farm.outcome(), deaths


@row("poison-fail", "a unit that kills every worker; --on-poison fail", quick=True)
def poison_fail(lab):
    outcome, deaths = poison(lab, "fail")
    if "unit 77" not in outcome["error"]:
        raise Failed(f"error: {outcome['error']}")
    return f"after {deaths} deaths the job fails: {outcome['error']}"


@row("poison-skip", "a unit that kills every worker; --on-poison skip", quick=True)
def poison_skip(lab):
    outcome, deaths = poison(lab, "skip")
    if outcome["error"] or outcome["units"] != 199:
        raise Failed(f"{outcome['units']} units, error {outcome['error']}")
    return f"{deaths} deaths; {outcome.event('unit 77', 'skipped')}; the other 199 units are there"


@row("clock-coordinator", "the coordinator's clock moved an hour ahead and back")
def clock_coordinator(lab):
    environment, clock = false_clock(lab.folder, "coordinator")
    farm = FaultFarm(lab, units=300, environment=environment)
    two_workers(lab, farm)
    return clock_moves(farm, clock)


@row("clock-worker", "a worker's clock moved an hour ahead and back")
def clock_worker(lab):
    environment, clock = false_clock(lab.folder, "worker")
    farm = FaultFarm(lab, units=300)
    lab.worker(lab.host(), farm, environment=environment)
    lab.worker(lab.host(), farm)
    return clock_moves(farm, clock)


def clock_moves(farm, clock):
    farm.wait_done(30)
    clock.write_text("+1h\n")
    farm.wait_done(150)
    clock.write_text("-1h\n")
    outcome = finish(farm)
    if outcome["reassigned"] or outcome["workers_lost"]:
        raise Failed(f"{outcome['reassigned']} units were given away, {outcome['workers_lost']} workers lost")
    return "no lease ended, no worker was lost"


@row("descriptors", "256 file descriptors for the coordinator, 300 workers")
def descriptors(lab):
    farm = FaultFarm(lab, units=12000, lease_ms=15000, descriptors=256)  # more than are done before all have come
    host = lab.host()
    first = [lab.worker(host, farm, threads=1, stub="slow=1000", patience=600) for _ in range(20)]
    farm.wait_done(20)
    for _ in range(280):
        lab.worker(host, farm, threads=1, stub="slow=1000", patience=600)
    outcome = finish(farm, 400)
    lost = [w for w in first if w.ended() and w.process.returncode]
    if outcome["workers_lost"] or lost or outcome["connections"] > 256:
        raise Failed(f"{outcome['workers_lost']} workers lost, {len(lost)} of the first ended")
    said = [line for line in farm.process.log().splitlines() if "descriptor" in line or "Too many" in line]
    if not said:
        raise Failed("the coordinator says nothing of its descriptors")
    return f"{outcome['connections']} connections at the end, none lost; the coordinator says: " + said[0].split("] ")[-1]
