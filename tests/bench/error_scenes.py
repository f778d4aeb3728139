#!/usr/bin/env python3
"""Scenes on which error is measured against run time: small, of Lambert surfaces, each hard in its own way.

    python3 tests/bench/error_scenes.py FOLDER [NAME ...]

Writes NAME.glb and NAME.kiln.json (density, sun, environment), which `kiln bake FOLDER/NAME.glb` reads by itself.
Rooms are modelled as the border of the air in them: one closed surface that faces inwards, so that nothing leaks and
no texel lies where nobody looks. Python 3, no packages; the same bytes on every machine.
"""
import json
import math
import os
import random
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.dirname(os.path.abspath(__file__))), "compare"))
import scenes  # noqa: E402  (tests/compare/scenes.py)

WHITE, RED, GREEN = (0.75, 0.75, 0.75), (0.63, 0.08, 0.06), (0.14, 0.45, 0.09)


class Scene(scenes.Builder):
    """Lambert quads, metal quads and lamps."""

    def use(self, extension):
        used = self.doc.setdefault("extensionsUsed", [])
        if extension not in used:
            used.append(extension)

    def lambert(self, quads, albedo=WHITE, emission=0.0, colour=(1, 1, 1)):
        used = list(self.doc.get("extensionsUsed", []))
        self.quads(quads, albedo, emission)
        material = self.doc["materials"][-1]
        if emission:
            material["emissiveFactor"] = list(colour)
        self.doc["materials"][-1] = scenes.as_lambert(material)
        self.doc["extensionsUsed"] = used
        self.use("KHR_materials_specular")
        if emission:
            self.use("KHR_materials_emissive_strength")

    def metal(self, quads, colour, roughness):
        self.quads(quads, colour)
        self.doc["materials"][-1]["pbrMetallicRoughness"].update(metallicFactor=1, roughnessFactor=roughness)

    def lamp(self, place, light, rotation=None):
        """A light of KHR_lights_punctual; equal ones are written once. Without a rotation a spot shines along -Z."""
        lights = self.doc.setdefault("extensions", {}).setdefault("KHR_lights_punctual", {"lights": []})["lights"]
        if light not in lights:
            lights.append(light)
        self.use("KHR_lights_punctual")
        node = {"translation": place, "extensions": {"KHR_lights_punctual": {"light": lights.index(light)}}}
        if rotation:
            node["rotation"] = rotation
        self.node(node)


DOWN = [-math.sqrt(0.5), 0, 0, math.sqrt(0.5)]  # turns -Z to -Y


def facing_down(x, y, z, half):
    return [(x - half, y, z - half), (x + half, y, z - half), (x + half, y, z + half), (x - half, y, z + half)]


def standing_box(lo, hi):
    """Outwards, without the face on the ground: two faces on one place would be none."""
    return [list(reversed(q)) for q in scenes.inside_of_box(lo, hi, ("-y",))]


def wall_with_hole(x, facing, y, z, hole_y, hole_z):
    """A wall at x that faces +x (1) or -x (-1), a grid of 3 x 3 without its middle."""
    ys, zs = (y[0], *hole_y, y[1]), (z[0], *hole_z, z[1])
    quads = []
    for j in range(3):
        for k in range(3):
            (y0, y1), (z0, z1) = ys[j:j + 2], zs[k:k + 2]
            if (j, k) != (1, 1) and y1 > y0 and z1 > z0:
                quad = [(x, y0, z1), (x, y0, z0), (x, y1, z0), (x, y1, z1)]
                quads.append(quad if facing > 0 else list(reversed(quad)))
    return quads


def two_rooms(scene, lo, hi, wall, hole_y, hole_z, albedo=WHITE):
    """Rooms of [lo, wall[0]] and [wall[1], hi] with a passage through the wall between them; nothing else is open."""
    scene.lambert(scenes.inside_of_box(lo, (wall[0], *hi[1:]), ("+x",)), albedo)
    scene.lambert(scenes.inside_of_box((wall[1], *lo[1:]), hi, ("-x",)), albedo)
    y, z = (lo[1], hi[1]), (lo[2], hi[2])
    scene.lambert(wall_with_hole(wall[0], -1, y, z, hole_y, hole_z) + wall_with_hole(wall[1], 1, y, z, hole_y, hole_z),
                  albedo)
    scene.lambert(scenes.inside_of_box((wall[0], hole_y[0], hole_z[0]), (wall[1], hole_y[1], hole_z[1]), ("-x", "+x")),
                  albedo)


