import type { AppBase, Asset } from 'playcanvas';

/** By index of a material the page of the lightmap that its primitives read. */
export function materialPages(gltf: object): Map<number, number>;

/** Linear 8-bit RGBA of E / intensity as PlayCanvas' RGBM of E/pi, in place. */
export function encodeRgbm<T extends Uint8Array | Uint8ClampedArray>(pixels: T, intensity: number): T;

/**
 * Loads a scene.glb of Kiln; the container asset's materials are lit.
 * @param pc the module playcanvas
 */
export function loadLitScene(pc: any, app: AppBase, url: string, options?: { textures?: boolean }): Promise<Asset>;
