"""What the pages say, held against the repository and the programs.

usage: docs_test.py links | site | spelling
       docs_test.py commands | settings | tutorial=PAGE  BIN

Exit status: 0 all holds, 1 something does not, 77 this machine has not what the check needs (said in one line).
"""
import html.parser
import os
import pathlib
import re
import shlex
import shutil
import signal
import socket
import subprocess
import sys
import tempfile
import time
import urllib.parse

ROOT = pathlib.Path(__file__).resolve().parents[2]
TUTORIALS = ("docs/first-bake.md", "docs/first-farm.md")
SERVERS = ("serve", "view", "kiln-worker")  # end when they are told to
FORMATS = ("charts",)  # `kiln charts` is what a file says that it is
SCRIPT = ("test", "package", "docs", "build-all")  # commands of the script ./kiln alone
problems = []


def pages():
    found = [ROOT / "README.md", *ROOT.glob("docs/**/*.md"), *ROOT.glob("configs/engines/**/*.md"),
             *ROOT.glob("tests/*/README.md")]
    return sorted(p for p in found if "node_modules" not in p.parts)


def skip(why):
    print(f"skipped: {why}")
    sys.exit(77)


def skip_without(program):
    """Where the program is not installed, or `./kiln test --without docs` leaves it out."""
    if "docs" in os.environ.get("KILN_TEST_WITHOUT", "").split():
        skip("left out: --without docs")
    if shutil.which(program) is None:
        skip(f"{program} is not installed")


def without_code(text, inline=True):
    """Fenced and indented blocks, and what stands between backticks, are blanked; lines stay."""
    out, fenced, before = [], False, ""
    for line in text.split("\n"):
        if line.lstrip().startswith("```"):
            fenced = not fenced
            line = ""
        elif fenced or (line.startswith("    ") and not before.strip().startswith(("-", "1"))):
            line = ""
        else:
            before = line or before
        out.append(line)
    text = "\n".join(out)
    return re.sub(r"(`+)(?:.|\n)*?\1", " ", text) if inline else text


def slug(heading):
    """The anchor that GitHub gives a heading."""
    heading = re.sub(r"!?\[([^\]]*)\]\([^)]*\)", r"\1", heading)
    return re.sub(r"[^\w\- ]", "", heading.strip().lower()).replace(" ", "-")


def anchors(page):
    found, text = {}, without_code(page.read_text(), inline=False)
    for heading in re.findall(r"^#+ +(.*?) *#*$", text, re.M):
        name = slug(heading)
        found[name] = found.get(name, 0) + 1
    return set(found) | {f"{name}-{i}" for name, n in found.items() for i in range(1, n)}


def check_links():
    links = 0
    for page in pages():
        for target in re.findall(r"\]\(([^()\s]*(?:\([^()]*\))?[^()\s]*)\)", without_code(page.read_text())):
            if re.match(r"[a-z]+:", target):
                continue
            links += 1
            path, _, anchor = target.partition("#")
            file = (page.parent / urllib.parse.unquote(path)).resolve() if path else page
            where = f"{page.relative_to(ROOT)}: {target}"
            if not file.exists():
                problems.append(f"{where}: no such file")
            elif anchor and file.suffix == ".md" and anchor not in anchors(file):
                problems.append(f"{where}: no such heading")
    print(f"{links} links on {len(pages())} pages")
    if links < 150:
        problems.append("hardly any links were found")


def code_lines(text, inline=True):
    """Lines of code blocks and short code in the text; lines that a backslash continues are joined."""
    out, fenced, before = [], False, ""
    for line in text.replace("\\\n", " ").split("\n"):
        if line.startswith("```"):
            fenced = not fenced
        elif fenced or (line.startswith("    ") and (not before.strip() or before.startswith(("    ", "#")))):
            out.append(line.strip())
        elif inline:
            out += re.findall(r"(?<!`)`([^`]+)`(?!`)", line)
        before = line
    return out


def words_of(command):
    command = re.sub(r"\[[^\]]*\]|\.\.\.", "", command)  # [settings of a bake]
    try:
        words = shlex.split(command, comments=True)
    except ValueError:
        words = command.split("#")[0].split()
    for stop in ("|", ">", "&&", "&", ";"):
        if stop in words:
            words = words[:words.index(stop)]
    while words and re.match(r"[A-Z_]+=", words[0]):
        words = words[1:]
    return words


def helped(program, *arguments):
    out = subprocess.run([program, *arguments], capture_output=True, text=True).stdout
    return set(re.findall(r"(?<![\w-])--[a-z0-9][\w-]*", "\n".join(
        line[:34] for line in out.splitlines() if line.startswith("  -")))) | {"--help"}, out


