"""A finished bake in Blender: a lit copy in a collection of its own, or the map on the objects' second UV map."""

import contextlib
import json
import os
import struct
import tempfile

import bpy

PAGE, UV, TEXELS = "kiln_page", "kiln_uv", "kiln_texels"  # custom properties of lit materials
PREFIX = "Kiln "


def read_glb(path):
    with open(path, "rb") as file:
        data = file.read()
    if len(data) < 20 or data[:4] != b"glTF":
        raise ValueError("{} is no GLB".format(path))
    length = struct.unpack_from("<I", data, 12)[0]
    return json.loads(data[20:20 + length]), data[20 + length:]


def write_glb(path, gltf, rest):
    text = json.dumps(gltf).encode()
    text += b" " * (-len(text) % 4)
    with open(path, "wb") as file:
        file.write(struct.pack("<4sIIII", b"glTF", 2, 20 + len(text) + len(rest), len(text), 0x4E4F534A) + text + rest)


def lightmap_of(gltf):
    return gltf["extensions"]["KILN_lightmap"]["lightmaps"][0]


def page_files(lightmap):
    """The file of E by page."""
    masters = next(e for e in lightmap["encodings"] if e["name"] == "masters")
    return {t["page"]: t["uri"] for t in masters["textures"] if t["channels"][0]["plane"] == "E.R"}


def material_pages(gltf):
    """By index of a material its page; of primitives on several pages each has a material of its own."""
    pages = {}
    for mesh in gltf.get("meshes", []):
        for primitive in mesh["primitives"]:
            lit = primitive.get("extensions", {}).get("KILN_lightmap")
            if lit and "material" in primitive:
                pages[primitive["material"]] = lit["page"]
    return pages


def take(context, scene, folder):
    """Shows a bake; a summary in one sentence."""
    with open(os.path.join(folder, "report.json"), encoding="utf-8") as file:
        report = json.load(file)
    list_warnings(scene, report)
    gltf, rest = read_glb(os.path.join(folder, "scene.glb"))
    lightmap = lightmap_of(gltf)
    images = {page: load_image(scene, page, os.path.join(folder, name)) for page, name in page_files(lightmap).items()}
    if scene.kiln.layout == "ATLAS":
        lit = mark_objects(scene, lightmap)
    else:
        lit = import_lit(context, scene, gltf, rest, lightmap)
    show(scene, "LIT")
    error = report.get("p95_relative_error")
    return "{} of {} x {} texels on {} materials{}".format(
        "one page" if len(images) == 1 else "{} pages".format(len(images)), lightmap["width"], lightmap["height"], lit,
        "" if error is None else ", error {:.1f} % at the 95th percentile".format(100 * error))


def list_warnings(scene, report):
    for note in report.get("notes", []):
        if note["kind"] != "warning":
            continue
        item = scene.kiln.warnings.add()
        item.name = note["what"]
        named = [o.name for o in scene.objects if "'{}'".format(o.name) in note["what"]]
        item.object = named[0] if named else ""


def image_name(scene, page):
    return "{}{} {}".format(PREFIX, scene.name, page)


def load_image(scene, page, path):
    image = bpy.data.images.get(image_name(scene, page))
    if image is None:
        image = bpy.data.images.load(path)
        image.name = image_name(scene, page)
    image.filepath = path
    image.colorspace_settings.name = "Non-Color"
    image.reload()
    return image


def mark(material, page, uv, lightmap):
    material[PAGE], material[UV] = page, uv
    material[TEXELS] = [lightmap["width"], lightmap["height"]]


def mark_objects(scene, lightmap):
    marked = set()
    for o in scene.objects:
        if o.type != "MESH" or len(o.data.uv_layers) < 2 or not o.kiln.receive:
            continue
        for slot in o.material_slots:
            if slot.material and slot.material.use_nodes:
                mark(slot.material, 0, o.data.uv_layers[1].name, lightmap)
                marked.add(slot.material)
    return len(marked)


def lit_collection(scene):
    """Empty, in the scene."""
    name = PREFIX + scene.name
    collection = bpy.data.collections.get(name) or bpy.data.collections.new(name)
    for o in list(collection.all_objects):
        bpy.data.objects.remove(o)
    for child in list(collection.children_recursive):
        bpy.data.collections.remove(child)
    if collection.name not in scene.collection.children:
        scene.collection.children.link(collection)
    return collection


def import_lit(context, scene, gltf, rest, lightmap):
    import numpy
    if not hasattr(numpy, "bool"):
        numpy.bool = bool  # as in export.py
    for index, page in material_pages(gltf).items():
        gltf["materials"][index].setdefault("extras", {})[PAGE] = page
    gltf.get("extensions", {}).pop("KHR_lights_punctual", None)
    for node in gltf.get("nodes", []):
        node.pop("camera", None)
        node.get("extensions", {}).pop("KHR_lights_punctual", None)
    collection = lit_collection(scene)
    before = set(bpy.data.objects)
    handle, path = tempfile.mkstemp(suffix=".glb")
    os.close(handle)
    try:
        write_glb(path, gltf, rest)
        bpy.ops.import_scene.gltf(filepath=path)
    finally:
        os.remove(path)
    lit = set()
    for o in set(bpy.data.objects) - before:
        for holder in list(o.users_collection):
            holder.objects.unlink(o)
        collection.objects.link(o)
        for slot in o.material_slots if o.type == "MESH" else []:
            if slot.material and PAGE in slot.material and len(o.data.uv_layers) > 1:
                mark(slot.material, slot.material[PAGE], o.data.uv_layers[1].name, lightmap)
                lit.add(slot.material)
    return len(lit)


def principled_input(node, *names):
    return next((node.inputs[n] for n in names if n in node.inputs), None)


