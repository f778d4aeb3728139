// Bases of Kiln beyond sh_l1 in a shader, GLSL ES 3.00 and desktop GLSL 3.30 alike; behind kiln_lightmap.glsl, whose
// KILN_PI it uses. common/responses (sh_l2, h_basis, lobes, lobes_specular, receiver_frame) is the same in C++; the
// tests compare both. `f` are the functions of a basis in the order of KILN_lightmap's basis.functions, RGB each.
// Irradiance may be below 0 where lobes or harmonics ring: cut it off there.
//
// n: the surface's shading normal, of which the frames of local bases are a function; m: the normal that is lit, n
// turned by a normal map, or n. World axes, unit length.

struct KilnFrame {
  vec3 x, y, n;
};

// Right-handed, z = n: a fixed frame about the pole q = (2, 3, 6) / 7, turned along the shortest arc from q to n.
KilnFrame kiln_frame(vec3 n) {
  const vec3 q = vec3(2.0, 3.0, 6.0) / 7.0, across = vec3(3.0, -6.0, 2.0) / 7.0;
  float above = 1.0 + dot(q, n);
  vec3 x = above > 1.0e-6 ? across - (q + n) * (dot(across, n) / above) : across;
  return KilnFrame(x, cross(n, x), n);
}
vec3 kiln_to_local(KilnFrame frame, vec3 v) {
  return vec3(dot(v, frame.x), dot(v, frame.y), dot(v, frame.n));
}

// sh_l2: L0, L1x, L1y, L1z, L2xy, L2yz, L2zz, L2xz, L2xx_yy of the traceless matrix M, world axes:
// E/pi = L0 + 2 L1.m + 15/8 m^T M m.
vec3 kiln_irradiance_sh_l2(vec3 f[9], vec3 n, vec3 m) {
  vec3 xx = 0.5 * (f[8] - f[6]), yy = -0.5 * (f[8] + f[6]);
  vec3 square = xx * (m.x * m.x) + yy * (m.y * m.y) + f[6] * (m.z * m.z);
  vec3 mixed = f[4] * (m.x * m.y) + f[5] * (m.y * m.z) + f[7] * (m.x * m.z);
  return KILN_PI * (f[0] + 2.0 * (f[1] * m.x + f[2] * m.y + f[3] * m.z) + 1.875 * (square + 2.0 * mixed));
}

// h6: H0, Hx, Hy, Hz, H2xy, Hxx_yy, frame of n.
vec3 kiln_irradiance_h6(vec3 f[6], vec3 n, vec3 m) {
  vec3 v = kiln_to_local(kiln_frame(n), m);
  vec3 first = f[1] * v.x + f[2] * v.y + f[3] * (2.0 * v.z - 1.0);
  vec3 second = f[4] * (2.0 * v.x * v.y) + f[5] * (v.x * v.x - v.y * v.y);
  return KILN_PI * (f[0] + 3.0 * first + 3.75 * second);
}

// Axes of lobes: of ad9, sg9 and sg12 in the frame of n, of ad12 in the world.
const vec3 KILN_AD9[9] = vec3[9](
  vec3(0.52569455, -0.30349684, 0.79469180), vec3(-0.52569455, -0.30349684, 0.79469180),
  vec3(0.00000000, 0.60706407, 0.79465294), vec3(0.85067302, 0.49108443, 0.18759406),
  vec3(-0.85067302, 0.49108443, 0.18759406), vec3(0.00000000, -0.98224396, 0.18760839),
  vec3(-0.85067302, -0.49108443, -0.18759406), vec3(0.85067302, -0.49108443, -0.18759406),
  vec3(0.00000000, 0.98224396, -0.18760839));
const vec3 KILN_AD12[12] = vec3[12](
  vec3(0.52573115, 0.00000000, 0.85065085), vec3(-0.52573115, 0.00000000, 0.85065085),
  vec3(0.52573115, 0.00000000, -0.85065085), vec3(-0.52573115, 0.00000000, -0.85065085),
  vec3(0.00000000, 0.85065085, 0.52573115), vec3(0.00000000, 0.85065085, -0.52573115),
  vec3(0.00000000, -0.85065085, 0.52573115), vec3(0.00000000, -0.85065085, -0.52573115),
  vec3(0.85065085, 0.52573115, 0.00000000), vec3(-0.85065085, 0.52573115, 0.00000000),
  vec3(0.85065085, -0.52573115, 0.00000000), vec3(-0.85065085, -0.52573115, 0.00000000));
