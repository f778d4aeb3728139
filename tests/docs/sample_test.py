"""The sample of KILN_lightmap, read by its specification: what is in the repository is what its script writes, fits the schemas
and Khronos' validator where node and its packages are there, and shows the light of its two lamps.

usage: sample_test.py
"""
import json
import math
import pathlib
import re
import struct
import subprocess
import sys
import tempfile
import zlib

ROOT = pathlib.Path(__file__).resolve().parents[2]
FOLDER = ROOT / "docs/extensions/KILN_lightmap"
SAMPLE = FOLDER / "sample"


def glb(path):
    data = path.read_bytes()
    return json.loads(data[20:20 + struct.unpack_from("<I", data, 12)[0]])


def png(path):
    data, at, packed = path.read_bytes(), 8, b""
    while at < len(data):
        n, kind = struct.unpack_from(">I4s", data, at)
        body = data[at + 8:at + 8 + n]
        if kind == b"IHDR":
            width, height = struct.unpack_from(">II", body)
        if kind == b"IDAT":
            packed += body
        at += 12 + n
    raw, stride = zlib.decompress(packed), 1 + 4 * width
    assert all(raw[y * stride] == 0 for y in range(height)), "this reader knows no filters"
    return [[tuple(raw[y * stride + 1 + 4 * x:y * stride + 5 + 4 * x]) for x in range(width)] for y in range(height)]


def main():
    with tempfile.TemporaryDirectory() as folder:
        subprocess.run([sys.executable, SAMPLE / "make_sample.py", folder], check=True)
        made = pathlib.Path(folder)
        assert (made / "floors.glb").read_bytes() == (SAMPLE / "floors.glb").read_bytes(), "floors.glb: run make_sample.py"
        assert png(made / "floors_rgbm_E.png") == png(SAMPLE / "floors_rgbm_E.png"), "the texture: run make_sample.py"
    document = glb(SAMPLE / "floors.glb")
    lightmap = document["extensions"]["KILN_lightmap"]["lightmaps"][0]
    texture = lightmap["encodings"][0]["textures"][0]
    pixels = png(SAMPLE / texture["uri"])
    assert (len(pixels[0]), len(pixels)) == (lightmap["width"], lightmap["height"])
    worst = 0
    # E below lamps at these heights, in closed form.
    for node, (intensity, height) in zip(document["nodes"], [((4, 4, 4), 1), ((6, 3, 1), 1.5)]):
        lit = node["extensions"]["KILN_lightmap"]
        for i in range(8):
            for k in range(8):
                uv = [(i + 0.5) / 8, (k + 0.5) / 8]
                u, v = (c * s + o for c, s, o in zip(uv, lit["scale"], lit["offset"]))
                texel = [c / 255 for c in pixels[int(v * lightmap["height"])][int(u * lightmap["width"])]]
                d = math.hypot(2 * uv[0] - 1, 2 * uv[1] - 1, height)
                for c in range(3):
                    channel = texture["channels"][c]
                    assert channel["plane"] == "E." + "RGB"[c]
                    e = (texture["unpackRange"] * texel[3] * texel[c]) ** 2
                    e = channel.get("scale", 1) * e + channel.get("bias", 0)
                    worst = max(worst, abs(e / (intensity[c] * height / d ** 3) - 1))
    assert worst < 0.02, f"{worst:.3f} off"  # 8 bits
    # The example of the page is the sample's own.
    example = json.loads(re.search(r"```json\n(.*?)```", (FOLDER / "README.md").read_text(), re.S)[1])
    assert example["extensions"] == document["extensions"]
    assert [n["extensions"] for n in example["nodes"]] == [n["extensions"] for n in document["nodes"]]
    print(f"E within {100 * worst:.2f} %")
    # Every property of the extension's schemas is on the page.
    page = (FOLDER / "README.md").read_text()
    for schema in (ROOT / "docs/schema").glob("*.KILN_lightmap.schema.json"):
        stack = [json.loads(schema.read_text())]
        while stack:
            part = stack.pop()
            for name in part.get("properties", {}):
                if f"`{name}`" not in page:
                    raise AssertionError(f"{schema.name}: {name} is not on the page")
            stack += [v for v in part.get("$defs", {}).values()]
            stack += [v for v in part.get("properties", {}).values() if isinstance(v, dict)]
    tools = ROOT / "tests/node"
    if not (tools / "node_modules/ajv").exists():
        print("schemas and validator: skipped, npm ci --prefix tests/node installs them")
        return
    for command in (["validate.mjs"], ["schema.mjs", ROOT / "docs/schema"]):
        said = subprocess.run(["node", tools / command[0], *command[1:], SAMPLE / "floors.glb"], capture_output=True, text=True)
        print(said.stdout.strip())
        assert said.returncode == 0, said.stdout + said.stderr


if __name__ == "__main__":
    main()
