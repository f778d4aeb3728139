#!/usr/bin/env python3
"""Rooms as people bake them, for measuring error against run time: furnished, of default glTF materials.

    python3 tests/bench/real_rooms.py FOLDER [NAME ...] [--materials default|lambert]

`flat`: a living room with two windows, curtains, sun and sky, and a bedroom without windows behind an open doorway.
`corridor`: four rooms with shaded lamps, whose doors stand ajar on a corridor without lamps of its own.

Writes NAME.glb and NAME.kiln.json. Air is bounded by one closed surface that faces inwards, so nothing leaks; furniture is
boxes that face outwards, without the faces on which they stand. `default`: glTF's dielectric of roughness 1, as files have
it that say nothing; `lambert`: without its specular layer. Python 3, no packages; the same bytes on every machine.
"""
import argparse
import math
import os
import random
import sys

sys.path.insert(0, os.path.dirname(os.path.abspath(__file__)))
import error_scenes  # noqa: E402
from error_scenes import scenes  # noqa: E402

WALL, CEILING, WOOD, DARK_WOOD = (0.78, 0.76, 0.72), (0.85, 0.85, 0.84), (0.5, 0.33, 0.2), (0.22, 0.13, 0.08)
CLOTH, LINEN, GREEN, STEEL = (0.25, 0.3, 0.42), (0.8, 0.77, 0.7), (0.12, 0.3, 0.1), (0.55, 0.55, 0.56)


class Room(error_scenes.Scene):
    def __init__(self, materials):
        super().__init__()
        self.is_lambert = materials == "lambert"
        self.pieces = {}  # quads by colour: one mesh each

    def add(self, quads, colour):
        self.pieces.setdefault(colour, []).extend(quads)

    def box(self, lo, hi, colour, without=("-y",)):
        faces = scenes.inside_of_box(lo, hi, without)
        self.add([list(reversed(quad)) for quad in faces], colour)

    def shine(self, quads, emission, colour):
        self.lambert(quads, (0, 0, 0), emission, colour)

    def finish(self):
        for colour, quads in self.pieces.items():
            if self.is_lambert:
                self.lambert(quads, colour)
            else:
                self.quads(quads, colour)
        self.pieces = {}


def facing(quad, direction):
    """The quad, turned so that its normal has that sign along the direction."""
    e = [b - a for a, b in zip(quad[0], quad[1])]
    f = [b - a for a, b in zip(quad[0], quad[3])]
    n = (e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0])
    return quad if sum(x * y for x, y in zip(n, direction)) > 0 else list(reversed(quad))


def wall(axis, at, sign, along, high, holes=()):
    """Quads of a wall at `at` on an axis (0: x, 2: z) that faces +axis or -axis, over a range of the other horizontal
    axis and from 0 to `high`, without holes (begin, end, sill, top)."""
    us = sorted({*along, *(u for h in holes for u in h[:2])})
    ys = sorted({0, high, *(y for h in holes for y in h[2:])})
    quads = []
    for u0, u1 in zip(us, us[1:]):
        for y0, y1 in zip(ys, ys[1:]):
            if any(h[0] <= u0 and u1 <= h[1] and h[2] <= y0 and y1 <= h[3] for h in holes):
                continue
            corners = [(u0, y0), (u1, y0), (u1, y1), (u0, y1)]
            quad = [(at, y, u) if axis == 0 else (u, y, at) for u, y in corners]
            quads.append(facing(quad, (sign, 0, 0) if axis == 0 else (0, 0, sign)))
    return quads


def passage(axis, begin, end, hole):
    """The inner faces of a hole through a wall from `begin` to `end` on its axis."""
    u0, u1, y0, y1 = hole
    lo, hi = ((begin, y0, u0), (end, y1, u1)) if axis == 0 else ((u0, y0, begin), (u1, y1, end))
    return scenes.inside_of_box(lo, hi, ("-x", "+x") if axis == 0 else ("-z", "+z"))


