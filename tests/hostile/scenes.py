"""Scenes that nobody means well with, each in a folder of its own: deterministic by number and seed.

A family is a function of a random generator that returns {file name: bytes}, with the glTF as scene.gltf or
scene.glb. Add one and it is baked by run.py."""
import base64, json, math, random, struct, zlib

FAMILIES = []


def family(f):
    FAMILIES.append(f)
    return f


class Doc:
    """A glTF with one buffer as a data: URI."""

    def __init__(self):
        self.root = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": []}], "nodes": [],
                     "meshes": [], "accessors": [], "bufferViews": []}
        self.data = b""

    def view(self, data, **more):
        self.data += b"\0" * (-len(self.data) % 4)
        self.root["bufferViews"].append({"buffer": 0, "byteOffset": len(self.data), "byteLength": len(data), **more})
        self.data += data
        return len(self.root["bufferViews"]) - 1

    def accessor(self, view, kind, count, component=5126, **more):
        a = {"componentType": component, "count": count, "type": kind, **more}
        if view is not None:
            a["bufferView"] = view
        self.root["accessors"].append(a)
        return len(self.root["accessors"]) - 1

    def floats(self, values, kind):
        size = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}[kind]
        return self.accessor(self.view(struct.pack(f"<{len(values)}f", *values)), kind, len(values) // size)

    def mesh(self, primitive):
        self.root["meshes"].append({"primitives": [primitive]})
        return len(self.root["meshes"]) - 1

    def node(self, **node):
        self.root["nodes"].append(node)
        self.root["scenes"][0]["nodes"].append(len(self.root["nodes"]) - 1)
        return len(self.root["nodes"]) - 1

    def quad(self, size=1.0):
        return self.floats([0, 0, 0, size, 0, 0, size, size, 0, 0, 0, 0, size, size, 0, 0, size, 0], "VEC3")

    def room(self, size=1.0):
        """A quad that can be baked, so that what is hostile is all that is wrong."""
        self.node(mesh=self.mesh({"attributes": {"POSITION": self.quad(size)}}))
        return self

    def extension(self, name, value=None):
        self.root.setdefault("extensionsUsed", []).append(name)
        if value is not None:
            self.root.setdefault("extensions", {})[name] = value

    def files(self, **more):
        uri = "data:application/octet-stream;base64," + base64.b64encode(self.data).decode()
        buffers = [{"uri": uri, "byteLength": len(self.data)}] + self.root.pop("buffers", [])
        return {"scene.gltf": json.dumps({**self.root, "buffers": buffers}).encode(), **more}


def png(width, height, rows=b"", colour=2):
    def chunk(name, data):
        return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))
    head = struct.pack(">IIBBBBB", width, height, 8, colour, 0, 0, 0)
    return b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", head) + chunk(b"IDAT", zlib.compress(rows, 9)) + chunk(b"IEND", b"")


def raw(text):
    return {"scene.gltf": text if isinstance(text, bytes) else text.encode()}


@family
def zero_accessors(r):
    d = Doc().room()
    d.node(mesh=d.mesh({"attributes": {"POSITION": d.accessor(None, "VEC3", r.choice([0, 3, 1 << 20, 1 << 24, 1 << 31]))}}))
    return d.files()


@family
def instances_of_zeros(r):
    d = Doc()
    d.extension("EXT_mesh_gpu_instancing")
    a = d.accessor(None, "VEC3", r.choice([1000, 1 << 17, 1 << 20, 1 << 24, (1 << 32) - 1]))
    d.node(mesh=d.mesh({"attributes": {"POSITION": d.quad()}}),
           extensions={"EXT_mesh_gpu_instancing": {"attributes": {"TRANSLATION": a}}})
    return d.files()


@family
def instances_of_many_triangles(r):
    d = Doc()
    d.extension("EXT_mesh_gpu_instancing")
    n = r.choice([3000, 30000])
    soup = [r.uniform(-1, 1) for _ in range(9 * n)]
    d.node(mesh=d.mesh({"attributes": {"POSITION": d.floats(soup, "VEC3")}}),
           extensions={"EXT_mesh_gpu_instancing": {"attributes": {"SCALE": d.accessor(
               d.view(struct.pack("<3f", 1, 1, 1) * 4096), "VEC3", 4096)}}})
    return d.files()


