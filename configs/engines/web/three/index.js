// The light of a scene.glb that Kiln baked, for three's GLTFLoader:
//   const loader = new GLTFLoader().register((parser) => new KilnLightmap(parser, { exr: new EXRLoader() }));
// A light map of three.js is irradiance E, divided by pi in the shader. With `exr`, E comes from the float masters beside the
// file, which KILN_lightmap names; without, or where they cannot be read, from MOZ_lightmap's 8-bit images in it.
// Nodes whose materials have no MOZ_lightmap are lit by MX_lightmap (Third Room) or EPIC_lightmap_textures (Unreal's exporter). A
// MeshStandardMaterial takes what the surface reflects like a mirror off the diffuse light, to be given back by
// reflections; where there are none, pass `material: THREE.MeshLambertMaterial`, which shows base colour / pi x E.
const KILN = 'KILN_lightmap', MOZ = 'MOZ_lightmap', MX = 'MX_lightmap', EPIC = 'EPIC_lightmap_textures';

// By index of a material the page of the lightmap that its primitives read.
export function materialPages(gltf) {
  const pages = new Map();
  for (const { primitives } of gltf.meshes ?? [])
    for (const { material, extensions } of primitives)
      if (material !== undefined && extensions?.[KILN]?.page !== undefined) pages.set(material, extensions[KILN].page);
  return pages;
}

// What lights a node beside its materials: the texture, uv scale and offset, intensity and E of the texels by GLSL.
export function nodeLight(gltf, node) {
  const mx = node.extensions?.[MX], epic = gltf.extensions?.[EPIC]?.lightmaps?.[node.extensions?.[EPIC]?.lightmap];
  if (mx)
    return { texture: mx.lightMapTexture, scale: mx.scale ?? [1, 1], offset: mx.offset ?? [0, 0], intensity: mx.intensity ?? 1,
      glsl: 'vec4 t = texture2D(map, uv); return vec4(34.49 * pow(t.a, 2.2) * t.rgb, 1.0);' };
  if (!epic) return null;
  // Two halves on top of each other: colour and a logarithm of 16 bits; Unreal's unit is E / pi.
  const vec = (v) => `vec4(${v.map((x) => Number(x).toExponential(9)).join(', ')})`, [sx, sy, ox, oy] = epic.coordinateScaleBias;
  return { texture: epic.texture, scale: [sx, sy], offset: [ox, oy], intensity: 1, glsl: `
    vec4 a = texture2D(map, vec2(uv.x, 0.5 * uv.y)), b = texture2D(map, vec2(uv.x, 0.5 * uv.y + 0.5));
    vec4 v = vec4(a.rgb * a.rgb, a.a + (b.a - 0.5) / 255.0) * ${vec(epic.lightmapScale)} + ${vec(epic.lightmapAdd)};
    return vec4(1.884955592 * (exp2(v.a) - 0.01858136) * max(vec3(0.0), v.rgb), 1.0);` };
}

// Lets a material decode its light map by `glsl`.
function decode(material, glsl) {
  material.onBeforeCompile = (shader) => {
    const chunk = (name) => `#include <${name}>`, swap = (to) => `\n#undef texture2D\n#define texture2D ${to}\n`;
    shader.fragmentShader = shader.fragmentShader
      .replace(chunk('lightmap_pars_fragment'), (x) => `${x}\nvec4 kilnLight(sampler2D map, vec2 uv) { ${glsl} }\n`)
      .replace(chunk('lights_fragment_maps'), (x) => swap('kilnLight') + x + swap('texture'));
  };
  material.customProgramCacheKey = () => glsl;
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
    return this.moz(index) || this.ofNodes().has(index) ? this.material : null;
  }

  // Materials of nodes with a light of their own.
  ofNodes() {
    const { json } = this.parser, used = ({ mesh }) => json.meshes[mesh].primitives.map(({ material }) => material);
    return this.lit ??= new Set((json.nodes ?? []).filter((n) => n.mesh !== undefined && nodeLight(json, n)).flatMap(used));
  }

  async extendMaterialParams(index, parameters) {
    const map = this.moz(index);
    if (!map && !this.ofNodes().has(index)) return;
    if (this.material) for (const key of ['metalness', 'roughness']) delete parameters[key];
    if (!map) return;
    const master = this.exr && await this.master(this.pages().get(index));
    if (master) {
      parameters.lightMap = master;
      return;
    }
    await this.parser.assignTexture(parameters, 'lightMap', map);  // linear, by TEXCOORD_1
    parameters.lightMapIntensity = map.intensity ?? 1;
  }

  // The lights of nodes: their materials are shared, so each of their meshes gets one of its own.
  async afterRoot({ scenes }) {
    const { json, associations } = this.parser, textures = new Map(), meshes = [];
    const visit = (object, node) => {
      node = associations.get(object)?.nodes ?? node;
      const { material } = object, of = associations.get(material)?.materials;
      if (object.isMesh && !material.isMeshBasicMaterial && node !== undefined && !(of !== undefined && this.moz(of))) meshes.push([object, json.nodes[node]]);
      for (const child of object.children) visit(child, node);
    };
    for (const scene of scenes) visit(scene, undefined);
    for (const [object, node] of meshes) {
      const light = nodeLight(json, node);
      if (!light) continue;
      const key = JSON.stringify(light);
      if (!textures.has(key)) {
        const parameters = {};
        await this.parser.assignTexture(parameters, 'map', light.texture);
        const texture = parameters.map.clone();
        texture.channel = light.texture.texCoord ?? 1;
        texture.repeat.set(...light.scale);
        texture.offset.set(...light.offset);
        texture.generateMipmaps = false;
        texture.minFilter = 1006;  // THREE.LinearFilter
        textures.set(key, texture);
      }
      object.material = object.material.clone();
      object.material.lightMap = textures.get(key);
      object.material.lightMapIntensity = light.intensity;
      decode(object.material, light.glsl);
    }
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
