#!/usr/bin/env python3
"""Turns the L1 textures of a bake into Unity's axes, for shaders that read Bakery's SH or RNM textures.

usage: bakery_textures.py BAKE FOLDER

BAKE was written with `--encode rgbm --encode-quantity basis --encode-range unit`. glTF's importers for Unity negate x: the texture
of L1x is stored as 1 - texel, the others as they are. FOLDER gets lightmap_L1x.png, _L1y.png and _L1z.png.
"""
import pathlib
import struct
import sys
import zlib


def chunk(kind, data):
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))


def read_rows(path):
    """Rows of 8-bit PNG files without interlacing; filters as the PNG specification has them."""
    data, at, packed = path.read_bytes(), 8, b""
    if data[:8] != b"\x89PNG\r\n\x1a\n":
        raise ValueError(f"{path} is no PNG file")
    while at < len(data):
        n, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 8:at + 8 + n]
        if kind == b"IHDR":
            width, height, depth, colour, _, _, interlaced = struct.unpack(">IIBBBBB", body)
        elif kind == b"IDAT":
            packed += body
        at += 12 + n
    if depth != 8 or colour not in (2, 6) or interlaced:
        raise ValueError(f"{path} is not 8-bit RGB or RGBA")
    step = 3 if colour == 2 else 4
    raw, stride, rows = zlib.decompress(packed), step * width, []
    above = bytearray(stride)
    for y in range(height):
        kind, row = raw[y * (stride + 1)], bytearray(raw[y * (stride + 1) + 1:(y + 1) * (stride + 1)])
        for i in range(stride):
            a, b = row[i - step] if i >= step else 0, above[i]
            c = above[i - step] if i >= step else 0
            if kind == 4:
                p = a + b - c
                near = min((abs(p - a), 0, a), (abs(p - b), 1, b), (abs(p - c), 2, c))[2]
            else:
                near = (0, a, b, (a + b) // 2)[kind]
            row[i] = (row[i] + near) & 255
        rows.append(row)
        above = row
    return rows, width, height, colour, step


def convert(bake, folder):
    folder.mkdir(parents=True, exist_ok=True)
    for axis in "xyz":
        rows, width, height, colour, step = read_rows(bake / f"lightmap_rgb8_L1{axis}.png")
        if axis == "x":
            for row in rows:
                for i in range(len(row)):
                    if i % step < 3:
                        row[i] = 255 - row[i]
        raw = b"".join(b"\0" + bytes(row) for row in rows)
        head = struct.pack(">IIBBBBB", width, height, 8, colour, 0, 0, 0)
        (folder / f"lightmap_L1{axis}.png").write_bytes(
            b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(raw)) + chunk(b"IEND", b""))


if __name__ == "__main__":
    if len(sys.argv) != 3:
        sys.exit(__doc__.split("\n\n")[1])
    try:
        convert(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]))
    except (OSError, ValueError) as why:
        sys.exit(f"bakery_textures.py: {why}")
