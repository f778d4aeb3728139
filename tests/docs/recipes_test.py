"""Runs the commands of every page that is not a tutorial (docs_test.py runs those), on one small room and one small farm.

usage: recipes_test.py BIN [PAGE ...]

The lines of a page run one after another in a folder of their own, in which scene.glb, level.glb and the others that pages
speak of are the same closed room. What a page leaves open is filled in (FILLED); bakes that do not say how many samples get
16, the demo one texel a metre. Commands that cannot run here are named with what
runs them instead (ELSEWHERE). Any other must end with status 0.
"""
import json
import pathlib
import re
import shutil
import sys
import tempfile

import docs_test
from docs_test import ROOT

sys.path.insert(0, str(ROOT / "tests/bench"))
import error_scenes  # noqa: E402

SCENES = ("scene.glb", "level.glb", "hall.glb")
# Beginning of a command -> what runs it.
ELSEWHERE = {
    "kiln test": ".ci/run", "kiln package": "tests/packages/bare.sh", "kiln docs": "Docs.Site",
    "kiln-worker --replay": "agent_test", "kiln-worker --play": "agent_test", "kiln workers --forgive": "service_test",
}
FILLED = (
    ("/srv/kiln", "farm"), ("/etc/kiln/token", "farm/worker.token"), ("render1:7800", "127.0.0.1:7800"),
    (r" 12/77\b", " 2/0"), (r" 12\b", " 2"), ("--data DIR", "--data farm"),
    ("why worker render7", "why worker 1"),
)
FEW, COARSE = " --min-samples 16 --max-samples 16", " --texels-per-metre 1"
VOLUMES = {"version": 1, "volumes": [{"name": "middle", "min": [0.3, 0.3, 0.3], "max": [0.7, 0.7, 0.7], "spacing": 0.2}]}
# Pages whose commands stand in their text and tables.
INLINE = ("docs/queue.md",)
# What the reader of a page has done before its first command.
BEFORE = {
    "docs/operating.md": ["kiln serve --data farm", "export KILN_TOKEN_FILE=farm/worker.token"],
}
# After a line, to have a job that is not done; what waits for its end comes last.
AFTER = ("kiln submit hall.glb", "kiln submit hall.glb --texels-per-metre 4 --min-samples 2048 --max-samples 2048")
LAST = ("kiln watch", "kiln fetch")


def commands_of(name, text):
    """Calls of our programs in code blocks, and in the text of the pages of INLINE; what sets the environment for them."""
    lines = docs_test.code_lines(text, name in INLINE)
    return [line for line in lines if re.match(r"export |([A-Z_]+=\S+ )*(\./)?kiln(-worker)? \S*[a-z]", line) and
            (name not in INLINE or re.search(r" (12|render7|--?[a-z])|export", line))]


def command_of(line):
    """The line as it is run, without a comment; None: it runs elsewhere."""
    command = re.sub(r"\s+#.*", "", line).replace("./kiln ", "kiln ")
    for beginning, test in ELSEWHERE.items():
        if command.startswith(beginning):
            print("left out: %s (%s runs it)" % (command, test), flush=True)
            return None
    for of_the_page, here in FILLED:
        command = re.sub(of_the_page, here, command)
    bakes = re.match(r"kiln (bake|submit) ", command)
    if not bakes:
        return command
    few = "" if "--min-samples" in command else FEW
    return command + few + (COARSE if "arcade" in command and "--texels-per-metre" not in command else "")


def main():
    binaries = pathlib.Path(sys.argv[1]).resolve()
    count = 0
    with tempfile.TemporaryDirectory() as made:
        room = error_scenes.write(made)["cornell"]

        def prepare(folder):
            for name in SCENES:
                shutil.copyfile(room, folder / name)
            (folder / "volumes.json").write_text(json.dumps(VOLUMES))

        for page in docs_test.pages():
            name = str(page.relative_to(ROOT))
            lines = commands_of(name, page.read_text())
            if name in docs_test.TUTORIALS or not lines or (sys.argv[2:] and name not in sys.argv[2:]):
                continue
            print("##", name, flush=True)
            lines = [c for c in map(command_of, BEFORE.get(name, []) + lines) if c]
            if name in INLINE:
                at = next(i for i, line in enumerate(lines) if line.startswith(AFTER[0]))
                lines.insert(at + 1, AFTER[1])
                lines.sort(key=lambda line: line.startswith(LAST))
            count += len(lines)
            docs_test.run_lines(lines, binaries, prepare)
    if count < 40 and not sys.argv[2:]:
        docs_test.problems.append("hardly any commands were found")
    for problem in docs_test.problems:
        print("FAILED:", problem)
    return bool(docs_test.problems)


if __name__ == "__main__":
    sys.exit(main())
