import type { Material, Texture } from 'three';

/** By index of a material the page of the lightmap that its primitives read. */
export function materialPages(gltf: object): Map<number, number>;

/** What lights a node beside its materials (MX_lightmap, EPIC_lightmap_textures); null: nothing. */
export function nodeLight(gltf: object, node: object): {
  texture: object, scale: number[], offset: number[], intensity: number, glsl: string } | null;

export interface KilnLightmapOptions {
  /** The class of lit materials in place of MeshStandardMaterial. */
  material?: (new (...parameters: any[]) => Material) | null;
  /** An EXRLoader: light from the float masters beside the file. */
  exr?: { loadAsync(url: string): Promise<Texture> } | null;
}

/** A plugin for GLTFLoader.register. */
export class KilnLightmap {
  constructor(parser: object, options?: KilnLightmapOptions);
  readonly name: string;
  /** What the file says of its lightmap: the first entry of KILN_lightmap. */
  readonly description: object | undefined;
}
