#!/usr/bin/env python3
"""Writes the room that every program of docs/engines.md shows beside itself, or into the folder given.

    python3 tests/scenes/room/make_room.py [FOLDER]

A sun through the open sides, a lamp, a normal map (back wall), holes of alpha (screen), instances of two meshes, one
mirrored, and something that glows. Textures are smooth, so that a program's filter decides little. Python's standard
library only; equal bytes on every run.
"""
import math
import os
import pathlib
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "arcade"))
import shapes  # noqa: E402
from gltf_out import Gltf, about_y, quaternion  # noqa: E402
from mesh import Mesh, cross, sub, unit  # noqa: E402
from textures import png  # noqa: E402

SIDE = 64  # texels of a texture


def picture(channels, colour):
    """PNG of colour(x, y) in 0..1, x and y in 0..1."""
    data = bytearray()
    for y in range(SIDE):
        for x in range(SIDE):
            data += bytes(int(255 * c + 0.5) for c in colour((x + 0.5) / SIDE, (y + 0.5) / SIDE))
    return png(SIDE, SIDE, channels, data)


def tiles(x, y):
    """Two tones that pass into each other."""
    t = 0.5 + 0.5 * math.sin(2 * math.pi * x) * math.sin(2 * math.pi * y)
    return 0.78 - 0.25 * t, 0.74 - 0.29 * t, 0.68 - 0.3 * t


def bumps(x, y):
    n = unit((0.45 * math.sin(2 * math.pi * x), 0.45 * math.sin(2 * math.pi * y), 1))
    return tuple(0.5 + 0.5 * c for c in n)


def screen(x, y):
    """A green sheet with one round hole a repeat."""
    return 0.3, 0.55, 0.25, 1.0 if math.hypot(x - 0.5, y - 0.5) > 0.3 else 0.0


def towards(eye, target):
    """The rotation that turns -z to the target."""
    z = unit(sub(eye, target))
    x = unit(cross((0, 1, 0), z))
    return quaternion(x, cross(z, x), z)


def walls(g):
    floor = Mesh("floor", "tiles", authored=False)
    floor.quad((-3, 0, 3), (3, 0, 3), (3, 0, -3), (-3, 0, -3), tile=1.5)
    back = Mesh("back", "bumpy", authored=False)
    back.quad((-3, 0, -3), (3, 0, -3), (3, 3, -3), (-3, 3, -3), tile=0.75)
    left = Mesh("left", "red", authored=False)
    left.quad((-3, 0, 3), (-3, 0, -3), (-3, 3, -3), (-3, 3, 3))
    right = Mesh("right", "white", authored=False)
    right.quad((3, 0, -3), (3, 0, -0.8), (3, 3, -0.8), (3, 3, -3))
    ceiling = Mesh("ceiling", "white", authored=False)
    ceiling.quad((-3, 3, -3), (3, 3, -3), (3, 3, 3), (-3, 3, 3))
    for m in (floor, back, left, right, ceiling):
        g.node(m.name, mesh=g.mesh(m))


def things(g):
    box = Mesh("crate", "wood", authored=False)
    box.box((-0.4, 0, -0.4), (0.4, 0.8, 0.4), leave_out="b")
    crate = g.mesh(box)
    g.node("crate", mesh=crate, translation=[-1.7, 0, -1.7], rotation=about_y(20))
    g.node("crate, small", mesh=crate, translation=[-1.65, 0.8, -1.7], rotation=about_y(50), scale=[0.6, 0.6, 0.6])
    g.node("crate, mirrored", mesh=crate, translation=[0.1, 0, -0.2], rotation=about_y(-30), scale=[-1.2, 0.5, 0.8])
    round_thing = Mesh("ball", "white", authored=False)
    shapes.ball(round_thing, 0.45, 12, 24, (0, 0.45, 0))
    ball = g.mesh(round_thing)
    for name, x, z in (("ball, left", -2.1, 0.1), ("ball, right", 1.9, -1.9)):
        g.node(name, mesh=ball, translation=[x, 0, z])
    sheet = Mesh("screen", "screen", authored=False)
    sheet.quad((-0.8, 0, 0), (0.8, 0, 0), (0.8, 1.6, 0), (-0.8, 1.6, 0), tile=0.8)
    g.node("screen", mesh=g.mesh(sheet), translation=[0.6, 0, -1.9], rotation=about_y(15))
    bar = Mesh("bar", "glow", authored=False)
    bar.box((-0.05, 0, -0.05), (0.05, 1.8, 0.05), leave_out="b")
    g.node("bar", mesh=g.mesh(bar), translation=[-2.8, 0, -1.0])


def room():
    g = Gltf()
    g.root["asset"]["generator"] = "make_room.py"
    g.material("tiles", texture="tiles.png")
    g.material("bumpy", (0.6, 0.62, 0.7, 1), normalTexture=g.texture("bumps.png"))
    g.material("screen", texture="screen.png", alphaMode="MASK", alphaCutoff=0.5, doubleSided=True)
    g.material("white", (0.75, 0.75, 0.72, 1))
    g.material("red", (0.62, 0.2, 0.14, 1))
    g.material("wood", (0.5, 0.36, 0.2, 1))
    g.material("glow", (0, 0, 0, 1), emissiveFactor=[0.6, 0.36, 0.12],
               extensions={"KHR_materials_emissive_strength": {"emissiveStrength": 1.5}})
    walls(g)
    things(g)
    g.light("sun", None, {"type": "directional", "color": [1, 0.92, 0.8], "intensity": 4.5},
            rotation=towards((2.1, 1.2, 3.0), (0, 0, 0)))
    g.light("lamp", None, {"type": "point", "color": [1, 0.75, 0.45], "intensity": 2.5}, translation=[1.9, 2.1, -2.0])
    eye = (1.5, 1.75, 3.6)
    g.root["cameras"].append({"type": "perspective", "perspective": {
        "aspectRatio": 1.777778, "yfov": 0.75, "znear": 0.05, "zfar": 50}})
    g.node("camera", camera=0, translation=list(eye), rotation=towards(eye, (-0.35, 0.95, -1.5)))
    g.root["scenes"] = [{"nodes": list(range(len(g.root["nodes"])))}]
    return g


def main():
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else os.path.dirname(os.path.abspath(__file__)))
    for name, channels, colour in (("tiles", 3, tiles), ("bumps", 3, bumps), ("screen", 4, screen)):
        (folder / (name + ".png")).write_bytes(picture(channels, colour))
    room().write(folder, "room")


if __name__ == "__main__":
    main()
