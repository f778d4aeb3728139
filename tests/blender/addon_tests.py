"""blender -b --factory-startup --python-exit-code 1 -P addon_tests.py -- CASE FOLDER KILN: one case of the add-on's tests,
in a Blender without window, with $BLENDER_USER_SCRIPTS/addons a folder of its own."""

import os
import re
import signal
import subprocess
import sys
import threading
import time

import bpy

HERE = os.path.dirname(os.path.abspath(__file__))
case, folder, program = sys.argv[sys.argv.index("--") + 1:]
sys.path.insert(0, HERE)
import cycles_shot  # noqa: E402
import room  # noqa: E402

QUICK = "--max-samples 16 --min-samples 16"


def enable():
    link = os.path.join(os.environ["BLENDER_USER_SCRIPTS"], "addons/kiln_bake")  # Blender looks when it starts
    if not os.path.islink(link):
        os.symlink(os.path.join(HERE, "../../configs/engines/blender/kiln_bake"), link)
    assert bpy.ops.preferences.addon_enable(module="kiln_bake") == {"FINISHED"}
    bpy.context.preferences.addons["kiln_bake"].preferences.program = program


def quick(scene, name):
    scene.kiln.folder = os.path.join(folder, name)
    scene.kiln.extra, scene.kiln.preset = QUICK, "DEFAULT"
    return scene


def bake(expected):
    """The outcome's beginning, and the sentence whole."""
    try:
        bpy.ops.kiln.bake()
    except RuntimeError as error:  # what an operator reports as an error
        assert not expected.startswith("done"), error
    outcome = bpy.context.scene.kiln.outcome
    assert outcome.startswith(expected), outcome
    return outcome


def shot(name):
    cycles_shot.shot(os.path.join(folder, name))


class Farm:
    """A coordinator with a worker; its address is in the add-on's preferences."""

    def __init__(self):
        data = os.path.join(folder, "farm")
        self.process = subprocess.Popen([program, "serve", "--data", data, "--local-workers", "1", "--listen", "127.0.0.1:0"],
                                        stdout=subprocess.PIPE, stderr=subprocess.STDOUT, text=True)
        for line in self.process.stdout:
            if found := re.search(r"(127\.0\.0\.1:\d+)", line):
                break
        threading.Thread(target=self.process.stdout.read, daemon=True).start()
        p = bpy.context.preferences.addons["kiln_bake"].preferences
        p.server, p.token_file = found[1], os.path.join(data, "submit.token")

    def states(self):
        p = bpy.context.preferences.addons["kiln_bake"].preferences
        out = subprocess.run([program, "jobs", "--server", p.server, "--token-file", p.token_file], capture_output=True,
                             text=True, check=True)
        return out.stdout

    def end(self):
        self.process.kill()
        self.process.wait()


def after(seconds, action):
    timer = threading.Timer(seconds, action)
    timer.start()
    return timer


def cancel_once(scene, ready):
    """Presses Cancel for the scene's bake as soon as ready(run) says so; [True] where that took two minutes."""
    import kiln_bake.operators as operators
    late = []

    def press():
        end = time.monotonic() + 120
        while scene.name not in operators.running or not ready(operators.running[scene.name].run):
            if time.monotonic() > end:
                late.append(True)
                break
            time.sleep(0.1)
        operators.running[scene.name].cancelled = True
    threading.Thread(target=press, daemon=True).start()
    return late


def lit_copy(scene):
    return bpy.data.collections["Kiln " + scene.name]


# ---- cases

def case_room():
    """Baked, shown, baked again from the same scene."""
    scene = quick(room.build(), "room")
    scene.kiln.preset, scene.kiln.extra = "PREVIEW", ""
    bake("done: one page of")
    assert len(lit_copy(scene).all_objects) >= 11
    first = open(os.path.join(folder, "room/input.glb"), "rb").read()
    for mode in ("LIGHT", "DENSITY", "OFF", "LIT"):
        assert bpy.ops.kiln.preview(mode=mode) == {"FINISHED"}
        hidden = [o.hide_render for o in scene.objects if o.name == "floor"]
        assert hidden == [mode != "OFF"], (mode, hidden)
    shot("room.png")
    bake("done")
    assert open(os.path.join(folder, "room/input.glb"), "rb").read() == first, "the lit copy was exported"
    assert not [c for c in bpy.data.collections if c.name.startswith("Kiln Scene.")], "a second collection"
    text = first[20:20 + int.from_bytes(first[12:16], "little")].decode()
    for extras in ('"kiln":{"receive":false,"cast":false}', '"kiln":{"density":2.0}', '"shape":"rectangle"'):
        assert extras in text, extras
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder, "room.blend"))


