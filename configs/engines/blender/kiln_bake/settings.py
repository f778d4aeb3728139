"""What the panels edit: of the scene, of objects, and of this machine."""

import shutil

import bpy
from bpy.props import BoolProperty, CollectionProperty, EnumProperty, FloatProperty, IntProperty, PointerProperty, StringProperty


class KilnPreferences(bpy.types.AddonPreferences):
    bl_idname = __package__

    program: StringProperty(
        name="Program", subtype="FILE_PATH", default="kiln",
        description="The program kiln, or the script ./kiln of its sources")
    server: StringProperty(name="Server", default="127.0.0.1:7800", description="HOST:PORT of the farm's coordinator")
    token_file: StringProperty(name="Token file", subtype="FILE_PATH", description="For a coordinator without TLS")
    ca: StringProperty(name="Authority", subtype="FILE_PATH", description="The farm's authority, a PEM file")
    certificate: StringProperty(name="Certificate", subtype="FILE_PATH", description="Yours, a PEM file")
    key: StringProperty(name="Key", subtype="FILE_PATH", description="Of your certificate")

    def draw(self, _context):
        for name in ("program", "server", "token_file", "ca", "certificate", "key"):
            self.layout.prop(self, name)


class KilnWarning(bpy.types.PropertyGroup):
    """`name` is the sentence; `object` the object that it speaks of, where there is one."""
    object: StringProperty()


class KilnScene(bpy.types.PropertyGroup):
    where: EnumProperty(name="Bake on", items=[
        ("LOCAL", "This machine", "kiln bake"), ("FARM", "A farm", "kiln submit: the server is in the add-on's preferences")])
    what: EnumProperty(name="Objects", items=[
        ("SCENE", "All", "Every object of the scene"),
        ("VIEW_LAYER", "Visible in the view layer", "What the active view layer shows")])
    folder: StringProperty(name="Folder", subtype="DIR_PATH", default="//kiln",
                           description="For the scene, the maps and the report; // is the folder of the .blend file")
    preset: EnumProperty(name="Quality", items=[
        ("PREVIEW", "Preview", "Standard error within 20 %, at most 256 samples a texel"),
        ("DEFAULT", "Default", "Within 5 % at 95 % confidence"),
        ("PRODUCTION", "Production", "Within 3 % at 95 % confidence"),
        ("ERROR", "Error", "Until the error below is reached"),
        ("TIME", "Time", "The best map in the time below")])
    error: FloatProperty(name="Error", subtype="PERCENTAGE", default=5, min=0.1, max=100)
    minutes: FloatProperty(name="Minutes", default=5, min=0.1, soft_max=600)
    density: FloatProperty(name="Texels per metre", default=8, min=0.01, soft_max=256)
    layout: EnumProperty(name="Coordinates", items=[
        ("PACK", "Made by Kiln", "A lit copy of the scene in a collection of its own; nothing of yours is changed"),
        ("ATLAS", "Second UV map", "Every object's second UV map is a part of one atlas; the map goes onto your objects")])
    resolution: IntProperty(name="Resolution", default=1024, min=16, max=16384, description="Of the atlas, texels a side")
    extra: StringProperty(name="More options", description="As on the command line: --split direct,indirect")
    # Of the running bake or the last one.
    stage: StringProperty()
    share: FloatProperty(subtype="PERCENTAGE", min=0, max=100)
    left: StringProperty()
    outcome: StringProperty()
    shown: StringProperty(default="OFF")
    warnings: CollectionProperty(type=KilnWarning)
    warning_index: IntProperty(update=lambda self, context: select_warned(self, context))


class KilnObject(bpy.types.PropertyGroup):
    """Written as extras.kiln of the object's node; what is as by default is not written."""
    receive: BoolProperty(name="Receives a lightmap", default=True)
    cast: BoolProperty(name="Blocks light", default=True)
    reflect: BoolProperty(name="Reflects and emits light", default=True)
    density: FloatProperty(name="Density", default=1, min=1 / 64, max=64,
                           description="Times the scene's texels per metre")
    bake: EnumProperty(name="Lamp", items=[
        ("full", "In the map", "All of its light is baked"),
        ("indirect", "Reflections in the map", "The engine shines its direct light"),
        ("none", "Not in the map", "The engine shines it")])


def select_warned(scene_settings, context):
    if not 0 <= scene_settings.warning_index < len(scene_settings.warnings):
        return
    named = context.scene.objects.get(scene_settings.warnings[scene_settings.warning_index].object)
    if named is None:
        return
    for o in context.selected_objects:
        o.select_set(False)
    if named.visible_get():
        named.select_set(True)
        context.view_layer.objects.active = named


def preferences(context):
    return context.preferences.addons[__package__].preferences


def program_path(context):
    """The program, or None."""
    given = bpy.path.abspath(preferences(context).program)
    return shutil.which(given)


CLASSES = [KilnPreferences, KilnWarning, KilnScene, KilnObject]


def attach():
    bpy.types.Scene.kiln = PointerProperty(type=KilnScene)
    bpy.types.Object.kiln = PointerProperty(type=KilnObject)


def detach():
    del bpy.types.Scene.kiln
    del bpy.types.Object.kiln
