"""Runs inside Blender: bakes one scene with Cycles and holds it against Kiln's map of the same atlas.

    blender -b --factory-startup --python cycles_bake.py -- JOB.json

cycles.py writes the job and reads the result that is written beside it; cycles_time.py asks for a ladder of samples
and for the maps, and compares them itself. Everything is baked as one mesh in world
space, built from what Blender's own glTF importer read, so that a scene of hundreds of objects is one bake.
"""
import json
import math
import os
import sys
import time

import bpy
import numpy

if "bool" not in numpy.__dict__:
    numpy.bool = bool  # Debian's importer is older than its numpy and asks for the alias that was removed

LUMINANCE = numpy.array([0.2126, 0.7152, 0.0722])
SUBTEXELS = 4  # a side; see bake()
MEASURED = 1  # class of validity.exr


def main():
    with open(sys.argv[sys.argv.index("--") + 1]) as file:
        job = json.load(file)
    bpy.ops.wm.read_factory_settings(use_empty=True)
    bpy.ops.preferences.addon_enable(module="io_scene_gltf2")
    # COMPAT: a lamp of P watts has the radiant intensity P / (4 pi); the calibration scenes hold that to account.
    bpy.ops.import_scene.gltf(filepath=job["scene"], convert_lighting_mode="COMPAT")
    settle_lamps(job)
    settle_world(job)
    for material in list(bpy.data.materials):
        rebuild(material, job["mode"])
    target = one_mesh()
    kiln = read_maps(job["kiln"])
    height, width = kiln["valid"].shape
    if "ladder" in job:
        climb(target, width, height, job)
        return
    bakes = [bake(target, width, height, job, seed) for seed in job["seeds"]]
    result = compare(kiln, bakes, job)
    with open(job["result"], "w") as file:
        json.dump(result, file, indent=1)


def climb(target, width, height, job):
    """A map and its seconds for every number of samples and seed, until one takes too long."""
    runs = []
    for samples in job["ladder"]:
        for seed in job["seeds"]:
            start = time.time()
            pixels = bake(target, width, height, {**job, "samples": samples}, seed)
            seconds = time.time() - start
            # Texels at the border of a chart are only in part on triangles, and each program has its way with them.
            pixels[..., 3] = interior(pixels[..., 3] > 0.5)
            path = os.path.join(job["folder"], "%d-%d.exr" % (samples, seed))
            save_map(pixels, path)
            runs.append({"samples": samples, "seed": seed, "seconds": seconds, "map": path})
        if seconds > job["most_seconds"]:
            break
    with open(job["result"], "w") as file:
        json.dump(runs, file, indent=1)


