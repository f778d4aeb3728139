"""Scenes of the comparison with Cycles: small ones with closed forms, and variants of files that both can read alike."""
import json
import math
import os
import struct


def read(path):
    """(JSON, binary chunk or None) of a .gltf or .glb."""
    with open(path, "rb") as file:
        data = file.read()
    if data[:4] != b"glTF":
        return json.loads(data), None
    length = struct.unpack_from("<I", data, 12)[0]
    binary = data[20 + length + 8:]
    return json.loads(data[20:20 + length]), binary


def write(path, doc, binary):
    text = json.dumps(doc).encode()
    text += b" " * (-len(text) % 4)
    binary += b"\0" * (-len(binary) % 4)
    with open(path, "wb") as file:
        file.write(b"glTF" + struct.pack("<II", 2, 28 + len(text) + len(binary)))
        file.write(struct.pack("<I", len(text)) + b"JSON" + text)
        file.write(struct.pack("<I", len(binary)) + b"BIN\0" + binary)


def as_lambert(material):
    """Base colour, alpha, sidedness and emission stay; the specular layer goes."""
    pbr = material.get("pbrMetallicRoughness", {})
    kept = {k: pbr[k] for k in ("baseColorFactor", "baseColorTexture") if k in pbr}
    extensions = {"KHR_materials_specular": {"specularFactor": 0}}
    if "KHR_materials_emissive_strength" in material.get("extensions", {}):
        extensions["KHR_materials_emissive_strength"] = material["extensions"]["KHR_materials_emissive_strength"]
    result = {k: material[k] for k in ("name", "alphaMode", "alphaCutoff", "doubleSided", "emissiveFactor",
                                       "emissiveTexture") if k in material}
    return {**result, "pbrMetallicRoughness": {**kept, "metallicFactor": 0, "roughnessFactor": 1},
            "extensions": extensions}


def variant(source, folder, mode):
    """A copy both renderers read alike: spots shine as points (Blender's cone falls off otherwise), and in mode
    lambert no material has a specular layer. Primitives without a material become grey, which glTF has as metal."""
    doc, binary = read(source)
    os.makedirs(folder, exist_ok=True)
    for light in doc.get("extensions", {}).get("KHR_lights_punctual", {}).get("lights", []):
        if light["type"] == "spot":
            light["type"] = "point"
            light.pop("spot", None)
    materials = doc.setdefault("materials", [])
    bare = [p for m in doc["meshes"] for p in m["primitives"] if "material" not in p]
    if bare:
        materials.append({"pbrMetallicRoughness": {"baseColorFactor": [0.7, 0.7, 0.7, 1], "metallicFactor": 0}})
        for primitive in bare:
            primitive["material"] = len(materials) - 1
    if mode == "lambert":
        doc["materials"] = [as_lambert(m) for m in materials]
        used = doc.setdefault("extensionsUsed", [])
        if "KHR_materials_specular" not in used:
            used.append("KHR_materials_specular")
    if not materials:
        del doc["materials"]
    if binary is not None:
        path = os.path.join(folder, "scene.glb")
        write(path, doc, binary)
        return path
    for name in os.listdir(os.path.dirname(source)):
        link = os.path.join(folder, name)
        if not os.path.lexists(link) and not name.endswith((".gltf", ".kiln.json")):
            os.symlink(os.path.join(os.path.dirname(source), name), link)
    path = os.path.join(folder, "scene.gltf")
    with open(path, "w") as file:
        json.dump(doc, file)
    return path


class Builder:
    """A glTF file of Lambert quads."""

    def __init__(self):
        self.doc = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": [], "meshes": [],
                    "materials": [], "accessors": [], "bufferViews": [], "buffers": [{}]}
        self.binary = b""

    def accessor(self, values, kind, code):
        flat = [x for v in values for x in v] if kind != "SCALAR" else list(values)
        data = struct.pack("<%d%s" % (len(flat), code), *flat)
        self.doc["bufferViews"].append({"buffer": 0, "byteOffset": len(self.binary), "byteLength": len(data)})
        self.binary += data
        entry = {"bufferView": len(self.doc["bufferViews"]) - 1, "componentType": 5126 if code == "f" else 5125,
                 "count": len(values), "type": kind}
        if kind == "VEC3":
            entry["min"] = [min(v[i] for v in values) for i in range(3)]
            entry["max"] = [max(v[i] for v in values) for i in range(3)]
        self.doc["accessors"].append(entry)
        return len(self.doc["accessors"]) - 1

    def quads(self, quads, albedo=(0.5, 0.5, 0.5), emission=0.0):
        """Each quad four corners, counter-clockwise from its front; TEXCOORD_1 covers [0,1]^2 with each of them."""
        position, normal, uv, index = [], [], [], []
        for a, b, c, d in quads:
            e = [y - x for x, y in zip(a, b)]
            f = [y - x for x, y in zip(a, d)]
            n = [e[1] * f[2] - e[2] * f[1], e[2] * f[0] - e[0] * f[2], e[0] * f[1] - e[1] * f[0]]
            length = math.sqrt(sum(x * x for x in n))
            at = len(position)
            position += [a, b, c, d]
            normal += [[x / length for x in n]] * 4
            uv += [(0, 1), (1, 1), (1, 0), (0, 0)]
            index += [at, at + 1, at + 2, at, at + 2, at + 3]
        material = {"pbrMetallicRoughness": {"baseColorFactor": [*albedo, 1], "metallicFactor": 0}}
        if emission:
            material["emissiveFactor"] = [1, 1, 1]
            material["extensions"] = {"KHR_materials_emissive_strength": {"emissiveStrength": emission}}
            self.doc["extensionsUsed"] = ["KHR_materials_emissive_strength"]
        self.doc["materials"].append(material)
        self.doc["meshes"].append({"primitives": [{
            "attributes": {"POSITION": self.accessor(position, "VEC3", "f"),
                           "NORMAL": self.accessor(normal, "VEC3", "f"), "TEXCOORD_1": self.accessor(uv, "VEC2", "f"),
                           "TEXCOORD_0": self.accessor(uv, "VEC2", "f")},
            "indices": self.accessor(index, "SCALAR", "I"), "material": len(self.doc["materials"]) - 1}]})
        self.node({"mesh": len(self.doc["meshes"]) - 1})

    def node(self, node):
        self.doc["scenes"][0]["nodes"].append(len(self.doc["nodes"]))
        self.doc["nodes"].append(node)

    def point(self, candela, place):
        self.doc["extensions"] = {"KHR_lights_punctual": {"lights": [{"type": "point", "intensity": candela}]}}
        self.doc.setdefault("extensionsUsed", []).append("KHR_lights_punctual")
        self.node({"translation": place, "extensions": {"KHR_lights_punctual": {"light": 0}}})

    def save(self, path):
        self.doc["buffers"][0]["byteLength"] = len(self.binary)
        write(path, self.doc, self.binary)
        return path


