// MOZ_lightmap for three's GLTFLoader, which does not read it by itself:
//   new GLTFLoader().register((parser) => new MozLightmap(parser))
// A light map of three.js is irradiance: E = texel x intensity (docs/gltf.md).
export class MozLightmap {
  constructor(parser) {
    this.parser = parser;
    this.name = 'MOZ_lightmap';
  }

  async extendMaterialParams(index, parameters) {
    const map = this.parser.json.materials[index].extensions?.[this.name];
    if (!map) return;
    await this.parser.assignTexture(parameters, 'lightMap', map);  // linear
    parameters.lightMapIntensity = map.intensity ?? 1;
  }
}
