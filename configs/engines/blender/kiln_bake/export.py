"""The scene as glTF: what Blender's exporter writes, and what Kiln reads besides (docs/scenes.md)."""

import math
import os

import bpy


def object_extras(o):
    """extras.kiln of an object, without what is as by default."""
    out = {name: False for name in ("receive", "cast", "reflect") if not getattr(o.kiln, name)}
    if abs(o.kiln.density - 1) > 1e-6:
        out["density"] = round(o.kiln.density, 6)
    if o.type == "LIGHT" and o.kiln.bake != "full":
        out["bake"] = o.kiln.bake
    return out


def area_light(o):
    """An area lamp as extras.kiln.light. Cycles spreads its power over the area: P / (4 A) in every direction."""
    lamp = o.data
    scale = o.matrix_world.to_scale()
    wide, high = lamp.size, lamp.size if lamp.shape in {"SQUARE", "DISK"} else lamp.size_y
    area = wide * high * abs(scale.x * scale.y)
    is_round = lamp.shape in {"DISK", "ELLIPSE"}
    if is_round:
        area *= math.pi / 4
    if area <= 0 or lamp.energy <= 0:
        return None
    light = {"radiance": [c * lamp.energy / (4 * area) for c in lamp.color]}
    if is_round and abs(wide * scale.x - high * scale.y) < 1e-4 * wide:
        light.update(shape="disc", radius=wide / 2)
    else:  # an ellipse by the rectangle of its area
        fit = math.sqrt(math.pi) / 2 if is_round else 1
        light.update(shape="rectangle", size=[wide * fit, high * fit])
    return light


def own_extras(extras, names):
    """The custom properties, without the panel's values, which Blender keeps in "kiln" too; keys that no panel has stay."""
    extras = dict(extras or {})
    kiln = extras.pop("kiln", {})
    return extras, {k: v for k, v in kiln.items() if k in names}


class GltfHooks:
    """Called by Blender's glTF exporter."""

    def gather_node_hook(self, node, blender_object, export_settings):
        if not isinstance(blender_object, bpy.types.Object):
            return
        extras, kiln = own_extras(node.extras, ("proxy", "lod_distance"))
        kiln.update(object_extras(blender_object))
        if blender_object.type == "LIGHT" and blender_object.data.type == "AREA":
            light = area_light(blender_object)
            if light:
                kiln["light"] = light  # the exporter has turned the node, so that a lamp shines along its -Z
        if kiln:
            extras["kiln"] = kiln
        node.extras = extras or None

    def gather_scene_hook(self, scene, blender_scene, export_settings):
        extras, kiln = own_extras(scene.extras, ("environment", "importance"))
        if kiln:
            extras["kiln"] = kiln
        scene.extras = extras or None


def write_gltf(context, path):
    """Writes the scene, or what its view layer shows, with lamps in Blender's own units."""
    import numpy
    if not hasattr(numpy, "bool"):
        numpy.bool = bool  # Debian's Blender 3.4 uses a name that NumPy 1.24 no longer has
    wanted = {
        "filepath": path, "export_format": "GLB", "check_existing": False, "export_extras": True,
        "export_lights": True, "export_cameras": True, "export_apply": True, "export_animations": False,
        "use_active_scene": True, "use_renderable": True, "use_visible": context.scene.kiln.what == "VIEW_LAYER",
        "convert_lighting_mode": "COMPAT", "export_import_convert_lighting_mode": "COMPAT",  # the name changed in 3.6
    }
    known = bpy.ops.export_scene.gltf.get_rna_type().properties.keys()
    if not bpy.app.background and context.mode != "OBJECT":
        bpy.ops.object.mode_set(mode="OBJECT")
    bpy.ops.export_scene.gltf(**{name: value for name, value in wanted.items() if name in known})


def environment(world):
    """The value of --environment and a sentence about what was left out; either may be None."""
    if world is None:
        return None, None
    if not world.use_nodes:
        return "{:.6g},{:.6g},{:.6g}".format(*world.color), None
    background = next((n for n in world.node_tree.nodes if n.type == "BACKGROUND"), None)
    if background is None:
        return None, "the world has no Background node: it is taken for black"
    colour, strength = background.inputs["Color"], background.inputs["Strength"].default_value
    if not colour.is_linked:
        return ",".join("{:.6g}".format(c * strength) for c in colour.default_value[:3]), None
    picture = colour.links[0].from_node
    if picture.type != "TEX_ENVIRONMENT" or picture.image is None:
        return None, "the world's colour comes from the node {}, which Kiln does not read: it is taken for black".format(
            picture.name)
    file = bpy.path.abspath(picture.image.filepath)
    if not os.path.isfile(file):
        return None, "the world's image {} is no file on this machine, so the world is black: save the image".format(
            file or picture.image.name)
    if strength != 1 or picture.inputs["Vector"].is_linked:
        return file, "the strength and the rotation of the world's image are left out"
    return file, None