def check_commands(binaries):
    """Every command line on every page names a command and options that there are."""
    kiln, worker = binaries / "kiln", binaries / "kiln-worker"
    listed = set(re.findall(r"^  (\w[\w-]*) ", helped(kiln, "help")[1].split("Subcommands:")[1], re.M))
    listed |= {"help", "version", "check-scene", "manual-pages"}
    options, seen = {}, 0
    for page in pages():
        for line in code_lines(page.read_text()):
            words = words_of(line)
            if len(words) < 2 or words[0].split("/")[-1] not in ("kiln", "kiln-worker"):
                continue
            name, words = words[0].split("/")[-1], words[1:]
            where = f"{page.relative_to(ROOT)}: {line}"
            if name == "kiln" and words[0].startswith("--"):
                known = helped(kiln, "--help")[0]
            elif name == "kiln":
                if words[0] in SCRIPT + FORMATS or words[0].isupper():
                    continue
                if words[0] not in listed:
                    if re.match(r"[a-z]", words[0]):
                        problems.append(f"{where}: there is no command {words[0]}")
                    continue
                known = options.setdefault(words[0], helped(kiln, "help", words[0])[0] | (
                    {"--scene"} if words[0] == "check-scene" else set()))
            else:
                known = options.setdefault(name, helped(worker, "--help")[0])
            seen += 1
            for word in words:
                if word == "--":
                    break
                if word.startswith("--") and re.sub(r"[=|].*", "", word) not in known:
                    problems.append(f"{where}: there is no option {word}")
    print(f"{seen} commands")
    if seen < 200:
        problems.append("hardly any commands were found")


def check_settings(binaries):
    made = subprocess.run([sys.executable, ROOT / "tests/docs/settings_reference.py", binaries / "kiln"],
                          capture_output=True, text=True)
    if made.returncode:
        problems.append(made.stderr.strip().splitlines()[-1])
    elif made.stdout.strip() not in (ROOT / "docs/settings.md").read_text():
        problems.append("docs/settings.md is not what the program says: "
                        "run python3 tests/docs/settings_reference.py build/bin/kiln --write")


def free_port():
    with socket.socket() as s:
        s.bind(("127.0.0.1", 0))
        return str(s.getsockname()[1])


def heard(process, output):
    """Waits until a server has said where it listens."""
    for _ in range(600):
        output.seek(0)
        if "127.0.0.1" in output.read():
            return True
        if process.poll() is not None:
            return False
        time.sleep(0.1)
    return False


def run_lines(lines, binaries, prepare=lambda folder: None):
    """Runs lines one after another in a folder that has the programs, tests and configs; servers go on until the end."""
    ports = {port: free_port() for port in ("7800", "7801")}
    environment = dict(os.environ, PATH=f"{binaries}:{os.environ['PATH']}")
    running = []
    with tempfile.TemporaryDirectory() as folder:
        for name, to in (("kiln", binaries / "kiln"), ("tests", ROOT / "tests"), ("configs", ROOT / "configs")):
            os.symlink(to, pathlib.Path(folder) / name)
        prepare(pathlib.Path(folder))
        environment["XDG_CACHE_HOME"] = folder + "/cache"
        try:
            for line in lines:
                command = re.sub(r"\b780[01]\b", lambda m: ports[m[0]], line)
                words = words_of(command)
                if words[0] == "export":
                    environment |= dict(word.split("=", 1) for word in words[1:])
                    continue
                serves = words[0] == "kiln-worker" or words[1] in SERVERS
                if words[1] == "view" and not (ROOT / "docs/examples/three/node_modules/three").exists():
                    print("left out:", line, "(three.js is not installed: npm ci --prefix docs/examples/three)", flush=True)
                    continue
                if words[1] == "view":
                    command += " --port " + free_port()
                elif words[1] == "serve" and "--listen" not in words:
                    command += " --listen 127.0.0.1:" + ports["7800"]
                print("$", command, flush=True)
                output = open(pathlib.Path(folder) / f"output.{len(running)}", "w+")
                command = re.sub(r"^((?:[A-Z_]+=\S+ )*)", r"\1exec ", command)
                process = subprocess.Popen(["sh", "-c", command], cwd=folder, env=environment, stdin=subprocess.DEVNULL,
                                           stdout=output, stderr=subprocess.STDOUT)
                if serves:
                    running.append((line, process, output))
                    if words[0] == "kiln-worker":
                        time.sleep(1)
                    elif not heard(process, output):
                        problems.append(f"{line}: says no address")
                    if process.poll() is not None:
                        output.seek(0)
                        problems.append(f"{line}: ended with {process.returncode}: {output.read()}")
                elif process.wait(timeout=280):
                    output.seek(0)
                    problems.append(f"{line}: status {process.returncode}: {output.read()[-2000:]}")
        finally:
            for _, process, _ in reversed(running):
                process.send_signal(signal.SIGINT)
            for line, process, _ in running:
                try:
                    process.wait(timeout=60)
                except subprocess.TimeoutExpired:
                    process.kill()
                    problems.append(f"{line}: did not end")


