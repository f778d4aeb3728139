# blender -b --factory-startup --python blender_shot.py -- FILE.glb OUT.png: the file from its first camera, by Cycles.
import os
import sys

import bpy
import numpy

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../blender"))
from cycles_shot import shot  # noqa: E402

numpy.bool = bool  # Debian 12: the importer of Blender 3.4 uses a name that NumPy 1.24 no longer has
file, out = sys.argv[sys.argv.index("--") + 1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
bpy.ops.import_scene.gltf(filepath=file)
bpy.context.scene.camera = next(o for o in bpy.data.objects if o.type == "CAMERA")
shot(out)
