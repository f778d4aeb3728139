#!/usr/bin/env python3
"""Branch coverage of the ledger and the queue by their unit tests and the simulated farm.

usage: run.py SOURCE_DIR [--build DIR] [--seeds N] [--room FOLDER] [--quick] [--least PERCENT]
Builds the tests' programs with --coverage in a tree of its own (default SOURCE_DIR/build/coverage), runs them, and
prints a row per file and every branch that no test takes. --quick: neither builds nor runs, reads the last run. Exit
status 1 if a room is below --least (default 95).

A branch is an outcome of a condition that gcov reports: `a && b` has four. The tree is built without exceptions, so
that calls are no branches. Statements of EXCLUDED are not counted, and the output says how many branches each
kind would have added. A KILN_TRY with a condition of its own counts like any other line."""
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
# name, pattern of a statement's first line, what makes it count all the same, reason
EXCLUDED = [
    ("KILN_CHECK", re.compile(r"^\s*KILN_CHECK\("), None, "a contract: fails only if the program is wrong, and ends it"),
    ("KILN_TRY", re.compile(r"^\s*KILN_TRY(_STATUS)?\("), re.compile(r"\?|&&|\|\||[{}]"),
     "hands on an error that is a branch where it arises"),
    ("a lone }", re.compile(r"^\s*\}[;)]*$"), None, "no condition: the ways out of a scope by its returns, once more"),
    ("= default", re.compile(r"operator(==|<=>)\(.*= default;"), None, "the compiler's comparison of each member"),
]
STRINGS = re.compile(r'"(\\.|[^"\\])*"')


def run(command, **options):
    return subprocess.run(command, check=True, **options)


def build(source, folder, programs):
    if not os.path.exists(os.path.join(folder, "build.ninja")):
        run(["cmake", "-S", source, "-B", folder, "-G", "Ninja", "-DKILN_COVERAGE=ON", "-DKILN_TESTS=ON"],
            stdout=subprocess.DEVNULL)
    run(["ninja", "-C", folder] + programs)


def files_below(folder, ending):
    return sorted(os.path.join(parent, name) for parent, _, names in os.walk(folder) for name in names
                  if name.endswith(ending))


def excluded_lines(lines):
    """{number of a statement's line: name of its exclusion}"""
    found = {}
    number = 0
    while number < len(lines):
        entry = next((entry for entry in EXCLUDED if entry[1].search(lines[number])), None)
        if entry:
            first, depth = number, 0
            while True:
                depth += lines[number].count("(") - lines[number].count(")")
                if depth <= 0 or number + 1 == len(lines):
                    break
                number += 1
            if not (entry[2] and entry[2].search(STRINGS.sub("", " ".join(lines[first:number + 1])))):
                found.update((line, entry[0]) for line in range(first + 1, number + 2))
        number += 1
    return found


def read_notes(source, folder, room, note, totals):
    """Adds up the counts of one object file; without a run they are zero."""
    output = run(["gcov", "--json-format", "--stdout", "--branch-probabilities", note], capture_output=True,
                 cwd=folder).stdout
    for document in filter(None, output.decode().splitlines()):
        for file in json.loads(document)["files"]:
            name = os.path.relpath(os.path.join(folder, file["file"]), source)
            if not name.startswith(room + "/"):
                continue
            # Instances of a template begin at one place, a lambda and the function around it do not.
            starts = {f["name"]: (f["start_line"], f["start_column"]) for f in file["functions"]}
            for line in file["lines"]:
                counts = [branch["count"] for branch in line["branches"]]
                if not counts:
                    continue
                if any(branch["throw"] for branch in line["branches"]):
                    raise SystemExit(f"{name}:{line['line_number']}: built with exceptions")
                where = (line["line_number"], starts.get(line.get("function_name")), len(counts))
                before = totals[name].get(where, [0] * len(counts))
                totals[name][where] = [a + b for a, b in zip(before, counts)]


def measure(source, folder, room):
    """{file: {(line, start of its function, number of branches): counts}}, over all objects that include the file."""
    totals = collections.defaultdict(dict)
    for part in (room, "tests"):
        for note in files_below(os.path.join(folder, part), ".gcno"):
            read_notes(source, folder, room, note, totals)
    return totals


def report(source, room, totals):
    taken_of_room = all_of_room = 0
    missed = []
    left_out = collections.Counter()
    print(f"| file of {room} | branches | taken | % |\n|---|---|---|---|")
    for name in sorted(totals):
        with open(os.path.join(source, name), encoding="utf-8") as handle:
            text = handle.read().splitlines()
        excluded = excluded_lines(text)
        taken = every = 0
        for (number, _, _), counts in sorted(totals[name].items(), key=lambda item: item[0][0]):
            if number in excluded:
                left_out[excluded[number]] += len(counts)
                continue
            every += len(counts)
            taken += sum(1 for count in counts if count)
            if not all(counts):
                missed.append(f"{name}:{number}: {counts.count(0)} of {len(counts)}: {text[number - 1].strip()}")
        taken_of_room += taken
        all_of_room += every
        if every:
            print(f"| `{os.path.basename(name)}` | {every} | {taken} | {100 * taken / every:.1f} |")
    share = 100 * taken_of_room / max(1, all_of_room)
    print(f"| all | {all_of_room} | {taken_of_room} | {share:.1f} |\n")
    print("\n".join(missed))
    for name, _, _, reason in EXCLUDED:
        print(f"not counted: {left_out[name]} branches of {name}: {reason}")
    print(flush=True)
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
    rooms = [room for room in ROOMS if options.room in (None, room)]
    if not options.quick:
        programs = [program for room in rooms for program in ROOMS[room]]
        build(source, folder, programs)
        for counts in files_below(folder, ".gcda"):
            os.remove(counts)
        for program in programs:
            run([os.path.join(folder, "bin", program), "--gtest_brief=1"], cwd=folder,
                env=dict(os.environ, KILN_SEEDS=options.seeds))
    shares = [report(source, room, measure(source, folder, room)) for room in rooms]
    return 1 if min(shares) < options.least else 0


if __name__ == "__main__":
    sys.exit(main())