@family
def many_nodes(r):
    d = Doc().room()
    n = r.choice([10000, 100000, 300000])
    d.root["nodes"] += [{} for _ in range(n)]
    if r.random() < 0.5:
        d.root["scenes"][0]["nodes"] += list(range(1, n + 1))
    return d.files()


@family
def deep_nodes(r):
    d = Doc().room()
    n = r.choice([1000, 100000])
    for i in range(n):
        d.root["nodes"].append({"children": [i + 2]} if i + 1 < n else {"mesh": 0})
    d.root["scenes"][0]["nodes"].append(1)
    return d.files()


@family
def cycles(r):
    d = Doc().room()
    n = r.randint(1, 50)
    first = len(d.root["nodes"])
    for i in range(n):
        d.root["nodes"].append({"children": [first + (i + 1) % n]})
    if r.random() < 0.5:
        d.root["scenes"][0]["nodes"].append(first)
    return d.files()


@family
def nodes_of_many_parents(r):
    d = Doc().room()
    d.root["nodes"] += [{"children": [0] * r.randint(1, 3)} for _ in range(3)]
    d.root["scenes"][0]["nodes"] += [1, 2, 3]
    return d.files()


@family
def sparse(r):
    d = Doc().room()
    count = r.choice([3, 1 << 16, 1 << 26])
    indices = d.view(struct.pack("<3I", *(r.choice([0, 1, 2, count - 1, count, 0xffffffff]) for _ in range(3))))
    values = d.view(struct.pack("<9f", *(r.uniform(-1, 1) for _ in range(9))))
    a = d.accessor(None, "VEC3", count, sparse={
        "count": r.choice([3, 3, 4, 1 << 31, -1]),
        "indices": {"bufferView": indices, "componentType": 5125, "byteOffset": r.choice([0, 0, -4, 1 << 40])},
        "values": {"bufferView": values, "byteOffset": r.choice([0, 0, -4])}})
    d.node(mesh=d.mesh({"attributes": {"POSITION": a}}))
    return d.files()


@family
def offsets(r):
    d = Doc().room()
    target = r.choice([d.root["accessors"][0], d.root["bufferViews"][0]])
    key = r.choice(["byteOffset", "byteLength", "byteStride", "count"])
    target[key] = r.choice([-1, -(1 << 40), 1 << 31, (1 << 32) - 1, (1 << 63), (1 << 64) - 1, 1e300, 0.5, "1", None])
    return d.files()


@family
def one_file_many_times(r):
    d = Doc().room()
    n = r.choice([100, 10000])
    d.root["buffers"] = [{"uri": r.choice(["a.bin", "./a.bin", "b/../a.bin"]), "byteLength": 1 << 20} for _ in range(n)]
    return d.files(**{"a.bin": b"\0" * (1 << 20)})


@family
def flat_images(r):
    d = Doc()
    side = r.choice([1024, 8192, 16384, 65535])
    rows = (b"\0" + b"\x80" * (3 * side)) * side if side <= 8192 else b""
    files = {}
    d.root.update(images=[], textures=[], materials=[])
    for i in range(r.choice([1, 6])):
        files[f"{i}.png"] = png(side, side, rows) if i == 0 else files["0.png"]
        d.root["images"].append({"uri": f"{i}.png"})
        d.root["textures"].append({"source": i})
        d.root["materials"].append({"pbrMetallicRoughness": {"baseColorTexture": {"index": i}}})
        d.node(mesh=d.mesh({"attributes": {"POSITION": d.quad(), "TEXCOORD_0": d.floats([0, 0, 1, 0, 1, 1] * 2, "VEC2")},
                            "material": i}))
    return d.files(**files)


@family
def damaged_images(r):
    d = Doc()
    image = bytearray(png(64, 64, (b"\0" + bytes(range(192))) * 64))
    for _ in range(r.randint(1, 8)):
        image[r.randrange(8, len(image))] = r.randrange(256)
    image = bytes(image[:r.randrange(8, len(image))]) if r.random() < 0.5 else bytes(image)
    d.root.update(images=[{"uri": "i.png"}], textures=[{"source": 0}],
                  materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}])
    d.node(mesh=d.mesh({"attributes": {"POSITION": d.quad(), "TEXCOORD_0": d.floats([0, 0, 1, 0, 1, 1] * 2, "VEC2")},
                        "material": 0}))
    return d.files(**{"i.png": image})


