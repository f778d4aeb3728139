"""What the add-on reads from a bake, without Blender: the lines of `kiln bake` and `kiln watch` as the program writes them.

    python3 tests/blender/process_test.py KILN SCENE      # the scene is baked into a folder of its own, cheaply
"""
import os
import sys
import tempfile
import time

sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../configs/engines/blender/kiln_bake"))
import process  # noqa: E402


def main(kiln, scene):
    with tempfile.TemporaryDirectory() as folder:
        run = process.Run([kiln, "bake", scene, "-o", os.path.join(folder, "out"), "--texels-per-metre", "1", "--encode", "none",
                           "--preview", "off", "--error", "10%", "--max-samples", "256"])
        shares, stages, lefts = [0.0], set(), set()
        while run.poll() is None:
            if run.stage.startswith("pass "):
                shares.append(run.share)
            stages.add(run.stage)
            lefts.add(run.left)
            time.sleep(0.01)
        assert run.poll() == 0, run.error()
        assert any(stage.startswith("pass ") for stage in stages), stages
        assert shares == sorted(shares), "the share of a bake falls: %s" % shares
        assert shares[-1] > 0, "no line of progress was read: %s" % run.lines
        assert any(left.endswith(" s") for left in lefts), lefts
        assert not [line for line in run.lines if line.startswith("bake ")], "lines that were not understood: %s" % run.lines


if __name__ == "__main__":
    main(*sys.argv[1:])
