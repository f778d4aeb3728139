// Lights moving renderers below this object by the probes of a bake: probes_unity.bytes, which probe_bytes.py writes.
// KilnProbeField is the look-up, without anything of Unity; common/probes/query.h has the same in C++.
using System;

public enum KilnMirror { X, Z, None }

public sealed class KilnProbeField
{
    const float LeastWeight = 1e-6f, Crush = 0.2f;
    const uint Inactive = 2;

    struct Brick
    {
        public uint X, Y, Z, Level, Parent, Children, Coarser;
        public uint Corner(int k) { return k == 0 ? X : k == 1 ? Y : Z; }
        public int FirstProbe;  // in Volume.Probes
    }

    sealed class Volume
    {
        public float[] Low = new float[3];
        public float Spacing;
        public uint[] Roots = new uint[3];
        public int Levels;
        public bool Visibility;
        public Brick[] Bricks;
        public int[] Probes;  // 64 a brick
    }

    readonly Volume[] volumes;
    readonly float[] position, harmonics, distance;  // 3, 27 and 2 (side + 2)^2 a probe
    readonly uint[] state;
    readonly int side;

    public int Count { get { return state.Length; } }

    public KilnProbeField(byte[] bytes)
    {
        if (bytes.Length < 20 || bytes[0] != 'K' || bytes[1] != 'P' || bytes[2] != 'R' || bytes[3] != 'B')
            throw new FormatException("this is no file of probe_bytes.py");
        int at = 4;
        Func<uint> word = () => { at += 4; return BitConverter.ToUInt32(bytes, at - 4); };
        Func<float> real = () => { at += 4; return BitConverter.ToSingle(bytes, at - 4); };
        if (word() != 1) throw new FormatException("the file of probes is of another version");
        int count = (int)word();
        volumes = new Volume[word()];
        side = (int)word();
        for (int i = 0; i < volumes.Length; ++i)
        {
            var v = volumes[i] = new Volume();
            for (int k = 0; k < 3; ++k) v.Low[k] = real();
            v.Spacing = real();
            for (int k = 0; k < 3; ++k) v.Roots[k] = word();
            v.Levels = (int)word();
            v.Visibility = word() != 0;
            v.Bricks = new Brick[word()];
            v.Probes = new int[64 * v.Bricks.Length];
            for (int b = 0; b < v.Bricks.Length; ++b)
            {
                v.Bricks[b] = new Brick { X = word(), Y = word(), Z = word(), Level = word(), Parent = word(), Children = word(),
                                          Coarser = word(), FirstProbe = 64 * b };
                for (int p = 0; p < 64; ++p) v.Probes[64 * b + p] = (int)word();
            }
        }
        Array.Sort(volumes, (a, b) => a.Spacing.CompareTo(b.Spacing));  // the finest first
        position = new float[3 * count];
        state = new uint[count];
        harmonics = new float[27 * count];
        for (int p = 0; p < count; ++p)
        {
            for (int k = 0; k < 3; ++k) position[3 * p + k] = real();
            state[p] = word();
            for (int k = 0; k < 27; ++k) harmonics[27 * p + k] = real();
        }
        distance = new float[side > 0 ? 2 * (side + 2) * (side + 2) * count : 0];
        Buffer.BlockCopy(bytes, at, distance, 0, 4 * distance.Length);
    }

    // Light around a point, in glTF's axes: sh[9 colour + coefficient]. Returns how much is known: 1 inside of volumes, 0
    // where no probe has light.
    public float Look(float x, float y, float z, float[] sh)
    {
        Array.Clear(sh, 0, 27);
        float left = 1;
        var list = new Weights();
        foreach (var v in volumes)
        {
            float inside = Find(v, new[] { x, y, z }, list);
            for (int i = 0; i < list.Count; ++i)
                for (int k = 0; k < 27; ++k) sh[k] += left * inside * list.Weight[i] * harmonics[27 * list.Probe[i] + k];
            left *= 1 - inside;
        }
        if (left < 1)
            for (int k = 0; k < 27; ++k) sh[k] /= 1 - left;
        return 1 - left;
    }

    // From glTF's axes into those of an importer that turns one axis round, or back: functions that are odd in it change
    // their sign.
    public static void Mirror(float[] sh, KilnMirror axis)
    {
        if (axis == KilnMirror.None) return;
        var odd = axis == KilnMirror.X ? new[] { 3, 4, 7 } : new[] { 2, 5, 7 };
        for (int c = 0; c < 3; ++c)
            foreach (int k in odd) sh[9 * c + k] = -sh[9 * c + k];
    }

