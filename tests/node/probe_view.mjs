// node probe_view.mjs URL WIDTH HEIGHT FOLDER STEP...: uses the viewer as a person does. Steps, in order:
//   shot:NAME      FOLDER/NAME.png, the canvas
//   key:K          presses a key
//   drag:X,Y,X,Y   with the mouse, from a pixel to another
// Prints, a line each: "fetched" with files of probes and code for them, and after every step "STEP | probes | ball"
// from the page. Status 1 if the page logs an error.
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { chromium } from 'playwright-core';

const [url, width, height, folder, ...steps] = process.argv.slice(2);
const profile = mkdtempSync(join(tmpdir(), 'kiln-chromium-'));
const context = await chromium.launchPersistentContext(profile, { executablePath: '/usr/bin/chromium', headless: true,
  viewport: { width: +width, height: +height }, deviceScaleFactor: 1,
  args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
         '--disable-background-networking', '--disable-component-update', '--disable-sync'] });
let failed = false;
const fetched = [];
try {
  const page = context.pages()[0] ?? await context.newPage();
  page.setDefaultTimeout(240000);
  page.on('console', (message) => { if (message.type() === 'error') { console.error(message.text()); failed = true; } });
  page.on('pageerror', (error) => { console.error(error.message); failed = true; });
  page.on('request', (request) => { if (/probes?[._]/.test(request.url())) fetched.push(new URL(request.url()).pathname.split('/').pop()); });
  await page.goto(url);
  await page.waitForSelector('html[data-ready], html[data-error]', { state: 'attached' });
  failed ||= await page.evaluate(() => 'error' in document.documentElement.dataset);
  const settle = async () => {
    await page.waitForFunction(() => document.documentElement.dataset.probes !== 'loading');
    await page.evaluate(() => new Promise((done) => requestAnimationFrame(() => requestAnimationFrame(done))));
  };
  console.log(`panel ${await page.evaluate(() => !document.getElementById('probes').classList.contains('hidden'))}`);
  for (const step of steps) {
    await settle();
    const [what, value] = step.split(':');
    if (what === 'shot') await page.screenshot({ path: join(folder, `${value}.png`) });
    if (what === 'key') await page.keyboard.press(value);
    if (what === 'drag') {
      const [x0, y0, x1, y1] = value.split(',').map(Number);
      await page.mouse.move(x0, y0);
      await page.mouse.down();
      await page.mouse.move((x0 + x1) / 2, (y0 + y1) / 2);
      await page.mouse.move(x1, y1);
      await page.mouse.up();
    }
    await settle();
    const { probes, ball } = await page.evaluate(() => ({ ...document.documentElement.dataset }));
    console.log(`${step} | ${probes} | ${ball}`);
  }
  console.log(`fetched ${[...new Set(fetched)].sort().join(' ')}`);
} finally {
  await context.close();
  rmSync(profile, { recursive: true, force: true });
}
process.exit(failed ? 1 : 0);
