// The light of a scene.glb that Kiln baked, for three's GLTFLoader:
//   const loader = new GLTFLoader().register((parser) => new KilnLightmap(parser, { exr: new EXRLoader() }));
// A light map of three.js is irradiance E, divided by pi in the shader. With `exr`, E comes from the float masters beside the
// file, which KILN_lightmap names; without, or where they cannot be read, from MOZ_lightmap's 8-bit images in it. A
// MeshStandardMaterial takes what the surface reflects like a mirror off the diffuse light, to be given back by
// reflections; where there are none, pass `material: THREE.MeshLambertMaterial`, which shows base colour / pi x E.
const KILN = 'KILN_lightmap', MOZ = 'MOZ_lightmap';

// By index of a material the page of the lightmap that its primitives read.
export function materialPages(gltf) {
  const pages = new Map();
  for (const { primitives } of gltf.meshes ?? [])
    for (const { material, extensions } of primitives)
      if (material !== undefined && extensions?.[KILN]?.page !== undefined) pages.set(material, extensions[KILN].page);
  return pages;
}

export class KilnLightmap {
  constructor(parser, { material = null, exr = null } = {}) {
    this.name = MOZ;
    this.parser = parser;
    this.material = material;
    this.exr = exr;
    this.masters = new Map();  // promises of textures by page
  }

  get description() {
    return this.parser.json.extensions?.[KILN]?.lightmaps?.[0];
  }

  moz(index) {
    return this.parser.json.materials[index].extensions?.[MOZ];
  }

  getMaterialType(index) {
    return this.moz(index) ? this.material : null;
  }

  async extendMaterialParams(index, parameters) {
    const map = this.moz(index);
    if (!map) return;
    if (this.material) for (const key of ['metalness', 'roughness']) delete parameters[key];
    const master = this.exr && await this.master(this.pages().get(index));
    if (master) {
      parameters.lightMap = master;
      return;
    }
    await this.parser.assignTexture(parameters, 'lightMap', map);  // linear, by TEXCOORD_1
    parameters.lightMapIntensity = map.intensity ?? 1;
  }

  pages() {
    return this.found ??= materialPages(this.parser.json);
  }

  // The float master of a page, or null.
  master(page) {
    const file = this.description?.encodings.find(({ name }) => name === 'masters')?.textures
      .find((t) => t.page === page && t.channels[0].plane === 'E.R');
    if (!file) return null;
    if (!this.masters.has(page)) this.masters.set(page, this.load(file.uri));
    return this.masters.get(page);
  }

  async load(uri) {
    try {
      const texture = await this.exr.loadAsync(this.parser.options.path + uri);
      texture.channel = 1;
      texture.generateMipmaps = false;
      texture.minFilter = texture.magFilter = 1006;  // THREE.LinearFilter
      if (!texture.flipY) {  // its rows begin at the bottom, glTF's v at the top
        texture.repeat.y = -1;
        texture.offset.y = 1;
      }
      return texture;
    } catch (error) {
      console.warn(`${uri}: ${error.message ?? error}; the light is MOZ_lightmap's, in 8 bits`);
      return null;
    }
  }
}
