// The light of a scene.glb baked with configs/engines/playcanvas.json (textures of E/pi in RGBM) in PlayCanvas:
//   const asset = await loadLitScene(pc, app, 'out/scene.glb');
//   app.root.addChild(asset.resource.instantiateRenderEntity());
// MOZ_lightmap would not do: PlayCanvas takes 8-bit light maps without a code for sRGB.
const load = (app, asset) => new Promise((resolve, reject) => {
  asset.once('load', resolve);
  asset.once('error', reject);
  app.assets.add(asset);
  app.assets.load(asset);
});

export async function loadLitScene(pc, app, url) {
  let description;
  const lit = [];  // materials; one of several pages has a copy for each, which MOZ_lightmap's image tells apart
  const asset = new pc.Asset(url, 'container', { url }, null, {
    global: { preprocess: (gltf) => { description = gltf.extensions.KILN_lightmap.lightmaps[0]; } },
    material: { postprocess: (source, material) => {
      const map = source.extensions?.MOZ_lightmap;
      if (map) lit.push({ material, image: map.index });
    } } });
  await load(app, asset);
  const rgbm = description.encodings.find((e) => e.name === 'rgbm').textures.filter((t) => t.channels[0].plane === 'E.R');
  const images = [...new Set(lit.map(({ image }) => image))].sort((a, b) => a - b);  // by page
  const folder = url.slice(0, url.lastIndexOf('/') + 1);
  for (const [page, image] of images.entries()) {
    const file = rgbm.find((t) => t.page === page).uri;
    const texture = new pc.Asset(file, 'texture', { url: folder + file }, { type: pc.TEXTURETYPE_RGBM, mipmaps: false,
      addressu: 'clamp', addressv: 'clamp' });
    await load(app, texture);
    for (const { material } of lit.filter((l) => l.image === image)) {
      material.lightMap = texture.resource;
      material.lightMapUv = 1;
      material.update();
    }
  }
  return asset;
}