class Tree:
    """Nodes of a preview in one material, which are told by their names."""

    def __init__(self, material):
        self.tree = material.node_tree
        self.output = next((n for n in self.tree.nodes if n.type == "OUTPUT_MATERIAL" and n.is_active_output), None)

    def node(self, kind, **inputs):
        node = self.tree.nodes.new(kind)
        node.name = PREFIX + node.name
        for name, value in inputs.items():
            self.put(node.inputs[name], value)
        return node

    def put(self, socket, value):
        if isinstance(value, bpy.types.NodeSocket):
            self.tree.links.new(value, socket)
        elif value is not None:
            socket.default_value = value

    def value_of(self, socket):
        """What the socket reads: a link's source, or its own value."""
        if socket is None:
            return None
        return socket.links[0].from_socket if socket.is_linked else socket.default_value[:] if hasattr(
            socket.default_value, "__len__") else socket.default_value

    def vector(self, operation, a, b):
        node = self.node("ShaderNodeVectorMath")
        node.operation = operation
        for socket, value in zip(node.inputs, (a, b)):
            self.put(socket, value[:3] if isinstance(value, tuple) else (value,) * 3 if isinstance(value, float) else value)
        return node.outputs[0]


def restore(material):
    """Takes the preview out again; whether there was one."""
    tree = material.node_tree
    ours = [n for n in tree.nodes if n.name.startswith(PREFIX)]
    surface = Tree(material).output
    for n in ours:
        tree.nodes.remove(n)
    was = material.get("kiln_surface")
    if surface and was and was in tree.nodes and not surface.inputs["Surface"].is_linked:
        tree.links.new(tree.nodes[was].outputs[0], surface.inputs["Surface"])
    return bool(ours)


def light_texture(t, material, image):
    uv = t.node("ShaderNodeUVMap")
    uv.uv_map = material[UV]
    node = t.node("ShaderNodeTexImage", Vector=uv.outputs[0])
    node.image, node.interpolation, node.extension = image, "Linear", "EXTEND"
    return node.outputs["Color"]


def checker(t, material):
    uv = t.node("ShaderNodeUVMap")
    uv.uv_map = material[UV]
    texels = t.vector("MULTIPLY", uv.outputs[0], (float(material[TEXELS][0]), float(material[TEXELS][1]), 0.0))
    node = t.node("ShaderNodeTexChecker", Vector=texels, Scale=1.0)
    node.inputs["Color1"].default_value, node.inputs["Color2"].default_value = (0.7, 0.7, 0.7, 1), (0.2, 0.2, 0.2, 1)
    return node.outputs["Color"]


def preview(material, image, mode):
    restore(material)
    if mode == "OFF":
        return
    t = Tree(material)
    if t.output is None:
        return
    surface = t.output.inputs["Surface"]
    if surface.is_linked:
        material["kiln_surface"] = surface.links[0].from_node.name
    shader = next((n for n in t.tree.nodes if n.type == "BSDF_PRINCIPLED"), None)
    if mode == "DENSITY":
        shown = checker(t, material)
    else:
        shown = t.vector("SCALE", light_texture(t, material, image), 0.0)
        shown.node.inputs["Scale"].default_value = 0.31830988618  # E / pi
    alpha = None
    if shader is not None and mode == "LIT":
        shown = t.vector("MULTIPLY", shown, t.value_of(shader.inputs["Base Color"]))
        emission = t.value_of(principled_input(shader, "Emission", "Emission Color"))
        scaled = t.vector("SCALE", emission, 0.0)
        t.put(scaled.node.inputs["Scale"], t.value_of(principled_input(shader, "Emission Strength")))
        shown = t.vector("ADD", shown, scaled)
        alpha = t.value_of(shader.inputs["Alpha"])
    light = t.node("ShaderNodeEmission", Color=shown, Strength=1.0).outputs[0]
    if alpha is not None and alpha != 1.0:
        clear = t.node("ShaderNodeBsdfTransparent").outputs[0]
        mix = t.node("ShaderNodeMixShader", Fac=alpha)
        t.put(mix.inputs[1], clear)
        t.put(mix.inputs[2], light)
        light = mix.outputs[0]
    t.tree.links.new(light, surface)


def show(scene, mode):
    """Changes what lit materials of the scene show; how many there are."""
    shown = {slot.material for o in scene.objects for slot in o.material_slots if slot.material and PAGE in slot.material}
    for material in shown:
        preview(material, bpy.data.images.get(image_name(scene, material[PAGE])), mode)
    collection = bpy.data.collections.get(PREFIX + scene.name)
    if collection is not None:
        lit = set(collection.all_objects)
        collection.hide_viewport = collection.hide_render = mode == "OFF"
        for o in scene.objects:  # the originals of a lit copy stand in the same place
            if mode != "OFF" and lit and o.type == "MESH" and o not in lit and not o.hide_render:
                o["kiln_hidden"] = True
                o.hide_viewport = o.hide_render = True
            elif mode == "OFF" and o.get("kiln_hidden"):
                o.hide_viewport = o.hide_render = False
                del o["kiln_hidden"]
    scene.kiln.shown = mode
    return len(shown)


@contextlib.contextmanager
def originals(scene):
    """The scene as it was before any bake, for export."""
    mode, collection = scene.kiln.shown, bpy.data.collections.get(PREFIX + scene.name)
    linked = collection is not None and collection.name in scene.collection.children
    if mode != "OFF":
        show(scene, "OFF")
    if linked:
        scene.collection.children.unlink(collection)
    try:
        yield
    finally:
        if linked:
            scene.collection.children.link(collection)
        if mode != "OFF":
            show(scene, mode)
