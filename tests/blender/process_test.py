"""What the add-on reads from a bake, without Blender: the lines of `kiln bake` and `kiln watch` as the program writes them.

    python3 tests/blender/process_test.py KILN SCENE      # the scene is baked into a folder of its own, cheaply
"""
import os
import signal
import subprocess
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


def runs(pid):
    """Not gone, nor a zombie that nobody has asked about."""
    try:
        with open("/proc/{}/stat".format(pid), encoding="utf-8") as file:
            return file.read().rsplit(")", 1)[1].split()[0] != "Z"
    except FileNotFoundError:
        return False


def check_end_with_parent(kiln, scene):
    """Whoever started a bake is killed: the bake ends too."""
    if not process.can_end_with_parent():
        print("skipped: there is no setpriv")
        return
    with tempfile.TemporaryDirectory() as folder:
        starter = ("import process, time; run = process.Run({!r})\n"
                   "while not run.stage.startswith('pass') and run.poll() is None: time.sleep(0.01)\n"
                   "print(run.pid, flush=True); time.sleep(600)").format(
                       [os.path.abspath(kiln), "bake", os.path.abspath(scene), "-o", os.path.join(folder, "out"), "--texels-per-metre", "8",
                        "--encode", "none", "--min-samples", "16384", "--max-samples", "16384"])
        parent = subprocess.Popen([sys.executable, "-c", starter], stdout=subprocess.PIPE, text=True,
                                  cwd=os.path.dirname(process.__file__))
        pid = int(parent.stdout.readline())
        assert runs(pid)
        parent.send_signal(signal.SIGKILL)
        parent.wait()
        end = time.monotonic() + 20
        while runs(pid) and time.monotonic() < end:
            time.sleep(0.05)
        left = runs(pid)
        if left:
            os.kill(pid, signal.SIGTERM)
        assert not left, "the bake goes on without its parent"


if __name__ == "__main__":
    main(*sys.argv[1:])
    check_end_with_parent(*sys.argv[1:])