def horizontal(y, x, z, sign):
    return [facing([(x[0], y, z[0]), (x[1], y, z[0]), (x[1], y, z[1]), (x[0], y, z[1])], (0, sign, 0))]


def table(room, x, z, width, depth, high, colour):
    for dx in (0.04, width - 0.1):
        for dz in (0.04, depth - 0.1):
            room.box((x + dx, 0, z + dz), (x + dx + 0.06, high - 0.04, z + dz + 0.06), colour, ("-y", "+y"))
    room.box((x, high - 0.04, z), (x + width, high, z + depth), colour, ())


def chair(room, x, z, back, colour):
    """`back`: where the back rest is, -1 or 1 on z."""
    for dx in (0, 0.38):
        for dz in (0, 0.38):
            room.box((x + dx, 0, z + dz), (x + dx + 0.04, 0.44, z + dz + 0.04), STEEL, ("-y", "+y"))
    room.box((x, 0.44, z), (x + 0.42, 0.48, z + 0.42), colour, ())
    at = z if back < 0 else z + 0.38
    room.box((x + 0.02, 0.52, at), (x + 0.4, 0.9, at + 0.04), colour, ())


def shelf(room, x, z, width, depth, high, seed):
    """Boards with books, open to -z."""
    numbers = random.Random(seed)
    room.box((x, 0, z), (x + 0.03, high, z + depth), DARK_WOOD)
    room.box((x + width - 0.03, 0, z), (x + width, high, z + depth), DARK_WOOD)
    boards = 5
    for k in range(boards + 1):
        y = 0.05 + k * (high - 0.1) / boards
        room.box((x + 0.032, y, z), (x + width - 0.032, y + 0.025, z + depth), DARK_WOOD, ())
        if k == boards:
            break
        at = x + 0.05
        while at < x + width - 0.12:
            thick, tall = 0.02 + 0.03 * numbers.random(), 0.16 + 0.1 * numbers.random()
            if numbers.random() < 0.8:
                hue = [(0.45, 0.1, 0.08), (0.1, 0.2, 0.4), (0.6, 0.55, 0.4), (0.15, 0.3, 0.18)][int(4 * numbers.random())]
                room.box((at, y + 0.026, z + 0.05), (at + thick, y + 0.026 + tall, z + depth - 0.03), hue)
            at += thick + 0.004


def sofa(room, x, z):
    room.box((x, 0.06, z), (x + 2.1, 0.4, z + 0.9), CLOTH, ())
    room.box((x, 0.402, z + 0.68), (x + 2.1, 0.85, z + 0.9), CLOTH)
    for side in (x, x + 1.9):
        room.box((side, 0.402, z), (side + 0.2, 0.6, z + 0.678), CLOTH)
    for k in range(2):
        room.box((x + 0.22 + 0.84 * k, 0.402, z + 0.02), (x + 1.04 + 0.84 * k, 0.52, z + 0.66), (0.5, 0.45, 0.35))


def curtain(room, x, z, y, folds):
    """A cloth of two sheets along x that waves on z."""
    width, deep = 0.06, 0.05
    for k in range(folds):
        x0, x1 = x + k * width, x + (k + 1) * width
        z0, z1 = (z, z + deep) if k % 2 == 0 else (z + deep, z)
        sheet = [(x0, y[0], z0), (x1, y[0], z1), (x1, y[1], z1), (x0, y[1], z0)]
        room.add([sheet, [(a, b, c - 0.004) for a, b, c in reversed(sheet)]], LINEN)


def shade(room, x, y, z, radius, high, colour):
    """A drum of eight sides, open above and below, with a bulb in it."""
    ring = [(math.cos(math.pi * k / 4), math.sin(math.pi * k / 4)) for k in range(9)]
    for (c0, s0), (c1, s1) in zip(ring, ring[1:]):
        for r, outwards in ((radius, 1), (radius - 0.004, -1)):
            quad = [(x + r * c0, y, z + r * s0), (x + r * c1, y, z + r * s1), (x + r * c1, y + high, z + r * s1),
                    (x + r * c0, y + high, z + r * s0)]
            room.add([facing(quad, (outwards * (c0 + c1), 0, outwards * (s0 + s1)))], LINEN)
    bulb = [list(reversed(q)) for q in scenes.inside_of_box((x - 0.03, y + 0.06, z - 0.03), (x + 0.03, y + 0.12, z + 0.03))]
    room.shine(bulb, 900, colour)


