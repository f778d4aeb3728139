"""What configs/engines/godot/godot4.py writes, read by the rules of Godot 4's sources; no Godot 4 runs here.

usage: godot4_test.py KILN

The demo is baked on pages of 128 texels, so that objects lie on several; names of its nodes are made awkward first.
"""
import itertools
import json
import math
import os
import pathlib
import re
import shutil
import struct
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
TOOL = ROOT / "configs/engines/godot/godot4.py"
HIDDEN = re.compile(r"[-$](noimp|col|convcol|colonly|convcolonly|rigid|navmesh|occ|occonly|vehicle|wheel|loop|cycle)$")


def chunks(path):
    data = path.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data)), "the head of the GLB"
    at, found = 12, []
    while at < len(data):
        n, kind = struct.unpack_from("<I4s", data, at)
        assert n % 4 == 0
        found.append((kind, data[at + 8:at + 8 + n]))
        at += 8 + n
    return json.loads(found[0][1]), found[1][1]


def resource(path):
    """(head, ext resources by id, properties by name) of a text resource; values as text."""
    parts = re.split(r"^\[(.*)\]$", path.read_text(), flags=re.M)
    external, properties = {}, {}
    for tag, body in zip(parts[1::2], parts[2::2]):
        fields = dict(re.findall(r'(\w+)="((?:[^"\\]|\\.)*)"', tag))
        if tag.startswith("ext_resource"):
            external[fields["id"]] = fields
        for name, value in re.findall(r"^(\w+) = (.*?)(?=^\w+ = |\Z)", body, re.M | re.S):
            properties[(fields.get("name", ""), name)] = value.strip()
    return parts[1], external, properties


def imported_paths(document):
    """Paths of nodes as GLTFDocument gives them: invalid characters replaced, a number behind a name that is taken."""
    taken, names = set(), []
    for node in document["nodes"]:
        name = re.sub(r'[.:@/"%]', "_", node["name"])
        unique, i = name, 1
        while unique in taken:
            i += 1
            unique = name + str(i)
        taken.add(unique)
        names.append(unique)
        assert not HIDDEN.search(unique), f"{unique} means something to the importer"
    paths = {}

    def visit(i, above):
        paths["../Scene/" + above + names[i]] = i
        for child in document["nodes"][i].get("children", []):
            visit(child, above + names[i] + "/")
    for root in document["scenes"][document.get("scene", 0)]["nodes"]:
        visit(root, "")
    return paths


def place(document, path, paths, point):
    """A point of a node's mesh in the scene: the node's transform, then those above it."""
    while path != "../Scene":
        node = document["nodes"][paths[path]]
        if "matrix" in node:
            m = node["matrix"]
            point = [sum(m[4 * k + r] * v for k, v in enumerate([*point, 1])) for r in range(3)]
        else:
            point = [p * s for p, s in zip(point, node.get("scale", [1, 1, 1]))]
            *u, w = node.get("rotation", [0, 0, 0, 1])
            cross = lambda a, b: [a[i - 2] * b[i - 1] - a[i - 1] * b[i - 2] for i in range(3)]  # noqa: E731
            t = [2 * c for c in cross(u, point)]
            point = [p + w * a + b + o for p, a, b, o in
                     zip(point, t, cross(u, t), node.get("translation", [0, 0, 0]))]
        path = path.rsplit("/", 1)[0]
    return point


def vectors(document, data, accessor, n):
    a = document["accessors"][accessor]
    view = document["bufferViews"][a["bufferView"]]
    at, stride = view.get("byteOffset", 0) + a.get("byteOffset", 0), view.get("byteStride", 4 * n)
    assert a["componentType"] == 5126
    return [struct.unpack_from(f"<{n}f", data, at + i * stride) for i in range(a["count"])]


def exr_size(path):
    data = path.read_bytes()
    assert data[:4] == b"\x76\x2f\x31\x01"
    at = data.index(b"dataWindow\0box2i\0") + 21
    x0, y0, x1, y1 = struct.unpack_from("<4i", data, at)
    return x1 - x0 + 1, y1 - y0 + 1


