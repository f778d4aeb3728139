"""Writes floors.glb and floors_rgbm_E.png beside this file: two floors below a lamp each, by the specification alone.

usage: make_sample.py [FOLDER]

E of a lamp of intensity I at height h over the floor: I h / d^3. The left lamp is white, the right one orange.
"""
import json
import math
import pathlib
import struct
import sys
import zlib

WIDTH, HEIGHT, RANGE = 16, 8, 8
LAMPS = [((4.0, 4.0, 4.0), 1.0), ((6.0, 3.0, 1.0), 1.5)]  # intensity, height, above the middle of a floor of 2 x 2 m


def irradiance(floor, x, z):
    intensity, height = LAMPS[floor]
    d = math.sqrt(x * x + z * z + height * height)
    return [i * height / d ** 3 for i in intensity]


def rgbm(e):
    """(r a c)^2 = e, with c as large as it goes."""
    roots = [math.sqrt(v) / RANGE for v in e]
    a = math.ceil(255 * max(max(roots), 1 / 255)) / 255
    return [round(255 * min(v / a, 1)) for v in roots] + [round(255 * a)]


def png(rows):
    def chunk(kind, data):
        return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
    raw = b"".join(b"\0" + bytes(v for pixel in row for v in pixel) for row in rows)
    return (b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", struct.pack(">IIBBBBB", WIDTH, HEIGHT, 8, 6, 0, 0, 0)) +
            chunk(b"IDAT", zlib.compress(raw, 9)) + chunk(b"IEND", b""))


def texel(x, y):
    floor, column = divmod(x, WIDTH // 2)
    return rgbm(irradiance(floor, (column + 0.5) / (WIDTH // 2) * 2 - 1, (y + 0.5) / HEIGHT * 2 - 1))


def scene():
    positions = [-1, 0, -1, 1, 0, -1, 1, 0, 1, -1, 0, 1]
    normals, coordinates = [0, 1, 0] * 4, [0, 0, 1, 0, 1, 1, 0, 1]
    data = struct.pack("<12f12f8f6H", *positions, *normals, *coordinates, 0, 2, 1, 0, 3, 2)
    views = [(0, 48), (48, 48), (96, 32), (128, 12)]
    accessor = lambda view, kind, count, component=5126, **more: {  # noqa: E731
        "bufferView": view, "componentType": component, "count": count, "type": kind, **more}
    lit = lambda offset: {"KILN_lightmap": {  # noqa: E731
        "lightmap": 0, "pages": [0], "scale": [0.5, 1], "offset": [offset, 0]}}
    document = {
        "asset": {"version": "2.0", "generator": "make_sample.py of KILN_lightmap"},
        "extensionsUsed": ["KILN_lightmap"],
        "extensions": {"KILN_lightmap": {"version": 1, "lightmaps": [{
            "width": WIDTH, "height": HEIGHT, "pages": 1, "texCoord": 1, "quantity": "irradiance",
            "unit": "that of the scene's radiance, times steradian",
            "basis": {"name": "irradiance", "functions": [], "axes": "world"},
            "encodings": [{"name": "rgbm", "container": "png", "textures": [{
                "uri": "floors_rgbm_E.png", "container": "png", "format": "R8G8B8A8_UNORM", "unpack": "rgbm",
                "unpackRange": RANGE, "width": WIDTH, "height": HEIGHT, "layers": 1, "levels": 1, "page": 0,
                "channels": [{"plane": "E.R"}, {"plane": "E.G"}, {"plane": "E.B"}, {"plane": ""}]}]}]}]}},
        "scene": 0, "scenes": [{"nodes": [0, 1]}],
        "nodes": [{"name": "left", "mesh": 0, "translation": [-1.1, 0, 0], "extensions": lit(0)},
                  {"name": "right", "mesh": 0, "translation": [1.1, 0, 0], "extensions": lit(0.5)}],
        "meshes": [{"name": "floor", "primitives": [{
            "attributes": {"POSITION": 0, "NORMAL": 1, "TEXCOORD_0": 2, "TEXCOORD_1": 2}, "indices": 3, "material": 0,
            "extensions": {"KILN_lightmap": {"page": 0}}}]}],
        "materials": [{"name": "white", "pbrMetallicRoughness": {"metallicFactor": 0, "roughnessFactor": 1}}],
        "accessors": [accessor(0, "VEC3", 4, min=[-1, 0, -1], max=[1, 0, 1]), accessor(1, "VEC3", 4),
                      accessor(2, "VEC2", 4), accessor(3, "SCALAR", 6, 5123)],
        "bufferViews": [{"buffer": 0, "byteOffset": at, "byteLength": n, "target": 34963 if i == 3 else 34962}
                        for i, (at, n) in enumerate(views)],
        "buffers": [{"byteLength": len(data)}],
    }
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    chunks = struct.pack("<II", len(text), 0x4E4F534A) + text + struct.pack("<II", len(data), 0x004E4942) + data
    return struct.pack("<III", 0x46546C67, 2, 12 + len(chunks)) + chunks


def main():
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else __file__).resolve()
    folder = folder if folder.is_dir() else folder.parent
    (folder / "floors.glb").write_bytes(scene())
    (folder / "floors_rgbm_E.png").write_bytes(png([[texel(x, y) for x in range(WIDTH)] for y in range(HEIGHT)]))


if __name__ == "__main__":
    main()
