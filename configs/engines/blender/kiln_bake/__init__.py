"""Kiln for Blender: bakes the scene's lightmap with the program `kiln` and puts it on the objects."""

bl_info = {
    "name": "Kiln lightmaps",
    "description": "Bake lightmaps with Kiln, on this machine or on a farm",
    "author": "Kiln",
    "version": (0, 1, 0),
    "blender": (3, 4, 0),
    "location": "Properties > Render > Kiln lightmap",
    "category": "Render",
}

from . import export, operators, panels, settings

# The glTF exporter asks every enabled add-on for a class of this name.
glTF2ExportUserExtension = export.GltfHooks

CLASSES = settings.CLASSES + operators.CLASSES + panels.CLASSES


def register():
    import bpy
    for c in CLASSES:
        bpy.utils.register_class(c)
    settings.attach()


def unregister():
    import bpy
    operators.stop_all()
    settings.detach()
    for c in reversed(CLASSES):
        bpy.utils.unregister_class(c)
