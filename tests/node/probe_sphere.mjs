// node probe_sphere.mjs FOLDER: a sphere that moves through a bake's probes, in three.js with
// docs/examples/three/kiln_probes.js. FOLDER has the probes' files and scene.json: {width, height (pixels), wide, high
// (metres, seen from +z), radius, colour, places: [[x, y, z]], corners: [x, y, z, ...] of the scene's triangles}. Writes
// FOLDER/pixels: RGBA, the lowest row first, of all places in one picture.
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { fileURLToPath } from 'node:url';
import { chromium } from 'playwright-core';

const folder = process.argv[2], HOST = 'http://kiln.test';
const viewer = fileURLToPath(new URL('../../docs/examples/three/', import.meta.url));
const PAGE = `<!doctype html><script type="importmap">
{"imports": {"three": "${HOST}/viewer/node_modules/three/build/three.module.js"}}</script>
<script type="module">
import * as THREE from 'three';
import { KilnProbes } from '${HOST}/viewer/kiln_probes.js';
window.show = async () => {
  const s = await (await fetch('${HOST}/bake/scene.json')).json();
  const probes = await KilnProbes.load('${HOST}/bake/');
  const renderer = new THREE.WebGLRenderer({ antialias: false, preserveDrawingBuffer: true });
  renderer.setPixelRatio(1);
  renderer.setSize(s.width, s.height);
  renderer.autoClear = false;
  const camera = new THREE.OrthographicCamera(0, s.wide, s.high, 0, 0.1, 100);
  camera.position.z = 50;
  const room = new THREE.BufferGeometry();
  room.setAttribute('position', new THREE.Float32BufferAttribute(s.corners, 3));
  const lines = new THREE.Scene();
  lines.add(new THREE.Mesh(room, new THREE.MeshBasicMaterial({ color: 0x404040, wireframe: true })));
  renderer.clear();
  renderer.render(lines, camera);
  renderer.clearDepth();
  const scene = new THREE.Scene(), lamp = new THREE.LightProbe();
  const material = new THREE.MeshLambertMaterial();
  material.color.setRGB(s.colour, s.colour, s.colour, THREE.LinearSRGBColorSpace);
  const ball = new THREE.Mesh(new THREE.SphereGeometry(s.radius, 256, 128), material);
  scene.add(lamp, ball);
  for (const place of s.places) {
    ball.position.set(...place);
    probes.update(lamp, ball.position);
    renderer.render(scene, camera);
  }
  const gl = renderer.getContext(), pixels = new Uint8Array(4 * s.width * s.height);
  gl.readPixels(0, 0, s.width, s.height, gl.RGBA, gl.UNSIGNED_BYTE, pixels);
  let text = '';
  for (const byte of pixels) text += String.fromCharCode(byte);
  return btoa(text);
};
</script>`;

function answer(route) {
  const path = new URL(route.request().url()).pathname;
  if (path === '/') return route.fulfill({ contentType: 'text/html', body: PAGE });
  const file = path.startsWith('/viewer/') ? join(viewer, path.slice(8)) : join(folder, path.replace('/bake/', ''));
  return route.fulfill({ contentType: file.endsWith('.js') ? 'text/javascript' : 'application/octet-stream', body: readFileSync(file) });
}

const profile = mkdtempSync(join(tmpdir(), 'kiln-chromium-'));
const context = await chromium.launchPersistentContext(profile, { executablePath: '/usr/bin/chromium', headless: true,
  args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
         '--disable-background-networking', '--disable-component-update', '--disable-sync'] });
let failed = false;
try {
  const page = context.pages()[0] ?? await context.newPage();
  page.on('console', (message) => { if (message.type() === 'error') console.error(message.text()); });
  page.on('pageerror', (error) => { console.error(error.message); failed = true; });
  await page.route(`${HOST}/**`, answer);
  await page.goto(HOST);
  await page.waitForFunction(() => window.show, null, { timeout: 60000 });
  writeFileSync(join(folder, 'pixels'), Buffer.from(await page.evaluate(() => window.show()), 'base64'));
} finally {
  await context.close();
  rmSync(profile, { recursive: true, force: true });
}
process.exit(failed ? 1 : 0);