const vec3 KILN_SG9[9] = vec3[9](
  vec3(0.32867110, 0.00000000, 0.94444442), vec3(-0.40759602, 0.37339130, 0.83333331),
  vec3(0.06046909, -0.68901277, 0.72222227), vec3(0.48160636, 0.62817079, 0.61111110),
  vec3(-0.85278684, -0.15084627, 0.50000000), vec3(0.77733892, -0.49447915, 0.38888890),
  vec3(-0.24938847, 0.92770952, 0.27777779), vec3(-0.45446044, -0.87503594, 0.16666667),
  vec3(0.93787038, 0.34250951, 0.05555556));
const vec3 KILN_SG12[12] = vec3[12](
  vec3(0.28565231, 0.00000000, 0.95833337), vec3(-0.35697722, 0.32702032, 0.87500000),
  vec3(0.05341314, -0.60861391, 0.79166669), vec3(0.42948341, 0.56018561, 0.70833337),
  vec3(-0.76869166, -0.13597099, 0.62500000), vec3(0.70925522, -0.45116988, 0.54166669),
  vec3(-0.23073195, 0.85830843, 0.45833334), vec3(-0.42727226, -0.82268673, 0.37500003),
  vec3(0.89847946, 0.32812396, 0.29166669), vec3(-0.90406394, 0.37318310, 0.20833334),
  vec3(0.42052212, -0.89863020, 0.12500001), vec3(0.29902291, 0.95333588, 0.04166667));

// Irradiance / pi of a lobe at a normal of cosine c to its axis.
float kiln_dice_irradiance(float c) {
  return 0.05981 + c * (0.12918 + 0.07056 * c);
}
float kiln_gaussian_irradiance(float c) {  // S. Hill's fit (2016) for the sharpness 6
  float x0 = 0.36 * c, x1 = 0.283495306;
  float y = abs(x0) <= x1 ? (x0 + x1) * (x0 + x1) / 0.408233240 : clamp(c, 0.0, 1.0);
  return (0.833345622 * y + 0.000405957115) / 3.0;
}

vec3 kiln_irradiance_ad9(vec3 f[9], vec3 n, vec3 m) {
  vec3 d = kiln_to_local(kiln_frame(n), m), sum = vec3(0.0);
  for (int i = 0; i < 9; ++i) sum += f[i] * kiln_dice_irradiance(dot(d, KILN_AD9[i]));
  return KILN_PI * sum;
}
vec3 kiln_irradiance_ad12(vec3 f[12], vec3 n, vec3 m) {
  vec3 d = m, sum = vec3(0.0);
  for (int i = 0; i < 12; ++i) sum += f[i] * kiln_dice_irradiance(dot(d, KILN_AD12[i]));
  return KILN_PI * sum;
}
vec3 kiln_irradiance_sg9(vec3 f[9], vec3 n, vec3 m) {
  vec3 d = kiln_to_local(kiln_frame(n), m), sum = vec3(0.0);
  for (int i = 0; i < 9; ++i) sum += f[i] * kiln_gaussian_irradiance(dot(d, KILN_SG9[i]));
  return KILN_PI * sum;
}
vec3 kiln_irradiance_sg12(vec3 f[12], vec3 n, vec3 m) {
  vec3 d = kiln_to_local(kiln_frame(n), m), sum = vec3(0.0);
  for (int i = 0; i < 12; ++i) sum += f[i] * kiln_gaussian_irradiance(dot(d, KILN_SG12[i]));
  return KILN_PI * sum;
}

// Reflection off rough surfaces: GGX of alpha = roughness^2, one scattering. v: to the eye, unit; f0: reflectance
// straight on. Radiance; 0 where the eye is behind m.

// Ambient Dice (Roughton 2019, section 8.4): radiance in the mirror direction blended with irradiance, times
// `response`, which is kiln_dice_response.exr: 32 x 32, linear filter, clamped, R for f0 and G for f90, by the eye's
// cosine and, downwards, alpha.
vec2 kiln_dice_scale(highp sampler2D response, float nv, float alpha) {
  return texture(response, (clamp(vec2(nv, alpha), 0.0, 1.0) * 31.0 + 0.5) / 32.0).rg;
}
float kiln_dice_reflection(float mirror, float normal, float alpha) {
  float s = sqrt(alpha), c2 = mirror * mirror;
  float towards = clamp(s * (3.04989105 + 7.38827044 * alpha) - alpha * (6.98300251 + 2.66275692 * alpha), 0.0, 1.0);
  float diffuse = clamp(alpha * (5.62669935 + 1.90061249 * alpha) - s * (0.40054295 + 6.0400987 * alpha), 0.0, 1.0);
  float c = mix(mirror, normal, towards);
  return mix(mirror > 0.0 ? c2 * (0.35 + 0.25 * c2) : 0.0, 0.06 + c * (0.129 + 0.0697 * c), diffuse);
}

