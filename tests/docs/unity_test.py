"""configs/engines/unity/bakery_textures.py: PNG files with every filter are read, and Bakery's formula on what it writes gives
Kiln's E/pi in Unity's axes, to what 8 bits hold.

usage: unity_test.py
"""
import pathlib
import random
import struct
import subprocess
import sys
import tempfile
import zlib

TOOL = pathlib.Path(__file__).resolve().parents[2] / "configs/engines/unity/bakery_textures.py"
SIZE = 15


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def paeth(a, b, c):
    p = a + b - c
    return a if abs(p - a) <= abs(p - b) and abs(p - a) <= abs(p - c) else b if abs(p - b) <= abs(p - c) else c


def write(path, pixels):
    """RGB rows; row y is filtered by y % 5."""
    raw, above = b"", [0] * 3 * SIZE
    for y, row in enumerate(pixels):
        flat, kind = [v for p in row for v in p], y % 5
        raw += bytes([kind])
        for i, v in enumerate(flat):
            a, b = flat[i - 3] if i > 2 else 0, above[i]
            c = above[i - 3] if i > 2 else 0
            raw += bytes([(v - (0, a, b, (a + b) // 2, paeth(a, b, c))[kind]) & 255])
        above = flat
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", SIZE, len(pixels), 8, 2, 0, 0, 0)) +
                     chunk(b"IDAT", zlib.compress(raw)) + chunk(b"IEND", b""))


def read(path):
    data = path.read_bytes()
    at = data.index(b"IDAT")
    raw = zlib.decompress(data[at + 4:at + 4 + struct.unpack_from(">I", data, at - 4)[0]])
    stride = 1 + 3 * SIZE
    assert all(raw[i] == 0 for i in range(0, len(raw), stride))
    return [[tuple(raw[y * stride + 1 + 3 * x:][:3]) for x in range(SIZE)] for y in range(len(raw) // stride)]


def main():
    rng = random.Random(5)
    light = [[([rng.random() * 9 for _ in range(3)], [[rng.uniform(-0.6, 0.6) for _ in range(3)] for _ in range(3)])
              for _ in range(SIZE)] for _ in range(SIZE)]  # L0 by colour, L1/L0 by axis and colour
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        for axis in range(3):
            write(folder / f"lightmap_rgb8_L1{'xyz'[axis]}.png",
                  [[tuple(round(255 * (r[axis][c] + 1) / 2) for c in range(3)) for _, r in row] for row in light])
        subprocess.run([sys.executable, TOOL, folder, folder / "sh"], check=True)
        maps = [read(folder / f"sh/lightmap_L1{a}.png") for a in "xyz"]
        worst = 0
        for y in range(SIZE):
            for x in range(SIZE):
                l0, ratio = light[y][x]
                n = [rng.gauss(0, 1) for _ in range(3)]
                n = [v / sum(w * w for w in n) ** 0.5 for v in n]
                unity = [-n[0], n[1], n[2]]
                for c in range(3):
                    kiln = l0[c] * (1 + 2 * sum(ratio[a][c] * n[a] for a in range(3)))
                    bakery = l0[c] + sum(unity[a] * (2 * maps[a][y][x][c] / 255 - 1) * l0[c] * 2 for a in range(3))
                    worst = max(worst, abs(kiln - bakery) / l0[c])
        assert worst < 2 * 3 ** 0.5 / 255 + 1e-9, worst
        print(f"off by {worst:.4f} of L0 at most")
        (folder / "lightmap_rgb8_L1x.png").write_bytes(b"no picture")
        said = subprocess.run([sys.executable, TOOL, folder, folder / "sh"], capture_output=True, text=True)
        assert said.returncode == 1 and "is no PNG file" in said.stderr, said


if __name__ == "__main__":
    main()
