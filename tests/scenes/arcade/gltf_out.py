"""Meshes, materials and nodes as glTF 2.0: a .gltf and a .bin."""
import json
import math
import struct


def quaternion(x, y, z):
    """The rotation whose axes are the given unit vectors, rounded."""
    m = (x, y, z)  # columns
    trace = x[0] + y[1] + z[2]
    if trace > 0:
        w = math.sqrt(1 + trace) / 2
        q = ((y[2] - z[1]) / (4 * w), (z[0] - x[2]) / (4 * w), (x[1] - y[0]) / (4 * w), w)
    else:
        i = max(range(3), key=lambda k: m[k][k])
        j, k = (i + 1) % 3, (i + 2) % 3
        r = math.sqrt(max(0.0, 1 + m[i][i] - m[j][j] - m[k][k])) / 2
        v = [0.0, 0.0, 0.0]
        v[i], v[j], v[k] = r, (m[i][j] + m[j][i]) / (4 * r), (m[i][k] + m[k][i]) / (4 * r)
        q = (v[0], v[1], v[2], (m[j][k] - m[k][j]) / (4 * r))
    return [round(c, 7) + 0.0 for c in q]


def about_y(degrees):
    half = math.radians(degrees) / 2
    return [0.0, round(math.sin(half), 7), 0.0, round(math.cos(half), 7)]


class Gltf:
    def __init__(self):
        self.buffer = bytearray()
        self.root = {"asset": {"version": "2.0", "generator": "make_arcade.py"}, "scene": 0, "scenes": [],
                     "nodes": [], "meshes": [], "materials": [], "accessors": [], "bufferViews": [],
                     "images": [], "textures": [], "cameras": [],
                     "samplers": [{"magFilter": 9729, "minFilter": 9987, "wrapS": 10497, "wrapT": 10497}]}
        self.lights, self.materials, self.triangles = [], {}, {}

    def accessor(self, values, kind, component, target, bounds=False):
        code = {5126: "f", 5123: "H", 5125: "I"}[component]
        flat = [v for row in values for v in row] if kind != "SCALAR" else list(values)
        data = struct.pack("<%d%s" % (len(flat), code), *flat)
        while len(self.buffer) % 4:
            self.buffer += b"\0"
        self.root["bufferViews"].append({"buffer": 0, "byteOffset": len(self.buffer), "byteLength": len(data),
                                         "target": target})
        self.buffer += data
        entry = {"bufferView": len(self.root["bufferViews"]) - 1, "componentType": component,
                 "count": len(values), "type": kind}
        if bounds:
            stored = struct.unpack("<%df" % len(flat), data)
            entry["min"] = [min(stored[i::3]) for i in range(3)]
            entry["max"] = [max(stored[i::3]) for i in range(3)]
        self.root["accessors"].append(entry)
        return len(self.root["accessors"]) - 1

    def texture(self, uri):
        for i, image in enumerate(self.root["images"]):
            if image["uri"] == uri:
                return {"index": i}
        self.root["images"].append({"uri": uri, "name": uri.split(".")[0]})
        self.root["textures"].append({"source": len(self.root["images"]) - 1, "sampler": 0})
        return {"index": len(self.root["textures"]) - 1}

    def material(self, name, color=(1, 1, 1, 1), texture=None, metallic=0.0, roughness=0.9, **more):
        pbr = {"baseColorFactor": list(color), "metallicFactor": metallic, "roughnessFactor": roughness}
        if texture:
            pbr["baseColorTexture"] = self.texture(texture)
        self.materials[name] = len(self.root["materials"])
        self.root["materials"].append(dict({"name": name, "pbrMetallicRoughness": pbr}, **more))

    def mesh(self, m):
        m.finish()
        attributes = {"POSITION": self.accessor(m.positions, "VEC3", 5126, 34962, True),
                      "NORMAL": self.accessor(m.normals, "VEC3", 5126, 34962),
                      "TEXCOORD_0": self.accessor(m.uv0, "VEC2", 5126, 34962)}
        if m.authored:
            attributes["TEXCOORD_1"] = self.accessor(m.uv1, "VEC2", 5126, 34962)
        wide = 5125 if len(m.positions) > 65535 else 5123
        indices = self.accessor([i for t in m.triangles for i in t], "SCALAR", wide, 34963)
        self.root["meshes"].append({"name": m.name, "primitives": [{
            "attributes": attributes, "indices": indices, "material": self.materials[m.material]}]})
        index = len(self.root["meshes"]) - 1
        self.triangles[index] = len(m.triangles)
        return index

    def node(self, name, parent=None, **members):
        """Members as in glTF; returns its index."""
        self.root["nodes"].append(dict({"name": name}, **members))
        index = len(self.root["nodes"]) - 1
        if parent is not None:
            self.root["nodes"][parent].setdefault("children", []).append(index)
        return index

    def light(self, name, parent, light, **members):
        self.lights.append(dict({"name": name}, **light))
        members["extensions"] = {"KHR_lights_punctual": {"light": len(self.lights) - 1}}
        return self.node(name, parent, **members)

    def write(self, folder, name):
        root = dict(self.root)
        root["extensionsUsed"] = ["KHR_lights_punctual", "KHR_materials_emissive_strength"]
        root["extensions"] = {"KHR_lights_punctual": {"lights": self.lights}}
        root["buffers"] = [{"uri": name + ".bin", "byteLength": len(self.buffer)}]
        (folder / (name + ".bin")).write_bytes(bytes(self.buffer))
        text = json.dumps(root, separators=(",", ":"))
        for key in root:
            text = text.replace('"%s":[{' % key, '\n"%s":[\n{' % key)
        text = text.replace("},{", "},\n{")
        (folder / (name + ".gltf")).write_text(text + "\n")