def case_atlas():
    """The map on the second UV map of one's own objects."""
    scene = quick(room.build(instances=1), "atlas")
    for o in list(scene.objects):
        if o.type == "LIGHT" and o.data.type == "AREA":
            bpy.data.objects.remove(o)
    meshes = [o for o in scene.objects if o.type == "MESH"]
    bpy.ops.object.select_all(action="DESELECT")
    for o in meshes:
        o.data.uv_layers.new(name="Light")
        o.data.uv_layers.active_index = len(o.data.uv_layers) - 1
        o.select_set(True)
    bpy.context.view_layer.objects.active = meshes[0]
    bpy.ops.object.mode_set(mode="EDIT")
    bpy.ops.mesh.select_all(action="SELECT")
    bpy.ops.uv.lightmap_pack(PREF_CONTEXT="ALL_FACES", PREF_PACK_IN_ONE=True, PREF_NEW_UVLAYER=False, PREF_MARGIN_DIV=0.3)
    bpy.ops.object.mode_set(mode="OBJECT")
    scene.kiln.layout, scene.kiln.resolution = "ATLAS", 256
    bake("done: one page of 256 x 256 texels")
    assert "Kiln Scene" not in bpy.data.collections
    white = bpy.data.materials["white"]
    assert white.node_tree.nodes["Material Output"].inputs["Surface"].links[0].from_node.name.startswith("Kiln")
    shot("atlas.png")
    bpy.ops.kiln.preview(mode="OFF")
    assert white.node_tree.nodes["Material Output"].inputs["Surface"].links[0].from_node.name == "Principled BSDF"


def case_cancel():
    """Ends at once, keeps an earlier result, and may be baked again."""
    scene = quick(room.build(), "cancel")
    bake("done")
    kept = os.path.getmtime(os.path.join(folder, "cancel/out/irradiance.exr"))
    import kiln_bake.operators as operators
    scene.kiln.extra, scene.kiln.density = "--max-samples 16384 --min-samples 16384", 64
    late = cancel_once(scene, lambda run: run.stage.startswith("pass") and run.share > 0)
    bake("cancelled")
    assert not late, "its progress was never read"
    assert not operators.running
    assert os.path.getmtime(os.path.join(folder, "cancel/out/irradiance.exr")) == kept
    scene.kiln.extra, scene.kiln.density = QUICK, 8
    bake("done")


def case_killed():
    """Dies in the middle of a bake, and leaves the number of the program's process in a file."""
    import kiln_bake.operators as operators
    scene = quick(room.build(), "killed")
    scene.kiln.extra, scene.kiln.density = "--max-samples 16384 --min-samples 16384", 64

    def die():
        while scene.name not in operators.running or not operators.running[scene.name].run.stage.startswith("pass"):
            time.sleep(0.1)
        with open(os.path.join(folder, "killed.pid"), "w") as file:
            file.write(str(operators.running[scene.name].run.pid))
        os.kill(os.getpid(), signal.SIGKILL)
    threading.Thread(target=die, daemon=True).start()
    bake("done")


def case_failures():
    """Each with a sentence, and nothing left running."""
    scene = quick(room.build(), "failures")
    p = bpy.context.preferences.addons["kiln_bake"].preferences
    p.program = "/nowhere/kiln"
    assert "install Kiln, or name it in the add-on's preferences" in bake("failed")
    p.program = program
    scene.kiln.folder = "//kiln"
    assert "save the .blend file first" in bake("failed")
    with open(os.path.join(folder, "a-file"), "w"):
        pass
    scene.kiln.folder = os.path.join(folder, "a-file/below")
    assert "cannot write to" in bake("failed")
    quick(scene, "failures").kiln.extra = "--texel-per-metre 3"
    assert "--texel-per-metre" in bake("failed")
    quick(scene, "failures").kiln.where, p.server = "FARM", "127.0.0.1:9"
    assert "127.0.0.1:9" in bake("failed")
    scene.kiln.where = "LOCAL"
    bpy.context.scene.collection.objects.unlink(bpy.data.objects["floor"])
    for o in list(scene.objects):
        if o.type == "MESH":
            bpy.data.objects.remove(o)
    assert "no triangles to bake" in bake("failed")


def case_farm():
    """On a farm: done, cancelled there too, and a farm that goes away."""
    scene = quick(room.build(), "farm-job")
    farm = Farm()
    try:
        scene.kiln.where = "FARM"
        bake("done: one page")
        scene.kiln.extra, scene.kiln.density = "--max-samples 16384 --min-samples 16384", 64
        late = cancel_once(scene, lambda run: run.job is not None and run.stage in ("preparing", "baking"))
        bake("cancelled")
        assert not late, "its job was never seen"
        end = time.monotonic() + 20
        while "cancelled" not in (states := farm.states()):
            assert time.monotonic() < end, states
            time.sleep(0.2)
        after(3, farm.end)
        assert "127.0.0.1" in bake("failed")
    finally:
        farm.end()


