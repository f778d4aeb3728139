// Shows a lightmap of Kiln on the renderers below this object, in Unity's own lightmap slots.
using System.Collections.Generic;
using UnityEngine;

[ExecuteAlways]
public sealed class KilnLightmap : MonoBehaviour
{
    [Tooltip("lightmap_E.exr, imported with texture type Lightmap: one texture, of a bake with one page.")]
    public Texture2D light;

    [Tooltip("Renderers without a second set of coordinates stay as they are.")]
    public bool skipWithoutCoordinates = true;

    int slot = -1;
    readonly List<Renderer> lit = new List<Renderer>();

    void OnEnable()
    {
        if (light == null)
        {
            Debug.LogError("KilnLightmap: there is no texture", this);
            return;
        }
        var maps = new List<LightmapData>(LightmapSettings.lightmaps);
        slot = maps.Count;
        maps.Add(new LightmapData { lightmapColor = light });
        LightmapSettings.lightmapsMode = LightmapsMode.NonDirectional;
        LightmapSettings.lightmaps = maps.ToArray();
        foreach (var renderer in GetComponentsInChildren<MeshRenderer>(true))
        {
            var filter = renderer.GetComponent<MeshFilter>();
            var mesh = filter ? filter.sharedMesh : null;
            if (mesh == null) continue;
            if (skipWithoutCoordinates && !mesh.HasVertexAttribute(UnityEngine.Rendering.VertexAttribute.TexCoord1)) continue;
            renderer.lightmapIndex = slot;
            renderer.lightmapScaleOffset = new Vector4(1, 1, 0, 0);  // the coordinates are already on the page
            lit.Add(renderer);
        }
    }

    void OnDisable()
    {
        foreach (var renderer in lit)
            if (renderer) renderer.lightmapIndex = -1;
        lit.Clear();
        var maps = new List<LightmapData>(LightmapSettings.lightmaps);
        // Other components' slots keep their numbers: the last one is removed, another is emptied.
        if (slot == maps.Count - 1) maps.RemoveAt(slot);
        else if (slot >= 0 && slot < maps.Count) maps[slot] = new LightmapData();
        LightmapSettings.lightmaps = maps.ToArray();
        slot = -1;
    }
}