@family
def many_textures_of_one_image(r):
    d = Doc()
    n = r.choice([100, 1000])
    d.root.update(images=[{"uri": "i.png"}], textures=[{"source": 0} for _ in range(n)],
                  materials=[{"pbrMetallicRoughness": {"baseColorTexture": {"index": i}}} for i in range(n)])
    p, t = d.quad(), d.floats([0, 0, 1, 0, 1, 1] * 2, "VEC2")
    for i in range(n):
        d.node(mesh=d.mesh({"attributes": {"POSITION": p, "TEXCOORD_0": t}, "material": i}), translation=[2 * i, 0, 0])
    return d.files(**{"i.png": png(1024, 1024, (b"\0" + b"\x40" * 3072) * 1024)})


@family
def wild_transforms(r):
    d = Doc()
    wild = lambda: r.choice([0, 1, -1, 1e-30, 1e30, 1e300, -1e308, 1e15, math.pi])
    node = {"mesh": d.mesh({"attributes": {"POSITION": d.quad()}})}
    node.update(r.choice([{"matrix": [wild() for _ in range(16)]}, {"matrix": [1] * r.choice([0, 15, 17])},
                          {"translation": [wild() for _ in range(3)], "scale": [wild() for _ in range(3)]},
                          {"rotation": [wild() for _ in range(4)]}]))
    d.node(**node)
    return d.files()


@family
def words_for_numbers(r):
    d = Doc().room()
    text = d.files()["scene.gltf"].decode()
    return raw(text.replace('"count": 6', '"count": ' + r.choice(["NaN", "Infinity", "1e400", "0x10", "\"6\"", "[]", "{}"])))


@family
def positions_of_any_scale(r):
    d = Doc()
    d.room(10.0 ** r.choice([-45, -38, -30, -10, 10, 14, 15, 18, 30, 38]))
    if r.random() < 0.5:
        d.room()
    return d.files()


@family
def positions_that_are_no_numbers(r):
    d = Doc()
    values = [r.uniform(-1, 1) for _ in range(9)]
    values[r.randrange(9)] = r.choice([float("nan"), float("inf"), -float("inf"), 3e38])
    d.node(mesh=d.mesh({"attributes": {"POSITION": d.floats(values, "VEC3")}}))
    return d.files()


@family
def degenerate_triangles(r):
    d = Doc().room()
    values = []
    for _ in range(300):
        a, e = [r.uniform(-1, 1) for _ in range(3)], r.choice([0, 1e-38, 1e-20, 1e-7])
        values += a + [c + e for c in a] + r.choice([a, [c - e for c in a], [2 * c for c in a]])
    d.node(mesh=d.mesh({"attributes": {"POSITION": d.floats(values, "VEC3")}}))
    return d.files()


@family
def repeated_triangles(r):
    d = Doc()
    d.node(mesh=d.mesh({"attributes": {"POSITION": d.floats([0, 0, 0, 1, 0, 0, 0, 1, 0] * r.choice([10, 20000]), "VEC3")}}))
    return d.files()


@family
def lightmap_coordinates_of_nothing(r):
    d = Doc()
    uv = r.choice([[0.5] * 12, [0, 0, 1, 0, 1, 0] * 2, [1e30, -1e30] * 6, [float("nan")] * 12, [0, 0, 1e-30, 0, 0, 1e-30] * 2])
    d.node(mesh=d.mesh({"attributes": {"POSITION": d.quad(), "TEXCOORD_1": d.floats(uv, "VEC2")}}))
    return d.files()


@family
def copies_on_one_place(r):
    d = Doc()
    mesh = d.mesh({"attributes": {"POSITION": d.quad()}})
    for i in range(r.choice([100, 3000])):
        d.node(mesh=mesh, translation=[0, 0, r.choice([0, 1e-6 * i])])
    return d.files()


@family
def crossing_soup(r):
    d = Doc()
    n = r.choice([100, 3000])
    d.node(mesh=d.mesh({"attributes": {"POSITION": d.floats([r.uniform(-1, 1) for _ in range(9 * n)], "VEC3")}}))
    return d.files()


