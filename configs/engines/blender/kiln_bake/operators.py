"""Baking without a frozen window, and what may be done with a bake."""

import os
import subprocess
import time

import bpy

from . import command, export, process, result, settings

running = {}  # by scene's name: the operator that bakes it


def stop_all():
    for operator in list(running.values()):
        operator.end("cancelled: the add-on was switched off")


def folder_of(scene):
    return os.path.normpath(bpy.path.abspath(scene.kiln.folder))


def server_options(context):
    p = settings.preferences(context)
    paths = [bpy.path.abspath(x) for x in (p.token_file, p.ca, p.certificate, p.key)]
    return command.server(p.server, *paths)


def prepare(context):
    """Checks, exports, and gives the command line. Raises ValueError with a sentence for the user."""
    scene, k = context.scene, context.scene.kiln
    program = settings.program_path(context)
    if program is None:
        raise ValueError("the program {!r} is not there: install Kiln, or name it in the add-on's preferences".format(
            settings.preferences(context).program))
    if k.folder.startswith("//") and not bpy.data.filepath:
        raise ValueError("save the .blend file first, or name a folder that does not begin with //")
    folder = folder_of(scene)
    try:
        os.makedirs(folder, exist_ok=True)
        probe = os.path.join(folder, ".kiln-write-test")
        open(probe, "w").close()
        os.remove(probe)
    except OSError as error:
        raise ValueError("cannot write to {}: {}".format(folder, error.strerror)) from None
    k.warnings.clear()
    light, warning = export.environment(scene.world)
    if warning:
        k.warnings.add().name = warning
    glb = os.path.join(folder, "input.glb")
    with result.originals(scene):
        export.write_gltf(context, glb)
    line = command.bake(program, glb, os.path.join(folder, "out"), k.preset, k.error, k.minutes, k.layout, k.density,
                        k.resolution, light, k.extra)
    if k.where == "FARM":
        line = command.submit(line, scene.name, server_options(context))
    return line


class KILN_OT_bake(bpy.types.Operator):
    bl_idname = "kiln.bake"
    bl_label = "Bake lightmap"
    bl_description = "Export the scene, bake it with Kiln and put the result into Blender"

    @classmethod
    def poll(cls, context):
        return context.scene.name not in running

    def start(self, context):
        self.scene_name, k = context.scene.name, context.scene.kiln
        k.stage, k.share, k.left, k.outcome = "exporting", 0, "", ""
        try:
            line = prepare(context)
            self.run = process.Run(line)
        except (ValueError, OSError, RuntimeError) as error:
            k.outcome = "failed: {}".format(error)
            self.report({"ERROR"}, str(error))
            return False
        self.program, self.context_options, self.cancelled = line[0], server_options(context), False
        running[self.scene_name] = self
        return True

    def step(self, context):
        """True once it has ended."""
        scene = bpy.data.scenes.get(self.scene_name)
        if scene is None:
            self.end("cancelled: the scene was removed")
            return True
        status = self.run.poll()
        k = scene.kiln
        k.stage, k.share, k.left = self.run.stage, self.run.share, self.run.left
        if self.cancelled:
            self.end("cancelled")
            return True
        if status is None:
            return False
        self.end("")
        if status in (0, 3):  # 3: published, with texels that were never sampled
            try:
                summary = result.take(context, scene, os.path.join(folder_of(scene), "out"))
                k.outcome = "done: " + summary
            except (OSError, ValueError, KeyError, RuntimeError) as error:
                k.outcome = "baked, but the result cannot be shown: {}".format(error)
                self.report({"ERROR"}, k.outcome)
        else:
            k.outcome = "failed: " + self.run.error()
            self.report({"ERROR"}, k.outcome)
        return True

    def end(self, outcome):
        """Ends the program, on the farm the job too."""
        running.pop(self.scene_name, None)
        if outcome and self.run.poll() is None:
            self.run.cancel()
            if self.run.job is not None:
                subprocess.run(command.cancel(self.program, self.run.job, self.context_options), check=False,
                               stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL, timeout=60)
        scene = bpy.data.scenes.get(self.scene_name)
        if scene is not None:
            scene.kiln.stage, scene.kiln.left = "", ""
            if outcome:
                scene.kiln.outcome = outcome

    def execute(self, context):
        """Without a window, as scripts call it: waits until the bake has ended."""
        if not self.start(context):
            return {"CANCELLED"}
        while not self.step(context):
            time.sleep(0.05)
        return {"FINISHED"} if context.scene.kiln.outcome.startswith("done") else {"CANCELLED"}

    def invoke(self, context, _event):
        if not self.start(context):
            return {"CANCELLED"}
        self.timer = context.window_manager.event_timer_add(0.2, window=context.window)
        context.window_manager.modal_handler_add(self)
        return {"RUNNING_MODAL"}

    def modal(self, context, event):
        if event.type != "TIMER":
            return {"PASS_THROUGH"}  # Blender stays at the user's hands
        ended = self.step(context)
        for window in context.window_manager.windows:
            for area in window.screen.areas:
                if area.type == "PROPERTIES":
                    area.tag_redraw()
        if not ended:
            return {"PASS_THROUGH"}
        context.window_manager.event_timer_remove(self.timer)
        return {"FINISHED"}


class KILN_OT_cancel(bpy.types.Operator):
    bl_idname = "kiln.cancel"
    bl_label = "Cancel"
    bl_description = "End the bake; an earlier result stays"

    @classmethod
    def poll(cls, context):
        return context.scene.name in running

    def execute(self, context):
        running[context.scene.name].cancelled = True
        return {"FINISHED"}


class KILN_OT_preview(bpy.types.Operator):
    bl_idname = "kiln.preview"
    bl_label = "Show"
    bl_description = "What the lit materials show"
    mode: bpy.props.EnumProperty(items=[("LIT", "Lit", "Base colour and light"), ("LIGHT", "Light", "The light alone"),
                                        ("DENSITY", "Density", "A checker of the map's texels"),
                                        ("OFF", "Off", "The materials as they were")])

    def execute(self, context):
        changed = result.show(context.scene, self.mode)
        if not changed:
            self.report({"WARNING"}, "nothing here has a lightmap of Kiln: bake first")
            return {"CANCELLED"}
        return {"FINISHED"}


CLASSES = [KILN_OT_bake, KILN_OT_cancel, KILN_OT_preview]
