# blender -b --factory-startup --python blender_shot.py -- FILE.glb WIDTH HEIGHT OUT.png: the file from its first camera,
# by Cycles with one sample a pixel: an unlit material needs no more.
import sys

import bpy
import numpy

numpy.bool = bool  # Debian 12: the importer of Blender 3.4 uses a name that NumPy 1.24 no longer has
file, width, height, out = sys.argv[sys.argv.index("--") + 1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=file)
scene = bpy.context.scene
scene.camera = next(o for o in bpy.data.objects if o.type == "CAMERA")
scene.render.engine = "CYCLES"
scene.cycles.samples = 1
scene.cycles.use_denoising = False
scene.cycles.pixel_filter_type = "BOX"
scene.cycles.filter_width = 0.01
scene.render.resolution_x, scene.render.resolution_y = int(width), int(height)
scene.render.resolution_percentage = 100
scene.view_settings.view_transform = "Standard"
scene.render.image_settings.file_format = "PNG"
scene.render.filepath = out
bpy.ops.render.render(write_still=True)