def cornell(scene):
    """A box of 3 m with a red and a green wall, a lamp and two blocks."""
    lo, hi = (-1.5, 0, -1.5), (1.5, 3, 1.5)
    scene.lambert(scenes.inside_of_box(lo, hi, ("-x", "+x")))
    scene.lambert([scenes.inside_of_box(lo, hi)[4]], RED)
    scene.lambert([scenes.inside_of_box(lo, hi)[5]], GREEN)
    scene.lambert(standing_box((-1.0, 0, -0.9), (-0.2, 1.7, -0.1)))
    scene.lambert(standing_box((0.2, 0, 0.1), (1.0, 0.8, 0.9)))
    scene.lambert([facing_down(0, 2.99, 0, 0.35)], (0, 0, 0), emission=12, colour=(1, 0.85, 0.6))
    return {"texels-per-metre": 8}


def ajar(scene):
    """Two rooms, a lamp in the far one, and a door between them that stands open by 10 cm."""
    two_rooms(scene, (0, 0, 0), (4.95, 2.6, 2.4), (2.0, 2.15), (0, 2.1), (0.8, 1.6))
    # The leaf lies on the wall of the dark room, reaches 3 cm over the doorway, and turns about its edge at z = 0.77.
    width, thick, high, gap = 0.86, 0.04, 2.13, 0.10
    turn = 2 * math.asin(gap / 2 / width)
    leaf = scenes.outside_of_box((0, 0.004, 0), (thick, high, width))
    place = [[(2.152 + x * math.cos(turn) + z * math.sin(turn), y, 0.77 + z * math.cos(turn) - x * math.sin(turn))
              for x, y, z in quad] for quad in leaf]
    scene.lambert(place, (0.6, 0.45, 0.3))
    scene.lambert([facing_down(0.6, 2.59, 1.9, 0.25)], (0, 0, 0), emission=40)
    scene.lambert(standing_box((3.6, 0, 1.5), (4.2, 0.7, 2.1)))
    return {"texels-per-metre": 7}


def keyhole(scene):
    """A cabinet of two closed halves; the dark one has light only by a hole of 3 x 3 cm."""
    two_rooms(scene, (0, 0, 0), (0.812, 0.4, 0.4), (0.4, 0.412), (0.24, 0.27), (0.19, 0.22), (0.85, 0.85, 0.85))
    panel = [(0.01, 0.1, 0.35), (0.01, 0.1, 0.15), (0.01, 0.3, 0.15), (0.01, 0.3, 0.35)]
    scene.lambert([panel], (0, 0, 0), emission=10)
    scene.lambert(standing_box((0.6, 0, 0.06), (0.7, 0.12, 0.16)))
    return {"texels-per-metre": 42}


def lights1000(scene):
    """A hall with two rows of pillars and 1,000 small lights: 600 points, 200 spots, 200 shining squares of 4 cm."""
    scene.lambert(scenes.inside_of_box((0, 0, 0), (20, 5, 10)))
    pillars = [(2.5 + 3 * i, z) for i in range(6) for z in (3, 7)]
    for x, z in pillars:
        quads = scenes.inside_of_box((x - 0.3, 0, z - 0.3), (x + 0.3, 5, z + 0.3), ("-y", "+y"))
        scene.lambert([list(reversed(q)) for q in quads])
    numbers = random.Random(1000)
    hues = [(1, 0.8, 0.5), (0.6, 0.8, 1), (1, 0.4, 0.3), (0.7, 1, 0.6)]
    squares = {hue: [] for hue in hues}
    placed = 0
    while placed < 1000:
        x, y, z = 0.2 + 19.6 * numbers.random(), 0.6 + 4.2 * numbers.random(), 0.2 + 9.6 * numbers.random()
        if any(abs(x - px) < 0.4 and abs(z - pz) < 0.4 for px, pz in pillars):
            continue
        hue = hues[placed % 4]
        if placed % 5 < 3:
            scene.lamp([x, y, z], {"type": "point", "color": list(hue), "intensity": 0.3})
        elif placed % 5 == 3:
            scene.lamp([x, y, z], {"type": "spot", "color": list(hue), "intensity": 1.0,
                                   "spot": {"innerConeAngle": 0.35, "outerConeAngle": 0.6}}, DOWN)
        else:
            squares[hue].append(facing_down(x, y, z, 0.02))
        placed += 1
    for hue, quads in squares.items():
        scene.lambert(quads, (0, 0, 0), emission=150, colour=hue)
    return {"texels-per-metre": 1.8}


