#!/usr/bin/env python3
"""Writes the demo scene beside itself, or into the folder given: an arcaded courtyard in the late afternoon.

    python3 make_arcade.py [FOLDER]

Python's standard library only; equal bytes on every run and machine.
"""
import math
import pathlib
import sys

import building as b
import textures
import things
from gltf_out import Gltf, about_y, quaternion
from mesh import cross, scaled, unit

TO_SUN = unit((0.64, 0.64, 0.70))
EYE, TARGET = (-7.35, 1.65, 5.6), (-3.28, 2.3, -3.53)

PRESET = """{
  "texels-per-metre": 4,
  "error": 0.1,
  "max-samples": 512,
  "sun-angle": 0.53
}
"""


def materials(g):
    double = {"doubleSided": True}
    lit = lambda strength: {"KHR_materials_emissive_strength": {"emissiveStrength": strength}}
    g.material("ashlar", texture="ashlar.png")
    g.material("stone", (0.62, 0.55, 0.43, 1), "plaster.png", roughness=0.8)
    g.material("flags", texture="flags.png")
    g.material("tiles", texture="tiles.png", roughness=0.6)
    g.material("plaster", (0.80, 0.70, 0.56, 1), "plaster.png")
    g.material("cream", (0.90, 0.85, 0.75, 1), "plaster.png")
    g.material("ochre", (0.80, 0.56, 0.32, 1), "plaster.png")
    g.material("roof", texture="roof.png")
    g.material("terracotta", (0.56, 0.22, 0.11, 1), "plaster.png")
    g.material("soil", (0.09, 0.06, 0.04, 1))
    g.material("wood", texture="wood.png", roughness=0.7)
    g.material("shutter", texture="shutter.png", roughness=0.7)
    g.material("bark", (0.25, 0.18, 0.12, 1))
    g.material("leaves", texture="leaves.png", alphaMode="MASK", alphaCutoff=0.5, **double)
    g.material("orange", (0.85, 0.30, 0.03, 1), roughness=0.5)
    g.material("water", (0.35, 0.55, 0.55, 0.3), roughness=0.3, alphaMode="BLEND", **double)
    g.material("glass", (0.95, 0.9, 0.8, 0.12), roughness=0.35, alphaMode="BLEND", **double)
    g.material("bronze", (0.78, 0.48, 0.20, 1), metallic=1.0, roughness=0.3)
    g.material("iron", (0.05, 0.05, 0.05, 1), metallic=0.0, roughness=0.6)
    g.material("flame", (1, 0.8, 0.5, 1), emissiveFactor=[1, 0.62, 0.28], extensions=lit(60))
    g.material("sign", (0.05, 0.04, 0.04, 1), roughness=0.4, emissiveFactor=[1, 1, 1],
               emissiveTexture=g.texture("sign.png"), extensions=lit(14))


class Scene:
    def __init__(self, g):
        self.g, self.made, self.roots, self.triangles = g, {}, [], 0

    def put(self, mesh, parent=None, name=None, **at):
        """Places a mesh; it is written when it is first placed."""
        if mesh.name not in self.made:
            self.made[mesh.name] = self.g.mesh(mesh)
        index = self.made[mesh.name]
        self.triangles += self.g.triangles[index]
        node = self.g.node(name or mesh.name, parent, mesh=index, **at)
        if parent is None:
            self.roots.append(node)
        return node

    def frame(self, name, parent=None, **at):
        node = self.g.node(name, parent, **at)
        if parent is None:
            self.roots.append(node)
        return node


# Name, turn about y, bays, half the length, distance of the wall from the middle.
SIDES = (("north", 0, b.ALONG_X, b.HALF_X, b.HALF_Z), ("west", 90, b.ALONG_Z, b.HALF_Z, b.HALF_X),
         ("south", 180, b.ALONG_X, b.HALF_X, b.HALF_Z), ("east", 270, b.ALONG_Z, b.HALF_Z, b.HALF_X))
# Bays are counted from the left as seen from the court.
DOORS = {("north", 2), ("west", 1), ("west", 4), ("south", 2), ("east", 3)}
NICHES = {("north", 0), ("north", 3), ("west", 2), ("east", 1), ("east", 5), ("south", 0)}
BENCHES = {("west", 3), ("west", 5), ("north", 1), ("east", 2), ("south", 3)}
LANTERNS = {("west", 2), ("west", 4), ("north", 1), ("east", 2), ("east", 4), ("south", 1)}
SIGN = ("east", 2)
VINES = {("north", 2): 7, ("east", 1): 8}


