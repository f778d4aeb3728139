#!/usr/bin/env python3
"""Where a bake errs: true and stated error by brightness, against a reference in two independent halves.

    kiln bench scene.glb -o bench --only-reference              # prints the folder of the halves
    python3 tests/bench/by_brightness.py OUT REFERENCE/half0 REFERENCE/half1 [--before-denoiser]

A row is a range of E over its mean, a factor of 3 wide. *Bake over half*: the sum of E over that of a half; the range is that of
the other half, so that no noise chooses its own texels. Where both numbers are off by the same, all texels of the row share an
error. relMSE: true, by the product of the differences from the halves; stated; and the reference's own; each relative to the mean of
the row. (Relative to each texel of a reference that errs by more than the bake, the product is no longer without bias: where both
halves are too dark it is positive and counts most.)
"""
import array
import math
import os
import struct
import sys
import zlib

LINES = {0: 1, 2: 1, 3: 16}  # by compression: none, ZIPS, ZIP
MEASURED = 1
STEP = 3


def name_at(data, at):
    end = data.index(b"\0", at)
    return data[at:end].decode(), end + 1


def unpacked(data):
    """OpenEXR's ZIP: deltas of bytes whose even and odd places stand apart."""
    data = bytearray(zlib.decompress(data))
    for i in range(1, len(data)):
        data[i] = (data[i] + data[i - 1] - 128) & 255
    half, out = (len(data) + 1) // 2, bytearray(len(data))
    out[0::2], out[1::2] = data[:half], data[half:]
    return bytes(out)


def read_exr(path):
    """Channel -> float32 values, of the files that Kiln writes."""
    with open(path, "rb") as file:
        data = file.read()
    at, header = 8, {}
    while data[at]:
        name, at = name_at(data, at)
        _, at = name_at(data, at)
        size, = struct.unpack_from("<i", data, at)
        header[name], at = data[at + 4:at + 4 + size], at + 4 + size
    names, rest = [], header["channels"]
    while rest[0]:
        name, begin = name_at(rest, 0)
        names.append(name)
        rest = rest[begin + 16:]
    left, top, right, bottom = struct.unpack("<4i", header["dataWindow"])
    width, height = right - left + 1, bottom - top + 1
    lines = LINES[header["compression"][0]]
    channels = {name: array.array("f", bytes(4 * width * height)) for name in names}
    for offset in struct.unpack_from("<%dQ" % -(-height // lines), data, at + 1):
        y, size = struct.unpack_from("<ii", data, offset)
        rows = min(lines, bottom + 1 - y)
        raw = data[offset + 8:offset + 8 + size]
        if size < 4 * rows * width * len(names):
            raw = unpacked(raw)
        for row in range(rows):
            for k, name in enumerate(names):
                begin = 4 * width * (row * len(names) + k)
                channels[name][(y - top + row) * width:(y - top + row + 1) * width] = array.array("f", raw[begin:begin + 4 * width])
    return channels


def luminance(e, prefix=""):
    return [0.2126 * r + 0.7152 * g + 0.0722 * b for r, g, b in zip(*(e[prefix + c] for c in "RGB"))]


def in_folder(folder, name):
    return read_exr(os.path.join(folder, name))


def measured(folder):
    return [v == MEASURED for v in in_folder(folder, "validity.exr")["Y"]]


def rows_of(out, half0, half1, before_denoiser=False):
    """By row k, of E from STEP^k to STEP^(k + 1) of its mean: the sums of a bake and of one half where the other one puts them, twice,
    then the number of texels and the sums of their true, stated and the reference's own relMSE."""
    folders = (out, half0, half1)
    maps = [luminance(in_folder(folder, "irradiance.exr")) for folder in folders]
    stated = in_folder(out, "error.exr")["Y"]
    if before_denoiser:
        before = in_folder(out, "measured.exr")
        maps[0], stated = luminance(before, "E."), before["error"]
    valid = [all(v) for v in zip(*(measured(folder) for folder in folders))]
    texels = [(*e, s) for *e, s, v in zip(*maps, stated, valid) if v]
    mean = sum((b1 + b2) / 2 for _, b1, b2, _ in texels) / len(texels)
    rows = {}
    for e, b1, b2, s in texels:
        for which, (by, half) in enumerate(((b2, b1), (b1, b2))):
            row = rows.setdefault(math.floor(math.log(max(by / mean, 1e-4), STEP)), [0] * 8)
            row[2 * which] += e
            row[2 * which + 1] += half
            for k, value in enumerate((1, (e - b1) * (e - b2), s * s, (b1 - b2)**2 / 4)):
                row[4 + k] += value / 2
    for row in rows.values():
        floor = ((row[0] + row[2]) / 2 / row[4])**2 + (mean / 100)**2
        row[5:] = [value / floor for value in row[5:]]
    return rows


def main():
    folders = [word for word in sys.argv[1:] if word != "--before-denoiser"]
    if len(folders) != 3:
        sys.exit(__doc__)
    rows = rows_of(*folders, "--before-denoiser" in sys.argv)
    print("| E over the mean | texels | bake over half | relMSE | stated | reference |\n|---|---|---|---|---|---|")
    for key in sorted(rows):
        e1, b1, e2, b2, n, true, said, own = rows[key]
        ratios = ", ".join("%.3f" % (e / b) if b > 0 else "" for e, b in ((e1, b1), (e2, b2)))
        print("| %.3g to %.3g | %d | %s | %.2g | %.2g | %.2g |" % (
            STEP**key, STEP**(key + 1), n, ratios, true / n, said / n, own / n))


if __name__ == "__main__":
    main()
