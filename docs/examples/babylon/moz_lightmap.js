// MOZ_lightmap for the glTF loader of Babylon.js, which does not read it by itself:
//   registerMozLightmap(BABYLON)
// The material becomes unlit: its colour times the map, as baked. Babylon multiplies by the texel, so the level is
// that of E/pi (docs/gltf.md). The image is linear and uses TEXCOORD_1.
const NAME = 'MOZ_lightmap';

export function registerMozLightmap(BABYLON) {
  BABYLON.GLTF2.GLTFLoader.RegisterExtension(NAME, (loader) => ({
    name: NAME,
    enabled: true,
    order: 1000,  // after the extensions that set up the material
    dispose() {},
    loadMaterialPropertiesAsync(context, material, babylonMaterial) {
      const map = material.extensions?.[NAME];
      if (!map) return null;
      return loader.loadMaterialPropertiesAsync(context, { ...material, extensions: { ...material.extensions, [NAME]: undefined } }, babylonMaterial)
        .then(() => loader.loadTextureInfoAsync(`${context}/extensions/${NAME}`, { index: map.index, texCoord: map.texCoord, nonColorData: true }, (texture) => {
          texture.gammaSpace = false;
          texture.level = (map.intensity ?? 1) / Math.PI;
          babylonMaterial.lightmapTexture = texture;
          babylonMaterial.useLightmapAsShadowmap = true;
          babylonMaterial.unlit = true;
        }));
    } }));
}