def parts():
    end = b.BAY / 2 + 0.1
    half = b.BAY / 2
    made = {
        "ring": b.arch_ring(), "column": b.column(), "rib": b.rib("rib", half - 0.15, half + 0.15), "vault":
        b.vault((0.0, -(b.THICK + b.CLEAR / 2))), "lunette": b.lunette(), "sill": b.sill(), "bracket": b.bracket(),
        "wall": b.arcade_wall("arcade wall", -half, half), "end wall": b.arcade_wall("arcade wall at a corner", -half, end),
        "upper": b.upper_wall("upper wall", -half, half), "end upper": b.upper_wall("upper wall at a corner", -half, end),
        "blind": b.upper_wall("upper wall without window", -half, half, False),
        "window": b.surround("window surround", b.WINDOW, 0.24, 0.0, 0.11),
        "shutter": b.leaf("shutters", "shutter", b.WINDOW, -0.2, 0),
        "plain": b.back_wall("walk wall", -half, half),
        "doorway": b.opened_wall("walk wall with door", "plaster", b.DOOR, 0.18, b.LEDGE, -half, half, -b.BACK, 0.13, 0.18),
        "door frame": b.surround("door surround", b.DOOR, 0.2, -b.BACK, 0.13, 0.06),
        "door": b.leaf("door", "wood", b.DOOR, -b.BACK - 0.17, 1.0),
        "niched": b.opened_wall("walk wall with niche", "plaster", b.NICHE, 0.18, b.LEDGE, -half, half, -b.BACK, 0.1),
        "niche frame": b.surround("niche surround", b.NICHE, 0.26, -b.BACK, 0.1),
        "niche": b.leaf("niche back", "ochre", b.NICHE, -b.BACK - 0.26, 2.6),
        "dentils": b.dentils(8), "bench": things.bench(), "lantern": things.lantern(), "pot": things.pot(),
        "sign": things.sign_board(),
    }
    return made


def bay(s, p, side, i, count, parent):
    first, last = i == 0, i == count - 1
    mirror = {"scale": [-1, 1, 1]} if first else {}  # the left end is the right end's mirror image
    s.put(p["end wall"] if first or last else p["wall"], parent, **mirror)
    blind = (side, i) == SIGN
    s.put(p["end upper"] if first or last else p["blind"] if blind else p["upper"], parent, **mirror)
    for m in p["ring"]:
        s.put(m, parent)
    s.put(p["vault"], parent)
    s.put(p["lunette"], parent)
    s.put(p["dentils"], parent)
    if not last:
        s.put(p["column"], parent, translation=[b.BAY / 2, 0, -b.THICK / 2])
        s.put(p["rib"], parent)
        s.put(p["bracket"], parent, translation=[b.BAY / 2, 0, 0])
    if blind:
        for m in p["sign"]:
            s.put(m, parent)
    else:
        for key in ("window", "shutter", "sill"):
            s.put(p[key], parent)
    if (side, i) in DOORS:
        for key in ("doorway", "door frame", "door"):
            s.put(p[key], parent)
    elif (side, i) in NICHES:
        for key in ("niched", "niche frame", "niche"):
            s.put(p[key], parent)
    else:
        s.put(p["plain"], parent)
    if (side, i) in BENCHES:
        s.put(p["bench"], parent, translation=[0, 0, -b.BACK + 0.32])
    if (side, i) in LANTERNS:
        hang = s.frame("lantern of %s %d" % (side, i), parent,
                       translation=[0, round(b.SPRING + b.R_VAULT - 0.001, 5), -b.THICK - b.CLEAR / 2])
        for m in p["lantern"]:
            s.put(m, hang)
        # Below the lantern: a point light centimetres from a pane would make that pane a spark for stray paths.
        s.g.light("lantern %s %d" % (side, i), hang, {"type": "point", "color": [1, 0.62, 0.28], "intensity": 5},
                  translation=[0, -1.25, 0])
    if (side, i) in VINES:
        s.put(things.vine("vine %d" % VINES[side, i], VINES[side, i]), parent, translation=[b.BAY / 2, 0, -b.THICK / 2])


