// What npm's ktx-parse reads from a KTX2 file: node ktx_parse.mjs FILE. For tests/container.
import { readFileSync } from "node:fs";
import { read } from "ktx-parse";

const file = read(readFileSync(process.argv[2]));
const descriptor = file.dataFormatDescriptor[0];
console.log(
  `format ${file.vkFormat} size ${file.pixelWidth} ${file.pixelHeight} layers ${file.layerCount} ` +
    `levels ${file.levels.length} scheme ${file.supercompressionScheme} transfer ${descriptor.transferFunction}`,
);
for (const level of file.levels) console.log(`level ${level.uncompressedByteLength}`);
const text = (value) => (typeof value === "string" ? value : new TextDecoder().decode(value)).replace(/\0$/, "");
for (const [key, value] of Object.entries(file.keyValue)) console.log(`${key} ${text(value)}`);
