"""`kiln serve` on the row's central machine, and a person's commands beside it."""
import base64
import hashlib
import json
import sqlite3
import struct
import subprocess
import threading

from farm import Failed, Lab, Skipped, clean_environment, wait_until

# What a bake decides; reports and previews hold times.
DECIDED = (".exr", ".glb", "charts.json", ".bin")


def write_scene(path):
    """A floor with a block on it, as glTF in one file."""
    positions, normals, indices = [], [], []

    def quad(corner, u, v, normal):
        first = len(positions)
        for a, b in ((0, 0), (1, 0), (1, 1), (0, 1)):
            positions.append([corner[i] + a * u[i] + b * v[i] for i in range(3)])
            normals.append(normal)
        indices.extend(first + i for i in (0, 1, 2, 0, 2, 3))

    quad((-2, 0, 2), (4, 0, 0), (0, 0, -4), (0, 1, 0))
    quad((-.5, 0, .5), (1, 0, 0), (0, 1, 0), (0, 0, 1))
    quad((.5, 0, -.5), (-1, 0, 0), (0, 1, 0), (0, 0, -1))
    quad((.5, 0, .5), (0, 0, -1), (0, 1, 0), (1, 0, 0))
    quad((-.5, 0, -.5), (0, 0, 1), (0, 1, 0), (-1, 0, 0))
    quad((-.5, 1, .5), (1, 0, 0), (0, 0, -1), (0, 1, 0))
    flat = b"".join(struct.pack("<3f", *p) for p in positions) + b"".join(struct.pack("<3f", *n) for n in normals)
    size = 12 * len(positions)
    data = flat + struct.pack(f"<{len(indices)}H", *indices)
    view = [{"buffer": 0, "byteOffset": 0, "byteLength": size}, {"buffer": 0, "byteOffset": size, "byteLength": size},
            {"buffer": 0, "byteOffset": 2 * size, "byteLength": 2 * len(indices)}]
    low, high = [[f(p[i] for p in positions) for i in range(3)] for f in (min, max)]
    path.write_text(json.dumps({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0, "name": "yard"}],
        "meshes": [{"primitives": [{"attributes": {"POSITION": 0, "NORMAL": 1}, "indices": 2}]}],
        "buffers": [{"byteLength": len(data),
                     "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}],
        "bufferViews": view,
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": len(positions), "type": "VEC3", "min": low, "max": high},
            {"bufferView": 1, "componentType": 5126, "count": len(positions), "type": "VEC3"},
            {"bufferView": 2, "componentType": 5123, "count": len(indices), "type": "SCALAR"}]}))


BAKE = ("--texels-per-metre", 8, "--environment", "0.6,0.8,1", "--sun", "0.4,1,0.3:5,4.7,4.2", "--tile-texels", 4,
        "--min-samples", 256, "--max-samples", 256, "--unwrap-cache", "off",
        "--cache", "off")  # the stub worker has an atlas of its own size


def digest_of(folder):
    names = sorted(p.name for p in folder.iterdir() if p.name.endswith(DECIDED))
    if not any(name.endswith(".exr") for name in names):
        raise Failed(f"no lightmap in {folder}")
    total = hashlib.sha256()
    for name in names:
        total.update(name.encode() + hashlib.sha256((folder / name).read_bytes()).digest())
    return total.hexdigest()


ENDED = 1 << 60  # more units than any job has