@family
def deep_json(r):
    n = r.choice([100, 127, 129, 100000])
    return raw('{"asset":{"version":"2.0"},"extras":' + "[" * n + "]" * r.choice([n, 0]) + "}")


@family
def wide_json(r):
    d = Doc().room()
    d.root["extras"] = [[]] * r.choice([1000, 1000000])
    d.root["materials"] = [{}] * r.choice([10, 100000])
    return d.files()


@family
def huge_strings(r):
    d = Doc().room()
    word = r.choice(["x", "\u20ac", "\u0000", "\n\u001b[31m"]) * r.choice([1000, 1000000])
    where = r.choice(["node", "mesh", "material", "key", "extension"])
    if where == "node":
        d.root["nodes"][0]["name"] = word
    elif where == "mesh":
        d.root["meshes"][0]["name"] = word
    elif where == "material":
        d.root["materials"] = [{"name": word, "alphaMode": word}]
        d.root["meshes"][0]["primitives"][0]["material"] = 0
    elif where == "key":
        d.root["nodes"][0]["extras"] = {"kiln": {word: 1}}
    else:
        d.root["extensionsRequired"] = [word]
    return d.files()


@family
def names_that_are_no_text(r):
    text = Doc().room().files()["scene.gltf"]
    return raw(text.replace(b'"mesh": 0', b'"mesh": 0, "name": "' + r.choice([b"\xff\xfe", b"\xc0\x80", b"\xed\xa0\x80", b"\x01"]) + b'"'))


@family
def indices(r):
    d = Doc()
    component, code = r.choice([(5121, "B"), (5123, "H"), (5125, "I")])
    values = [r.choice([0, 1, 2, 3, 5, 6, 200, 255]) for _ in range(r.choice([3, 4, 300]))]
    a = d.accessor(d.view(struct.pack(f"<{len(values)}{code}", *values)), "SCALAR", len(values), component)
    d.node(mesh=d.mesh({"attributes": {"POSITION": d.quad()}, "indices": a, "mode": r.choice([0, 4, 5, 6, 7, -1])}))
    return d.files()


@family
def wrong_references(r):
    d = Doc().room()
    bad = r.choice([-1, -2, 1, 99, 1 << 31, 1 << 40])
    target = r.choice([(d.root["nodes"][0], "mesh"), (d.root["accessors"][0], "bufferView"), (d.root["bufferViews"][0], "buffer"),
                       (d.root["meshes"][0]["primitives"][0], "material"), (d.root, "scene"),
                       (d.root["meshes"][0]["primitives"][0]["attributes"], "POSITION")])
    target[0][target[1]] = bad
    return d.files()


@family
def wrong_types(r):
    d = Doc().room()
    key = r.choice(["nodes", "meshes", "accessors", "bufferViews", "scenes", "asset", "images", "extensionsUsed", "buffers"])
    text = d.files()["scene.gltf"]
    root = json.loads(text)
    root[key] = r.choice([None, 1, "x", [], {}, [1], [None], [[]], {"a": []}, True])
    return raw(json.dumps(root))


@family
def wild_lights(r):
    d = Doc().room()
    wild = lambda: r.choice([0, -1, 1, 1e-40, 1e38, 1e300, "bright", None])
    d.extension("KHR_lights_punctual", {"lights": [{"type": r.choice(["point", "spot", "directional", "laser", 3]),
                "intensity": wild(), "range": wild(), "color": [wild(), wild(), wild()],
                "spot": {"innerConeAngle": wild(), "outerConeAngle": wild()}}]})
    for _ in range(r.choice([1, 2000])):
        d.node(extensions={"KHR_lights_punctual": {"light": r.choice([0, 0, 0, 1, -1])}}, translation=[0, 0, 1])
    return d.files()


@family
def ies_named_often(r):
    d = Doc().room()
    n = r.choice([10, 180])
    numbers = " ".join(str(i * 180 / (n - 1)) for i in range(n)) + "\n0\n" + " ".join(["100"] * n)
    profile = f"IESNA:LM-63-2002\nTILT=NONE\n1 1000 1 {n} 1 1 2 0 0 0\n1 1 10\n{numbers}\n"
    d.extension("EXT_lights_ies", {"lights": [{"uri": "a.ies"}]})
    for _ in range(r.choice([1, 5000])):
        d.node(extensions={"EXT_lights_ies": {"light": 0}}, translation=[0, 0, 1])
    return d.files(**{"a.ies": profile.encode()})


