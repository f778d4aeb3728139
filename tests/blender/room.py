"""A room for the tests of the add-on: sun, lamps of three kinds, a normal map, alpha, instances, a glowing bar."""

import math

import bpy


def picture(name, side, colour):
    image = bpy.data.images.new(name, side, side, alpha=True)
    image.pixels = [c for y in range(side) for x in range(side) for c in colour(x / side, y / side)]
    image.pack()
    return image


def material(name, colour, **inputs):
    m = bpy.data.materials.new(name)
    m.use_nodes = True
    shader = m.node_tree.nodes["Principled BSDF"]
    shader.inputs["Base Color"].default_value = (*colour, 1)
    shader.inputs["Specular"].default_value = 0
    shader.inputs["Roughness"].default_value = 1
    for key, value in inputs.items():
        shader.inputs[key.replace("_", " ")].default_value = value
    return m


def textured(m, socket, image, normal=False):
    nodes, links = m.node_tree.nodes, m.node_tree.links
    texture = nodes.new("ShaderNodeTexImage")
    texture.image = image
    shader = nodes["Principled BSDF"]
    if normal:
        image.colorspace_settings.name = "Non-Color"
        bumps = nodes.new("ShaderNodeNormalMap")
        links.new(texture.outputs["Color"], bumps.inputs["Color"])
        links.new(bumps.outputs["Normal"], shader.inputs["Normal"])
    else:
        links.new(texture.outputs["Color"], shader.inputs[socket])
    return texture


def box(name, size, at, m, **props):
    bpy.ops.mesh.primitive_cube_add(size=1, location=at)
    o = bpy.context.object
    o.name, o.data.name = name, name
    o.scale = size
    bpy.ops.object.transform_apply(location=False, rotation=False, scale=True)
    o.data.materials.append(m)
    for key, value in props.items():
        setattr(o.kiln, key, value)
    return o


def lamp(kind, name, at, energy, **more):
    data = bpy.data.lights.new(name, kind)
    data.energy = energy
    for key, value in more.items():
        setattr(data, key, value)
    o = bpy.data.objects.new(name, data)
    o.location = at
    bpy.context.scene.collection.objects.link(o)
    return o


def build(instances=4):
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
    scene = bpy.context.scene
    white, red = material("white", (0.7, 0.7, 0.7)), material("red", (0.6, 0.15, 0.1))
    bumpy = material("bumpy", (0.5, 0.5, 0.55))
    textured(bumpy, None, picture("bumps", 16, lambda x, y: (0.5 + 0.2 * math.sin(12.6 * x), 0.5, 0.9, 1)), normal=True)
    leafy = material("leafy", (0.2, 0.5, 0.2))
    leaf = textured(leafy, "Base Color", picture(
        "leaf", 16, lambda x, y: (0.1, 0.4, 0.1, 1.0 if math.hypot(x - 0.5, y - 0.5) < 0.35 else 0.0)))
    leafy.node_tree.links.new(leaf.outputs["Alpha"], leafy.node_tree.nodes["Principled BSDF"].inputs["Alpha"])
    leafy.blend_method, leafy.alpha_threshold = "CLIP", 0.5
    glow = material("glow", (0, 0, 0), Emission=(1, 0.6, 0.2, 1), Emission_Strength=4.0)
    box("floor", (6, 6, 0.2), (0, 0, -0.1), white)
    box("back", (6, 0.2, 3), (0, 2.9, 1.5), bumpy)
    box("side", (0.2, 6, 3), (-2.9, 0, 1.5), red, density=2.0)
    box("bar", (0.1, 0.1, 1.6), (2, 2, 1), glow)
    crate = box("crate", (0.7, 0.7, 0.7), (-1, 1, 0.35), white)
    bevel = crate.modifiers.new("bevel", "BEVEL")
    bevel.width, bevel.segments = 0.05, 2
    block = box("block", (0.4, 0.4, 0.4), (1.8, -1.6, 0.2), red)
    for i in range(1, instances):
        copy = bpy.data.objects.new("block.{:03}".format(i), block.data)
        copy.location, copy.rotation_euler[2] = (1.8 - 0.25 * (i % 16), -1.6 + 0.25 * (i // 16), 0.2 + 0.5 * (i % 4)), 0.3 * i
        scene.collection.objects.link(copy)
    bpy.ops.mesh.primitive_plane_add(size=1.2, location=(0.6, 0.6, 0.9), rotation=(1.2, 0, 0.4))
    bpy.context.object.name = "leaf"
    bpy.context.object.data.materials.append(leafy)
    box("ghost", (0.3, 0.3, 0.3), (0, -2, -1), white, cast=False, receive=False)
    lamp("POINT", "bulb", (-1.5, -1, 2), 60, color=(1, 0.9, 0.7))
    lamp("AREA", "panel", (0.5, 0, 2.8), 80, shape="RECTANGLE", size=1.5, size_y=0.5)
    sun = lamp("SUN", "sun", (0, 0, 5), 2)
    sun.rotation_euler = (0.6, 0.3, 0)
    camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
    camera.location, camera.rotation_euler = (4.2, -4.6, 3.2), (math.radians(62), 0, math.radians(42))
    camera.data.sensor_fit = "VERTICAL"
    scene.collection.objects.link(camera)
    scene.camera = camera
    scene.world = bpy.data.worlds.new("sky")
    scene.world.use_nodes = True
    background = scene.world.node_tree.nodes["Background"]
    background.inputs["Color"].default_value, background.inputs["Strength"].default_value = (0.3, 0.4, 0.6, 1), 0.5
    return scene
