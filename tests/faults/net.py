"""Networks of a row: namespaces, links, cuts. Everything lives in the mount, network and process namespaces that
run.py entered, and is gone with them."""
import subprocess
import sys
import threading
from pathlib import Path

HERE = Path(__file__).resolve().parent


def command(*words, check=True):
    done = subprocess.run([str(w) for w in words], capture_output=True, text=True)
    if check and done.returncode:
        raise RuntimeError(f"{' '.join(map(str, words))}: {done.stderr.strip()}")
    return done


class Host:
    """A machine of one row: a namespace with one address."""

    def __init__(self, space, address):
        self.space, self.address = space, address

    def wrap(self, words):
        return ["ip", "netns", "exec", self.space, *map(str, words)]


class Network:
    """The coordinator's machine with a bridge; every other machine hangs on it by one link."""

    def __init__(self, name):
        self.name = name
        self.number = 10
        self.processes = []
        self.center = Host(f"{name}c", "10.77.0.1")
        command("ip", "netns", "add", self.center.space)
        for words in (("link", "set", "lo", "up"), ("link", "add", "br0", "type", "bridge"),
                      # Its own: else it takes the lowest of its ports', and a new port cuts everybody off.
                      ("link", "set", "br0", "address", "02:00:00:00:00:01"),
                      ("addr", "add", "10.77.0.1/24", "dev", "br0"), ("link", "set", "br0", "up")):
            command("ip", "-n", self.center.space, *words)

    def _link(self, space, device, other_space, other_device):
        command("ip", "link", "add", device, "netns", space, "type", "veth", "peer", "name", other_device, "netns",
                other_space)
        command("ip", "-n", space, "link", "set", device, "up")
        command("ip", "-n", other_space, "link", "set", other_device, "up")

    def host(self, wire=None):
        """`wire`: {"delay_ms", "loss"}: its packets go through wire.py, both ways."""
        self.number += 1
        host = Host(f"{self.name}h{self.number}", f"10.77.0.{self.number}")
        port = f"p{self.number}"
        command("ip", "netns", "add", host.space)
        command("ip", "-n", host.space, "link", "set", "lo", "up")
        if wire:
            middle = f"{self.name}x{self.number}"
            command("ip", "netns", "add", middle)
            self._link(self.center.space, port, middle, "left")
            self._link(host.space, "eth0", middle, "right")
            for space, device in ((self.center.space, port), (host.space, "eth0")):
                command("ip", "netns", "exec", space, sys.executable, HERE / "wire.py", "whole-packets", device)
            self.processes.append(subprocess.Popen(
                ["ip", "netns", "exec", middle, sys.executable, str(HERE / "wire.py"), "forward", "left", "right",
                 str(wire["delay_ms"]), str(wire["loss"]), str(wire.get("seed", 1))]))
        else:
            self._link(self.center.space, port, host.space, "eth0")
        command("ip", "-n", self.center.space, "link", "set", port, "master", "br0")
        command("ip", "-n", host.space, "addr", "add", f"{host.address}/24", "dev", "eth0")
        host.port = port
        return host

    def slow(self, host, rate):
        for space, device in ((self.center.space, host.port), (host.space, "eth0")):
            command("tc", "-n", space, "qdisc", "add", "dev", device, "root", "tbf", "rate", rate, "burst", "16kb",
                    "latency", "400ms")

    def cut(self, host, way="both"):
        """way: "both", "in" (what the machine says is lost) or "out" (what it is told is lost)."""
        rules = ["table inet cut {"]
        if way in ("both", "in"):
            rules.append(f"chain i {{ type filter hook input priority 0; ip saddr {host.address} drop; }}")
        if way in ("both", "out"):
            rules.append(f"chain o {{ type filter hook output priority 0; ip daddr {host.address} drop; }}")
        rules.append("}")
        command(*self.center.wrap(["nft", "\n".join(rules)]))

    def heal(self):
        command(*self.center.wrap(["nft", "delete", "table", "inet", "cut"]))

    def flap(self, host, period_s, times):
        """Cut and whole by turns, each for a period; returns the thread."""
        pause = threading.Event()

        def turns():
            for _ in range(times):
                self.cut(host)
                pause.wait(period_s)
                self.heal()
                pause.wait(period_s)

        thread = threading.Thread(target=turns, daemon=True)
        thread.start()
        return thread

    def end(self):
        for process in self.processes:
            process.kill()
            process.wait()
        names = command("ip", "netns", "list").stdout.split()
        for name in names:
            if name.startswith((f"{self.name}c", f"{self.name}h", f"{self.name}x")):
                command("ip", "netns", "delete", name, check=False)
