// node validate.mjs FILE...: what Khronos' validator says of each. Exit status 1 if it finds an error.
import { readFileSync } from 'node:fs';
import { createRequire } from 'node:module';

const validator = createRequire(import.meta.url)('gltf-validator');
let bad = false;
for (const file of process.argv.slice(2)) {
  const report = await validator.validateBytes(new Uint8Array(readFileSync(file)), { uri: file });
  const { numErrors, numWarnings, numInfos } = report.issues;
  console.log(`${file}: ${numErrors} errors, ${numWarnings} warnings, ${numInfos} notes`);
  for (const message of report.issues.messages.slice(0, 40))
    if (message.severity < 2) console.log(`  ${message.severity ? 'warning' : 'error'} ${message.code} ${message.pointer}: ${message.message}`);
  bad ||= numErrors > 0;
}
process.exit(bad ? 1 : 0);
