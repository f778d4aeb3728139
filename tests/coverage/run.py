#!/usr/bin/env python3
"""Branch coverage of the ledger and the queue by their unit tests and the simulated farm.

usage: run.py SOURCE_DIR [--build DIR] [--seeds N] [--room FOLDER] [--quick] [--least PERCENT]
Builds the tests' programs with --coverage in a tree of its own (default SOURCE_DIR/build/coverage), runs them, and
prints a row per file and every branch that no test takes. --quick: neither builds nor runs, reads the last run. Exit
status 1 below --least (default 95).

A branch is one that gcov reports and does not mark as thrown: what the compiler adds for exceptions is not counted.
EXCLUDED lists what is not counted besides, with the reason."""
import argparse
import collections
import json
import os
import re
import subprocess
import sys

ROOMS = {
    "coordinator/farm/ledger": ["ledger_test", "sim_test"],
    "coordinator/farm/queue": ["queue_test"],
}
# pattern of a statement's first line, reason
EXCLUDED = [
    (r"^\s*KILN_CHECK\(", "fails only if the program is wrong, and then ends it"),
]
MACROS = [
    (r"^\s*(return )?KILN_TRY(_STATUS)?\(", "hands an error on; the error itself is a branch where it arises"),
]


def run(command, **options):
    return subprocess.run(command, check=True, **options)


def build(source, folder, programs):
    if not os.path.exists(os.path.join(folder, "build.ninja")):
        run(["cmake", "-S", source, "-B", folder, "-G", "Ninja", "-DCMAKE_BUILD_TYPE=Coverage", "-DKILN_TESTS=ON",
             "-DCMAKE_CXX_FLAGS=--coverage -O0 -fprofile-abs-path"], stdout=subprocess.DEVNULL)
    run(["ninja", "-C", folder] + programs)


def objects(folder, room):
    """The notes of the room's library: tests that include its headers are not the room."""
    for parent, _, files in os.walk(os.path.join(folder, room)):
        for name in files:
            if name.endswith(".gcno"):
                yield os.path.join(parent, name)


def statement_lines(lines, patterns):
    """Numbers of the lines of statements that begin with one of the patterns."""
    found = {}
    number = 0
    while number < len(lines):
        reason = next((why for pattern, why in patterns if re.search(pattern, lines[number])), None)
        if reason:
            depth = 0
            while True:
                depth += lines[number].count("(") - lines[number].count(")")
                found[number + 1] = reason
                if depth <= 0 or number + 1 == len(lines):
                    break
                number += 1
        number += 1
    return found


def measure(source, folder, room):
    """{file: {line: [counts of branches]}}; a header's branches are added up over the files that include it."""
    totals = collections.defaultdict(lambda: collections.defaultdict(dict))
    for note in sorted(objects(folder, room)):
        data = note[:-5] + ".gcda"
        if not os.path.exists(data):
            raise SystemExit(f"{data}: no test ran this file")
        output = run(["gcov", "--json-format", "--stdout", "--branch-probabilities", data], capture_output=True,
                     cwd=folder).stdout
        for document in filter(None, output.decode().splitlines()):
            for file in json.loads(document)["files"]:
                name = os.path.relpath(os.path.join(folder, file["file"]), source)
                if not name.startswith(room + "/"):
                    continue
                for line in file["lines"]:
                    kept = [b["count"] for b in line["branches"] if not b["throw"]]
                    place = totals[name][line["line_number"]]
                    where = (line.get("function_name"), len(kept))
                    before = place.get(where, [0] * len(kept))
                    place[where] = [a + b for a, b in zip(before, kept)]
    return totals


def report(source, room, totals):
    taken_of_room = all_of_room = 0
    missed = []
    print(f"| file of {room} | branches | taken | % |\n|---|---|---|---|")
    for name in sorted(totals):
        with open(os.path.join(source, name), encoding="utf-8") as handle:
            text = handle.read().splitlines()
        excluded = statement_lines(text, EXCLUDED + MACROS)
        taken = every = 0
        for number, places in sorted(totals[name].items()):
            if number in excluded:
                continue
            # An inlined or instantiated function has its line several times: a branch is taken if any of them takes it.
            merged = {}
            for (_, size), counts in places.items():
                merged[size] = [max(a, b) for a, b in zip(merged.get(size, [0] * size), counts)]
            for counts in merged.values():
                every += len(counts)
                taken += sum(1 for count in counts if count)
                if counts and not all(counts):
                    missed.append(f"{name}:{number}: {counts.count(0)} of {len(counts)}: {text[number - 1].strip()}")
        taken_of_room += taken
        all_of_room += every
        if every:
            print(f"| `{os.path.basename(name)}` | {every} | {taken} | {100 * taken / every:.1f} |")
    share = 100 * taken_of_room / max(1, all_of_room)
    print(f"| all | {all_of_room} | {taken_of_room} | {share:.1f} |\n")
    print("\n".join(missed) + "\n")
    return share


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("source")
    parser.add_argument("--build")
    parser.add_argument("--seeds", default="200")
    parser.add_argument("--room", choices=sorted(ROOMS))
    parser.add_argument("--quick", action="store_true")
    parser.add_argument("--least", type=float, default=95)
    options = parser.parse_args()
    source = os.path.abspath(options.source)
    folder = os.path.abspath(options.build or os.path.join(source, "build/coverage"))
    low = False
    for room, programs in ROOMS.items():
        if options.room not in (None, room):
            continue
        if not options.quick:
            build(source, folder, programs)
            for parent, _, files in os.walk(os.path.join(folder, room)):
                for name in files:
                    if name.endswith(".gcda"):
                        os.remove(os.path.join(parent, name))
            for program in programs:
                run([os.path.join(folder, "bin", program), "--gtest_brief=1"], cwd=folder,
                    env=dict(os.environ, KILN_SEEDS=options.seeds))
        low |= report(source, room, measure(source, folder, room)) < options.least
    print("not counted besides:")
    for pattern, reason in EXCLUDED + MACROS:
        print(f"  {pattern}: {reason}")
    return 1 if low else 0


if __name__ == "__main__":
    sys.exit(main())
