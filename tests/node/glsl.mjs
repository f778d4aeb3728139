// node glsl.mjs PROGRAM SHADER[,SHADER] INPUT OUTPUT [RESPONSE]: evaluates shaders for every record of INPUT in WebGL2.
// `lightmap`: docs/shaders/kiln_lightmap.glsl; records of 24 floats: L0, L1x, L1y, L1z of RGB, n, v, f0, roughness, 2
// unused; 20 floats each: linear and non-linear E (RGB, 0), specular (RGB, 0), dominant direction and focus, unpacked
// texels (rgbm.r, rgbd.g, rgbe.b, chart.x).
// `bases`: with docs/shaders/kiln_bases.glsl; records of 52 floats: 12 functions of RGB, n, m, v, f0, roughness, 3
// unused; 48 floats each: E of sh_l2, h6, ad9, ad12, sg9, sg12, specular of ad9, ad12, sg9, sg12 (RGB, 0), x and y
// of the frame (XYZ, 0). RESPONSE: 32 x 32 x RG floats of kiln_dice_response.exr.
import { mkdtempSync, readFileSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { chromium } from 'playwright-core';

const [name, shaders, input, output, response] = process.argv.slice(2), program = '/usr/bin/chromium';
const LIGHTMAP = `
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
const BASES = `
uniform highp sampler2D records, response;
layout(location = 0) out vec4 o0; layout(location = 1) out vec4 o1; layout(location = 2) out vec4 o2;
layout(location = 3) out vec4 o3;
uniform int second;
float part(int i) {
  return texelFetch(records, ivec2(i / 4, int(gl_FragCoord.y)), 0)[i % 4];
}
vec3 triple(int i) {
  return vec3(part(i), part(i + 1), part(i + 2));
}
void main() {
  vec3 f[12], g[9], h[6];
  for (int i = 0; i < 12; ++i) f[i] = triple(3 * i);
  for (int i = 0; i < 9; ++i) g[i] = f[i];
  for (int i = 0; i < 6; ++i) h[i] = f[i];
  vec3 n = triple(36), m = triple(39), v = triple(42), f0 = triple(45);
  float roughness = part(48);
  KilnFrame frame = kiln_frame(n);
  o0 = vec4(second == 0 ? kiln_irradiance_sh_l2(g, n, m) : second == 1 ? kiln_irradiance_sg9(g, n, m)
          : kiln_specular_sg9(g, n, m, v, roughness, f0), 0.0);
  o1 = vec4(second == 0 ? kiln_irradiance_h6(h, n, m) : second == 1 ? kiln_irradiance_sg12(f, n, m)
          : kiln_specular_sg12(f, n, m, v, roughness, f0), 0.0);
  o2 = vec4(second == 0 ? kiln_irradiance_ad9(g, n, m)
          : second == 1 ? kiln_specular_ad9(g, response, n, m, v, roughness, f0) : frame.x, 0.0);
  o3 = vec4(second == 0 ? kiln_irradiance_ad12(f, n, m)
          : second == 1 ? kiln_specular_ad12(f, response, n, m, v, roughness, f0) : frame.y, 0.0);
}`;
// Texels of a record, the program, and the targets that are read of each draw.
const [width, MAIN, draws] = { lightmap: [6, LIGHTMAP, [4, 1]], bases: [13, BASES, [4, 4, 4]] }[name];
const profile = mkdtempSync(join(tmpdir(), 'kiln-chromium-'));
const context = await chromium.launchPersistentContext(profile, { executablePath: program, headless: true,
  args: ['--no-sandbox', '--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader',
         '--disable-background-networking', '--disable-component-update', '--disable-sync'] });
try {
  const page = context.pages()[0] ?? await context.newPage();
  const floats = (file) => {
    const bytes = readFileSync(file);
    return [...new Float32Array(bytes.buffer, bytes.byteOffset, bytes.length / 4)];
  };
  const result = await page.evaluate(({ source, records, width, draws, response }) => {
    const rows = records.length / (4 * width);
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
    const texture = (width, height, data, format = gl.RGBA, kind = gl.RGBA32F, filter = gl.NEAREST) => {
      const t = gl.createTexture();
      gl.bindTexture(gl.TEXTURE_2D, t);
      gl.texImage2D(gl.TEXTURE_2D, 0, kind, width, height, 0, format, gl.FLOAT, data);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MIN_FILTER, filter);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_MAG_FILTER, filter);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_S, gl.CLAMP_TO_EDGE);
      gl.texParameteri(gl.TEXTURE_2D, gl.TEXTURE_WRAP_T, gl.CLAMP_TO_EDGE);
      return t;
    };
    gl.bindFramebuffer(gl.FRAMEBUFFER, gl.createFramebuffer());
    const targets = [0, 1, 2, 3].map((k) => gl.COLOR_ATTACHMENT0 + k);
    for (const at of targets) gl.framebufferTexture2D(gl.FRAMEBUFFER, at, gl.TEXTURE_2D, texture(1, rows, null), 0);
    gl.drawBuffers(targets);
    if (response) {
      gl.activeTexture(gl.TEXTURE1);
      texture(32, 32, new Float32Array(response), gl.RG, gl.RG16F, gl.LINEAR);
      gl.activeTexture(gl.TEXTURE0);
    }
    texture(width, rows, new Float32Array(records));
    gl.viewport(0, 0, 1, rows);
    gl.useProgram(program);
    gl.uniform1i(gl.getUniformLocation(program, 'response'), 1);
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
    const all = draws.flatMap((count, k) => draw(k, targets.slice(0, count)));
    const out = [];
    for (let r = 0; r < rows; ++r) for (const data of all) out.push(...data.subarray(4 * r, 4 * r + 4));
    return out;
  }, { source: ['#version 300 es\nprecision highp float;\nprecision highp int;\n',
                ...shaders.split(',').map((file) => readFileSync(file, 'utf8')), MAIN].join(''),
       records: floats(input), width, draws, response: response && floats(response) });
  writeFileSync(output, Buffer.from(new Float32Array(result).buffer));
} finally {
  await context.close();
  rmSync(profile, { recursive: true, force: true });
}
