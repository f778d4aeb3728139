// node schema.mjs FOLDER FILE.glb...: the KILN_lightmap and KILN_probes objects of each file against the schemas in FOLDER. Exit
// status 1 if one does not fit.
import { readFileSync } from 'node:fs';
import { join } from 'node:path';
import Ajv2020 from 'ajv/dist/2020.js';

const [folder, ...files] = process.argv.slice(2);
const ajv = new Ajv2020({ allErrors: true, strict: true });
const load = (name) => ajv.compile(JSON.parse(readFileSync(join(folder, name), 'utf8')));
const schemas = Object.fromEntries(['KILN_lightmap', 'KILN_probes'].map((name) =>
  [name, Object.fromEntries(['glTF', 'node', ...(name === 'KILN_lightmap' ? ['primitive'] : [])].map((place) =>
    [place, load(`${place}.${name}.schema.json`)]))]));
let bad = false;
for (const file of files) {
  const bytes = readFileSync(file), json = JSON.parse(bytes.subarray(20, 20 + bytes.readUInt32LE(12)).toString());
  const count = { KILN_lightmap: 0, KILN_probes: 0 };
  const check = (place, object, where) => {
    for (const name of Object.keys(count)) {
      const found = object?.extensions?.[name], validate = schemas[name][place];
      if (found === undefined) continue;
      ++count[name];
      if (validate?.(found)) continue;
      bad = true;
      console.log(`${file} ${where}: ${name}: ${validate ? ajv.errorsText(validate.errors) : 'does not belong here'}`);
    }
  };
  check('glTF', json, '/');
  (json.nodes ?? []).forEach((n, i) => check('node', n, `/nodes/${i}`));
  (json.meshes ?? []).forEach((m, i) => m.primitives.forEach((p, k) => check('primitive', p, `/meshes/${i}/primitives/${k}`)));
  console.log(`${file}: ${count.KILN_lightmap} objects, ${count.KILN_probes} of probes`);
}
process.exit(bad ? 1 : 0);