class Service:
    _truth, _lock = {}, threading.Lock()

    def __init__(self, lab, tls=None, person=None, environment=None, descriptors=None, data=None, **options):
        program = lab.programs / "kiln"
        if not program.exists():
            raise Skipped("kiln is not built")
        self.lab, self.tls, self.person = lab, tls, person
        self.data = data or lab.folder / "data"
        self.address = f"{lab.network.center.address}:7800"
        self.environment, self.descriptors = environment, descriptors
        self.words = [program, "serve", "--data", self.data, "--listen", self.address, "--verbose"]
        for name, value in ({"audit_first": 0} | options).items():
            self.words += ["--" + name.replace("_", "-"), value]
        if tls:
            self.words += ["--ca", tls / "ca.pem", "--certificate", tls / "cert.pem", "--key", tls / "key.pem"]
        else:
            self.words.append("--insecure-plain")
        self.starts = 0
        self.start()

    def start(self):
        self.starts += 1
        name = f"serve-{self.starts}"
        self.process = self.lab.start(self.lab.network.center, self.words, name, environment=self.environment,
                                      descriptors=self.descriptors)

        def listening():
            if self.process.ended():
                raise Failed(f"kiln serve ended: {self.process.log()[-300:]}")
            return "kiln serves" in self.process.log()

        wait_until("kiln serve", listening, 60)

    @property
    def worker_token(self):
        return (self.data / "worker.token").read_text().strip()

    def kiln(self, *words, check=True, token="admin.token", patience_s=120):
        """A command of a person on the coordinator's machine: (status, output, errors)."""
        environment = {**clean_environment(), "KILN_SERVER": self.address}
        if self.person:
            for key, file in (("CA", "ca.pem"), ("CERTIFICATE", "cert.pem"), ("KEY", "key.pem")):
                environment[f"KILN_{key}"] = str(self.person / file)
        elif token:
            environment["KILN_TOKEN_FILE"] = str(self.data / token)
        done = subprocess.run(self.lab.network.center.wrap([self.lab.programs / "kiln", *words]), env=environment,
                              capture_output=True, text=True, timeout=patience_s)
        if check and done.returncode:
            raise Failed(f"kiln {words[0]}: {done.stderr.strip()[-300:]}")
        return done.returncode, done.stdout, done.stderr

    def scene(self):
        file = self.lab.folder / "yard.gltf"
        if not file.exists():
            write_scene(file)
        return file

    def submit(self, *options):
        _, out, _ = self.kiln("submit", self.scene(), *BAKE, *options, "--json")
        return json.loads(out)["id"]

    def job(self, job):
        """What `kiln jobs ID` says; None while the coordinator is away."""
        status, out, _ = self.kiln("jobs", job, "--json", check=False)
        return json.loads(out) if status == 0 else None

    def record(self, job):
        """job() of a running coordinator: asks again, because a slow machine may miss an answer."""
        return wait_until(f"what is known of job {job}", lambda: self.job(job), 60)

    def units_done(self, job):
        record = self.job(job)
        if record and record["state"] in ("done", "failed", "cancelled"):
            return ENDED
        return ((record or {}).get("progress") or {}).get("units_done", 0)

    def wait_units(self, job, count, patience_s=90):
        wait_until(f"unit {count} of job {job}", lambda: self.units_done(job) >= count, patience_s)

    def wait_state(self, job, *states, patience_s=150):
        def reached():
            record = self.job(job)
            if record and record["state"] in ("failed", "cancelled") and record["state"] not in states:
                raise Failed(f"job {job} {record['state']}: {record['reason']}")
            return record if record and record["state"] in states else None

        return wait_until(f"job {job} {states}", reached, patience_s)

    def fetch(self, job):
        folder = self.lab.folder / f"fetched-{job}"
        self.kiln("fetch", job, "-o", folder)
        return digest_of(folder)

    def worker(self, host, **options):
        options.setdefault("patience", 600)
        return self.lab.worker(host, self, token=None if self.tls else self.worker_token, **options)

    def finish(self, job, truth=None):
        """Done, fetched, equal to the undisturbed bake, and the data folder is whole. What was said of the job."""
        record = self.wait_state(job, "done")
        digest = self.fetch(job)
        expected = truth or self.truth()
        if digest != expected:
            raise Failed(f"digest {digest[:16]}, undisturbed {expected[:16]}")
        self.process.signal(15)
        self.process.status(60)
        for file in self.data.rglob("*.db"):
            with sqlite3.connect(file) as database:
                (answer,), = database.execute("pragma integrity_check").fetchall()
            if answer != "ok":
                raise Failed(f"{file.name}: {answer}")
        return record

    def said(self, record, *words):
        """What the job's events or the coordinator's log say with all these words."""
        lines = [event["text"] for event in record.get("events", [])]
        for log in sorted(self.lab.folder.glob("serve-*.log")):
            lines += [line.split("info: ")[-1] for line in log.read_text(errors="replace").splitlines()]
        for line in lines:
            if all(word in line for word in words):
                return line
        raise Failed(f"nothing was said of {words}: " + " | ".join(lines[-12:]))

    def truth(self):
        with Service._lock:
            if "stub" not in Service._truth:
                lab = Lab("truth", 990, self.lab.programs, self.lab.folder / "truth", self.lab.rng)
                try:
                    calm = Service(lab)
                    for _ in range(2):
                        calm.worker(lab.host(), stub="")
                    job = calm.submit()
                    calm.wait_state(job, "done")
                    Service._truth["stub"] = calm.fetch(job)
                finally:
                    lab.end()
            return Service._truth["stub"]
