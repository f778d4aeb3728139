/** By index of a material the page of the lightmap that its primitives read. */
export function materialPages(gltf: object): Map<number, number>;

/** The texture of E in RGBD for a page, as KILN_lightmap describes it. */
export function rgbdOf(gltf: object, page: number): { uri: string; channels: { plane: string; scale?: number }[] } | undefined;

/**
 * Registers the reader with the glTF loader, before a file is loaded.
 * `rgbd`: light from the RGBD textures beside the file, where KILN_lightmap names some.
 * @param BABYLON the global of babylonjs with its loaders, or an object with `GLTF2` and `Texture`
 */
export function registerKilnLightmap(BABYLON: any, options?: { rgbd?: boolean }): void;