// Spherical Gaussians: the microfacets' distribution as an anisotropic Gaussian about the mirror direction (Xu et al.
// 2013), convolved with each lobe. Too dark on rough surfaces at grazing angles.
struct KilnGlossy {
  vec3 mirror, across, along;
  float wide_x, wide_y, scale;  // of the convolution; amplitude with shadowing
};
KilnGlossy kiln_glossy(vec3 m, vec3 v, float roughness) {
  float alpha = max(roughness * roughness, 1.0e-3), a2 = alpha * alpha, nv = dot(m, v), away = max(nv, 0.1);
  vec3 mirror = 2.0 * nv * m - v, side = cross(m, mirror);
  if (dot(side, side) < 1.0e-8) side = cross(m, abs(m.z) < 0.9 ? vec3(0.0, 0.0, 1.0) : vec3(1.0, 0.0, 0.0));
  vec3 across = normalize(side);
  float sharp = 2.0 / a2, x = sharp / (8.0 * away * away), y = sharp / 8.0;
  float shadowing = 0.25 / sqrt(nv * nv * (1.0 - a2) + a2);
  return KilnGlossy(mirror, across, cross(mirror, across), 3.0 * x / (3.0 + x), 3.0 * y / (3.0 + y),
                    shadowing / (a2 * sqrt((3.0 + x) * (3.0 + y))));
}
float kiln_gaussian_reflection(KilnGlossy g, vec3 axis) {
  float p = dot(axis, g.across), q = dot(axis, g.along);
  return max(dot(axis, g.mirror), 0.0) * exp(-g.wide_x * p * p - g.wide_y * q * q);
}
vec3 kiln_schlick(vec3 f0, float cosine) {
  return f0 + (1.0 - f0) * pow(1.0 - clamp(cosine, 0.0, 1.0), 5.0);
}

vec3 kiln_specular_ad9(vec3 f[9], highp sampler2D response, vec3 n, vec3 m, vec3 v, float roughness, vec3 f0) {
  float nv = dot(m, v), alpha = roughness * roughness;
  if (nv <= 0.0) return vec3(0.0);
  KilnFrame frame = kiln_frame(n);
  vec3 normal = kiln_to_local(frame, m), eye = kiln_to_local(frame, v), sum = vec3(0.0);
  vec3 mirror = 2.0 * nv * normal - eye;
  for (int i = 0; i < 9; ++i)
    sum += f[i] * kiln_dice_reflection(dot(mirror, KILN_AD9[i]), dot(normal, KILN_AD9[i]), alpha);
  vec2 scale = kiln_dice_scale(response, nv, alpha);
  return max(sum * (f0 * scale.x + scale.y), 0.0);
}
vec3 kiln_specular_ad12(vec3 f[12], highp sampler2D response, vec3 n, vec3 m, vec3 v, float roughness, vec3 f0) {
  float nv = dot(m, v), alpha = roughness * roughness;
  if (nv <= 0.0) return vec3(0.0);
  vec3 normal = m, eye = v, sum = vec3(0.0);
  vec3 mirror = 2.0 * nv * normal - eye;
  for (int i = 0; i < 12; ++i)
    sum += f[i] * kiln_dice_reflection(dot(mirror, KILN_AD12[i]), dot(normal, KILN_AD12[i]), alpha);
  vec2 scale = kiln_dice_scale(response, nv, alpha);
  return max(sum * (f0 * scale.x + scale.y), 0.0);
}
vec3 kiln_specular_sg9(vec3 f[9], vec3 n, vec3 m, vec3 v, float roughness, vec3 f0) {
  float nv = dot(m, v);
  if (nv <= 0.0) return vec3(0.0);
  KilnFrame frame = kiln_frame(n);
  vec3 normal = kiln_to_local(frame, m), eye = kiln_to_local(frame, v), sum = vec3(0.0);
  KilnGlossy g = kiln_glossy(normal, eye, roughness);
  for (int i = 0; i < 9; ++i) sum += f[i] * kiln_gaussian_reflection(g, KILN_SG9[i]);
  return max(sum * kiln_schlick(f0, nv) * g.scale, 0.0);
}
vec3 kiln_specular_sg12(vec3 f[12], vec3 n, vec3 m, vec3 v, float roughness, vec3 f0) {
  float nv = dot(m, v);
  if (nv <= 0.0) return vec3(0.0);
  KilnFrame frame = kiln_frame(n);
  vec3 normal = kiln_to_local(frame, m), eye = kiln_to_local(frame, v), sum = vec3(0.0);
  KilnGlossy g = kiln_glossy(normal, eye, roughness);
  for (int i = 0; i < 12; ++i) sum += f[i] * kiln_gaussian_reflection(g, KILN_SG12[i]);
  return max(sum * kiln_schlick(f0, nv) * g.scale, 0.0);
}