def flat(room):
    high, thick = 2.6, 0.3
    windows = [(0.8, 2.2, 0.9, 2.3), (3.0, 4.4, 0.9, 2.3)]  # on x
    door = (3.9, 4.8, 0, 2.05)                              # on z
    living, bedroom = (0, 5), (5.15, 8.4)
    depth, far = 6, (2.2, 6)
    room.add(wall(2, 0, 1, living, high, windows), WALL)
    room.add(wall(2, depth, -1, living, high), WALL)
    room.add(wall(0, 0, 1, (0, depth), high), WALL)
    room.add(wall(0, 5, -1, (0, depth), high, [door]), WALL)
    room.add(wall(0, 5.15, 1, far, high, [door]), WALL)
    room.add(wall(0, 8.4, -1, far, high), WALL)
    room.add(wall(2, far[0], 1, bedroom, high), WALL)
    room.add(wall(2, far[1], -1, bedroom, high), WALL)
    for hole in windows:
        room.add(passage(2, -thick, 0, hole), CEILING)
    room.add(passage(0, 5, 5.15, door), CEILING)
    for x, z in ((living, (0, depth)), (bedroom, far)):
        room.add(horizontal(0, x, z, 1), WOOD)
        room.add(horizontal(high, x, z, -1), CEILING)
    for x in (0.35, 2.3, 4.45):
        curtain(room, x, 0.12, (0.05, 2.45), 7)
    table(room, 0.5, 4.2, 1.6, 0.9, 0.75, WOOD)
    for x in (0.65, 1.5):
        chair(room, x, 3.75, -1, DARK_WOOD)
        chair(room, x, 5.15, 1, DARK_WOOD)
    sofa(room, 2.5, 2.6)
    table(room, 2.9, 1.5, 1.1, 0.6, 0.42, DARK_WOOD)
    shelf(room, 2.6, 5.65, 2.2, 0.34, 2.1, 1)
    room.box((2.4, 0, 1.2), (4.8, 0.012, 2.5), (0.5, 0.18, 0.12))               # a rug
    room.box((0.05, 0, 0.6), (0.6, 0.88, 3.0), CEILING)                         # counter and cabinets above it
    room.box((0.05, 0.882, 0.58), (0.63, 0.92, 3.02), DARK_WOOD, ())
    room.box((0.05, 1.45, 0.6), (0.4, 2.15, 3.0), CEILING, ())
    room.box((4.45, 0, 3.1), (4.75, 0.35, 3.4), (0.45, 0.2, 0.12))              # a pot with leaves
    numbers = random.Random(7)
    for _ in range(40):
        a, b = 2 * math.pi * numbers.random(), 0.5 + 0.9 * numbers.random()
        x, z, r = 4.6 + 0.22 * math.cos(a), 3.25 + 0.22 * math.sin(a), 0.05 + 0.05 * numbers.random()
        leaf = [(x - r, b, z - r), (x + r, b + 0.03, z - r), (x + r, b + 0.06, z + r), (x - r, b, z + r)]
        room.add([leaf, [(p, q - 0.002, s) for p, q, s in reversed(leaf)]], GREEN)
    room.box((6.2, 0.08, 3.9), (8.2, 0.4, 5.7), DARK_WOOD, ())                  # a bed
    room.box((6.22, 0.402, 3.92), (8.18, 0.58, 5.68), LINEN)
    for z in (4.05, 4.9):
        room.box((7.7, 0.582, z), (8.1, 0.68, z + 0.6), CEILING)
    room.box((5.4, 0, 2.25), (7.6, 2.2, 2.85), WOOD)                            # a wardrobe
    room.box((7.8, 0, 3.3), (8.3, 0.45, 3.75), DARK_WOOD)
    return {"sun": "-0.35,0.75,-0.6:60,56,50", "sun-angle": 0.53, "environment": "4,5,6.5"}


