"""Holds the files of configs/ and docker/ against what their engines take and what the programs know.

usage: files_test.py WORKER_PROGRAM

No engine is needed: YAML is parsed and its references are followed; units go through systemd-analyze, scripts
through bash and shellcheck, overlays through kubectl, each where it is installed. What is not, is named as skipped.
"""
import os
import re
import shutil
import subprocess
import sys
import tempfile
from pathlib import Path

ROOT = Path(__file__).resolve().parents[2]
CONFIGS = ROOT / "configs"
failures = []


def check(condition, message):
    if not condition:
        failures.append(message)


def have(program):
    found = shutil.which(program)
    if not found:
        print(f"skipped: {program} is not installed")
    return found


def run(*command, **options):
    done = subprocess.run(command, capture_output=True, text=True, **options)
    return done.returncode, done.stdout + done.stderr


def worker_variables(help_text):
    """Every KILN_ variable that kiln-worker reads, with the _FILE forms of those that are not paths."""
    names = set(re.findall(r"KILN_[A-Z_]*[A-Z]", help_text))
    values = names - {"KILN_CA", "KILN_CERTIFICATE", "KILN_KEY", "KILN_CACHE", "KILN_ALIVE_FILE"}
    return names | {name + "_FILE" for name in values if not name.endswith("_FILE")}


def check_variables(where, used, known):
    for name in used:
        check(name in known, f"{where}: kiln-worker does not know {name}")


def seconds(duration):
    return int(str(duration).removesuffix("s"))


def check_container(where, security):
    for key, wanted in (("allowPrivilegeEscalation", False), ("readOnlyRootFilesystem", True)):
        check(security.get(key) is wanted, f"{where}: securityContext.{key} is not {wanted}")
    check(security.get("capabilities") == {"drop": ["ALL"]}, f"{where}: capabilities are not dropped")


def check_web_token(where, words):
    files = dict(word.split("=", 1) for word in words if "token-file=" in word)
    check(files["--http-token-file"] != files["--token-file"], f"{where}: the pages' token is the workers'")


def check_kubernetes(known):
    import yaml

    objects = {}
    for path in sorted((CONFIGS / "kubernetes").glob("*.yaml")):
        for document in yaml.safe_load_all(path.read_text()):
            check({"apiVersion", "kind"} <= set(document), f"{path.name}: a document without apiVersion or kind")
            if document["kind"] == "Kustomization":
                for resource in document["resources"]:
                    check((path.parent / resource).is_file(), f"{path.name}: no file {resource}")
                continue
            objects[document["kind"], document["metadata"]["name"]] = document
    service = objects["Service", "kiln"]["spec"]
    ports = {port["port"] for port in service["ports"]}
    for kind, name in (("StatefulSet", "kiln"), ("Deployment", "kiln-worker")):
        where = f"{kind} {name}"
        spec = objects[kind, name]["spec"]
        pod = spec["template"]["spec"]
        labels = spec["template"]["metadata"]["labels"]
        check(spec["selector"]["matchLabels"].items() <= labels.items(), f"{where}: the selector misses its pods")
        check(pod["securityContext"].get("runAsNonRoot") is True, f"{where}: may run as root")
        check(pod["automountServiceAccountToken"] is False, f"{where}: has a token of the cluster")
        volumes = {volume["name"] for volume in pod["volumes"]}
        volumes |= {claim["metadata"]["name"] for claim in spec.get("volumeClaimTemplates", [])}
        for container in pod["containers"]:
            check_container(where, container["securityContext"])
            mounts = {mount["name"]: mount["mountPath"] for mount in container["volumeMounts"]}
            check(set(mounts) <= volumes, f"{where}: mounts {set(mounts) - volumes}, which are no volumes")
            names = {port["name"] for port in container.get("ports", [])}
            for probe in ("startupProbe", "readinessProbe", "livenessProbe"):
                get = container.get(probe, {}).get("httpGet")
                check(not get or get["port"] in names, f"{where}: {probe} asks a port that is not there")
    coordinator = objects["StatefulSet", "kiln"]["spec"]
    labels = coordinator["template"]["metadata"]["labels"]
    check(service["selector"].items() <= labels.items(), "Service kiln: selects no pod of the StatefulSet")
    check(coordinator["serviceName"] == "kiln" and coordinator["replicas"] == 1, "StatefulSet kiln: not one behind kiln")
    probes = {name: coordinator["template"]["spec"]["containers"][0][name]["httpGet"]["path"]
              for name in ("startupProbe", "readinessProbe", "livenessProbe")}
    check(probes == {"startupProbe": "/livez", "readinessProbe": "/readyz", "livenessProbe": "/livez"},
          f"StatefulSet kiln: {probes}: a full disk would restart it, or it would be sent work that it cannot store")
    check_web_token("StatefulSet kiln", coordinator["template"]["spec"]["containers"][0]["args"])
    targets = {port["targetPort"] for port in service["ports"]}
    opened = {port["name"] for port in coordinator["template"]["spec"]["containers"][0]["ports"]}
    check(targets == opened, f"Service kiln: ports {targets} lead to {opened}")

    worker = objects["Deployment", "kiln-worker"]["spec"]["template"]["spec"]
    environment = {entry["name"]: entry.get("value") for entry in worker["containers"][0]["env"]}
    check_variables("Deployment kiln-worker", environment, known)
    host, port = environment["KILN_CONNECT"].split(":")
    check(host == "kiln" and int(port) in ports, "Deployment kiln-worker: connects to another place than the Service")
    check(worker["terminationGracePeriodSeconds"] > int(environment["KILN_DRAIN_LIMIT"]),
          "Deployment kiln-worker: is killed before it has drained")
    scaler = objects["HorizontalPodAutoscaler", "kiln-worker"]["spec"]
    target = scaler["scaleTargetRef"]
    check((target["kind"], target["name"]) in objects, "HorizontalPodAutoscaler: scales nothing")
    check("replicas" not in objects["Deployment", "kiln-worker"]["spec"],
          "Deployment kiln-worker: replicas would undo the autoscaler at each apply")
    if have("kubectl"):
        status, output = run("kubectl", "kustomize", str(CONFIGS / "kubernetes"))
        check(status == 0, f"kubectl kustomize: {output}")


