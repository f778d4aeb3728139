// node screenshot.mjs URL WIDTH HEIGHT FILE.png [CHROMIUM]: the viewer's canvas once it says that it is ready. What
// the page logs as an error ends it with status 1.
import { mkdtempSync, rmSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { chromium } from 'playwright-core';

const [url, width, height, file, program = '/usr/bin/chromium'] = process.argv.slice(2);
const profile = mkdtempSync(join(tmpdir(), 'kiln-chromium-'));
const context = await chromium.launchPersistentContext(profile, {
  executablePath: program, headless: true, viewport: { width: +width, height: +height }, deviceScaleFactor: 1,
  args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
         '--disable-background-networking', '--disable-component-update', '--disable-sync'] });
let failed = false;
try {
  const page = context.pages()[0] ?? await context.newPage();
  page.on('console', (message) => {
    if (message.type() !== 'error') return;
    console.error(message.text());
    failed = true;
  });
  page.on('pageerror', (error) => { console.error(error.message); failed = true; });
  await page.goto(url);
  await page.waitForSelector('html[data-ready], html[data-error]', { state: 'attached', timeout: 120000 });
  failed ||= await page.evaluate(() => 'error' in document.documentElement.dataset);
  await page.waitForTimeout(300);
  await page.screenshot({ path: file });
} finally {
  await context.close();
  rmSync(profile, { recursive: true, force: true });
}
process.exit(failed ? 1 : 0);
