#!/usr/bin/env python3
"""Breaks the ledger on purpose, one rule at a time, and expects the simulated farm to notice.

usage: mutations.py SOURCE_DIR BUILD_DIR [--seeds N]
Prints a line per mutation with the promise that broke first. Exit status 1 if one is not noticed, or if a rule's text
is not found any more: then the list below must follow the code."""
import os
import re
import subprocess
import sys
import tempfile

MUTATIONS = [
    # name, file, text, replacement
    ("no fence: a unit is merged as often as it is settled", "unit_table.cpp",
     "if (unit.delivered) return;", "if (false) return;"),
    ("acknowledge before the commit", "farm_answers.cpp",
     "units_.await_commit(unit, answer, worker.id());\n  if (unit->needed",
     "out.push_back(Acknowledge{worker.id(), unit.job_id(), unit.id(), digest});\n  if (unit->needed"),
    ("skip the digest of a second answer", "farm_answers.cpp",
     "[&](const Answer& answer) { return answer.digest == digest; }", "[&](const Answer&) { return true; }"),
    ("one answer is always enough", "trust_table.cpp", "if (quorum > 1) return quorum;", "return 1;"),
    ("merge before the commit", "farm_answers.cpp",
     "if (unit->answers[best].stored) settle(", "settle("),
    ("units of a lost worker are forgotten", "farm_workers.cpp",
     "units_.count(unit.job_id(), &JobCounts::reassigned);\n    units_.enqueue(unit);",
     "units_.count(unit.job_id(), &JobCounts::reassigned);"),
    ("silence is not noticed", "farm_workers.cpp",
     "if (known || now - worker->last_heard <= rules_.lease_ms) return;", "return;"),
    ("a liar's earlier answers stay", "unit_answers.cpp",
     "changed |= std::erase(answer.voters, who) > 0;", "changed |= false;"),
    ("what a liar had merged stays merged", "unit_answers.cpp",
     "purged.merged |= unit.delivered;", "purged.merged |= false;"),
    ("credits are not counted", "farm_grants.cpp",
     "if (worker->leases.size() >= worker->credits || grants_.holds_suspect(*worker)) return false;",
     "if (worker->leases.size() >= 64 || grants_.holds_suspect(*worker)) return false;"),
    ("votes of one owner count as often as there are machines", "trust_table.cpp",
     "return std::max<size_t>(count, voters.empty() ? 0 : 1);", "return voters.size();"),
    ("one worker may vote twice", "grants_choose.cpp",
     "if (!units_.voted(*unit, worker.identity) && !leased(*unit)) return unit;", "return unit;"),
    ("work of later passes goes on after a rewind", "unit_table.cpp",
     "dequeue(Ref(id, unit_id, job, unit));\n    unit.delivered = unit.disputed = false;",
     "unit.delivered = false;"),
    ("a poisonous unit is tried for ever", "unit_table.cpp",
     "ref.unit_->phase = Phase::kFailed;", "return;"),
    ("hung workers are waited for", "farm_workers.cpp",
     "if (static_cast<double>(now - grants_.at(oldest).since) <= limit) return;", "return;"),
    ("time passes while nobody listens", "listened_time.cpp", "gap_ms > longest_gap_ms_ ? 0 : gap_ms", "false ? 0 : gap_ms"),
    ("time goes backwards with the clock", "listened_time.cpp", "gap_ms < 0 || gap_ms > longest_gap_ms_",
     "gap_ms > longest_gap_ms_"),
    ("the return of a process excuses nothing", "unit_table.cpp",
     "loss.process == process ? find(loss.job, loss.unit) : Ref{}", "Ref{}"),
    ("units of an ended job stay with their workers", "farm_jobs.cpp", "grants_.release_all(id);", ""),
    ("what is known of an ended job stays with workers", "worker_table.cpp", "worker.classes.erase(job);", ""),
    ("answers of the quarantined are restored", "farm_jobs.cpp",
     "if (!known.verified && quarantined_for(known.identity)) continue;", ""),
    ("a restored answer is a result", "unit_answers.cpp", "if (known.settled) {", "if (true) {"),
]


def text_pattern(text):
    """The text with any white space between its words, so that a formatter may break lines elsewhere."""
    return re.compile(r"\s+".join(re.escape(word) for word in text.split()))


def main():
    source, build = sys.argv[1], sys.argv[2]
    seeds = sys.argv[sys.argv.index("--seeds") + 1] if "--seeds" in sys.argv else "400"
    compiler = os.environ.get("CXX", "c++")
    failures = 0
    with tempfile.TemporaryDirectory() as folder:
        for number, (name, file, text, replacement) in enumerate(MUTATIONS):
            path = os.path.join(source, "coordinator/farm/ledger", file)
            with open(path, encoding="utf-8") as handle:
                code = handle.read()
            pattern = text_pattern(text)
            if len(pattern.findall(code)) != 1:
                print(f"NOT FOUND ONCE  {name}: {file} has changed, change this list")
                failures += 1
                continue
            mutated = os.path.join(folder, file)
            with open(mutated, "w", encoding="utf-8") as handle:
                handle.write(pattern.sub(lambda _: replacement, code))
            program = os.path.join(folder, f"farm_sim_{number}")
            subprocess.run(
                [compiler, "-std=c++20", "-O1", "-w", "-I", source, mutated,
                 os.path.join(source, "tests/sim/farm_sim.cpp"), os.path.join(build, "tests/sim/libkiln_sim.a"),
                 os.path.join(build, "coordinator/farm/ledger/libkiln_coordinator_farm_ledger.a"),
                 os.path.join(build, "common/base/libkiln_common_base.a"), "-lfmt", "-lspdlog", "-lcrypto", "-lxxhash",
                 "-o", program], check=True)
            try:
                run = subprocess.run([program, "--seeds", seeds], capture_output=True, text=True, timeout=240)
                first = run.stdout.splitlines()[0][:140] if run.stdout else f"signal {-run.returncode}"
                noticed = run.returncode != 0
            except subprocess.TimeoutExpired:
                first, noticed = "it never ended", True
            print(f"{'noticed' if noticed else 'NOT NOTICED'}  {name}: {first}", flush=True)
            failures += not noticed
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
