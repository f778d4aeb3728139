#!/usr/bin/env python3
"""Makes files of Godot 4 from the output folder of a bake: a scene with a LightmapGI whose data name the baked textures.

usage: godot4.py BAKE PROJECT [NAME]

BAKE is a folder that `kiln bake --config configs/engines/godot.json` wrote, PROJECT a folder with project.godot. Written is
PROJECT/NAME (default: lightmap): the scene, its textures with .import files, lightmap.tres and lit.tscn, to be opened or instanced.
Exit status: 0 done, 1 the files cannot be written, 2 wrong usage or a bake that does not fit.
"""
import copy
import json
import math
import pathlib
import re
import shutil
import struct
import sys


class Unfit(Exception):
    pass


def read_glb(path):
    data = path.read_bytes()
    if data[:4] != b"glTF":
        raise Unfit(f"{path} is no GLB file")
    length, = struct.unpack_from("<I", data, 12)
    return json.loads(data[20:20 + length]), data[20 + length:]


def write_glb(path, document, rest):
    text = json.dumps(document, separators=(",", ":")).encode()
    text += b" " * (-len(text) % 4)
    path.write_bytes(struct.pack("<IIIII", 0x46546C67, 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest)


def textures_of(lightmap):
    """Files of E/pi in EXR, by page."""
    for encoding in lightmap.get("encodings", []):
        if encoding["name"] != "exr":
            continue
        found = {t["page"]: t["uri"] for t in encoding["textures"] if t["channels"][0]["plane"] == "E.R" and
                 abs(t["channels"][0].get("scale", 1) / math.pi - 1) < 1e-3}
        if sorted(found) == list(range(lightmap["pages"])):
            return [found[page] for page in range(lightmap["pages"])]
    raise Unfit("the bake has no E/pi in EXR: bake or encode with --config configs/engines/godot.json")


def split_by_page(document):
    """Godot gives a node one slice: a node on several pages gets a child for each further one."""
    for node in list(document["nodes"]):
        pages = node.get("extensions", {}).get("KILN_lightmap", {}).get("pages", [])
        if len(pages) < 2:
            continue
        mesh = document["meshes"][node["mesh"]]
        unlit = [p for p in mesh["primitives"] if "page" not in p.get("extensions", {}).get("KILN_lightmap", {})]
        for page in pages:
            part = copy.deepcopy(mesh)
            part["primitives"] = [p for p in mesh["primitives"]
                                  if p.get("extensions", {}).get("KILN_lightmap", {}).get("page") == page]
            if page == pages[0]:
                part["primitives"] += unlit
            document["meshes"].append(part)
            lit = {"KILN_lightmap": {"lightmap": 0, "pages": [page]}}
            if page == pages[0]:
                node["mesh"], node["extensions"] = len(document["meshes"]) - 1, {**node["extensions"], **lit}
            else:
                document["nodes"].append({"name": f"{node.get('name', 'node')} page {page}",
                                          "mesh": len(document["meshes"]) - 1, "extensions": lit})
                node.setdefault("children", []).append(len(document["nodes"]) - 1)


def name_nodes(document):
    """Names that Godot's importer keeps: each once, without the characters and endings that mean something to it."""
    taken = set()
    for node in document["nodes"]:
        name = re.sub(r'[.:@/"%\\]', "_", node.get("name", "")).strip() or "node"
        name = re.sub(r"[-$](\w+)$", r"_\1", name)
        unique, i = name, 1
        while unique.lower() in taken:
            i += 1
            unique = f"{name}_{i}"
        taken.add(unique.lower())
        node["name"] = unique


def matrix_of(node):
    if "matrix" in node:
        m = node["matrix"]
        return [[m[4 * c + r] for c in range(4)] for r in range(4)]
    x, y, z, w = node.get("rotation", [0, 0, 0, 1])
    s, t = node.get("scale", [1, 1, 1]), node.get("translation", [0, 0, 0])
    turn = [[1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
            [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
            [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)]]
    return [[turn[r][c] * s[c] for c in range(3)] + [t[r]] for r in range(3)] + [[0, 0, 0, 1]]


def times(a, b):
    return [[sum(a[r][k] * b[k][c] for k in range(4)) for c in range(4)] for r in range(4)]


def walk(document):
    """Visits (node, its path below the scene, its matrix)."""
    scene = document["scenes"][document.get("scene", 0)]
    unit = [[float(r == c) for c in range(4)] for r in range(4)]
    stack = [(i, "", unit) for i in reversed(scene["nodes"])]
    while stack:
        i, above, matrix = stack.pop()
        node = document["nodes"][i]
        path, matrix = above + node["name"], times(matrix, matrix_of(node))
        yield node, path, matrix
        stack += [(child, path + "/", matrix) for child in reversed(node.get("children", []))]


def users_and_bounds(document):
    users, low, high = [], [math.inf] * 3, [-math.inf] * 3
    for node, path, matrix in walk(document):
        if "mesh" not in node:
            continue
        for primitive in document["meshes"][node["mesh"]]["primitives"]:
            box = document["accessors"][primitive["attributes"]["POSITION"]]
            for corner in range(8):
                at = [box["max" if corner >> k & 1 else "min"][k] for k in range(3)] + [1]
                for r in range(3):
                    value = sum(matrix[r][k] * at[k] for k in range(4))
                    low[r], high[r] = min(low[r], value), max(high[r], value)
        lit = node.get("extensions", {}).get("KILN_lightmap")
        if lit:
            rect = [*lit.get("offset", [0, 0]), *lit.get("scale", [1, 1])]
            users.append((path, rect, lit["pages"][0]))
    return users, low, high


def quoted(text):
    return '"' + text.replace("\\", "\\\\").replace('"', '\\"') + '"'


def numbers(values):
    return ", ".join(f"{v:.9g}" for v in values)


def lightmap_resource(base, textures, users, low, high):
    lines = [f'[gd_resource type="LightmapGIData" load_steps={len(textures) + 1} format=3]', ""]
    for i, name in enumerate(textures):
        lines.append(f'[ext_resource type="CompressedTexture2DArray" path={quoted(base + name)} id="{i + 1}"]')
    data = ", ".join(f"NodePath({quoted('../Scene/' + path)}), Rect2({numbers(rect)}), {page}, -1" for path, rect, page in users)
    middle, margin = [(a + b) / 2 for a, b in zip(low, high)], 0.01
    size = [b - a + 2 * margin for a, b in zip(low, high)]
    textures = ", ".join(f'ExtResource("{i + 1}")' for i in range(len(textures)))
    # A lightmap without any probe has no bounds in Godot, and is culled: one black probe in the middle.
    lines += ["", "[resource]", f"lightmap_textures = Array[TextureLayered]([{textures}])", "uses_spherical_harmonics = false", f"user_data = [{data}]",
              "probe_data = {", '"baked_exposure": 1.0,',
              f'"bounds": AABB({numbers([a - margin for a in low] + size)}),', '"bsp": PackedInt32Array(),', '"interior": false,',
              '"lightprobe_hash": 0,', f'"points": PackedVector3Array({numbers(middle)}),',
              f'"sh": PackedColorArray({", ".join(["0, 0, 0, 1"] * 9)}),', '"tetrahedra": PackedInt32Array()', "}", ""]
    return "\n".join(lines)


def lit_scene(base):
    return "\n".join([
        "[gd_scene load_steps=3 format=3]", "",
        f'[ext_resource type="PackedScene" path={quoted(base + "scene.glb")} id="1"]',
        f'[ext_resource type="LightmapGIData" path={quoted(base + "lightmap.tres")} id="2"]', "",
        '[node name="Lit" type="Node3D"]', "",
        '[node name="Scene" parent="." instance=ExtResource("1")]', "",
        '[node name="LightmapGI" type="LightmapGI" parent="."]', 'light_data = ExtResource("2")', ""])


TEXTURE_IMPORT = """[remap]

importer="2d_array_texture"
type="CompressedTexture2DArray"

[params]

compress/mode=3
compress/channel_pack=1
mipmaps/generate=false
slices/horizontal=1
slices/vertical=1
"""
# Compressed meshes have UV2 in 16 bits; light baking of Godot's own would unwrap UV2 anew.
SCENE_IMPORT = """[remap]

importer="scene"
type="PackedScene"

[params]

meshes/force_disable_compression=true
meshes/light_baking=1
"""


def convert(bake, project, name):
    if not (project / "project.godot").exists():
        raise Unfit(f"{project} has no project.godot")
    document, rest = read_glb(bake / "scene.glb")
    lightmaps = document.get("extensions", {}).get("KILN_lightmap", {}).get("lightmaps", [])
    if not lightmaps or "quantity" not in lightmaps[0]:
        raise Unfit(f"{bake / 'scene.glb'} has no KILN_lightmap with light")
    textures = textures_of(lightmaps[0])
    split_by_page(document)
    name_nodes(document)
    users, low, high = users_and_bounds(document)
    if not users:
        raise Unfit("no object of the scene is lit")
    folder, base = project / name, f"res://{name}/"
    folder.mkdir(parents=True, exist_ok=True)
    for texture in textures:
        shutil.copyfile(bake / texture, folder / texture)
        (folder / (texture + ".import")).write_text(TEXTURE_IMPORT)
    write_glb(folder / "scene.glb", document, rest)
    (folder / "scene.glb.import").write_text(SCENE_IMPORT)
    (folder / "lightmap.tres").write_text(lightmap_resource(base, textures, users, low, high))
    (folder / "lit.tscn").write_text(lit_scene(base))
    return f"{folder / 'lit.tscn'}: {len(users)} lit objects, {len(textures)} pages"


def main():
    if len(sys.argv) not in (3, 4):
        print(__doc__.split("\n\n")[1], file=sys.stderr)
        return 2
    try:
        print(convert(pathlib.Path(sys.argv[1]), pathlib.Path(sys.argv[2]), sys.argv[3] if len(sys.argv) > 3 else "lightmap"))
    except (Unfit, FileNotFoundError, ValueError, KeyError) as why:
        print(f"godot4.py: {why}", file=sys.stderr)
        return 2
    except OSError as why:
        print(f"godot4.py: {why}", file=sys.stderr)
        return 1
    return 0


if __name__ == "__main__":
    sys.exit(main())