def check_compose(known):
    import yaml

    compose = yaml.safe_load((ROOT / "docker/compose.yaml").read_text())
    stages = set(re.findall(r"^FROM \S+ AS (\S+)", (ROOT / "docker/Dockerfile").read_text(), re.M))
    for name, service in compose["services"].items():
        where = f"compose.yaml: {name}"
        check(service["build"]["target"] in stages, f"{where}: the Dockerfile has no such stage")
        check((ROOT / "docker" / service["build"]["context"] / service["build"]["dockerfile"]).is_file(),
              f"{where}: no Dockerfile there")
        check(set(service["secrets"]) <= set(compose["secrets"]), f"{where}: a secret that is not declared")
        for volume in service["volumes"]:
            check(volume.split(":")[0] in compose["volumes"], f"{where}: volume {volume} is not declared")
        check(service["cap_drop"] == ["ALL"] and service["read_only"], f"{where}: more rights than it needs")
        for other in service.get("depends_on", {}):
            check("healthcheck" in compose["services"][other], f"{where}: waits for the health of {other}, which has none")
    worker = compose["services"]["worker"]
    check("container_name" not in worker and "ports" not in worker, "compose.yaml: worker cannot be scaled")
    check_variables("compose.yaml: worker", worker["environment"], known)
    check(seconds(worker["stop_grace_period"]) > int(worker["environment"]["KILN_DRAIN_LIMIT"]),
          "compose.yaml: worker is killed before it has drained")
    health = compose["services"]["coordinator"]["healthcheck"]["test"][3]
    check("/livez" in health, "compose.yaml: a full disk would count as a death")
    check_web_token("compose.yaml: coordinator", compose["services"]["coordinator"]["command"])
    status, output = run("bash", "-n", "-c", health)
    check(status == 0, f"compose.yaml: the health check: {output}")


