#!/usr/bin/env python3
"""Writes the probes of a bake as one file that KilnProbes.cs reads in Unity, which cannot read EXR at run time.

usage: probe_bytes.py BAKE [FILE]

BAKE has probes.json, probes.exr and, with visibility, probes_distance.exr; FILE is BAKE/probes_unity.bytes by default. The
ending makes it a TextAsset in Unity. Little endian; u: 32-bit unsigned, f: 32-bit float; axes are those of glTF.

    head     u "KPRB"  u version, 1  u probes  u volumes  u side of distances, 0: none
    volumes  f[3] min  f spacing  u[3] roots  u levels  u visibility  u bricks, then for each brick
               u[3] corner  u level  u parent  u children  u coarser  u[64] probes       (docs/probes.md)
    probes   f[3] position  u state  f[27] sh[colour][coefficient] as SphericalHarmonicsL2 has them: E / pi is
               sh0 + sh1 y + sh2 z + sh3 x + sh4 xy + sh5 yz + sh6 (3 z z - 1) + sh7 xz + sh8 (x x - y y)
    then     distances of each probe, (side + 2)^2 x f[2], mean and mean square, with the border
"""
import json
import math
import pathlib
import struct
import sys
import zlib
from array import array

NAMES = ("L00", "L1m1", "L10", "L11", "L2m2", "L2m1", "L20", "L21", "L22")
# Ramamoorthi & Hanrahan 2001: constants of the harmonics times pi, 2 pi / 3 and pi / 4, over pi.
Y = [math.sqrt(k / math.pi) for k in (1 / 4, 3 / 4, 3 / 4, 3 / 4, 15 / 4, 15 / 4, 5 / 16, 15 / 4, 15 / 16)]
COSINE = (1,) + (2 / 3,) * 3 + (1 / 4,) * 5
FACTOR = [y * c for y, c in zip(Y, COSINE)]


def unfilter(data):
    """OpenEXR's ZIP filter: differences of bytes, even ones before odd ones."""
    out, last = bytearray(len(data)), 128
    for i, v in enumerate(data):
        last = (last + v - 128) & 255
        out[i] = last
    half = (len(data) + 1) // 2
    whole = bytearray(len(data))
    whole[0::2], whole[1::2] = out[:half], out[half:]
    return bytes(whole)


def read_exr(path):
    """(width, height, {channel: floats}) of a scan-line file of 32-bit floats, uncompressed, ZIPS or ZIP."""
    data, at = path.read_bytes(), 8
    if data[:4] != b"\x76\x2f\x31\x01":
        raise ValueError(f"{path} is no OpenEXR file")

    def word():
        nonlocal at
        end = data.index(b"\0", at)
        text, at = data[at:end].decode(), end + 1
        return text

    names, width, height, top, packing = [], 0, 0, 0, 0
    while name := word():
        kind = word()
        size, = struct.unpack_from("<i", data, at)
        at += 4
        end = at + size
        if kind == "chlist":
            while channel := word():
                if struct.unpack_from("<i", data, at)[0] != 2:
                    raise ValueError(f"{path}: {channel} does not hold 32-bit floats")
                names.append(channel)
                at += 16
        elif name == "dataWindow":
            left, top, right, bottom = struct.unpack_from("<4i", data, at)
            width, height = right - left + 1, bottom - top + 1
        elif name == "compression":
            packing = data[at]
        at = end
    lines = {0: 1, 2: 1, 3: 16}[packing]
    planes = {name: array("f", bytes(4 * width * height)) for name in names}
    for offset in struct.unpack_from(f"<{-(-height // lines)}Q", data, at):
        first, size = struct.unpack_from("<ii", data, offset)
        first -= top
        count, body = min(lines, height - first), data[offset + 8:offset + 8 + size]
        if size < 4 * width * count * len(names):
            body = unfilter(zlib.decompress(body))
        values = array("f", body)
        if sys.byteorder == "big":
            values.byteswap()
        step = 0
        for y in range(first, first + count):
            for name in names:
                planes[name][y * width:(y + 1) * width] = values[step:step + width]
                step += width
    return width, height, planes


def convert(bake, file):
    layout = json.loads((bake / "probes.json").read_text())
    if layout["version"] != 1:
        raise ValueError(f"probes.json is of version {layout['version']}; this reads 1")
    count, columns, volumes = layout["probes"], layout["columns"], layout["volumes"]
    side = layout.get("distance_side", 0)
    out = [b"KPRB", struct.pack("<4I", 1, count, len(volumes), side)]
    for v in volumes:
        out.append(struct.pack("<4f6I", *v["min"], v["spacing"], *v["roots"], v["levels"], v["visibility"], len(v["bricks"])))
        for b in v["bricks"]:
            out.append(struct.pack("<71I", *b["corner"], b["level"], b["parent"], b["children"], b["coarser"], *b["probes"]))
    _, _, planes = read_exr(bake / "probes.exr")
    for i in range(count):
        sh = [FACTOR[k] * planes[f"{NAMES[k]}.{c}"][i] for c in "RGB" for k in range(9)]
        out.append(struct.pack("<3fI27f", *(planes[f"position.{a}"][i] for a in "XYZ"), int(planes["state"][i]), *sh))
    if side:
        width, _, maps = read_exr(bake / "probes_distance.exr")
        tile = side + 2
        for i in range(count):
            both = array("f", bytes(8 * tile * tile))
            for y in range(tile):
                begin = (i // columns * tile + y) * width + i % columns * tile
                for c, name in enumerate(("mean", "square")):
                    both[2 * y * tile + c:2 * (y + 1) * tile:2] = maps[name][begin:begin + tile]
            if sys.byteorder == "big":
                both.byteswap()
            out.append(both.tobytes())
    file.write_bytes(b"".join(out))


if __name__ == "__main__":
    if len(sys.argv) not in (2, 3):
        sys.exit(__doc__.split("\n\n")[1])
    folder = pathlib.Path(sys.argv[1])
    try:
        convert(folder, pathlib.Path(sys.argv[2]) if len(sys.argv) > 2 else folder / "probes_unity.bytes")
    except (OSError, ValueError, KeyError) as error:
        sys.exit(f"{sys.argv[0]}: {error}")