def corridor(room):
    high, length, width = 2.5, 14.4, 1.5
    doors = [(1.2 + 3.6 * k, 2.1 + 3.6 * k, 0, 2.05) for k in range(4)]  # on x
    room.add(wall(2, 0, 1, (0, length), high), WALL)
    room.add(wall(2, width, -1, (0, length), high, doors), WALL)
    room.add(wall(0, 0, 1, (0, width), high) + wall(0, length, -1, (0, width), high), WALL)
    room.add(horizontal(0, (0, length), (0, width), 1), (0.3, 0.3, 0.32))
    room.add(horizontal(high, (0, length), (0, width), -1), CEILING)
    hues = [(1, 0.8, 0.55), (1, 0.85, 0.65), (0.8, 0.9, 1), (1, 0.75, 0.45)]
    for k, hole in enumerate(doors):
        x, z = (3.6 * k + 0.1, 3.6 * k + 3.5), (width + 0.15, width + 4.15)
        room.add(wall(2, z[0], 1, x, high, [hole]) + wall(2, z[1], -1, x, high), WALL)
        room.add(wall(0, x[0], 1, z, high) + wall(0, x[1], -1, z, high), WALL)
        room.add(horizontal(0, x, z, 1), WOOD)
        room.add(horizontal(high, x, z, -1), CEILING)
        room.add(passage(2, width, z[0], hole), CEILING)
        # The leaf turns into the room about the hole's begin; the first door is open widest.
        turn = math.radians((60, 25, 12, 6)[k])
        leaf = scenes.outside_of_box((0.004, 0.004, 0), (0.9 - 0.008, 2.04, 0.04))
        place = [[(hole[0] + u * math.cos(turn) - w * math.sin(turn), y, z[0] + 0.004 + u * math.sin(turn) + w * math.cos(turn))
                  for u, y, w in quad] for quad in leaf]
        room.add(place, DARK_WOOD)
        if k % 2 == 0:
            table(room, x[0] + 0.3, z[1] - 0.9, 1.5, 0.75, 0.74, WOOD)
            chair(room, x[0] + 0.8, z[1] - 1.35, -1, DARK_WOOD)
            shelf(room, x[1] - 1.3, z[1] - 0.36, 1.2, 0.34, 1.9, 10 + k)
        else:
            room.box((x[0] + 0.2, 0.08, z[1] - 2.1), (x[0] + 1.3, 0.4, z[1] - 0.1), DARK_WOOD, ())
            room.box((x[0] + 0.22, 0.402, z[1] - 2.08), (x[0] + 1.28, 0.56, z[1] - 0.12), LINEN)
            room.box((x[1] - 0.7, 0, z[1] - 1.4), (x[1] - 0.1, 2.0, z[1] - 0.2), WOOD)
        shade(room, x[0] + 1.7, 1.75, z[0] + 2.0, 0.22, 0.24, hues[k])
    return {}


ROSTER = {"flat": flat, "corridor": corridor}


def write(folder, names=None, materials="default"):
    """Paths of the rooms by name."""
    paths = {}
    for name in names or ROSTER:
        room = Room(materials)
        settings = ROSTER[name](room)
        room.finish()
        paths[name] = error_scenes.save(folder, name, room, {"texels-per-metre": 8, **settings})
    return paths


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("folder")
    parser.add_argument("names", nargs="*", help=", ".join(ROSTER))
    parser.add_argument("--materials", choices=("default", "lambert"), default="default")
    arguments = parser.parse_args()
    unknown = [name for name in arguments.names if name not in ROSTER]
    if unknown:
        sys.exit("there is no room %s; known: %s" % (unknown[0], ", ".join(ROSTER)))
    write(arguments.folder, arguments.names, arguments.materials)