@family
def levels(r):
    d = Doc().room()
    d.extension("MSFT_lod")
    for i in range(r.choice([1, 300])):
        d.node(mesh=0, extensions={"MSFT_lod": {"ids": [r.randrange(0, 310) for _ in range(r.randint(0, 3))]}})
    if r.random() < 0.5:
        d.root["nodes"][0]["extras"] = {"kiln": {"proxy": r.choice([0, 1, -1, "x", 1e9])}}
    return d.files()


@family
def uris(r):
    d = Doc().room()
    d.root["buffers"] = [{"uri": r.choice(["/etc/passwd", "../x", "%2e%2e/x", "file:///etc/passwd", "http://example.com/x", "",
                                           "%00", "a\u0000b", "data:,x", "data:;base64,@@@", ".", "/dev/zero", "x" * 100000]),
                          "byteLength": 1}]
    return d.files()


@family
def glb_containers(r):
    text = Doc().room().files()["scene.gltf"]
    text += b" " * (-len(text) % 4)
    body = struct.pack("<II", r.choice([len(text), len(text) + 4, 0xffffffff, 0]), r.choice([0x4e4f534a, 0x004e4942, 0])) + text
    head = struct.pack("<III", 0x46546c67, r.choice([2, 2, 2, 1, 0xffffffff]), r.choice([12 + len(body), 12, 0, 0xffffffff]))
    return {"scene.glb": (head + body)[:r.choice([10, 12, 20, 100, 1 << 30])]}


@family
def damaged_text(r):
    text = bytearray(Doc().room().files()["scene.gltf"])
    for _ in range(r.randint(1, 5)):
        text[r.randrange(len(text))] = ord(r.choice("0123456789-{}[],:\".e\\ "))
    return raw(bytes(text))


@family
def wild_materials(r):
    d = Doc().room()
    wild = lambda: r.choice([0, 1, -1, 2, 1e38, 1e300, "x", None, []])
    d.root["materials"] = [{"pbrMetallicRoughness": {"baseColorFactor": [wild() for _ in range(r.choice([4, 4, 3]))],
                                                     "metallicFactor": wild(), "roughnessFactor": wild()},
                            "emissiveFactor": [wild(), wild(), wild()],
                            "extensions": {"KHR_materials_emissive_strength": {"emissiveStrength": wild()}}}]
    d.extension("KHR_materials_emissive_strength")
    d.root["meshes"][0]["primitives"][0]["material"] = r.choice([0, 0, 1])
    return d.files()


@family
def sky_of_the_scene(r):
    d = Doc().room()
    d.root["scenes"][0]["extras"] = {"kiln": {"environment": {"image": "sky.hdr", "strength": r.choice([1, 1e38, 0])}}}
    w, h = r.choice([(2, 1), (16384, 8192), (1 << 20, 1), (0, 0), (-1, 4)])
    return d.files(**{"sky.hdr": f"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y {h} +X {w}\n".encode()
                      + bytes(r.choice([[128, 128, 128, 129], [255, 255, 255, 255], [0, 0, 0, 0]])) * 2})


@family
def meshes_of_one_accessor(r):
    d = Doc()
    n = r.choice([1000, 20000])
    p = d.floats([r.uniform(-1, 1) for _ in range(9 * n)], "VEC3")
    for i in range(r.choice([3, 300])):
        d.node(mesh=d.mesh({"attributes": {"POSITION": p}}), translation=[3 * i, 0, 0])
    return d.files()


@family
def files_of_holes(r):
    d = Doc().room()
    d.root["buffers"] = [{"uri": "hole.bin", "byteLength": 1}]
    return d.files(**{"hole.bin": r.choice([1 << 20, 3 << 30])})  # a number: that many bytes of nothing


def scene(number, seed):
    """The files of a scene, and the name of its family."""
    make = FAMILIES[number % len(FAMILIES)]
    return make.__name__, make(random.Random(f"{seed} {number}"))