def check_tutorial(page, binaries):
    lines = [line.strip() for line in page.read_text().split("\n") if line.startswith("    ")]
    run_lines(lines, binaries)
    if not lines:
        problems.append("there are no commands")


class References(html.parser.HTMLParser):
    def __init__(self, text):
        super().__init__()
        self.ids, self.links, self.loads = set(), [], []
        self.feed(text)

    def handle_starttag(self, tag, attributes):
        at = dict(attributes)
        self.ids |= {at.get("id"), at.get("name")}
        if tag == "a" and at.get("href"):
            self.links.append(at["href"])
        if tag in ("script", "img") and at.get("src"):
            self.loads.append(at["src"])
        if tag == "link" and at.get("rel") != "canonical" and at.get("href"):
            self.loads.append(at["href"])


def check_site():
    skip_without("mkdocs")
    with tempfile.TemporaryDirectory() as folder:
        # Not this test's interpreter, if that is not Debian's own.
        made = subprocess.run(["mkdocs", "build", "--strict", "--quiet", "--config-file", ROOT / "mkdocs.yml", "--site-dir",
                               folder], capture_output=True, text=True)
        if made.returncode:
            problems.append(made.stdout + made.stderr)
            return
        site = pathlib.Path(folder)
        read = {page: References(page.read_text()) for page in site.rglob("*.html")}
        for page, there in read.items():
            for target in there.links + there.loads:
                if re.match(r"(https?:)?//", target):
                    if target in there.loads:
                        problems.append(f"{page.relative_to(site)} loads {target} from the network")
                    continue
                path, _, anchor = target.partition("#")
                file = (page.parent / urllib.parse.unquote(path)).resolve() if path else page
                if page.name == "404.html" or target.startswith("mailto:"):
                    continue
                if not file.exists():
                    problems.append(f"{page.relative_to(site)}: {target}: no such file")
                elif anchor and file in read and urllib.parse.unquote(anchor) not in read[file].ids:
                    problems.append(f"{page.relative_to(site)}: {target}: no such place")
        index = (site / "search/search_index.json").read_text()
        for word in ("splotches", "KILN_lightmap", "--texels-per-metre", "LightmapGIData"):
            if word not in index:
                problems.append(f"the search does not find {word}")
        made_of = {page.stem for page in ROOT.glob("docs/*.md")} - {page.stem for page in read}
        if made_of:
            problems.append(f"not on the site: {sorted(made_of)}")
        print(f"{len(read)} pages")


def check_spelling():
    skip_without("aspell")
    if "en_GB" not in subprocess.run(["aspell", "dicts"], capture_output=True, text=True).stdout:
        skip("aspell has no British dictionary (Debian: aspell-en)")
    listed = (ROOT / "tests/docs/words.txt").read_text().split("\n")[:-1]
    if listed != sorted(set(listed)):
        problems.append("tests/docs/words.txt is not sorted, or has a word twice")
    where, text = {}, []
    for page in pages():
        prose = re.sub(r"\]\([^)]*\)|https?:\S+|<[^>]*>", " ", without_code(page.read_text()))
        prose = re.sub(r"\S*[_/\\^=0-9]\S*|\S*\w\.\w\S*|--\S+", " ", prose)  # names of files and keys, formulas
        for word in re.findall(r"[^\W\d_](?:[^\W\d_]|'(?=[^\W\d_]))+", prose):
            where.setdefault(word, page.relative_to(ROOT))
    unknown = subprocess.run(["aspell", "list", "--lang=en_GB", "--encoding=utf-8", "--ignore-case=false"],
                             input="\n".join(where), capture_output=True, text=True, check=True).stdout.split()
    strange = sorted(set(unknown) - set(listed))
    for word in strange:
        problems.append(f"{where.get(word)}: {word}")
    for word in sorted(set(listed) - set(where)):
        problems.append(f"tests/docs/words.txt: {word} is on no page")
    print(f"{len(where)} words, {len(listed)} of the field")


def main():
    what = sys.argv[1]
    binaries = pathlib.Path(sys.argv[2]).resolve() if len(sys.argv) > 2 else None
    if what.startswith("tutorial="):
        check_tutorial(ROOT / what.split("=")[1], binaries)
    elif what in ("commands", "settings"):
        {"commands": check_commands, "settings": check_settings}[what](binaries)
    else:
        {"links": check_links, "site": check_site, "spelling": check_spelling}[what]()
    for problem in problems:
        print("FAILED:", problem)
    return bool(problems)


if __name__ == "__main__":
    sys.exit(main())