def courtyard(scene):
    """An open court in a covered walk behind pillars, in the sun and under the sky."""
    outer, inner, high, roof, back = 5.0, 3.0, 3.0, 3.3, 5.2  # walls of 20 cm
    scene.lambert(scenes.inside_of_box((-outer, 0, -outer), (outer, high, outer), ("+y",)), (0.7, 0.65, 0.55))
    below, above, rim = [], [], []
    for side, y, quads in ((outer, high, below), (back, roof, above)):
        for x0, x1, z0, z1 in ((-side, side, -side, -inner), (-side, side, inner, side),
                               (-side, -inner, -inner, inner), (inner, side, -inner, inner)):
            quad = [(x0, y, z0), (x1, y, z0), (x1, y, z1), (x0, y, z1)]
            quads.append(quad if quads is below else list(reversed(quad)))
    rim += scenes.inside_of_box((-inner, high, -inner), (inner, roof, inner), ("-y", "+y"))
    rim += [list(reversed(q)) for q in scenes.inside_of_box((-back, 0, -back), (back, roof, back), ("-y", "+y"))]
    scene.lambert(below + above + rim, (0.7, 0.6, 0.5))
    posts = {(a, b) for a in (-2.8, -1.4, 0.0, 1.4, 2.8) for b in (-2.8, 2.8)}
    for x, z in sorted(posts | {(b, a) for a, b in posts}):
        quads = scenes.inside_of_box((x - 0.15, 0, z - 0.15), (x + 0.15, high, z + 0.15), ("-y", "+y"))
        scene.lambert([list(reversed(q)) for q in quads], (0.75, 0.72, 0.68))
    scene.lambert(standing_box((-0.8, 0, -0.8), (0.8, 0.6, 0.8)), (0.5, 0.5, 0.55))
    return {"texels-per-metre": 2.4, "sun": "0.5,1,0.35:9,8.2,7", "sun-angle": 0.53, "environment": "0.55,0.75,1"}


def caustic(scene):
    """A bent sheet of metal beside a small lamp throws a bright line on the wall and the floor."""
    scene.lambert(scenes.inside_of_box((0, 0, 0), (3, 2.4, 3)))
    steps, radius = 12, 0.8
    arc = [(0.25 + radius * (1 - math.cos(t)), 1.5 + radius * math.sin(t))
           for t in (-0.9 + 1.8 * i / steps for i in range(steps + 1))]
    sheet = [[(xa, 0.3, za), (xa, 1.5, za), (xb, 1.5, zb), (xb, 0.3, zb)]
             for (xa, za), (xb, zb) in zip(arc, arc[1:])]
    scene.metal(sheet, (0.95, 0.9, 0.8), 0.3)
    scene.lambert([[(x - 0.004, y, z) for x, y, z in reversed(quad)] for quad in sheet])  # its back
    scene.lambert([[(0.9, 0.8, 1.4), (0.9, 0.8, 1.6), (0.9, 1.0, 1.6), (0.9, 1.0, 1.4)]], (0, 0, 0), emission=60)
    scene.lambert([facing_down(2.2, 2.39, 1.5, 0.3)], (0, 0, 0), emission=2)
    return {"texels-per-metre": 9}


def furnace(scene):
    """Albedo 1/2, walls of radiance 1: E is 2 pi everywhere."""
    scene.lambert(scenes.inside_of_box((-1, -1, -1), (1, 1, 1)), (0.5, 0.5, 0.5), emission=1.0)
    return {"texels-per-metre": 10}


ROSTER = {f.__name__: f for f in (cornell, ajar, keyhole, lights1000, courtyard, caustic, furnace)}


def save(folder, name, scene, settings):
    """NAME.glb and NAME.kiln.json; the path of the first."""
    os.makedirs(folder, exist_ok=True)
    with open(os.path.join(folder, name + ".kiln.json"), "w") as file:
        json.dump({"layout": "pack", **settings}, file, indent=1)
        file.write("\n")
    return scene.save(os.path.join(folder, name + ".glb"))


def write(folder, names=None):
    """Paths of the scenes by name."""
    paths = {}
    for name in names or ROSTER:
        scene = Scene()
        settings = ROSTER[name](scene)
        paths[name] = save(folder, name, scene, settings)
    return paths


if __name__ == "__main__":
    if len(sys.argv) < 2 or sys.argv[1].startswith("-") or any(name not in ROSTER for name in sys.argv[2:]):
        sys.exit(__doc__ + "\nNames: " + ", ".join(ROSTER))
    write(sys.argv[1], sys.argv[2:])
