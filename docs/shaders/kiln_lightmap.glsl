// Lightmaps of Kiln in a shader: GLSL ES 3.00 and desktop GLSL 3.30 alike. common/responses/evaluate.h is the same in
// C++; the tests compare both. All light is linear RGB; irradiance E is in the unit of the scene's radiance times
// steradian, and a diffuse surface shows base colour / pi x E.
//
// L0, Lx, Ly, Lz are the planes L0, L1x, L1y, L1z of the basis sh_l1: world axes,
//   L0 = 1/(4 pi) integral L dw, L1 = 1/(4 pi) integral L d dw.

const float KILN_PI = 3.14159265358979;

struct KilnL1 {
  vec3 L0, Lx, Ly, Lz;  // RGB each
};

// A ratio texture holds L1/L0: the planes are products of what two textures give.
KilnL1 kiln_from_ratios(vec3 L0, vec3 rx, vec3 ry, vec3 rz) {
  return KilnL1(L0, rx * L0, ry * L0, rz * L0);
}

// Texels of 8 bits a channel that stand for more; `texel` is in [0, 1].
vec3 kiln_rgbm(vec4 texel, float range) {
  vec3 root = texel.rgb * (texel.a * range);
  return root * root;
}
vec3 kiln_rgbd(vec4 texel, float range) {
  return pow(texel.rgb, vec3(2.2)) * (range / max(texel.a, 1.0 / 255.0));
}
vec3 kiln_rgbe(vec4 texel) {
  return texel.rgb * 255.0 * exp2(floor(texel.a * 255.0 + 0.5) - 136.0);
}
// Exponents cannot be filtered: the four texels are unpacked first.
vec3 kiln_rgbe_bilinear(highp sampler2D map, vec2 uv) {
  ivec2 last = textureSize(map, 0) - 1;
  vec2 p = uv * vec2(last + 1) - 0.5, f = fract(p);
  ivec2 a = clamp(ivec2(floor(p)), ivec2(0), last), b = clamp(ivec2(floor(p)) + 1, ivec2(0), last);
  vec3 upper = mix(kiln_rgbe(texelFetch(map, a, 0)), kiln_rgbe(texelFetch(map, ivec2(b.x, a.y), 0)), f.x);
  vec3 lower = mix(kiln_rgbe(texelFetch(map, ivec2(a.x, b.y), 0)), kiln_rgbe(texelFetch(map, b, 0)), f.x);
  return mix(upper, lower, f.y);
}

// Linear reconstruction, E/pi = L0 + 2 L1.n; below 0 where the light comes from one side only: cut off there.
vec3 kiln_irradiance_linear(KilnL1 s, vec3 n) {
  return KILN_PI * max(vec3(0.0), s.L0 + 2.0 * (s.Lx * n.x + s.Ly * n.y + s.Lz * n.z));
}

// One channel of the non-linear reconstruction (G. Hazel, Reconstructing diffuse lighting from spherical harmonic
// data, 2017): E/pi = L0 (k + (1 - k)(p + 1) q^p), never negative, with the mean of the linear one.
float kiln_irradiance_hazel(float l0, vec3 l1, vec3 n) {
  float size = length(l1);
  if (!(l0 > 0.0)) return 0.0;
  if (!(size > 0.0)) return KILN_PI * l0;
  float a = min(size / l0, 1.0);
  float q = 0.5 + 0.5 * dot(n, l1) / size;
  float p = 1.0 + 2.0 * a;
  float k = (1.0 - a) / (1.0 + a);
  return KILN_PI * l0 * (k + (1.0 - k) * (p + 1.0) * pow(max(q, 0.0), p));
}
vec3 kiln_irradiance_nonlinear(KilnL1 s, vec3 n) {
  return vec3(kiln_irradiance_hazel(s.L0.r, vec3(s.Lx.r, s.Ly.r, s.Lz.r), n),
              kiln_irradiance_hazel(s.L0.g, vec3(s.Lx.g, s.Ly.g, s.Lz.g), n),
              kiln_irradiance_hazel(s.L0.b, vec3(s.Lx.b, s.Ly.b, s.Lz.b), n));
}

// Mean direction that light comes from (xyz, unit; n where there is none) and how focused it is (w, 0 to 1). The
// mean over the channels.
vec4 kiln_dominant(KilnL1 s, vec3 n) {
  vec3 l1 = vec3(dot(s.Lx, vec3(1.0)), dot(s.Ly, vec3(1.0)), dot(s.Lz, vec3(1.0)));
  float l0 = dot(s.L0, vec3(1.0)), size = length(l1);
  if (!(l0 > 0.0) || !(size > 0.0)) return vec4(n, 0.0);
  return vec4(l1 / size, min(size / l0, 1.0));
}

// Approximate specular reflection (O'Donnell 2018): all light as one lamp in the dominant direction that gives a
// surface facing it the irradiance of the map, and a lobe of GGX whose smoothness 1 - roughness is softened by
// sqrt(focus). `v`: to the eye, unit; `f0`: reflectance straight on. Gives radiance. One direction only:
// fade it out on smooth surfaces.
vec3 kiln_specular(KilnL1 s, vec3 n, vec3 v, float roughness, vec3 f0) {
  vec4 dominant = kiln_dominant(s, n);
  vec3 l = dominant.xyz;
  float nl = dot(n, l), nv = dot(n, v);
  if (nl <= 0.0 || nv <= 0.0 || dominant.w <= 0.0) return vec3(0.0);
  float r = 1.0 - (1.0 - roughness) * sqrt(dominant.w);
  float alpha = max(r * r, 1.0e-3), a2 = alpha * alpha;
  vec3 h = normalize(l + v);
  float nh = max(dot(n, h), 0.0), vh = max(dot(v, h), 0.0);
  float d = nh * nh * (a2 - 1.0) + 1.0;
  float distribution = a2 / (KILN_PI * d * d);
  float visibility = 0.5 / (nl * sqrt(nv * nv * (1.0 - a2) + a2) + nv * sqrt(nl * nl * (1.0 - a2) + a2));
  vec3 fresnel = f0 + (1.0 - f0) * pow(1.0 - vh, 5.0);
  vec3 lamp = kiln_irradiance_linear(s, l);
  return lamp * fresnel * (distribution * visibility * nl);
}

// Place on the page of a point of a chart, by its row of the chart table (docs/engines.md): `uv` is TEXCOORD_1 of
// scene_instanced.glb.
vec2 kiln_chart_coordinates(vec2 uv, vec2 scale, vec2 offset, bool turned) {
  return (turned ? uv.yx : uv) * scale + offset;
}