    sealed class Weights
    {
        public int Count;
        public readonly int[] Probe = new int[80];
        public readonly float[] Weight = new float[80];
    }

    float Find(Volume v, float[] point, Weights list)
    {
        list.Count = 0;
        uint root = 3u << (v.Levels - 1);
        var at = new double[3];
        double off = 0;
        for (int k = 0; k < 3; ++k)
        {
            double place = ((double)point[k] - v.Low[k]) / v.Spacing;
            at[k] = Math.Min(Math.Max(place, 0), v.Roots[k] * root);
            off += (place - at[k]) * (place - at[k]);
        }
        off = Math.Sqrt(off) / (1 << (v.Levels - 1));
        if (!(off < 1)) return 0;
        uint index = FindBrick(v, at, root);
        float sum = 0, left = 1;
        for (;;)
        {
            var brick = v.Bricks[index];
            bool isRoot = brick.Parent == index;
            float own = isRoot ? 1 : Fade(brick, at);
            if (own > 0 && AddCell(v, brick, at, point, left * own, list))
            {
                sum += left * own;
                left *= 1 - own;
            }
            if (isRoot || !(left > 0)) break;
            index = brick.Parent;
        }
        if (!(sum > 0)) return 0;
        for (int i = 0; i < list.Count; ++i) list.Weight[i] /= sum;
        return (float)(1 - off);
    }

    static uint FindBrick(Volume v, double[] at, uint root)
    {
        var cell = new uint[3];
        for (int k = 0; k < 3; ++k) cell[k] = Math.Min((uint)(at[k] / root), v.Roots[k] - 1);
        uint index = cell[0] + v.Roots[0] * (cell[1] + v.Roots[1] * cell[2]);
        while (v.Bricks[index].Children != 0)
        {
            uint first = v.Bricks[index].Children, octant = 0;
            for (int k = 0; k < 3; ++k)
                if (at[k] >= v.Bricks[first].Corner(k) + (3u << (int)v.Bricks[first].Level)) octant |= 1u << k;
            index = first + octant;
        }
        return index;
    }

    // 0 at a neighbour of larger spacing, 1 from one cell off.
    static float Fade(Brick brick, double[] at)
    {
        double nearest = 1, cell = 1u << (int)brick.Level;
        for (int neighbour = 0; neighbour < 27; ++neighbour)
        {
            if ((brick.Coarser >> neighbour & 1) == 0) continue;
            double away = 0;
            for (int k = 0, rest = neighbour; k < 3; ++k, rest /= 3)
            {
                int step = rest % 3 - 1;
                double low = (at[k] - brick.Corner(k)) / cell;
                if (step < 0) away = Math.Max(away, low);
                if (step > 0) away = Math.Max(away, 3 - low);
            }
            nearest = Math.Min(nearest, away);
        }
        return (float)Math.Max(nearest, 0);
    }

    bool AddCell(Volume v, Brick brick, double[] at, float[] point, float share, Weights list)
    {
        var first = new int[3];
        var part = new float[3];
        for (int k = 0; k < 3; ++k)
        {
            double local = Math.Min(Math.Max((at[k] - brick.Corner(k)) / (1u << (int)brick.Level), 0), 3);
            first[k] = Math.Min((int)local, 2);
            part[k] = (float)(local - first[k]);
        }
        int begin = list.Count;
        float sum = 0;
        for (int corner = 0; corner < 8; ++corner)
        {
            float weight = 1;
            int place = 0;
            for (int k = 0, stride = 1; k < 3; ++k, stride *= 4)
            {
                int upper = corner >> k & 1;
                weight *= upper == 1 ? part[k] : 1 - part[k];
                place += (first[k] + upper) * stride;
            }
            int probe = v.Probes[brick.FirstProbe + place];
            if (!(weight > 0) || state[probe] == Inactive) continue;
            if (v.Visibility && side > 0)
            {
                float seen = Math.Max(LeastWeight, Sees(probe, point));
                weight *= seen < Crush ? seen * seen * seen / (Crush * Crush) : seen;
            }
            list.Probe[list.Count] = probe;
            list.Weight[list.Count++] = weight;
            sum += weight;
        }
        for (int i = begin; i < list.Count; ++i) list.Weight[i] *= share / sum;
        return list.Count > begin;
    }

