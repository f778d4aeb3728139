// MOZ_lightmap for three's GLTFLoader, which does not read it by itself:
//   new GLTFLoader().register((parser) => new MozLightmap(parser))
// A light map of three.js is irradiance: E = texel x intensity (docs/gltf.md). The loader's own MeshStandardMaterial
// takes what the surface reflects like a mirror off the diffuse light, to be given back by reflections. Where there are
// none, pass THREE.MeshLambertMaterial: it shows base colour / pi x E, also of metal, like preview.png.
export class MozLightmap {
  constructor(parser, Material = null) {
    this.parser = parser;
    this.name = 'MOZ_lightmap';
    this.Material = Material;
  }

  lightmap(index) {
    return this.parser.json.materials[index].extensions?.[this.name];
  }

  getMaterialType(index) {
    return this.lightmap(index) ? this.Material : null;
  }

  async extendMaterialParams(index, parameters) {
    const map = this.lightmap(index);
    if (!map) return;
    await this.parser.assignTexture(parameters, 'lightMap', map);  // linear
    parameters.lightMapIntensity = map.intensity ?? 1;
    if (this.Material) for (const key of ['metalness', 'roughness']) delete parameters[key];
  }
}
