// node glsl.mjs SHADER INPUT OUTPUT: evaluates docs/shaders/kiln_lightmap.glsl for every record of INPUT (24 floats:
// L0, L1x, L1y, L1z of RGB, n, v, f0, roughness, 2 unused) in WebGL2 and writes 20 floats each: linear and non-linear
// E (RGB, 0), specular (RGB, 0), dominant direction and focus, unpacked texels (rgbm.r, rgbd.g, rgbe.b, chart.x).
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { chromium } from 'playwright-core';

const [shader, input, output, program = '/usr/bin/chromium'] = process.argv.slice(2);
const MAIN = `
uniform highp sampler2D records;
layout(location = 0) out vec4 o0; layout(location = 1) out vec4 o1; layout(location = 2) out vec4 o2;
layout(location = 3) out vec4 o3;
uniform int second;
void main() {
  int row = int(gl_FragCoord.y);
  vec4 t[6];
  for (int k = 0; k < 6; ++k) t[k] = texelFetch(records, ivec2(k, row), 0);
  KilnL1 s = KilnL1(t[0].xyz, vec3(t[0].w, t[1].xy), vec3(t[1].zw, t[2].x), t[2].yzw);
  vec3 n = t[3].xyz, v = vec3(t[3].w, t[4].xy), f0 = vec3(t[4].zw, t[5].x);
  o0 = second == 0 ? vec4(kiln_irradiance_linear(s, n), 0.0)
     : vec4(kiln_rgbm(t[5], 8.0).r, kiln_rgbd(t[5], 8.0).g, kiln_rgbe(t[5]).b, kiln_chart_coordinates(t[5].xy, vec2(0.5, -2.0), vec2(0.25, 3.0), true).x);
  o1 = vec4(kiln_irradiance_nonlinear(s, n), 0.0);
  o2 = vec4(kiln_specular(s, n, v, t[5].y, f0), 0.0);
  o3 = kiln_dominant(s, n);
}`;
const profile = mkdtempSync(join(tmpdir(), 'kiln-chromium-'));
const context = await chromium.launchPersistentContext(profile, { executablePath: program, headless: true,
  args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
         '--disable-background-networking', '--disable-component-update', '--disable-sync'] });
try {
  const page = context.pages()[0] ?? await context.newPage();
  const bytes = readFileSync(input);
  const records = [...new Float32Array(bytes.buffer, bytes.byteOffset, bytes.length / 4)];
  const result = await page.evaluate(({ source, records }) => {
    const rows = records.length / 24;
    const gl = document.createElement('canvas').getContext('webgl2');
    if (!gl.getExtension('EXT_color_buffer_float')) throw new Error('no float targets');
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
    const texture = (width, height, data) => {
      const t = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, t);
      gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, width, height, 0, gl.RGBA, gl.FLOAT, data);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, gl.NEAREST);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, gl.NEAREST);
      return t;
    };
    gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
    const targets = [0, 1, 2, 3].map((k) => gl.COLOR_ATTACHMENT0 + k);
    for (const at of targets) gl.framebufferTexture2D(gl.FRAMEBUFFER, at, gl.TEXTURE_2D, texture(1, rows, null), 0);
    gl.drawBuffers(targets);
    texture(6, rows, new Float32Array(records));
    gl.viewport(0, 0, 1, rows);
    gl.useProgram(program);
    const draw = (second, read) => {
      gl.uniform1i(gl.getUniformLocation(program, 'second'), second);
      gl.drawArrays(gl.TRIANGLES, 0, 3);
      return read.map((at) => {
        const data = new Float32Array(4 * rows);
        gl.readBuffer(at);
        gl.readPixels(0, 0, 1, rows, gl.RGBA, gl.FLOAT, data);
        return data;
      });
    };
    const all = [...draw(0, targets), ...draw(1, targets.slice(0, 1))];
    const out = [];
    for (let r = 0; r < rows; ++r) for (const data of all) out.push(...data.subarray(4 * r, 4 * r + 4));
    return out;
  }, { source: `#version 300 es\nprecision highp float;\nprecision highp int;\n${readFileSync(shader, 'utf8')}${MAIN}`, records });
  writeFileSync(output, Buffer.from(new Float32Array(result).buffer));
} finally {
  await context.close();
  rmSync(profile, { recursive: true, force: true });
}
