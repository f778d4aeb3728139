"""Links that misbehave, for kernels without netem and for damage that no kernel makes.

  wire.py forward LEFT RIGHT DELAY_MS LOSS SEED   frames between two devices: each later by the delay, some never
  wire.py whole-packets DEVICE                    no segmentation or checksums by the device: frames are real ones
  wire.py relay PORT HOST:PORT [--flip-every BYTES] [--seed N]
        TCP from 127.0.0.1:PORT; flips one bit in about so many bytes, both ways
"""
import argparse
import array
import fcntl
import heapq
import random
import select
import socket
import struct
import sys
import threading
import time

EVERY_PROTOCOL = 0x0003
PACKET_OUTGOING = 4


def forward(left, right, delay_ms, loss, seed):
    rng = random.Random(seed)
    sockets = []
    for device in (left, right):
        s = socket.socket(socket.AF_PACKET, socket.SOCK_RAW, socket.htons(EVERY_PROTOCOL))
        s.bind((device, 0))
        sockets.append(s)
    other = {sockets[0]: sockets[1], sockets[1]: sockets[0]}
    waiting, number = [], 0
    while True:
        now = time.monotonic()
        while waiting and waiting[0][0] <= now:
            _, _, target, frame = heapq.heappop(waiting)
            try:
                target.send(frame)
            except OSError:
                pass  # the device's queue is full: one more loss
        patience = max(0.0, waiting[0][0] - now) if waiting else None
        for s in select.select(sockets, [], [], patience)[0]:
            frame, address = s.recvfrom(65536)
            # Neighbours are found without loss: the fault is meant for the farm's packets.
            is_ip = frame[12:14] == b"\x08\x00"
            if address[2] == PACKET_OUTGOING or (is_ip and rng.random() < loss):
                continue
            number += 1
            heapq.heappush(waiting, (time.monotonic() + delay_ms / 1000, number, other[s], frame))


def whole_packets(device):
    SIOCETHTOOL, SET = 0x8946, (0x17, 0x1F, 0x24, 0x2C)  # TX checksum, TSO, GSO, GRO
    s = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
    for what in SET:
        value = array.array("B", struct.pack("II", what, 0))
        try:
            fcntl.ioctl(s, SIOCETHTOOL, struct.pack("16sP", device.encode(), value.buffer_info()[0]) + b"\0" * 16)
        except OSError as error:
            print(f"{device}: ethtool {what:#x}: {error}", file=sys.stderr)


class Flipper:
    def __init__(self, every, rng):
        self.every, self.rng = every, rng
        self.left = self.draw()

    def draw(self):
        return int(self.rng.expovariate(1 / self.every)) if self.every else None

    def apply(self, data):
        if not self.every:
            return data
        data = bytearray(data)
        at = self.left
        while at < len(data):
            data[at] ^= 1 << self.rng.randrange(8)
            at += 1 + self.draw()
        self.left = at - len(data)
        return bytes(data)


def pump(source, target, flipper):
    try:
        while True:
            data = source.recv(65536)
            if not data:
                break
            target.sendall(flipper.apply(data))
    except OSError:
        pass
    for s in (source, target):
        try:
            s.shutdown(socket.SHUT_RDWR)
        except OSError:
            pass


def relay(options):
    rng = random.Random(options.seed)
    host, port = options.to.rsplit(":", 1)
    listener = socket.create_server(("127.0.0.1", options.port))
    while True:
        caller, _ = listener.accept()
        try:
            called = socket.create_connection((host, int(port)))
        except OSError:
            caller.close()
            continue
        for source, target in ((caller, called), (called, caller)):
            threading.Thread(target=pump, args=(source, target, Flipper(options.flip_every, rng)),
                             daemon=True).start()


def main():
    what, arguments = sys.argv[1], sys.argv[2:]
    if what == "forward":
        forward(arguments[0], arguments[1], float(arguments[2]), float(arguments[3]), int(arguments[4]))
    elif what == "whole-packets":
        whole_packets(arguments[0])
    elif what == "relay":
        parser = argparse.ArgumentParser()
        parser.add_argument("port", type=int)
        parser.add_argument("to")
        parser.add_argument("--flip-every", type=int, default=0)
        parser.add_argument("--seed", type=int, default=1)
        relay(parser.parse_args(arguments))


if __name__ == "__main__":
    main()