def house(s, p):
    for m in b.floor() + b.mouldings() + b.shell():
        s.put(m)
    for side, turn, count, half, away in SIDES:
        at = {0: [0, 0, -away], 90: [-away, 0, 0], 180: [0, 0, away], 270: [away, 0, 0]}[turn]
        parent = s.frame(side, translation=at, rotation=about_y(turn))
        for i in range(count):
            x = (i - (count - 1) / 2) * b.BAY
            bay(s, p, side, i, count, s.frame("%s bay %d" % (side, i), parent, translation=[round(x, 5), 0, 0]))
        s.put(b.roof_side("roof over %d bays" % count, half, 13 * (count + 3)), parent)
    corner = [b.pier()] + b.corner_walls()
    corner[-1].name = "corner vault"
    for k, (x, z) in enumerate(((-1, -1), (-1, 1), (1, 1), (1, -1))):
        parent = s.frame("corner %d" % k, translation=[x * b.HALF_X, 0, z * b.HALF_Z], rotation=about_y(90 * k))
        for m in corner:
            s.put(m, parent)


def garden(s, p):
    court = s.frame("court", translation=[0, b.COURT_Y, 0])
    for m in things.fountain() + [things.armillary()]:
        s.put(m, court)
    for k, (x, z) in enumerate(((-3.1, -5.0), (3.1, -5.0), (-3.1, 5.0), (3.1, 5.0))):
        tree = s.frame("orange tree %d" % k, court, translation=[x, 0, z], rotation=about_y(70 * k))
        for m in p["pot"] + things.orange_tree(100 + k % 2):
            s.put(m, tree)
    bushes = [things.bush(200), things.bush(201)]
    for k, (x, z) in enumerate(((-4.45, 0.0), (4.45, -2.6), (-1.3, -7.05), (1.3, -7.05), (-4.45, -2.6), (1.3, 7.05))):
        plant = s.frame("planter %d" % k, court, translation=[x, 0, z], rotation=about_y(50 * k), scale=[0.8, 0.8, 0.8])
        for m in p["pot"] + [bushes[k % 2]]:
            s.put(m, plant)
    for z, turn in ((2.6, 90), (-2.6, 90)):
        s.put(p["bench"], court, translation=[-2.6, 0, z], rotation=about_y(turn))


def lights_and_camera(s):
    x = unit(cross((0, 1, 0), TO_SUN))
    s.roots.append(s.g.light("sun", None, {"type": "directional", "color": [1, 0.85, 0.65], "intensity": 18},
                             rotation=quaternion(x, cross(TO_SUN, x), TO_SUN)))
    down = {"rotation": quaternion((1, 0, 0), (0, 0, -1), (0, 1, 0))}
    spot = {"type": "spot", "color": [1, 0.7, 0.4], "intensity": 14,
            "spot": {"innerConeAngle": 0.25, "outerConeAngle": 0.6}}
    for name, at in (("east", [7.7, 2.52, 1.3]), ("north", [1.3, 2.52, -10.3])):
        s.roots.append(s.g.light("spot over the %s door" % name, None, spot, translation=at, **down))
    z = unit(tuple(e - t for e, t in zip(EYE, TARGET)))
    x = unit(cross((0, 1, 0), z))
    s.g.root["cameras"].append({"type": "perspective", "name": "walk", "perspective": {
        "yfov": 0.94, "aspectRatio": 1.77778, "znear": 0.05, "zfar": 100}})
    s.roots.append(s.g.node("camera", translation=list(EYE), rotation=quaternion(x, cross(z, x), z), camera=0))


def main():
    folder = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else pathlib.Path(__file__).resolve().parent
    g = Gltf()
    materials(g)
    s, p = Scene(g), parts()
    house(s, p)
    garden(s, p)
    lights_and_camera(s)
    g.root["scenes"].append({"name": "arcade", "nodes": s.roots,
                             "extras": {"kiln": {"environment": {"image": "sky.hdr", "strength": 1, "rotation": 0}}}})
    g.write(folder, "arcade")
    for name in ("ashlar", "flags", "tiles", "plaster", "roof", "wood", "shutter", "leaves", "sign"):
        (folder / (name + ".png")).write_bytes(getattr(textures, name)())
    (folder / "sky.hdr").write_bytes(textures.sky(TO_SUN))
    (folder / "arcade.kiln.json").write_text(PRESET)
    print("%d triangles in %d nodes with a mesh" % (s.triangles, sum("mesh" in n for n in g.root["nodes"])))


if __name__ == "__main__":
    main()
