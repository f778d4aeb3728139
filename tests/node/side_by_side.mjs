// node side_by_side.mjs build/one_scene OUT.jpg: the pictures that the test OneScene left there beside each other, each
// with its program, version and mean difference from Kiln's own.
import { readFileSync, writeFileSync } from 'node:fs';
import { join } from 'node:path';
import { chromium } from 'playwright-core';

const [folder, out] = process.argv.slice(2);
const shown = JSON.parse(readFileSync(join(folder, 'shown.json'), 'utf8'));
const escaped = (text) => text.replace(/[&<"]/g, (c) => `&#${c.charCodeAt(0)};`);
const figure = (name, caption) => {
  const image = readFileSync(join(folder, `${name}.png`)).toString('base64');
  return `<figure><img src="data:image/png;base64,${image}"><figcaption>${caption}</figcaption></figure>`;
};
const figures = shown.map(({ name, version, mean }) =>
  figure(name, `<b>${escaped(name)}</b> ${escaped(version)}<span>${mean.toFixed(2)} / 255</span>`));

const browser = await chromium.launch({ executablePath: '/usr/bin/chromium', args: ['--no-sandbox'] });
try {
  const page = await browser.newPage({ viewport: { width: 1480, height: 100 } });
  await page.setContent(`<!doctype html><style>
    body { margin: 0; padding: 8px; background: #fff; font: 18px sans-serif; display: grid; gap: 8px; grid-template-columns: repeat(4, 1fr) }
    figure { margin: 0 } img { display: block; width: 100% } figcaption { padding: 3px 2px } span { float: right }
    p { margin: 0; padding: 0 8px; align-self: center; color: #444; line-height: 1.5 }
  </style>${figure('Kiln', '<b>Kiln</b>, the renderer of preview.png')}${figures.join('')}
  <p>One scene, baked once: sun, lamp, normal map, holes of alpha, instances. The number is the mean difference from
  Kiln's picture.</p>`);
  writeFileSync(out, await page.screenshot({ fullPage: true, type: 'jpeg', quality: 82 }));
} finally {
  await browser.close();
}
