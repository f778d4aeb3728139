"""A run of the program kiln: started, read without waiting, cancelled. Knows nothing of Blender."""

import functools
import os
import re
import subprocess

try:
    import pty
except ImportError:  # no terminals: progress comes every ten seconds
    pty = None

ESCAPE = re.compile(r"\x1b\[[0-9;]*[A-Za-z]")
# Before anything says how long the bake will take: the share of the pass. Then the share of the whole bake.
LOCAL_FIRST = re.compile(r"^bake\s+pass (\d+), \d+ % of it .*converged$")
LOCAL = re.compile(r"^bake\s+(?:[#.]+ )?\s*(\d+) %(?:  about (.+?) left)?  pass (\d+) .*converged$")
STAGE = re.compile(r"^(\w[\w ]*?)(?:\s+(\d+) %| \.\.\.)$")
FARM = re.compile(r"^job (\d+) .*?: (\w+)(.*)$")


# util-linux: the kernel ends the program when the thread that started it is gone, however that came about.
WITH_PARENT = ["setpriv", "--pdeathsig", "TERM"]


@functools.lru_cache(maxsize=None)
def can_end_with_parent():
    """Linux alone; elsewhere a program whose Blender crashed bakes to its end."""
    try:
        return subprocess.run([*WITH_PARENT, "true"], check=False, stdin=subprocess.DEVNULL, stdout=subprocess.DEVNULL,
                              stderr=subprocess.DEVNULL).returncode == 0
    except OSError:
        return False


class Run:
    def __init__(self, command, environment=None):
        self.lines, self.stage, self.share, self.left, self.job = [], "starting", 0.0, "", None
        self._parts = {}
        terminal = pty.openpty() if pty else None
        if can_end_with_parent():
            command = [*WITH_PARENT, *command]
        try:
            self._process = subprocess.Popen(
                command, stdin=subprocess.DEVNULL, stdout=subprocess.PIPE,
                stderr=terminal[1] if terminal else subprocess.PIPE, env=environment, start_new_session=True)
        finally:
            if terminal:
                os.close(terminal[1])
        self._streams = [self._process.stdout.fileno(), terminal[0] if terminal else self._process.stderr.fileno()]
        self._terminal = terminal[0] if terminal else None
        for stream in self._streams:
            os.set_blocking(stream, False)

    @property
    def pid(self):
        return self._process.pid

    def poll(self):
        """Reads what there is. The exit status, or None while it runs."""
        status = self._process.poll()
        for stream in self._streams:
            self._read(stream)
        if status is not None and self._terminal is not None:
            os.close(self._terminal)
            self._terminal = None
            self._streams = []
        return status

    def cancel(self):
        """Ends it and waits until it has ended; its workers end with it."""
        if self._process.poll() is None:
            self._process.terminate()
            try:
                self._process.wait(timeout=10)
            except subprocess.TimeoutExpired:
                self._process.kill()
                self._process.wait()

    def error(self):
        """What it said last that is no progress."""
        said = [line for line in self.lines if line.startswith("kiln: ")]
        return said[-1][6:] if said else (self.lines[-1] if self.lines else "it said nothing")

    def _read(self, stream):
        while True:
            try:
                data = os.read(stream, 65536)
            except (BlockingIOError, OSError):  # a terminal whose program has ended gives an error
                return
            if not data:
                return
            text = self._parts.get(stream, "") + ESCAPE.sub("", data.decode("utf-8", "replace"))
            *whole, self._parts[stream] = re.split(r"[\r\n]+", text)
            for line in whole:
                self._take(line.strip())
            self._take(self._parts[stream].strip(), partial=True)

    def _take(self, line, partial=False):
        if not line:
            return
        if found := LOCAL.match(line):
            self.stage, self.share, self.left = "pass " + found[3], float(found[1]), found[2] or ""
        elif found := LOCAL_FIRST.match(line):
            self.stage = "pass " + found[1]
        elif found := FARM.match(line):
            self.job, self.stage = int(found[1]), found[2]
            share, left = re.search(r"(\d+) %", found[3]), re.search(r"about (.+?) left", found[3])
            self.share, self.left = float(share[1]) if share else 0.0, left[1] if left else ""
        elif found := STAGE.match(line):
            self.stage, self.share, self.left = found[1], float(found[2] or 0), ""
        elif not partial:
            if found := re.match(r"^job (\d+)$", line):
                self.job = int(found[1])
            self.lines.append(line)