def check(bake, project):
    before, _ = chunks(bake / "scene.glb")
    lightmap = before["extensions"]["KILN_lightmap"]["lightmaps"][0]
    folder = project / "lightmap"
    document, data = chunks(folder / "scene.glb")
    head, external, properties = resource(folder / "lightmap.tres")
    assert 'type="LightmapGIData"' in head and "format=3" in head
    order = re.fullmatch(r"Array\[TextureLayered\]\(\[(.*)\]\)", properties["", "lightmap_textures"])[1]
    textures = [external[i]["path"] for i in re.findall(r'ExtResource\("(\w+)"\)', order)]
    assert len(textures) == lightmap["pages"] > 1, textures
    for texture in textures:
        file = project / texture.removeprefix("res://")
        assert exr_size(file) == (lightmap["width"], lightmap["height"]), texture
        options = (file.parent / (file.name + ".import")).read_text()
        for line in ('importer="2d_array_texture"', 'type="CompressedTexture2DArray"', "mipmaps/generate=false",
                     "slices/horizontal=1", "slices/vertical=1"):
            assert line + "\n" in options, line
    assert properties["", "uses_spherical_harmonics"] == "false"
    paths = imported_paths(document)
    assert len(paths) == len(set(paths.values()))
    users = re.findall(r'NodePath\("([^"]*)"\), Rect2\(([^)]*)\), (\d+), (-?\d+)', properties["", "user_data"])
    assert properties["", "user_data"].count("NodePath") == len(users)
    lit, primitives = set(), 0
    for path, rect, page, instance in users:
        node = document["nodes"][paths[path]]
        assert [float(v) for v in rect.split(",")] == [0, 0, 1, 1] and instance == "-1"
        for primitive in document["meshes"][node["mesh"]]["primitives"]:
            said = primitive.get("extensions", {}).get("KILN_lightmap")
            if said is None:
                continue
            primitives += 1
            assert said["page"] == int(page) < len(textures), path
            for u, v in vectors(document, data, primitive["attributes"]["TEXCOORD_1"], 2):
                assert -1e-6 <= u <= 1 + 1e-6 and -1e-6 <= v <= 1 + 1e-6
        lit.add(paths[path])
    everywhere = {i for i, n in enumerate(document["nodes"]) if "KILN_lightmap" in n.get("extensions", {})}
    assert lit == everywhere & set(paths.values()), "every lit node is a user"
    lit_before = [p for n in before["nodes"] if "KILN_lightmap" in n.get("extensions", {})
                  for p in before["meshes"][n["mesh"]]["primitives"] if "KILN_lightmap" in p.get("extensions", {})]
    assert primitives == len(lit_before) > 0, (primitives, len(lit_before))
    probes = properties["", "probe_data"]
    bounds = [float(v) for v in re.search(r"AABB\(([^)]*)\)", probes)[1].split(",")]
    for path, i in paths.items():
        for primitive in document["meshes"][document["nodes"][i]["mesh"]]["primitives"] if "mesh" in document["nodes"][i] else []:
            for point in itertools.islice(vectors(document, data, primitive["attributes"]["POSITION"], 3), 0, None, 7):
                for at, low, size in zip(place(document, path, paths, point), bounds[:3], bounds[3:]):
                    assert low - 1e-3 <= at <= low + size + 1e-3, path
    for key in ("bounds", "points", "tetrahedra", "bsp", "sh", "interior", "baked_exposure", "lightprobe_hash"):
        assert f'"{key}":' in probes, key
    points = re.search(r"PackedVector3Array\(([^)]*)\)", probes)[1].split(",")
    colours = re.search(r"PackedColorArray\(([^)]*)\)", probes)[1].split(",")
    assert len(points) == 3 and len(colours) == 4 * 9 * len(points) // 3
    _, external, properties = resource(folder / "lit.tscn")
    assert properties["LightmapGI", "light_data"] == 'ExtResource("2")' and external["2"]["path"].endswith("lightmap.tres")
    assert 'name="Scene" parent="." instance=ExtResource("1")' in (folder / "lit.tscn").read_text()
    print(f"{len(users)} users, {primitives} lit primitives, {len(textures)} slices")


def tool(*arguments):
    return subprocess.run([sys.executable, TOOL, *arguments], capture_output=True, text=True)


def main():
    kiln = os.path.abspath(sys.argv[1])
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        scene = ROOT / "tests/scenes/arcade"
        shutil.copytree(scene, folder / "scene")
        file = folder / "scene/arcade.gltf"
        gltf = json.loads(file.read_text())
        meshes = [n for n in gltf["nodes"] if "mesh" in n]
        meshes[0]["name"], meshes[1]["name"], meshes[2]["name"] = "a/b.c:d", "wall-col", meshes[3]["name"].upper()
        del meshes[4]["name"]
        file.write_text(json.dumps(gltf))
        subprocess.run([kiln, "bake", file, "-o", folder / "bake", "--config", ROOT / "configs/engines/godot.json", "--quiet",
                        "--texels-per-metre", "2", "--page-size", "128", "--min-samples", "2", "--max-samples", "2",
                        "--max-bounces", "1", "--layout", "pack"], check=True, capture_output=True)
        project = folder / "project"
        project.mkdir()
        said = tool(folder / "bake", project)
        assert said.returncode == 2 and "project.godot" in said.stderr, said
        (project / "project.godot").write_text("")
        said = tool(folder / "bake", project)
        assert said.returncode == 0, said.stderr
        check(folder / "bake", project)
        said = tool(folder, project, "other")
        assert said.returncode == 2 and "scene.glb" in said.stderr, said
        document, rest = chunks(folder / "bake/scene.glb")
        for spoil, words in ((lambda d: d["extensions"].pop("KILN_lightmap"), "no KILN_lightmap"),
                             (lambda d: d["extensions"]["KILN_lightmap"]["lightmaps"][0]["encodings"].clear(), "E/pi in EXR")):
            spoilt = json.loads(json.dumps(document))
            spoil(spoilt)
            text = json.dumps(spoilt).encode()
            text += b" " * (-len(text) % 4)
            (folder / "bake/scene.glb").write_bytes(struct.pack("<4sIII4s", b"glTF", 2, 20 + len(text), len(text), b"JSON") + text)
            said = tool(folder / "bake", project, "other")
            assert said.returncode == 2 and words in said.stderr, said
            assert not (project / "other").exists() or not list((project / "other").glob("*.tres"))


if __name__ == "__main__":
    main()