def floor(half=1.0, y=0.0):
    return [(-half, y, half), (half, y, half), (half, y, -half), (-half, y, -half)]


def inside_of_box(lo, hi, without=()):
    """Six quads that face inwards."""
    (a, b, c), (d, e, f) = lo, hi
    sides = {"-y": [(a, b, f), (d, b, f), (d, b, c), (a, b, c)], "+y": [(a, e, c), (d, e, c), (d, e, f), (a, e, f)],
             "-z": [(a, b, c), (d, b, c), (d, e, c), (a, e, c)], "+z": [(d, b, f), (a, b, f), (a, e, f), (d, e, f)],
             "-x": [(a, b, f), (a, b, c), (a, e, c), (a, e, f)], "+x": [(d, b, c), (d, b, f), (d, e, f), (d, e, c)]}
    return [quad for name, quad in sides.items() if name not in without]


def outside_of_box(lo, hi):
    return [list(reversed(quad)) for quad in inside_of_box(lo, hi)]


def calibration(folder):
    """Scenes with a closed form: sky, sun, point, and a furnace of albedo 1/2 whose walls shine."""
    cases = []

    def plane(name, truth, point=None, **light):
        scene = Builder()
        scene.quads([floor()])
        if point:
            scene.point(*point)
        path = scene.save(os.path.join(folder, name + ".glb"))
        cases.append({"name": name, "path": path, "layout": "atlas", "truth": truth, **light})

    plane("sky over a plane", {"kind": "constant", "value": math.pi}, environment=[1, 1, 1])
    plane("sun at 60 degrees", {"kind": "constant", "value": 2.0},
          sun={"to_light": [math.sqrt(0.75), 0.5, 0], "irradiance": [4, 4, 4]})
    plane("sun with a disc", {"kind": "constant", "value": 2.0}, sun_angle=5,
          sun={"to_light": [math.sqrt(0.75), 0.5, 0], "irradiance": [4, 4, 4]})
    plane("point over a plane", {"kind": "point", "intensity": 3.0, "height": 1.5}, point=(3.0, [0, 1.5, 0]))
    furnace = Builder()
    furnace.quads(inside_of_box((-1, -1, -1), (1, 1, 1)), emission=1.0)
    cases.append({"name": "furnace", "path": furnace.save(os.path.join(folder, "furnace.glb")), "density": 12,
                  "truth": {"kind": "constant", "value": 2 * math.pi}})
    return cases


def generated(folder):
    """Several bounces, no closed form: a closed room with blocks and a lamp, and a corridor lit from one end."""
    room = Builder()
    room.quads(inside_of_box((-2, 0, -2), (2, 3, 2), ("-x", "+x")), (0.8, 0.8, 0.8))
    room.quads([inside_of_box((-2, 0, -2), (2, 3, 2))[4]], (0.7, 0.1, 0.1))
    room.quads([inside_of_box((-2, 0, -2), (2, 3, 2))[5]], (0.1, 0.6, 0.1))
    room.quads(outside_of_box((-1.2, 0.01, -1.0), (-0.2, 1.8, 0.0)), (0.75, 0.75, 0.75))
    room.quads(outside_of_box((0.3, 0.01, 0.2), (1.2, 0.9, 1.1)), (0.75, 0.75, 0.75))
    room.quads([list(reversed(floor(0.5, 2.95)))], (0.5, 0.5, 0.5), emission=10.0)
    corridor = Builder()
    corridor.quads(inside_of_box((-1, 0, -6), (1, 2, 2), ("+z",)), (0.8, 0.8, 0.8))
    corridor.quads(outside_of_box((-1, 0.0, -2.2), (0.3, 2, -2.0)), (0.8, 0.8, 0.8))
    return [{"name": "room", "path": room.save(os.path.join(folder, "room.glb")), "density": 8},
            {"name": "corridor", "path": corridor.save(os.path.join(folder, "corridor.glb")), "density": 8,
             "environment": [1, 1, 1]}]
