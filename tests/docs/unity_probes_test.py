"""configs/engines/unity/probe_bytes.py and KilnProbes.cs: what Unity's shaders make of each probe's coefficients is E / pi, in
glTF's axes and mirrored; and the look-up in C#, where a compiler is installed, is that of kiln_probes.js.

usage: unity_probes_test.py KILN
"""
import base64
import json
import math
import pathlib
import random
import shutil
import struct
import subprocess
import sys
import tempfile

ROOT = pathlib.Path(__file__).resolve().parents[2]
UNITY = ROOT / "configs/engines/unity"
sys.path.insert(0, str(UNITY))
from probe_bytes import NAMES, read_exr  # noqa: E402

MAIN = """
using System; using System.IO;
static class Program {
  static void Main(string[] a) {
    var field = new KilnProbeField(File.ReadAllBytes(a[0]));
    var points = File.ReadAllBytes(a[1]);
    var sh = new float[27];
    using (var w = new BinaryWriter(File.Create(a[2])))
      for (int i = 0; i + 11 < points.Length; i += 12) {
        float known = field.Look(BitConverter.ToSingle(points, i), BitConverter.ToSingle(points, i + 4), BitConverter.ToSingle(points, i + 8), sh);
        KilnProbeField.Mirror(sh, KilnMirror.X);
        foreach (float s in sh) w.Write(s);
        w.Write(known);
      }
  }
}
"""

# As much of Unity as the component names: it compiles, which is all that is known of it here.
STUBS = """
using System;
namespace UnityEngine {
  public class ExecuteAlways : Attribute {}
  public class TooltipAttribute : Attribute { public TooltipAttribute(string s) {} }
  public struct Vector3 { public float x, y, z; }
  public struct Bounds { public Vector3 center; }
  public class Object {}
  public class TextAsset : Object { public byte[] bytes; }
  public class Transform : Object { public Vector3 InverseTransformPoint(Vector3 p) { return p; } }
  public class MaterialPropertyBlock { public void CopySHCoefficientArraysFrom(Rendering.SphericalHarmonicsL2[] l) {} }
  public class Renderer : Object {
    public Bounds bounds; public Rendering.LightProbeUsage lightProbeUsage;
    public void GetPropertyBlock(MaterialPropertyBlock b) {} public void SetPropertyBlock(MaterialPropertyBlock b) {} }
  public class MonoBehaviour : Object { public T[] GetComponentsInChildren<T>(bool all) { return null; } }
  public static class Debug { public static void LogError(object o, Object c) {} }
}
namespace UnityEngine.Rendering {
  public enum LightProbeUsage { CustomProvided }
  public struct SphericalHarmonicsL2 { public float this[int c, int k] { get { return 0; } set {} } }
}
"""


def room(path):
    """A room of 3 x 2 x 4 m seen from inside, a wall of 10 cm in it, and a panel that shines on one side."""
    corners, parts = [], []

    def box(low, high, inwards):
        first = len(corners) // 3
        for i in range(8):
            corners.extend((low, high)[i >> k & 1][k] for k in range(3))
        faces = ((0, 2, 3, 1), (4, 5, 7, 6), (0, 1, 5, 4), (2, 6, 7, 3), (0, 4, 6, 2), (1, 3, 7, 5))
        out = []
        for a, b, c, d in faces:
            for t in ((a, b, c), (a, c, d)):
                out.extend(first + i for i in (reversed(t) if inwards else t))
        return out

    parts.append((box((0, 0, 0), (3, 2, 4), True) + box((1.45, 0, 0), (1.55, 2, 3), False), 0))
    parts.append((box((0.3, 1.8, 1), (0.9, 1.9, 2), False), 1))
    data = struct.pack(f"<{len(corners)}f", *corners)
    document = {"asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
                "meshes": [{"primitives": []}], "bufferViews": [{"buffer": 0, "byteOffset": 0, "byteLength": len(data)}],
                "accessors": [{"bufferView": 0, "componentType": 5126, "count": len(corners) // 3, "type": "VEC3",
                               "min": [min(corners[k::3]) for k in range(3)], "max": [max(corners[k::3]) for k in range(3)]}],
                "materials": [{"pbrMetallicRoughness": {"metallicFactor": 0, "baseColorFactor": [0.8, 0.6, 0.4, 1]}},
                              {"emissiveFactor": [1, 0.8, 0.5]}]}
    for indices, material in parts:
        document["bufferViews"].append({"buffer": 0, "byteOffset": len(data), "byteLength": 4 * len(indices)})
        data += struct.pack(f"<{len(indices)}I", *indices)
        document["accessors"].append({"bufferView": len(document["bufferViews"]) - 1, "componentType": 5125,
                                      "count": len(indices), "type": "SCALAR"})
        document["meshes"][0]["primitives"].append({"attributes": {"POSITION": 0}, "material": material,
                                                    "indices": len(document["accessors"]) - 1})
    document["buffers"] = [{"byteLength": len(data),
                            "uri": "data:application/octet-stream;base64," + base64.b64encode(data).decode()}]
    path.write_text(json.dumps(document))