def save_map(pixels, path):
    height, width = pixels.shape[:2]
    image = bpy.data.images.new("map", width, height, alpha=True, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    image.alpha_mode = "CHANNEL_PACKED"
    image.pixels.foreach_set(pixels.astype(numpy.float32).ravel())
    image.filepath_raw, image.file_format = path, "OPEN_EXR"
    image.save()
    bpy.data.images.remove(image)


def settle_lamps(job):
    for lamp in bpy.data.lights:
        if lamp.type == "SUN":
            lamp.angle = math.radians(job["sun_angle"])
        else:
            lamp.shadow_soft_size = 0
        lamp.cycles.use_multiple_importance_sampling = True
        lamp.cycles.max_bounces = 1024
    if job.get("sun"):
        lamp = bpy.data.lights.new("sun", "SUN")
        colour = job["sun"]["irradiance"]
        lamp.energy = max(colour)
        lamp.color = [c / max(colour) for c in colour]
        lamp.angle = math.radians(job["sun_angle"])
        lamp.cycles.max_bounces = 1024
        node = bpy.data.objects.new("sun", lamp)
        x, y, z = job["sun"]["to_light"]
        from mathutils import Vector
        node.rotation_mode = "QUATERNION"
        node.rotation_quaternion = Vector((x, -z, y)).to_track_quat("Z", "Y")  # +Y up to +Z up
        bpy.context.scene.collection.objects.link(node)


def settle_world(job):
    world = bpy.data.worlds.new("world")
    bpy.context.scene.world = world
    world.use_nodes = True
    world.cycles.max_bounces = 1024
    tree = world.node_tree
    background = tree.nodes["Background"]
    background.inputs["Strength"].default_value = 1
    background.inputs["Color"].default_value = [*(job.get("environment") or (0, 0, 0)), 1]
    if job.get("environment_image"):
        image = tree.nodes.new("ShaderNodeTexEnvironment")
        image.image = bpy.data.images.load(job["environment_image"])
        image.image.colorspace_settings.name = "Linear"
        tree.links.new(image.outputs["Color"], background.inputs["Color"])
        background.inputs["Strength"].default_value = job.get("environment_strength", 1)


def rebuild(material, mode):
    """Shading by the glTF file's rules, with a white Lambert surface where the ray is the bake's own.

    The receiver then gives E / pi whatever its own albedo, metal and black ones too; every further vertex of a path
    sees the material itself. Backs of single-sided surfaces are black, masks cut at their threshold.
    """
    tree = material.node_tree
    principled = next((n for n in tree.nodes if n.type == "BSDF_PRINCIPLED"), None)
    output = next(n for n in tree.nodes if n.type == "OUTPUT_MATERIAL")
    new, link = tree.nodes.new, tree.links.new

    def wire(source, target):  # a socket's link or value
        if source.is_linked:
            link(source.links[0].from_socket, target)
        else:
            target.default_value = source.default_value

    def mix(factor, without, with_it):
        node = new("ShaderNodeMixShader")
        link(factor, node.inputs[0])
        link(without, node.inputs[1])
        link(with_it, node.inputs[2])
        return node.outputs[0]

    def diffuse(value):
        node = new("ShaderNodeBsdfDiffuse")
        node.inputs["Color"].default_value = (value, value, value, 1)
        return node

    if principled is None:
        surface = output.inputs["Surface"].links[0].from_socket
    else:
        if material.blend_method == "CLIP" and principled.inputs["Alpha"].is_linked:
            cut = new("ShaderNodeMath")
            cut.operation = "GREATER_THAN"
            cut.inputs[1].default_value = material.alpha_threshold
            link(principled.inputs["Alpha"].links[0].from_socket, cut.inputs[0])
            link(cut.outputs[0], principled.inputs["Alpha"])
        surface = principled.outputs[0]
        if mode == "lambert":
            base = diffuse(1)
            wire(principled.inputs["Base Color"], base.inputs["Color"])
            glow = new("ShaderNodeEmission")
            wire(principled.inputs["Emission"], glow.inputs["Color"])
            wire(principled.inputs["Emission Strength"], glow.inputs["Strength"])
            both = new("ShaderNodeAddShader")
            link(base.outputs[0], both.inputs[0])
            link(glow.outputs[0], both.inputs[1])
            surface = both.outputs[0]
            if material.blend_method != "OPAQUE":
                opaque = new("ShaderNodeMixShader")
                wire(principled.inputs["Alpha"], opaque.inputs[0])
                link(new("ShaderNodeBsdfTransparent").outputs[0], opaque.inputs[1])
                link(surface, opaque.inputs[2])
                surface = opaque.outputs[0]
    if material.use_backface_culling:
        surface = mix(new("ShaderNodeNewGeometry").outputs["Backfacing"], surface, diffuse(0).outputs[0])
    surface = mix(new("ShaderNodeLightPath").outputs["Is Camera Ray"], surface, diffuse(1).outputs[0])
    link(surface, output.inputs["Surface"])
    material.cycles.sample_as_light = True


def one_mesh():
    """All triangles in world space with their split normals, UV sets, colours and materials; the sources go."""
    parts, uv_sets, colours, materials, vertices = [], set(), set(), [], 0
    for node in [o for o in bpy.data.objects if o.type == "MESH"]:
        mesh = node.data
        n_vertices, n_loops, n_faces = len(mesh.vertices), len(mesh.loops), len(mesh.polygons)
        assert n_loops == 3 * n_faces, "glTF gives triangles"
        mesh.calc_normals_split()

        def read(collection, field, count, width, dtype=numpy.float32):
            values = numpy.empty(count * width, dtype)
            collection.foreach_get(field, values)
            return values.reshape(count, width) if width > 1 else values

        world = numpy.array(node.matrix_world)
        mirrored = numpy.linalg.det(world[:3, :3]) < 0
        order = numpy.arange(n_loops).reshape(-1, 3)
        if mirrored:
            order = order[:, ::-1]
        order = order.ravel()
        normals = read(mesh.loops, "normal", n_loops, 3) @ numpy.linalg.inv(world[:3, :3])
        part = {
            "position": read(mesh.vertices, "co", n_vertices, 3) @ world[:3, :3].T + world[:3, 3],
            "corner": read(mesh.loops, "vertex_index", n_loops, 1, numpy.int32)[order] + vertices,
            "normal": (normals / numpy.maximum(numpy.linalg.norm(normals, axis=1, keepdims=True), 1e-30))[order],
            "material": read(mesh.polygons, "material_index", n_faces, 1, numpy.int32),
            "uv": {u.name: read(u.data, "uv", n_loops, 2)[order] for u in mesh.uv_layers},
            "colour": {c.name: read(c.data, "color", n_loops, 4)[order] for c in mesh.color_attributes
                       if c.domain == "CORNER"},
        }
        slots = []
        for slot in node.material_slots:
            if slot.material not in materials:
                materials.append(slot.material)
            slots.append(materials.index(slot.material))
        part["material"] = numpy.array(slots, numpy.int32)[part["material"]]
        uv_sets |= set(part["uv"])
        colours |= set(part["colour"])
        vertices += n_vertices
        parts.append(part)

    def whole(field):
        return numpy.concatenate([p[field] for p in parts])

    corner = whole("corner")
    mesh = bpy.data.meshes.new("whole")
    mesh.vertices.add(vertices)
    mesh.loops.add(len(corner))
    mesh.polygons.add(len(corner) // 3)
    mesh.vertices.foreach_set("co", whole("position").astype(numpy.float32).ravel())
    mesh.loops.foreach_set("vertex_index", corner)
    mesh.polygons.foreach_set("loop_start", numpy.arange(0, len(corner), 3, dtype=numpy.int32))
    mesh.polygons.foreach_set("loop_total", numpy.full(len(corner) // 3, 3, numpy.int32))
    mesh.polygons.foreach_set("material_index", whole("material"))
    mesh.polygons.foreach_set("use_smooth", numpy.ones(len(corner) // 3, bool))
    for name in sorted(uv_sets):
        # Without the set the triangles are drawn outside the image.
        values = [p["uv"].get(name, numpy.full((len(p["corner"]), 2), -9, numpy.float32)) for p in parts]
        mesh.uv_layers.new(name=name).data.foreach_set("uv", numpy.concatenate(values).ravel())
    for name in sorted(colours):
        values = [p["colour"].get(name, numpy.ones((len(p["corner"]), 4), numpy.float32)) for p in parts]
        layer = mesh.color_attributes.new(name, "FLOAT_COLOR", "CORNER")
        layer.data.foreach_set("color", numpy.concatenate(values).ravel())
    for material in materials:
        mesh.materials.append(material)
    mesh.update(calc_edges=True)
    mesh.use_auto_smooth = True
    mesh.auto_smooth_angle = math.pi
    mesh.normals_split_custom_set(whole("normal"))
    for node in [o for o in bpy.data.objects if o.type == "MESH"]:
        bpy.data.objects.remove(node)
    target = bpy.data.objects.new("whole", mesh)
    target.cycles.shadow_terminator_offset = 0
    target.cycles.shadow_terminator_geometry_offset = 0
    bpy.context.scene.collection.objects.link(target)
    return target


def bake(target, width, height, job, seed):
    """E by Cycles: height x width x 4, the last channel 1 where a texel lies on triangles all over.

    Cycles 3.4 spreads the samples of a texel over the half of its width about its centre and over the one triangle
    there, Kiln over all of the texel. So Cycles bakes SUBTEXELS^2 smaller texels, and their mean is the texel's.
    """
    image = bpy.data.images.new("bake", width * SUBTEXELS, height * SUBTEXELS, alpha=True, float_buffer=True)
    image.colorspace_settings.name = "Non-Color"
    for material in target.data.materials:
        node = material.node_tree.nodes.new("ShaderNodeTexImage")
        node.image = image
        material.node_tree.nodes.active = node
    target.data.uv_layers.active = target.data.uv_layers["UVMap.001"]
    scene = bpy.context.scene
    scene.render.engine = "CYCLES"
    scene.render.threads_mode = "FIXED"
    scene.render.threads = job["threads"]
    cycles = scene.cycles
    cycles.samples, cycles.seed = max(job["samples"] // SUBTEXELS ** 2, 1), seed
    cycles.use_adaptive_sampling = cycles.use_denoising = False
    cycles.sample_clamp_direct = cycles.sample_clamp_indirect = 0
    cycles.blur_glossy = cycles.light_sampling_threshold = 0
    cycles.caustics_reflective = cycles.caustics_refractive = True
    for bounces in ("max_bounces", "diffuse_bounces", "glossy_bounces", "transmission_bounces"):
        setattr(cycles, bounces, job["max_bounces"])
    cycles.transparent_max_bounces = 1024
    for node in bpy.data.objects:
        node.select_set(node == target)
    bpy.context.view_layer.objects.active = target
    bpy.ops.object.bake(type="DIFFUSE", pass_filter={"DIRECT", "INDIRECT"}, margin=0, use_clear=True)
    pixels = pixels_of(image)
    bpy.data.images.remove(image)
    fine = pixels.reshape(height, SUBTEXELS, width, SUBTEXELS, 4)
    pixels = fine.mean(axis=(1, 3))
    pixels[..., :3] *= math.pi
    pixels[..., 3] = fine[..., 3].min(axis=(1, 3))
    return pixels


def pixels_of(image):
    width, height = image.size
    pixels = numpy.empty(width * height * 4, numpy.float32)
    image.pixels.foreach_get(pixels)
    return pixels.reshape(height, width, 4).astype(numpy.float64)


def read_maps(folder):
    """Rows from the bottom, as Blender has them: v = 0 of glTF is the last row."""
    planes = {}
    for name in ("irradiance", "error", "validity"):
        image = bpy.data.images.load(os.path.join(folder, name + ".exr"))
        image.colorspace_settings.name = "Non-Color"
        planes[name] = pixels_of(image)
    return {"E": planes["irradiance"][..., :3], "error": planes["error"][..., 0],
            "valid": numpy.round(planes["validity"][..., 0]) == MEASURED}


def interior(valid):
    """Texels whose whole 3 x 3 neighbourhood is valid: away from chart borders."""
    padded = numpy.pad(valid, 1)
    height, width = valid.shape
    return numpy.all([padded[y:y + height, x:x + width] for y in range(3) for x in range(3)], axis=0)


def truth_of(job, width, height):
    """Closed forms of the calibration scenes, the mean over 8 x 8 points of each texel. Rows from the bottom."""
    truth = job["truth"]
    if truth["kind"] == "constant":
        return numpy.full((height, width), truth["value"])
    step = 8
    u = (numpy.arange(width * step) + 0.5) / (width * step) * 2 - 1
    v = (numpy.arange(height * step) + 0.5) / (height * step) * 2 - 1
    d2 = u[None, :] ** 2 + v[:, None] ** 2 + truth["height"] ** 2
    fine = truth["intensity"] * truth["height"] / d2 ** 1.5
    return fine.reshape(height, step, width, step).mean(axis=(1, 3))


def compare(kiln, bakes, job):
    valid = interior(kiln["valid"] & numpy.all([b[..., 3] > 0.5 for b in bakes], axis=0))
    ours = kiln["E"] @ LUMINANCE
    runs = [b[..., :3] @ LUMINANCE for b in bakes]
    theirs = sum(runs) / len(runs)
    n = int(valid.sum())
    if n == 0:
        return {"texels": 0}
    k, c = ours[valid], theirs[valid]
    noise_k = kiln["error"][valid] ** 2
    # Half the squared difference of two runs is the variance of one, a quarter that of their mean.
    noise_c = sum((r[valid] - c) ** 2 for r in runs) / (len(runs) * (len(runs) - 1))
    scale = numpy.maximum(c, 0.01 * c.mean()) ** 2  # dark texels do not divide by nothing
    difference = (k - c) ** 2
    z = (k - c) / numpy.sqrt(noise_k + numpy.maximum(noise_c, noise_k) + 1e-12 * scale)
    at = int(numpy.argmax(numpy.abs(z) * (numpy.abs(k - c) > 0.05 * c.mean())))
    y, x = (int(i[at]) for i in numpy.nonzero(valid))
    ratio = k.sum() / c.sum()
    result = {
        "texels": n, "mean_kiln": k.mean(), "mean_cycles": c.mean(), "ratio": ratio,
        "ratio_sigma": math.sqrt((noise_k + ratio ** 2 * noise_c).sum()) / c.sum(),
        "median_ratio": float(numpy.median(k / numpy.maximum(c, 1e-30))),
        "rel_mse": (difference / scale).mean(), "rel_mse_noise": ((noise_k + noise_c) / scale).mean(),
        "channels": [float(kiln["E"][valid][:, i].sum() / sum(b[valid][:, i] for b in bakes).sum() * len(bakes))
                     for i in range(3)],
        "worst": {"x": x, "y": ours.shape[0] - 1 - y, "kiln": k[at], "cycles": c[at], "sigmas": abs(z[at])},
    }
    if job.get("truth"):
        truth = truth_of(job, ours.shape[1], ours.shape[0])[valid].sum()
        result["truth_mean"] = truth / n
        result["kiln_over_truth"], result["cycles_over_truth"] = k.sum() / truth, c.sum() / truth
    picture(ours, theirs, valid, job)
    return result


def picture(ours, theirs, valid, job):
    """Kiln, Cycles, and their relative difference (red: Kiln brighter, blue: darker; full at 20 %), side by side."""
    top = numpy.percentile(theirs[valid], 98)

    def grey(plane):
        shade = numpy.clip(plane / max(top, 1e-30), 0, 1) ** (1 / 2.2) * valid
        return numpy.dstack([shade] * 3)

    relative = numpy.where(valid, (ours - theirs) / numpy.maximum(theirs, 0.01 * theirs[valid].mean()), 0) / 0.2
    change = numpy.dstack([1 - numpy.clip(-relative, 0, 1), 1 - numpy.clip(abs(relative), 0, 1),
                           1 - numpy.clip(relative, 0, 1)]) * valid[..., None]
    rows = numpy.hstack([grey(ours), grey(theirs), change])
    height, width, _ = rows.shape
    image = bpy.data.images.new("picture", width, height)
    image.pixels.foreach_set(numpy.dstack([rows, numpy.ones((height, width))]).astype(numpy.float32).ravel())
    image.filepath_raw, image.file_format = job["picture"], "PNG"
    image.save()


try:
    main()
except Exception:  # Blender would go on with exit status 0
    import traceback
    traceback.print_exc()
    sys.stdout.flush()
    os._exit(1)
