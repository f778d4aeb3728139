"""blender -b --factory-startup --python lit_shot.py -- SCENE BAKE OUT.png: what the add-on shows of the folder BAKE where the
scene that was baked is open, from its first camera, by Cycles."""
import os
import sys

import bpy
import numpy

HERE = os.path.dirname(os.path.abspath(__file__))
sys.path[:0] = [HERE, os.path.join(HERE, "../../configs/engines/blender")]
import kiln_bake  # noqa: E402
from cycles_shot import shot  # noqa: E402
from kiln_bake import result  # noqa: E402

numpy.bool = bool  # as in tests/node/engines/blender_shot.py
source, folder, out = sys.argv[sys.argv.index("--") + 1:]
bpy.ops.wm.read_factory_settings(use_empty=True)
kiln_bake.register()
bpy.ops.import_scene.gltf(filepath=source)
scene = bpy.context.scene
scene.camera = next(o for o in bpy.data.objects if o.type == "CAMERA")
print(result.take(bpy.context, scene, folder))
shot(out)