def irradiance(light, n):
    """E from radiance in orthonormal real harmonics, of one colour."""
    x, y, z = n
    value = (math.sqrt(1 / math.pi) / 2, math.sqrt(3 / (4 * math.pi)) * y, math.sqrt(3 / (4 * math.pi)) * z,
             math.sqrt(3 / (4 * math.pi)) * x, math.sqrt(15 / math.pi) / 2 * x * y, math.sqrt(15 / math.pi) / 2 * y * z,
             math.sqrt(5 / math.pi) / 4 * (3 * z * z - 1), math.sqrt(15 / math.pi) / 2 * x * z,
             math.sqrt(15 / math.pi) / 4 * (x * x - y * y))
    weight = (math.pi,) + (2 * math.pi / 3,) * 3 + (math.pi / 4,) * 5
    return sum(a * b * c for a, b, c in zip(light, value, weight))


def shade(sh, n):
    """Unity: the constants that a SphericalHarmonicsL2 becomes, and ShadeSH9 of UnityCG.cginc on them, without its last max."""
    x, y, z = n
    ar = (sh[3], sh[1], sh[2], sh[0] - sh[6])
    br = (sh[4], sh[5], 3 * sh[6], sh[7])
    b = (x * y, y * z, z * z, z * x)
    return ar[0] * x + ar[1] * y + ar[2] * z + ar[3] + sum(p * q for p, q in zip(br, b)) + sh[8] * (x * x - y * y)


def normal(rng):
    n = [rng.gauss(0, 1) for _ in range(3)]
    size = math.sqrt(sum(v * v for v in n))
    return [v / size for v in n]


def probes_of(file):
    """(coefficients [probe][27], bytes of the head and the volumes)."""
    data = file.read_bytes()
    magic, version, count, volumes, side = struct.unpack_from("<4s4I", data)
    assert (magic, version, side) == (b"KPRB", 1, 16), (magic, version, side)
    at = 20
    for _ in range(volumes):
        at += 40 + 284 * struct.unpack_from("<I", data, at + 36)[0]
    assert len(data) == at + count * (16 + 108 + 8 * 18 * 18), len(data)
    return [struct.unpack_from("<27f", data, at + 124 * i + 16) for i in range(count)]


def main():
    kiln, rng = sys.argv[1], random.Random(7)
    with tempfile.TemporaryDirectory() as name:
        folder = pathlib.Path(name)
        room(folder / "room.gltf")
        subprocess.run([kiln, "bake", folder / "room.gltf", "-o", folder / "out", "--quiet", "--quantities", "probes", "--probes",
                        "auto", "--probe-spacing", "0.5", "--probe-max-spacing", "1", "--probe-visibility", "on",
                        "--min-samples", "16", "--max-samples", "16", "--workers", "1"], check=True, stdout=subprocess.DEVNULL)
        subprocess.run([sys.executable, UNITY / "probe_bytes.py", folder / "out"], check=True)
        file = folder / "out/probes_unity.bytes"
        written, (_, _, planes) = probes_of(file), read_exr(folder / "out/probes.exr")
        lit, worst = 0, 0
        for i, sh in enumerate(written):
            n = normal(rng)
            for c in range(3):
                light = [planes[f"{k}.{'RGB'[c]}"][i] for k in NAMES]
                e = irradiance(light, n) / math.pi
                worst = max(worst, abs(shade(sh[9 * c:9 * c + 9], n) - e) / (1e-3 + abs(light[0])))
                lit += light[0] > 0
        print(f"{len(written)} probes, {lit} colours lit: off by {worst:.2g} of L0 at most")
        assert lit > 100 and worst < 1e-5

        if not shutil.which("mcs") or not shutil.which("mono") or not shutil.which("node"):
            print("the look-up in C# was not run: apt install mono-mcs mono-runtime nodejs")
            return
        (folder / "main.cs").write_text(MAIN)
        subprocess.run(["mcs", "-warnaserror", f"-out:{folder / 'look.exe'}", UNITY / "KilnProbes.cs", folder / "main.cs"], check=True)
        (folder / "stubs.cs").write_text(STUBS)
        subprocess.run(["mcs", "-target:library", "-define:UNITY_5_3_OR_NEWER", f"-out:{folder / 'unity.dll'}",
                        UNITY / "KilnProbes.cs", folder / "stubs.cs"], check=True)
        points = [(rng.uniform(-0.8, 3.8), rng.uniform(-0.8, 2.8), rng.uniform(-0.8, 4.8)) for _ in range(600)]
        (folder / "out/points").write_bytes(b"".join(struct.pack("<3f", *p) for p in points))
        subprocess.run(["mono", folder / "look.exe", file, folder / "out/points", folder / "unity"], check=True)
        subprocess.run(["node", ROOT / "tests/node/probe_loader.mjs", folder / "out"], check=True)
        known, worst = 0, 0
        unity, three = ((folder / f).read_bytes() for f in ("unity", "out/light"))
        assert len(unity) == len(three) == 112 * len(points)
        for i in range(len(points)):
            u, t = struct.unpack_from("<28f", unity, 112 * i), struct.unpack_from("<28f", three, 112 * i)
            assert abs(u[27] - t[27]) < 1e-4, (points[i], u[27], t[27])
            if not t[27] > 0:
                continue
            known += 1
            n = normal(rng)
            for c in range(3):
                e = irradiance([t[3 * k + c] for k in range(9)], n) / math.pi
                found = shade(u[9 * c:9 * c + 9], (-n[0], n[1], n[2]))
                worst = max(worst, abs(found - e) / (1e-3 + abs(t[c])))
        print(f"{known} places: C# off by {worst:.2g} of L0 at most")
        assert known > 300 and worst < 2e-3


if __name__ == "__main__":
    main()
