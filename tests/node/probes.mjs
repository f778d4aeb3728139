// node probes.mjs SHADER FOLDER: evaluates docs/shaders/kiln_probes.glsl in WebGL2. FOLDER/probes.txt: words
// "bricks N probes N records N levels N roots X Y Z low X Y Z spacing S visibility 0|1"; FOLDER/bricks: 72 u32 a
// brick; light: 40 floats a probe; distances: 18 x 18 x 2 floats a probe; records: position and normal, 0 behind each;
// bevy (if there is one): 3-D texture of floats RGBA, with its size, translation and scale in probes.txt. Writes
// FOLDER/out: E and weight of every record, then Bevy's E / pi.
import { existsSync, mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { chromium } from 'playwright-core';

const [shader, folder] = process.argv.slice(2);
const words = readFileSync(join(folder, 'probes.txt'), 'utf8').trim().split(/\s+/), facts = {};
for (let i = 0; i < words.length;) {
  const name = words[i++], values = [];
  while (i < words.length && !isNaN(Number(words[i]))) values.push(Number(words[i++]));
  facts[name] = values;
}
const base64 = (name) => readFileSync(join(folder, name)).toString('base64');
// The lookup of Bevy's crates/bevy_pbr/src/light_probe/irradiance_volume.wesl, restated.
const MAIN = `
uniform highp usampler2D bricks;
uniform highp sampler2D probes, distances, records;
uniform highp sampler3D voxels;
uniform uvec3 roots;
uniform uint levels;
uniform vec3 low, translation, scale;
uniform float spacing;
uniform bool visibility;
layout(location = 0) out vec4 o0;
layout(location = 1) out vec4 o1;
vec3 bevy(vec3 position, vec3 n) {
  vec3 all = vec3(textureSize(voxels, 0)), resolution = vec3(textureSize(voxels, 0) / ivec3(1, 2, 3));
  vec3 unit = (position - translation) / scale;
  vec3 uvw = clamp((unit + 0.5) * resolution, vec3(0.5), resolution - vec3(0.5)) / all;
  vec3 negative = mix(vec3(0.0), vec3(0.5), lessThan(n, vec3(0.0)));
  vec3 x = textureLod(voxels, uvw + vec3(0.0, negative.x, 0.0), 0.0).rgb;
  vec3 y = textureLod(voxels, uvw + vec3(0.0, negative.y, 1.0 / 3.0), 0.0).rgb;
  vec3 z = textureLod(voxels, uvw + vec3(0.0, negative.z, 2.0 / 3.0), 0.0).rgb;
  return x * n.x * n.x + y * n.y * n.y + z * n.z * n.z;
}
void main() {
  int row = int(gl_FragCoord.y), column = int(gl_FragCoord.x);
  vec3 position = texelFetch(records, ivec2(2 * column, row), 0).xyz;
  vec3 n = texelFetch(records, ivec2(2 * column + 1, row), 0).xyz;
  KilnProbeVolume v = KilnProbeVolume(low, spacing, roots, levels, 0u, visibility);
  o0 = kiln_probe_light(v, bricks, probes, distances, position, n, 0.1);
  o1 = vec4(bevy(position, n), 0.0);
}`;
const profile = mkdtempSync(join(tmpdir(), 'kiln-chromium-'));
const context = await chromium.launchPersistentContext(profile, { executablePath: '/usr/bin/chromium', headless: true,
  args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
         '--disable-background-networking', '--disable-component-update', '--disable-sync'] });