def case_large():
    """A file with modifiers, a linked library and 200 objects."""
    room.build(instances=200)
    library = os.path.join(folder, "library.blend")
    bpy.ops.wm.save_as_mainfile(filepath=library)
    bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
    with bpy.data.libraries.load(library, link=True) as (theirs, ours):
        ours.objects = [name for name in theirs.objects if name != "bulb"]
    scene = bpy.context.scene
    for o in ours.objects:
        scene.collection.objects.link(o)
    bpy.ops.mesh.primitive_uv_sphere_add(radius=0.4, location=(-0.5, -1, 0.5))
    ball = bpy.context.object
    ball.modifiers.new("fine", "SUBSURF").render_levels = 1
    ball.modifiers.new("two", "ARRAY").count = 2
    bpy.ops.wm.save_as_mainfile(filepath=os.path.join(folder, "level.blend"))
    quick(scene, "large").kiln.density = 2
    bake("done")
    import json
    report = json.load(open(os.path.join(folder, "large/out/report.json")))
    assert len({o["name"] for o in report["objects"]}) >= 200, len(report["objects"])


def mean_of_picture(name):
    image = bpy.data.images.load(os.path.join(folder, name))
    pixels = list(image.pixels)
    return [sum(pixels[c::4]) / (len(pixels) // 4) for c in range(3)]


def case_lamps():
    """Each kind of lamp, and the world, is as bright as Cycles shows it: one floor from above, direct light alone. Not
    spots, which Cycles dims by the cosine to their axis and glTF does not."""
    for kind, more in (("POINT", {}), ("SUN", {}), ("AREA", {"shape": "RECTANGLE", "size": 1.5, "size_y": 0.5}), ("AREA", {"shape": "DISK", "size": 1.0}),
                       ("WORLD", {})):
        bpy.ops.wm.read_homefile(use_empty=True, use_factory_startup=False)
        scene = bpy.context.scene
        room.box("floor", (2, 2, 0.2), (0, 0, -0.1), room.material("white", (0.5, 0.5, 0.5)))
        # Principled is not Lambert: at roughness 1 it gives 3.6 % more of an even sky.
        bpy.data.materials["white"].node_tree.nodes["Principled BSDF"].inputs["Roughness"].default_value = 0.5
        if kind != "WORLD":
            lamp = room.lamp(kind, "lamp", (0.2, 0.3, 2), 3 if kind == "SUN" else 100, color=(1, 0.8, 0.6), **more)
            lamp.scale = (1.2, 1.2, 1.2) if kind == "AREA" else (1, 1, 1)
        scene.world = bpy.data.worlds.new("world")
        scene.world.use_nodes = True
        background = scene.world.node_tree.nodes["Background"].inputs
        background["Color"].default_value = (0.3, 0.4, 0.6, 1) if kind == "WORLD" else (0, 0, 0, 1)
        camera = bpy.data.objects.new("camera", bpy.data.cameras.new("camera"))
        camera.data.type, camera.data.ortho_scale, camera.location = "ORTHO", 1.6, (0, 0, 1.5)
        scene.collection.objects.link(camera)
        scene.camera = camera
        quick(scene, "lamps").kiln.extra = "--max-samples 256 --min-samples 256 --components direct"
        scene.render.engine, scene.cycles.samples, scene.cycles.use_denoising = "CYCLES", 256, False
        scene.cycles.max_bounces = 1  # to the world, which Cycles samples by bounces too
        scene.render.resolution_x = scene.render.resolution_y = 32
        scene.view_settings.view_transform = "Raw"
        scene.render.image_settings.file_format, scene.render.image_settings.color_depth = "OPEN_EXR", "32"
        means = []
        for name in ("cycles", "kiln"):
            if name == "kiln":
                bake("done")
            scene.render.filepath = os.path.join(folder, "{}-{}-{}.exr".format(kind, more.get("shape", ""), name))
            bpy.ops.render.render(write_still=True)
            means.append(mean_of_picture(os.path.basename(scene.render.filepath)))
        print("lamp", kind, more.get("shape", ""), means)
        for theirs, ours in zip(*means):
            assert abs(ours / theirs - 1) < 0.02, (kind, more, means)


enable()
globals()["case_" + case]()
bpy.ops.preferences.addon_disable(module="kiln_bake")
assert not hasattr(bpy.types.Scene, "kiln")
print("case", case, "passed")
