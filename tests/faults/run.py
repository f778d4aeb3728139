#!/usr/bin/env python3
"""Faults against real processes in network namespaces: README.md.

usage: run.py [--rows NAME,NAME] [--quick] [--seed N] [--kills N] [--parallel N] [--markdown FILE] [--bin DIR]

Runs itself again in mount, network and process namespaces of its own, so that nothing is left on the machine.
Exit status: 0 every row held, 1 one did not, 77 this machine cannot (no rights, a missing tool).
"""
import argparse
import os
import random
import shutil
import subprocess
import sys
import tempfile
import threading
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

sys.dont_write_bytecode = True
sys.path.insert(0, str(Path(__file__).resolve().parent))
import rows_certificates  # noqa: E402
import rows_service  # noqa: E402
import rows_upgrade  # noqa: E402
import rows_workers  # noqa: E402
from farm import Failed, Lab, Skipped  # noqa: E402

INSIDE = "KILN_FAULTS_INSIDE"
ROWS = rows_workers.ROWS + rows_certificates.ROWS + rows_service.ROWS + rows_upgrade.ROWS


def skip(reason):
    print(f"skipped: {reason}")
    sys.exit(77)


def enter():
    for tool, package in (("ip", "iproute2"), ("tc", "iproute2"), ("ss", "iproute2"), ("nft", "nftables"),
                          ("unshare", "util-linux")):
        if not shutil.which(tool):
            skip(f"{tool} is not installed ({package})")
    apart = ["unshare", "--mount", "--net", "--pid", "--fork", "--kill-child", "--mount-proc"]
    trial = "mount -t tmpfs none /run && mkdir /run/netns && ip netns add kiln-try && ip link add try0 type veth peer " \
            "name try1 && nft add table inet kiln-try"
    done = subprocess.run([*apart, "sh", "-c", trial], capture_output=True, text=True)
    if done.returncode:
        skip(f"no rights for namespaces of our own: {done.stderr.strip()}")
    os.execvpe("unshare", [*apart, sys.executable, *sys.argv], {**os.environ, INSIDE: "1"})


def run_row(number, row, options, folder):
    name, _, _, function = row
    begun, lab = time.monotonic(), None
    try:
        lab = Lab(name, number, options.bin, folder / name, random.Random(f"{options.seed} {name}"))
        lab.kills = options.kills
        outcome, said = "holds", function(lab)
    except Skipped as reason:
        outcome, said = "not run", str(reason)
    except Exception as error:  # whatever goes wrong, the other rows run
        kind = "" if isinstance(error, Failed) else f"{type(error).__name__}: "
        outcome, said = "FAILED", kind + str(error)
    finally:
        if lab:
            lab.end()
    print(f"{outcome:8} {name:18} {time.monotonic() - begun:6.1f} s  {said}", flush=True)
    return outcome, said.replace(f"{folder}/", "")  # the page holds no place of this run


def cell(text):
    return text.replace("|", "\\|").replace("\n", " ")


def write_markdown(path, results):
    """Writes the table between the two marks of a page; rows that were not run now keep their line."""
    begin, end = "<!-- rows -->\n", "<!-- end of rows -->"
    before, _, rest = Path(path).read_text().partition(begin)
    old, _, after = rest.partition(end)
    lines = {line.split("`")[1]: line for line in old.splitlines() if line.startswith("| `")}
    for (name, what, _, _), (outcome, said) in results:
        lines[name] = f"| `{name}` | {cell(what)} | {outcome} | {cell(said)} |"
    table = ["| row | fault | outcome | what happened |", "|---|---|---|---|"]
    table += [lines[name] for name, _, _, _ in ROWS if name in lines]
    Path(path).write_text(before + begin + "\n".join(table) + "\n" + end + after)


def main():
    root = Path(__file__).resolve().parents[2]
    parser = argparse.ArgumentParser()
    parser.add_argument("--rows", default="", help="names, with commas; all by default")
    parser.add_argument("--quick", action="store_true", help="the rows of the test suite")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--kills", type=int, default=5, help="how often the coordinator is killed")
    parser.add_argument("--parallel", type=int, default=6, help="rows at a time")
    parser.add_argument("--markdown", help="the page whose table gets the rows that ran")
    parser.add_argument("--bin", type=Path, default=root / "build/bin")
    parser.add_argument("--keep", help="folder for logs; by default they go with a row that holds")
    parser.add_argument("--list", action="store_true")
    options = parser.parse_args()
    options.bin = options.bin.resolve()
    wanted = [name for name in options.rows.split(",") if name]
    unknown = set(wanted) - {row[0] for row in ROWS}
    if unknown:
        parser.error(f"no such row: {', '.join(sorted(unknown))}")
    rows = [row for row in ROWS if (row[0] in wanted if wanted else row[2] or not options.quick)]
    if options.list:
        for name, what, quick, _ in rows:
            print(f"{name:18} {'quick' if quick else '     '} {what}")
        return 0
    for program in ("kiln-fault-farm", "kiln-stub-worker"):
        if not (options.bin / program).exists():
            skip(f"{options.bin / program} is not built")
    if not os.environ.get(INSIDE):
        enter()
    for words in (["mount", "-t", "tmpfs", "none", "/run"], ["ip", "link", "set", "lo", "up"]):
        subprocess.run(words, check=True)
    os.makedirs("/run/netns")
    folder = Path(options.keep or tempfile.mkdtemp(prefix="kiln-faults-"))
    with ThreadPoolExecutor(options.parallel) as pool:
        outcomes = list(pool.map(lambda pair: run_row(*pair, options, folder), enumerate(rows)))
    failed = sum(outcome == "FAILED" for outcome, _ in outcomes)
    print(f"{len(rows)} rows, {failed} failed, {sum(o == 'not run' for o, _ in outcomes)} not run; seed {options.seed}")
    if failed or options.keep:
        print(f"logs: {folder}")
    else:
        shutil.rmtree(folder, ignore_errors=True)
    if options.markdown:
        write_markdown(options.markdown, zip(rows, outcomes))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
