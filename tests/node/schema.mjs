// node schema.mjs FOLDER FILE.glb...: the KILN_lightmap objects of each file against the schemas in FOLDER. Exit
// status 1 if one does not fit.
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import Ajv2020 from 'ajv/dist/2020.js';

const [folder, ...files] = process.argv.slice(2);
const ajv = new Ajv2020({ allErrors: true, strict: true });
const load = (name) => ajv.compile(JSON.parse(readFileSync(join(folder, name), 'utf8')));
const root = load('glTF.KILN_lightmap.schema.json'), node = load('node.KILN_lightmap.schema.json'),
      primitive = load('primitive.KILN_lightmap.schema.json');
let bad = false;
for (const file of files) {
  const bytes = readFileSync(file), json = JSON.parse(bytes.subarray(20, 20 + bytes.readUInt32LE(12)).toString());
  let count = 0;
  const check = (validate, object, where) => {
    const found = object?.extensions?.KILN_lightmap;
    if (found === undefined) return;
    ++count;
    if (validate(found)) return;
    bad = true;
    console.log(`${file} ${where}: ${ajv.errorsText(validate.errors)}`);
  };
  check(root, json, '/');
  (json.nodes ?? []).forEach((n, i) => check(node, n, `/nodes/${i}`));
  (json.meshes ?? []).forEach((m, i) => m.primitives.forEach((p, k) => check(primitive, p, `/meshes/${i}/primitives/${k}`)));
  console.log(`${file}: ${count} objects`);
}
process.exit(bad ? 1 : 0);
