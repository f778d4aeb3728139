#!/usr/bin/env python3
"""Writes the flat beside itself, or into the folder given: two rooms, a window to the sun, a doorstep between them.

    python3 tests/scenes/flat/make_flat.py [FOLDER]

The patch of sun below the window ends in the far room and crosses the doorstep, a mesh of its own that lies level with
both floors: its edges cross two seams. Python's standard library only; equal bytes on every run and machine.
"""
import json
import os
import pathlib
import sys

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "..", "..", "bench"))
import error_scenes  # noqa: E402
import scenes  # noqa: E402  (tests/compare/scenes.py)

WIDTH, HIGH = 3.7, 2.6
LIVING, DARK = (0.0, 4.1), (4.3, 7.4)  # along x; the wall between them is 20 cm thick
DOOR = (1.23, 2.17)                    # along z
SETTINGS = {"layout": "pack", "texels-per-metre": 8,
            "sun": "-1,0.46,0.13:14,13,11", "sun-angle": 0.53, "environment": "0.7,0.85,1"}


def flat(scene):
    y, z = (0, HIGH), (0, WIDTH)
    scene.lambert(scenes.inside_of_box((LIVING[0], 0, 0), (LIVING[1], HIGH, WIDTH), ("-x", "+x")), (0.72, 0.7, 0.66))
    scene.lambert(error_scenes.wall_with_hole(0, 1, y, z, (0.9, 2.25), (0.9, 2.9)), (0.72, 0.7, 0.66))
    scene.lambert(scenes.inside_of_box((DARK[0], 0, 0), (DARK[1], HIGH, WIDTH), ("-x",)), (0.6, 0.62, 0.66))
    scene.lambert(error_scenes.wall_with_hole(LIVING[1], -1, y, z, (0, 2.1), DOOR), (0.72, 0.7, 0.66))
    scene.lambert(error_scenes.wall_with_hole(DARK[0], 1, y, z, (0, 2.1), DOOR), (0.6, 0.62, 0.66))
    frame = scenes.inside_of_box((LIVING[1], 0, DOOR[0]), (DARK[0], 2.1, DOOR[1]), ("-x", "+x", "-y"))
    scene.lambert(frame, (0.8, 0.8, 0.8))
    step = [(LIVING[1], 0, DOOR[1]), (DARK[0], 0, DOOR[1]), (DARK[0], 0, DOOR[0]), (LIVING[1], 0, DOOR[0])]
    scene.lambert([step], (0.35, 0.25, 0.18))
    scene.lambert(error_scenes.standing_box((1.2, 0, 2.4), (2.3, 0.72, 3.2)), (0.5, 0.35, 0.2))
    scene.lambert(error_scenes.standing_box((5.6, 0, 0.3), (6.9, 0.45, 1.2)), (0.4, 0.42, 0.5))


def main():
    folder = pathlib.Path(sys.argv[1] if len(sys.argv) > 1 else os.path.dirname(os.path.abspath(__file__)))
    scene = error_scenes.Scene()
    flat(scene)
    scene.save(str(folder / "flat.glb"))
    (folder / "flat.kiln.json").write_text(json.dumps(SETTINGS, indent=2) + "\n")


if __name__ == "__main__":
    main()
