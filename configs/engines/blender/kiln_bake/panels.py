"""Properties > Render > Kiln lightmap, and Properties > Object > Kiln."""

import bpy

from . import operators, settings


class KilnPanel:
    bl_space_type = "PROPERTIES"
    bl_region_type = "WINDOW"


class KILN_PT_scene(KilnPanel, bpy.types.Panel):
    bl_label = "Kiln lightmap"
    bl_context = "render"

    def draw(self, context):
        layout, k = self.layout, context.scene.kiln
        layout.use_property_split = True
        if settings.program_path(context) is None:
            layout.label(text="The program kiln is not there: see the add-on's preferences", icon="ERROR")
        for name in ("where", "what", "folder", "preset"):
            layout.prop(k, name)
        if k.preset == "ERROR":
            layout.prop(k, "error")
        if k.preset == "TIME":
            layout.prop(k, "minutes")
        layout.prop(k, "layout")
        layout.prop(k, "resolution" if k.layout == "ATLAS" else "density")
        layout.prop(k, "extra")
        if context.scene.name in operators.running:
            layout.prop(k, "share", text=k.stage, slider=True)
            if k.left:
                layout.label(text="about {} left".format(k.left))
            layout.operator("kiln.cancel", icon="CANCEL")
        else:
            layout.operator("kiln.bake", icon="RENDER_STILL")
        if k.outcome:
            layout.label(text=k.outcome, icon="ERROR" if k.outcome.startswith("failed") else "INFO")


class KILN_UL_warnings(bpy.types.UIList):
    def draw_item(self, _context, layout, _data, item, _icon, _active, _name):
        layout.label(text=item.name, icon="OBJECT_DATA" if item.object else "ERROR")


class KILN_PT_result(KilnPanel, bpy.types.Panel):
    bl_label = "Result"
    bl_context = "render"
    bl_parent_id = "KILN_PT_scene"

    def draw(self, context):
        layout, k = self.layout, context.scene.kiln
        row = layout.row(align=True)
        for mode, label in (("LIT", "Lit"), ("LIGHT", "Light"), ("DENSITY", "Density"), ("OFF", "Off")):
            row.operator("kiln.preview", text=label).mode = mode
        if k.warnings:
            layout.template_list("KILN_UL_warnings", "", k, "warnings", k, "warning_index", rows=3)


class KILN_PT_object(KilnPanel, bpy.types.Panel):
    bl_label = "Kiln"
    bl_context = "object"

    @classmethod
    def poll(cls, context):
        return context.object is not None

    def draw(self, context):
        self.layout.use_property_split = True
        if context.object.type == "LIGHT":
            self.layout.prop(context.object.kiln, "bake")
            return
        for name in ("receive", "cast", "reflect", "density"):
            self.layout.prop(context.object.kiln, name)


CLASSES = [KILN_PT_scene, KILN_UL_warnings, KILN_PT_result, KILN_PT_object]