try {
  const page = context.pages()[0] ?? await context.newPage();
  const result = await page.evaluate(({ source, facts, files }) => {
    const bytes = (text) => Uint8Array.from(atob(text), (c) => c.charCodeAt(0)).buffer;
    const gl = document.createElement('canvas').getContext('webgl2');
    if (!gl.getExtension('EXT_color_buffer_float')) throw new Error('no float targets');
    gl.getExtension('OES_texture_float_linear');
    const compile = (type, text) => {
      const s = gl.createShader(type);
      gl.shaderSource(s, text);
      gl.compileShader(s);
      if (!gl.getShaderParameter(s, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(s));
      return s;
    };
    const program = gl.createProgram();
    gl.attachShader(program, compile(gl.VERTEX_SHADER, '#version 300 es\nvoid main() { gl_Position = vec4(gl_VertexID == 1 ? 3.0 : -1.0, gl_VertexID == 2 ? 3.0 : -1.0, 0.0, 1.0); }'));
    gl.attachShader(program, compile(gl.FRAGMENT_SHADER, source));
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(program));
    gl.useProgram(program);
    let unit = 0;
    const bind = (name, target) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(target, gl.createTexture());
      const filter = target === gl.TEXTURE_3D ? gl.LINEAR : gl.NEAREST;
      gl.texParameteri(target, gl.TEXTURE_MIN_FILTER, filter);
      gl.texParameteri(target, gl.TEXTURE_MAG_FILTER, filter);
      for (const side of [gl.TEXTURE_WRAP_S, gl.TEXTURE_WRAP_T, gl.TEXTURE_WRAP_R])
        gl.texParameteri(target, side, gl.CLAMP_TO_EDGE);
      gl.uniform1i(gl.getUniformLocation(program, name), unit++);
    };
    // Sheets of `wide` x `high` texels an item, 64 items a row.
    const sheet = (name, data, count, wide, high, parts, internal, format, type) => {
      const columns = Math.min(64, count), rows = Math.ceil(count / 64), tile = wide * parts;
      const padded = new data.constructor(columns * tile * rows * high);
      for (let i = 0; i < count; ++i)
        for (let y = 0; y < high; ++y)
          padded.set(data.subarray((i * high + y) * tile, (i * high + y + 1) * tile),
                     ((Math.floor(i / 64) * high + y) * columns + i % 64) * tile);
      bind(name, gl.TEXTURE_2D);
      gl.texImage2D(gl.TEXTURE_2D, 0, internal, columns * wide, rows * high, 0, format, type, padded);
    };
    const count = facts.records[0], columns = 64, rows = Math.ceil(count / columns);
    sheet('bricks', new Uint32Array(bytes(files.bricks)), facts.bricks[0], 18, 1, 4, gl.RGBA32UI, gl.RGBA_INTEGER, gl.UNSIGNED_INT);
    sheet('probes', new Float32Array(bytes(files.light)), facts.probes[0], 10, 1, 4, gl.RGBA32F, gl.RGBA, gl.FLOAT);
    sheet('distances', new Float32Array(bytes(files.distances)), facts.probes[0], 18, 18, 2, gl.RG32F, gl.RG, gl.FLOAT);
    const records = new Float32Array(rows * columns * 8);
    records.set(new Float32Array(bytes(files.records)));
    bind('records', gl.TEXTURE_2D);
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, 2 * columns, rows, 0, gl.RGBA, gl.FLOAT, records);
    bind('voxels', gl.TEXTURE_3D);
    if (files.bevy)
      gl.texImage3D(gl.TEXTURE_3D, 0, gl.RGB9_E5, ...facts.size, 0, gl.RGB, gl.UNSIGNED_INT_5_9_9_9_REV, new Uint32Array(bytes(files.bevy)));
    const place = (name) => gl.getUniformLocation(program, name);
    gl.uniform3uiv(place('roots'), facts.roots);
    gl.uniform1ui(place('levels'), facts.levels[0]);
    gl.uniform3fv(place('low'), facts.low);
    gl.uniform1f(place('spacing'), facts.spacing[0]);
    gl.uniform1i(place('visibility'), facts.visibility[0]);
    if (files.bevy) {
      gl.uniform3fv(place('translation'), facts.translation);
      gl.uniform3fv(place('scale'), facts.scale);
    }
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
    const targets = [0, 1].map((k) => {
      const t = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, t);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, columns, rows, 0, gl.RGBA, gl.FLOAT, null);
      gl.framebufferTexture2D(gl.FRAMEBUFFER, gl.COLOR_ATTACHMENT0 + k, gl.TEXTURE_2D, t, 0);
      return gl.COLOR_ATTACHMENT0 + k;
    });
    gl.drawBuffers(targets);
    gl.viewport(0, 0, columns, rows);
    gl.drawArrays(gl.TRIANGLES, 0, 3);
    if (gl.getError()) throw new Error('GL error');
    return targets.flatMap((at) => {
      const data = new Float32Array(4 * columns * rows);
      gl.readBuffer(at);
      gl.readPixels(0, 0, columns, rows, gl.RGBA, gl.FLOAT, data);
      return [...data.subarray(0, 4 * count)];
    });
  }, { source: '#version 300 es\nprecision highp float;\nprecision highp int;\n' + readFileSync(shader, 'utf8') + MAIN, facts,
       files: { bricks: base64('bricks'), light: base64('light'), distances: base64('distances'), records: base64('records'),
                bevy: existsSync(join(folder, 'bevy')) ? base64('bevy') : null } });
  writeFileSync(join(folder, 'out'), Buffer.from(new Float32Array(result).buffer));
} finally {
  await context.close();
  rmSync(profile, { recursive: true, force: true });
}
