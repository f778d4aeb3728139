#!/usr/bin/env python3
"""Milliseconds from starting a worker to its Hello: hello_time.py [PROGRAM] (default build/bin/kiln-worker)."""
import os
import socket
import statistics
import subprocess
import sys
import time

ROOT = os.path.dirname(os.path.dirname(os.path.dirname(os.path.abspath(__file__))))
program = sys.argv[1] if len(sys.argv) > 1 else os.path.join(ROOT, "build/bin/kiln-worker")

listener = socket.create_server(("127.0.0.1", 0))
listener.settimeout(10)
times = []
for _ in range(20):
    start = time.perf_counter()
    worker = subprocess.Popen([program, "--connect", "127.0.0.1:%d" % listener.getsockname()[1]],
                              stderr=subprocess.DEVNULL)
    peer, _ = listener.accept()
    head = peer.recv(16)
    times.append((time.perf_counter() - start) * 1000)
    worker.kill()
    worker.wait()
    peer.close()
    if head[:2] != b"KL" or head[4] != 1:
        sys.exit("the first message was not a Hello")
print("start to Hello: median %.1f ms, worst %.1f ms of %d starts"
      % (statistics.median(times), max(times), len(times)))