def check_dockerfile(programs, known):
    text = (ROOT / "docker/Dockerfile").read_text().replace("\\\n", " ")
    stages = re.split(r"^FROM ", text, flags=re.M)[1:]
    packages = {}
    for stage in stages:
        name = stage.splitlines()[0].split()[-1]
        installed = re.search(r"apt-get install -y --no-install-recommends ([^&]*)", stage)
        packages[name] = set(installed.group(1).split()) if installed else set()
        if name == "build":
            continue
        user = re.findall(r"^USER (\S+)", stage, re.M)
        check(user and user[-1].split(":")[0] not in ("0", "root"), f"Dockerfile: {name} runs as root")
        check(re.search(r'^ENTRYPOINT \["/usr/local/bin/kiln', stage, re.M), f"Dockerfile: {name} starts nothing")
        check_variables(f"Dockerfile: {name}", re.findall(r"(KILN_[A-Z_]+)=", stage), known)
    if not (have("readelf") and have("dpkg") and have("ldconfig")):
        return
    # What a program links must be in its image: each library's package stands in the list.
    _, cache = run("ldconfig", "-p")
    base = {"libc6", "libgcc-s1", "libstdc++6"}
    for name, stage in (("kiln-worker", "worker"), ("kiln-worker", "coordinator"), ("kiln", "coordinator")):
        program = programs / name
        if not program.exists():
            print(f"skipped: the libraries of {name}, which is not built")
            continue
        _, dynamic = run("readelf", "-d", str(program))
        for library in re.findall(r"NEEDED.*\[(.*)\]", dynamic):
            found = re.search(rf"^\s*{re.escape(library)} .*x86-64.*=> (\S+)", cache, re.M)
            if not found:
                continue
            status, owner = run("dpkg", "-S", os.path.realpath(found.group(1)))
            package = owner.split(":")[0]
            check(status != 0 or package in base | packages[stage],
                  f"Dockerfile: {name} needs {library} of {package}, which the stage {stage} does not install")


def check_systemd(known):
    units = sorted((CONFIGS / "systemd").glob("*.service"))
    for unit in units:
        text = unit.read_text()
        for key in ("NoNewPrivileges=yes", "ProtectSystem=strict", "DynamicUser=yes", "RestartPreventExitStatus=2"):
            check(key in text, f"{unit.name}: {key} is missing")
        if "worker" in unit.name:
            check_variables(unit.name, re.findall(r"(KILN_[A-Z_]+)=", text), known)
            drain = int(re.search(r"KILN_DRAIN_LIMIT=(\d+)", text).group(1))
            check(seconds(re.search(r"TimeoutStopSec=(\d+)", text).group(1)) > drain, f"{unit.name}: killed while it drains")
    if not have("systemd-analyze"):
        return
    with tempfile.TemporaryDirectory() as folder:
        names = []
        for unit in units:  # the programs and pages need not be installed here
            text = re.sub(r"/usr/local/bin/kiln[a-z-]*", "/bin/true", unit.read_text())
            text = re.sub(r"^Documentation=.*\n", "", text, flags=re.M)
            (Path(folder) / unit.name).write_text(text)
            names.append("./" + unit.name)
        status, output = run("systemd-analyze", "--man=no", "verify", *names, cwd=folder)
        if "Failed to initialize manager" in output:
            print("skipped: systemd-analyze cannot work here")
            return
        check(status == 0 and not output.strip(), f"systemd-analyze verify: {output}")
        for name in names:  # 2.0 of 10: "OK"
            status, output = run("systemd-analyze", "security", "--offline=true", "--threshold=20", name, cwd=folder)
            check(status == 0, f"systemd-analyze security {name}: {output[-200:]}")


def check_scripts(known):
    scripts = sorted((CONFIGS / "slurm").glob("*.sbatch")) + sorted((ROOT / "tests/placement").glob("*.sh"))
    for script in scripts:
        text = script.read_text()
        status, output = run("bash", "-n", str(script))
        check(status == 0, f"{script.name}: {output}")
        if script.suffix == ".sbatch":
            check(re.search(r"^#SBATCH --requeue$", text, re.M), f"{script.name}: is not requeued")
            check(re.search(r"^#SBATCH --signal=B:TERM@\d+$", text, re.M), f"{script.name}: dies at the time limit")
    workers = (CONFIGS / "slurm/workers.sbatch").read_text()
    own = {"KILN_SHARE", "KILN_WORKER", "KILN_ADDRESS_PATIENCE"}
    check_variables("workers.sbatch", set(re.findall(r"KILN_[A-Z_]*[A-Z]", workers)) - own, known)
    if have("shellcheck"):
        status, output = run("shellcheck", *map(str, scripts))
        check(status == 0, f"shellcheck: {output}")


def main():
    program = Path(sys.argv[1])
    _, help_text = run(str(program), "--help")
    known = worker_variables(help_text)
    check("KILN_CONNECT_FILE" in known, "kiln-worker --help names no variables")
    check_scripts(known)
    check_systemd(known)
    check_dockerfile(program.parent, known)
    try:
        import yaml  # noqa: F401
    except ImportError:
        print("skipped: python3-yaml is not installed: nothing of Kubernetes and Compose was read")
    else:
        check_kubernetes(known)
        check_compose(known)
    for failure in failures:
        print("FAILED:", failure)
    if not failures:
        print("passed")
    return 1 if failures else 0


sys.exit(main())