    // Chebyshev's bound of the share of distances beyond, cubed.
    float Sees(int probe, float[] point)
    {
        float x = point[0] - position[3 * probe], y = point[1] - position[3 * probe + 1], z = point[2] - position[3 * probe + 2];
        float r = (float)Math.Sqrt(x * x + y * y + z * z);
        if (!(r > 0)) return 1;
        float size = Math.Abs(x) + Math.Abs(y) + Math.Abs(z), u = x / size, w = y / size;
        if (z < 0)
        {
            float fold = (1 - Math.Abs(w)) * (u < 0 ? -1 : 1);
            w = (1 - Math.Abs(u)) * (w < 0 ? -1 : 1);
            u = fold;
        }
        float s = (0.5f * u + 0.5f) * side + 0.5f, t = (0.5f * w + 0.5f) * side + 0.5f;
        int column = (int)s, row = (int)t, tile = side + 2;
        float fs = s - column, ft = t - row, mean = 0, square = 0;
        for (int k = 0; k < 4; ++k)
        {
            int texel = 2 * (tile * tile * probe + (row + (k >> 1)) * tile + column + (k & 1));
            float share = ((k & 1) == 1 ? fs : 1 - fs) * (k >> 1 == 1 ? ft : 1 - ft);
            mean += share * distance[texel];
            square += share * distance[texel + 1];
        }
        if (!(r > mean)) return 1;
        float variance = Math.Abs(square - mean * mean), beyond = r - mean, bound = variance / (variance + beyond * beyond);
        return bound * bound * bound;
    }
}

#if UNITY_5_3_OR_NEWER
[UnityEngine.ExecuteAlways]
public sealed class KilnProbes : UnityEngine.MonoBehaviour
{
    [UnityEngine.Tooltip("probes_unity.bytes, written by probe_bytes.py.")]
    public UnityEngine.TextAsset data;

    [UnityEngine.Tooltip("The root of the imported scene, in whose axes the probes are; none: the world. It must not be turned.")]
    public UnityEngine.Transform scene;

    [UnityEngine.Tooltip("The axis that the importer of glTF turns round: X with glTFast and UnityGLTF.")]
    public KilnMirror mirror = KilnMirror.X;

    [UnityEngine.Tooltip("What is lit; empty: all renderers below this object.")]
    public UnityEngine.Renderer[] renderers;

    KilnProbeField field;
    UnityEngine.MaterialPropertyBlock block;
    readonly float[] sh = new float[27];
    readonly UnityEngine.Rendering.SphericalHarmonicsL2[] one = new UnityEngine.Rendering.SphericalHarmonicsL2[1];

    void OnEnable()
    {
        if (data == null)
        {
            UnityEngine.Debug.LogError("KilnProbes: there is no data", this);
            return;
        }
        field = new KilnProbeField(data.bytes);
        block = new UnityEngine.MaterialPropertyBlock();
        if (renderers == null || renderers.Length == 0) renderers = GetComponentsInChildren<UnityEngine.Renderer>(true);
    }

    void LateUpdate()
    {
        if (field == null) return;
        foreach (var renderer in renderers)
        {
            if (renderer == null || !Look(renderer.bounds.center, out one[0])) continue;
            renderer.lightProbeUsage = UnityEngine.Rendering.LightProbeUsage.CustomProvided;
            renderer.GetPropertyBlock(block);
            block.CopySHCoefficientArraysFrom(one);
            renderer.SetPropertyBlock(block);
        }
    }

    // Light around a point of the world; false where no probe has light.
    public bool Look(UnityEngine.Vector3 world, out UnityEngine.Rendering.SphericalHarmonicsL2 light)
    {
        light = new UnityEngine.Rendering.SphericalHarmonicsL2();
        var p = scene != null ? scene.InverseTransformPoint(world) : world;
        if (mirror == KilnMirror.X) p.x = -p.x;
        if (mirror == KilnMirror.Z) p.z = -p.z;
        if (!(field.Look(p.x, p.y, p.z, sh) > 0)) return false;
        KilnProbeField.Mirror(sh, mirror);
        for (int c = 0; c < 3; ++c)
            for (int k = 0; k < 9; ++k) light[c, k] = sh[9 * c + k];
        return true;
    }
}
#endif
