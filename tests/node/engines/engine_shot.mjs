// node engine_shot.mjs ENGINE FOLDER FILE.glb WIDTH HEIGHT OUT.png [EXPOSURE [MATERIAL]]: what ENGINE (three, babylon,
// playcanvas), as npm has it, shows of a baked scene from the file's first camera, in headless Chromium. EXPOSURE:
// of scene.glb, loaded with configs/engines/web; scene_unlit.glb has its own. MATERIAL: "moz" for the light of the images in
// the file, not of the textures beside it; "standard" for three's own material.
import { readFileSync, mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { dirname, extname, join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { createRequire } from 'node:module';

const here = dirname(fileURLToPath(import.meta.url)), root = join(here, '../../..');
const { chromium } = createRequire(join(here, '../package.json'))('playwright-core');
const [engine, folder, file, width, height, out, exposure = '', material = ''] = process.argv.slice(2);
const HOST = 'http://kiln.test';
const SERVED = { '/bake/': folder, '/modules/': join(here, 'node_modules'), '/engines/': here, '/web/': join(root, 'configs/engines/web') };
const TYPES = { '.html': 'text/html', '.js': 'text/javascript', '.mjs': 'text/javascript', '.glb': 'model/gltf-binary' };

function answer(route) {
  const { pathname } = new URL(route.request().url());
  const [prefix, from] = Object.entries(SERVED).find(([p]) => pathname.startsWith(p)) ?? [];
  try {
    const body = readFileSync(join(from, pathname.slice(prefix.length)));
    return route.fulfill({ body, contentType: TYPES[extname(pathname)] ?? 'application/octet-stream' });
  } catch {
    return route.fulfill({ status: 404, body: pathname });
  }
}

const profile = mkdtempSync(join(tmpdir(), 'kiln-engines-'));
const context = await chromium.launchPersistentContext(profile, {
  executablePath: '/usr/bin/chromium', headless: true, viewport: { width: +width, height: +height }, deviceScaleFactor: 1,
  args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
         '--disable-background-networking', '--disable-component-update', '--disable-sync'] });
let failed = false;
try {
  const page = context.pages()[0] ?? await context.newPage();
  page.on('console', (message) => { if (message.type() === 'error') console.error(message.text()); });
  page.on('pageerror', (error) => { console.error(error.message); failed = true; });
  await page.route(`${HOST}/**`, answer);
  await page.goto(`${HOST}/engines/${engine}.html?file=${file}&exposure=${exposure}&material=${material}`);
  await page.waitForSelector('html[data-ready]', { state: 'attached', timeout: 120000 });
  await page.waitForTimeout(300);
  await page.screenshot({ path: out });
} catch (error) {
  console.error(error.message);
  failed = true;
} finally {
  await context.close();
  rmSync(profile, { recursive: true, force: true });
}
process.exit(failed ? 1 : 0);
