// The light of a scene.glb that Kiln baked, for the glTF loader of Babylon.js:
//   registerKilnLightmap(BABYLON)
// before the file is loaded. The material becomes unlit: its colour times the map, as baked. Babylon multiplies by the
// texel, so a texture's level is that of E/pi. E comes from MOZ_lightmap's linear 8-bit images in the file; with `rgbd: true`,
// from the RGBD textures beside it that configs/engines/babylon.json makes: finer in deep shade, further off between texels,
// because Babylon filters them before it decodes.
const KILN = 'KILN_lightmap', MOZ = 'MOZ_lightmap';

// By index of a material the page of the lightmap that its primitives read.
export function materialPages(gltf) {
  const pages = new Map();
  for (const { primitives } of gltf.meshes ?? [])
    for (const { material, extensions } of primitives)
      if (material !== undefined && extensions?.[KILN]?.page !== undefined) pages.set(material, extensions[KILN].page);
  return pages;
}

// The texture of E in RGBD for a page, as KILN_lightmap describes it; undefined: there is none.
export function rgbdOf(gltf, page) {
  return gltf.extensions?.[KILN]?.lightmaps?.[0]?.encodings.find(({ name }) => name === 'rgbd')?.textures
    .find((t) => t.page === page && t.channels[0].plane === 'E.R');
}

function show(babylonMaterial, texture, level) {
  texture.gammaSpace = false;
  texture.level = level / Math.PI;
  texture.coordinatesIndex = 1;
  babylonMaterial.lightmapTexture = texture;
  babylonMaterial.useLightmapAsShadowmap = true;
  babylonMaterial.unlit = true;
}

export function registerKilnLightmap(BABYLON, { rgbd = false } = {}) {
  BABYLON.GLTF2.GLTFLoader.RegisterExtension(MOZ, (loader) => ({
    name: MOZ,
    enabled: true,
    order: 1000,  // after the extensions that set up the material
    textures: new Map(),  // by page; one for all materials
    dispose() {},

    external(page, file, scene) {
      if (!this.textures.has(page)) {
        const texture = new BABYLON.Texture((loader.rootUrl ?? loader._rootUrl) + file.uri, scene, true, false);
        texture.isRGBD = true;
        texture.wrapU = texture.wrapV = BABYLON.Texture.CLAMP_ADDRESSMODE;
        this.textures.set(page, texture);
      }
      return this.textures.get(page);
    },

    loadMaterialPropertiesAsync(context, material, babylonMaterial) {
      const map = material.extensions?.[MOZ];
      if (!map) return null;
      const rest = { ...material, extensions: { ...material.extensions, [MOZ]: undefined } };
      return loader.loadMaterialPropertiesAsync(context, rest, babylonMaterial).then(() => {
        const page = materialPages(loader.gltf).get(material.index);
        const file = rgbd && page !== undefined ? rgbdOf(loader.gltf, page) : undefined;
        if (file) return show(babylonMaterial, this.external(page, file, babylonMaterial.getScene()), file.channels[0].scale ?? 1);
        const info = { index: map.index, texCoord: map.texCoord, nonColorData: true };
        return loader.loadTextureInfoAsync(`${context}/extensions/${MOZ}`, info, (texture) => show(babylonMaterial, texture, map.intensity ?? 1));
      });
    } }));
}
