// Our texture encoders beside those that npm's packages ship, on the same maps of a bake:
//   npm ci --prefix tests/compare
//   node tests/compare/encoders.mjs build OUT/sh_l1.exr
// OUT is the folder of a bake. Prints the tables of docs/encoding.md. Exits with 77 where node's packages are
// missing. Every encoder is held to one core. Encoders: bc7e and rgbcx as bc7enc_rdo has them (the package
// @gpu-tex-enc/bc ships the program), and Basis Universal in WebAssembly (ktx2-encoder), whose UASTC blocks are
// transcoded to BC7 and BC6H.
import { execFileSync } from "node:child_process";
import { existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from "node:fs";
import { tmpdir } from "node:os";
import { dirname, join } from "node:path";
import { fileURLToPath, pathToFileURL } from "node:url";

const here = dirname(fileURLToPath(import.meta.url));
const modules = join(here, "node_modules");
const bc7enc = join(modules, "@gpu-tex-enc/bc/bin/linux/bc7enc");
const basisFile = join(modules, "ktx2-encoder/dist/basis/basis_encoder.js");
const [build, bake] = process.argv.slice(2);
if (!build || !bake) {
  console.error("usage: encoders.mjs BUILD BAKE.exr");
  process.exit(2);
}
if (!existsSync(bc7enc) || !existsSync(basisFile)) {
  console.error("skipped: the encoders are not installed: npm ci --prefix tests/compare");
  process.exit(77);
}
const table = join(build, "bin/encoder_table");
const folder = mkdtempSync(join(tmpdir(), "kiln-encoders-"));
const run = (program, ...args) => execFileSync("taskset", ["-c", "0", program, ...args], { encoding: "utf8" });
const measure = (map, file, name, seconds) =>
  process.stdout.write(run(table, "measure", map, file, name, String(seconds)));
const head = (error) => console.log(`| format | encoder | megatexels/s | ${error} |\n|---|---|---|---|`);

function outside(map, name, ...options) {
  const file = join(folder, "x.dds");
  const said = run(bc7enc, "-g", ...options, map, file);
  measure(map, file, name, Number(/Total encoding time: ([\d.]+)/.exec(said)[1]));
}

// A KTX2 file of one level, uncompressed; the reader of encoder_table wants no more than this of its descriptor.
function ktx2(vkFormat, width, height, blocks) {
  const file = Buffer.alloc(80 + 24 + 44 + (16 - ((80 + 24 + 44) % 16)) + blocks.length);
  const at = file.length - blocks.length;
  Buffer.from([0xab, 0x4b, 0x54, 0x58, 0x20, 0x32, 0x30, 0xbb, 0x0d, 0x0a, 0x1a, 0x0a]).copy(file);
  [vkFormat, 1, width, height, 0, 0, 1, 1, 0, 104, 44].forEach((v, i) => file.writeUInt32LE(v, 12 + 4 * i));
  [at, blocks.length, blocks.length].forEach((v, i) => file.writeBigUInt64LE(BigInt(v), 80 + 8 * i));
  file[104 + 14] = 1; // linear
  Buffer.from(blocks).copy(file, at);
  return file;
}

async function basisRows(map, width, height, hdr) {
  const basis = await (await import(pathToFileURL(basisFile))).default({ print: () => {} });
  basis.initializeBasis();
  for (const level of hdr ? [0, 1, 3] : [0, 2, 3]) {
    const encoder = new basis.BasisEncoder();
    if (hdr) {
      encoder.setSliceSourceImageHDR(0, new Uint8Array(readFileSync(map)), 0, 0, 3, true);
      encoder.setHDR(true);
      encoder.setUASTCHDRQualityLevel?.(level);
    } else {
      encoder.setSliceSourceImage(0, new Uint8Array(readFileSync(join(folder, "ratio.rgba"))), width, height, 0);
      encoder.setUASTC(true);
      encoder.setPackUASTCFlags?.(level);
    }
    encoder.setCreateKTX2File(true);
    encoder.setKTX2UASTCSupercompression(false);
    encoder.setPerceptual(false);
    encoder.setMipGen(false);
    encoder.setKTX2SRGBTransferFunc?.(false);
    const out = new Uint8Array(width * height * 4 + (1 << 20));
    const start = process.hrtime.bigint();
    const size = encoder.encode(out);
    const seconds = Number(process.hrtime.bigint() - start) / 1e9;
    encoder.delete();
    const file = new basis.KTX2File(out.slice(0, size));
    if (!file.isValid() || !file.startTranscoding()) throw new Error("Basis Universal made no file");
    const target = hdr ? 22 : 6; // cTFBC6H, cTFBC7_RGBA
    const blocks = new Uint8Array(file.getImageTranscodedSizeInBytes(0, 0, 0, target));
    if (!file.transcodeImage(blocks, 0, 0, 0, target, 0, -1, -1)) throw new Error("Basis Universal did not transcode");
    file.close();
    const path = join(folder, "x.ktx2");
    writeFileSync(path, ktx2(hdr ? 143 : 145, width, height, blocks));
    measure(map, path, `Basis Universal ${hdr ? "UASTC HDR" : "UASTC"}, level ${level}`, seconds);
  }
}

try {
  const [width, height] = run(table, "maps", bake, folder).trim().split(" ").map(Number);
  const ratio = join(folder, "ratio.png"), light = join(folder, "light.exr");
  console.log(`${width} x ${height} texels of ${bake}: L1x/L0`);
  head("PSNR");
  process.stdout.write(run(table, "ours", ratio));
  for (const level of [0, 1, 4, 6]) outside(ratio, `bc7e, level ${level}`, `-u${level}`);
  // -b, -c: blocks of four colours alone; -r: colours rounded as our decoder does.
  for (const level of [0, 8, 18]) outside(ratio, `rgbcx, level ${level}`, "-1", "-b", "-c", "-r", `-L${level}`);
  await basisRows(ratio, width, height, false);
  console.log("The same texels of L0");
  head("relative mean square");
  process.stdout.write(run(table, "ours", light));
  await basisRows(light, width, height, true);
} finally {
  rmSync(folder, { recursive: true });
}
