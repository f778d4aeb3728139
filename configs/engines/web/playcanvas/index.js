// The light of a scene.glb that Kiln baked, in PlayCanvas:
//   const asset = await loadLitScene(pc, app, 'out/scene.glb');
//   app.root.addChild(asset.resource.instantiateRenderEntity());
// PlayCanvas multiplies a light map by the base colour, so it is E/pi; 8-bit maps without a code are taken for sRGB, so it
// is in RGBM. If the file was baked with configs/engines/playcanvas.json, the textures beside it are used, which
// KILN_lightmap names; else MOZ_lightmap's linear images are coded here.
const KILN = 'KILN_lightmap', MOZ = 'MOZ_lightmap', RANGE = 8;

const load = (app, asset) => new Promise((resolve, reject) => {
  asset.once('load', resolve);
  asset.once('error', (error) => reject(new Error(error)));
  app.assets.add(asset);
  app.assets.load(asset);
});

// By index of a material the page of the lightmap that its primitives read.
export function materialPages(gltf) {
  const pages = new Map();
  for (const { primitives } of gltf.meshes ?? [])
    for (const { material, extensions } of primitives)
      if (material !== undefined && extensions?.[KILN]?.page !== undefined) pages.set(material, extensions[KILN].page);
  return pages;
}

// Linear 8-bit RGBA of E / intensity as PlayCanvas' RGBM of E/pi, (8 a rgb)^2; in place.
export function encodeRgbm(pixels, intensity) {
  for (let i = 0; i < pixels.length; i += 4) {
    const root = [0, 1, 2].map((c) => Math.sqrt(pixels[i + c] / 255 * intensity / Math.PI));
    const most = Math.min(1, Math.max(1 / 255, Math.max(...root) / RANGE));
    pixels[i + 3] = Math.ceil(most * 255);
    for (let c = 0; c < 3; ++c) pixels[i + c] = Math.min(255, Math.round(root[c] / (RANGE * pixels[i + 3] / 255) * 255));
  }
  return pixels;
}

// The pixels of a texture's image; a float canvas would be no finer than its eight bits.
function pixelsOf(texture) {
  const source = texture.getSource(), canvas = document.createElement('canvas');
  canvas.width = texture.width;
  canvas.height = texture.height;
  const context = canvas.getContext('2d', { willReadFrequently: true });
  context.drawImage(source, 0, 0);
  return context.getImageData(0, 0, canvas.width, canvas.height).data;
}

async function preset(pc, app, folder, file) {
  const asset = new pc.Asset(file.uri, 'texture', { url: folder + file.uri },
    { type: pc.TEXTURETYPE_RGBM, mipmaps: false, addressu: 'clamp', addressv: 'clamp' });
  await load(app, asset);
  return asset.resource;
}

function converted(pc, app, texture, intensity) {
  const data = new Uint8Array(encodeRgbm(pixelsOf(texture), intensity).buffer);
  return new pc.Texture(app.graphicsDevice, { name: `${texture.name} rgbm`, width: texture.width, height: texture.height,
    format: pc.PIXELFORMAT_RGBA8, type: pc.TEXTURETYPE_RGBM, mipmaps: false, addressU: pc.ADDRESS_CLAMP_TO_EDGE,
    addressV: pc.ADDRESS_CLAMP_TO_EDGE, levels: [data] });
}

// The container asset, its materials lit. `textures: false`: MOZ_lightmap in any case.
export async function loadLitScene(pc, app, url, { textures = true } = {}) {
  let gltf;
  const lit = [];  // materials in use
  const asset = new pc.Asset(url, 'container', { url }, null, {
    global: { preprocess: (json) => { gltf = json; } },
    material: { postprocess: (source, material) => {
      const map = source.extensions?.[MOZ];
      if (map) lit.push({ material, map, index: gltf.materials.indexOf(source) });
    } } });
  await load(app, asset);
  const folder = url.slice(0, url.lastIndexOf('/') + 1), pages = materialPages(gltf), made = new Map();
  const files = gltf.extensions?.[KILN]?.lightmaps?.[0]?.encodings.find((e) => e.name === 'rgbm')?.textures ?? [];
  for (const { material, map, index } of lit) {
    // E/pi alone fits what PlayCanvas multiplies: the preset's unit.
    const file = textures && files.find((t) => t.page === pages.get(index) && t.channels[0].plane === 'E.R' &&
      Math.abs(t.channels[0].scale / Math.PI - 1) < 1e-3);
    const key = file ? file.uri : map.index;
    if (!made.has(key))
      made.set(key, file ? await preset(pc, app, folder, file)
                         : converted(pc, app, asset.resource.textures[map.index].resource, map.intensity ?? 1));
    material.lightMap = made.get(key);
    material.lightMapUv = 1;
    material.update();
  }
  return asset;
}
