#!/usr/bin/env python3
"""Breaks the agent, the session or the store on purpose, one rule at a time, and expects the simulation to notice.

usage: mutations.py SOURCE_DIR BUILD_DIR [--seeds N]
Prints a line per mutation with the promise that broke first. Exit status 1 if one is not noticed, or if a rule's text
is not found any more: then the list below must follow the code."""
import os
import re
import shlex
import subprocess
import sys
import tempfile

AGENT, QUEUE, LEDGER = "worker/agent", "coordinator/farm/queue", "coordinator/farm/ledger"
MUTATIONS = [
    # name, file, text, replacement
    ("the agent forgets to deliver again", f"{AGENT}/agent_units.cpp",
     "for (const auto& [unit, result] : job->kept) outbox_.push_back({id, unit});", ""),
    ("the agent answers twice", f"{AGENT}/agent_units.cpp",
     "send(it->second);", "send(it->second); send(it->second);"),
    ("the agent forgets results that it sent", f"{AGENT}/agent_units.cpp",
     "send(it->second);", "send(it->second); drop_kept(*known(id), unit);"),
    ("credits are told before the class", f"{AGENT}/agent_units.cpp",
     "if (draining_ || current()->class_told != connection_count_) return; grant(*current());",
     "if (draining_) return; current()->class_told = connection_count_; grant(*current());"),
    ("a withdrawn unit stays queued for ever", f"{AGENT}/agent_units.cpp",
     "taken_.erase(it); KnownJob* job = known(unit.job);", "KnownJob* job = known(unit.job);"),
    ("the agent asks for no chunk again after a lost connection", f"{AGENT}/agent.cpp",
     "for (auto& [id, job] : jobs_) job.awaited.clear();", ""),
    ("a hung unit is waited for", f"{AGENT}/agent_units.cpp",
     "if (!oldest || leaving_ ||", "if (true || !oldest || leaving_ ||"),
    ("units that wait for a cache are kept without a connection", f"{AGENT}/agent.cpp",
     "stop_waiting([](const Unit&) { return true; });", ""),
    ("the store acknowledges before it syncs", f"{QUEUE}/spool.cpp",
     "KILN_TRY_STATUS(file.file.sync(disk_));", ""),
    ("votes of machines that come back are not counted again", f"{LEDGER}/farm_workers.cpp",
     "if (unknown) count_again(identity, now, out);", ""),
]


def pattern_of(text):
    """The text with any white space between its words, so that a formatter may break lines elsewhere."""
    return re.compile(r"\s+".join(re.escape(word) for word in text.split()))


def commands(build, target):
    return subprocess.run(["ninja", "-C", build, "-t", "commands", target], check=True, capture_output=True,
                          text=True).stdout.splitlines()


def main():
    source, build = sys.argv[1], sys.argv[2]
    seeds = sys.argv[sys.argv.index("--seeds") + 1] if "--seeds" in sys.argv else "600"
    known = commands(build, "agent_sim")
    link = next(line for line in reversed(known) if "-o bin/agent_sim " in line)
    failures = 0
    with tempfile.TemporaryDirectory() as folder:
        for name, file, text, replacement in MUTATIONS:
            with open(os.path.join(source, file), encoding="utf-8") as handle:
                code = handle.read()
            if len(pattern_of(text).findall(code)) != 1:
                print(f"NOT FOUND ONCE  {name}: {file} has changed, change this list")
                failures += 1
                continue
            mutated, program = os.path.join(folder, os.path.basename(file)), os.path.join(folder, "agent_sim")
            with open(mutated, "w", encoding="utf-8") as handle:
                handle.write(pattern_of(text).sub(lambda _: replacement, code))
            compile_line = next(line for line in known if f" -c {os.path.join(source, file)}" in line)
            # Without what writes the dependencies of the build.
            compile_line = re.sub(r" -MD -MT \S+ -MF \S+", "", compile_line)
            words = [w for w in shlex.split(compile_line) if w not in ("-Werror", "-Wall", "-Wextra")]
            words[words.index("-o") + 1] = f"{mutated}.o"
            words[words.index("-c") + 1] = mutated
            subprocess.run([w for w in words if w != "-O2"] + ["-O1", "-w"], check=True, cwd=build)
            # Before the archives, so that theirs is not taken.
            line = link.replace("-o bin/agent_sim ", f"-o {program} {mutated}.o ")
            subprocess.run(line, shell=True, check=True, cwd=build)
            try:
                run = subprocess.run([program, "--seeds", seeds], capture_output=True, text=True, timeout=300)
                first = run.stdout.splitlines()[0][:140] if run.stdout else f"signal {-run.returncode}"
                noticed = run.returncode != 0
            except subprocess.TimeoutExpired:
                first, noticed = "it never ended", True
            print(f"{'noticed' if noticed else 'NOT NOTICED'}  {name}: {first}", flush=True)
            failures += not noticed
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
