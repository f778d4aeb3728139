// What the bases of KILN_lightmap say in a shader, by the functions of kiln_lightmap.glsl and kiln_bases.glsl.

// `l1` gives L0 and L1 of what the functions f say, for the view of directions and where no reflection of the basis' own
// is known. Means of a lobe, and of it times the cosine to its axis, over the sphere.
const dice = [1 / 12, 0.0645833], gaussian = [0.0833328, 0.0694449];
const lobes = (name, [mean, along], isLocal) => ({ specular: `kiln_specular_${name}`, response: /^ad/.test(name), l1: `
  KilnL1 s = KilnL1(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));
  KilnFrame frame = kiln_frame(n);
  for (int i = 0; i < KILN_${name.toUpperCase()}.length(); ++i) {
    vec3 a = KILN_${name.toUpperCase()}[i];
    ${isLocal ? 'a = frame.x * a.x + frame.y * a.y + frame.n * a.z;' : ''}
    s.L0 += ${mean} * t.f[i];
    s.Lx += ${along} * a.x * t.f[i], s.Ly += ${along} * a.y * t.f[i], s.Lz += ${along} * a.z * t.f[i];
  }
  return s;` });
const harmonics = { l1: 'return KilnL1(t.f[0], t.f[1], t.f[2], t.f[3]);' };
const BASES = {
  sh_l1: harmonics, sh_l2: harmonics,
  h6: { specular: null, l1: `
  KilnFrame frame = kiln_frame(n);
  vec3 gradient[3];
  for (int k = 0; k < 3; ++k)
    gradient[k] = 1.5 * (t.f[1] * frame.x[k] + t.f[2] * frame.y[k]) + 3.0 * t.f[3] * frame.n[k];
  return KilnL1(t.f[0] - 3.0 * t.f[3], gradient[0], gradient[1], gradient[2]);` },
  ad9: lobes('ad9', dice, true), ad12: lobes('ad12', dice, false),
  sg9: lobes('sg9', gaussian, true), sg12: lobes('sg12', gaussian, true),
};
// Name of the basis, if this code evaluates it.
export const basisOf = ({ basis }) => (basis?.functions?.length && basis.name in BASES ? basis.name : undefined);

// KilnTexel, what it says about irradiance and reflections, and how it is fetched. n: the surface's normal, m: the one
// that is lit, v: to the eye.
export function basisGlsl(name, functions, maps, masters) {
  const count = Math.max(1, functions.length), { specular, response, l1 } = BASES[name] ?? { specular: null };
  const values = (planes) => (functions.length ? functions : ['none']).map((f) =>
    planes.known.has(`${f}.R`) ? `vec3(${f}_R, ${f}_G, ${f}_B)` : 'vec3(0.0)').join(', ');
  const fetch = (as, planes) => `KilnTexel ${as}(vec3 place) {
${name ? planes.code : ''}
return KilnTexel(vec3[${count}](${values(planes)}));
}`;
  const isL1 = name === 'sh_l1';
  const reflected = specular === null ? 'vec3(0.0)'
    : specular ? `${specular}(t.f, ${response ? 'kilnResponse, ' : ''}n, m, v, roughness, f0)`
               : 'kiln_specular(kilnL1(t, n), m, v, roughness, f0)';
  return `
struct KilnTexel { vec3 f[${count}]; };
${response ? 'uniform highp sampler2D kilnResponse;' : ''}
${fetch('kilnFetch', maps)}
${masters === maps ? 'KilnTexel kilnFetchMaster(vec3 place) { return kilnFetch(place); }'
                   : fetch('kilnFetchMaster', masters)}
KilnL1 kilnL1(KilnTexel t, vec3 n) {
  ${l1 ?? 'return KilnL1(vec3(0.0), vec3(0.0), vec3(0.0), vec3(0.0));'}
}
vec3 kilnShown(KilnTexel t, vec3 n, vec3 m) {
  return ${!name ? 'vec3(0.0)' : isL1 ? 'kiln_irradiance_linear(kilnL1(t, n), m)'
           : `max(kiln_irradiance_${name}(t.f, n, m), 0.0)`};
}
vec3 kilnReflected(KilnTexel t, vec3 n, vec3 m, vec3 v, float roughness, vec3 f0) {
  return ${reflected};
}
vec3 kilnShownOtherwise(KilnTexel t, vec3 n, vec3 m) {
  return ${isL1 ? 'kiln_irradiance_nonlinear(kilnL1(t, n), m)' : 'kilnShown(t, n, m)'};
}`;
}
