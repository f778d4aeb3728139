// Light of Kiln's probes in a shader, GLSL ES 3.00 and desktop GLSL 3.30 alike. common/probes/query.cpp is the same in
// C++; the tests compare both. docs/probes.md describes the files and how these textures are made of them.
//
// bricks: RGBA32UI, 18 texels a brick, 64 bricks a row: (corner.xyz, level), (parent, children, coarser, 0), then the
//   indices of its 64 probes, four a texel.
// probes: RGBA32F or RGBA16F, 10 texels a probe, 64 probes a row: (position.xyz, state), then the nine coefficients of
//   radiance in RGB.
// distances: RG, the tiles of probes_distance.exr: 18 x 18 texels a probe with the border, as many probes a row as the
//   texture is wide for (the file has 64). Read only where the volume has visibility.
//
// A normal of 0 asks for an object around the point: its mean E over all normals, of probes on all sides.

struct KilnProbeVolume {
  vec3 low;       // world
  float spacing;  // of the finest bricks
  uvec3 roots;
  uint levels;
  uint first_brick;  // row-major place of its first brick in `bricks`; indices of bricks count from it
  bool visibility;
};

uvec4 kiln_brick(highp usampler2D bricks, uint brick, uint texel) {
  return texelFetch(bricks, ivec2(int((brick % 64u) * 18u + texel), int(brick / 64u)), 0);
}
vec4 kiln_probe(highp sampler2D probes, uint probe, uint texel) {
  return texelFetch(probes, ivec2(int((probe % 64u) * 10u + texel), int(probe / 64u)), 0);
}

// Irradiance of a surface with normal n, of a probe; n = 0: its mean over all normals.
vec3 kiln_probe_irradiance(highp sampler2D probes, uint probe, vec3 n) {
  vec3 e = 0.8862269255 * kiln_probe(probes, probe, 1u).rgb;
  e += 1.0233267079 * (n.y * kiln_probe(probes, probe, 2u).rgb + n.z * kiln_probe(probes, probe, 3u).rgb +
                       n.x * kiln_probe(probes, probe, 4u).rgb);
  e += 0.8580855308 * (n.x * n.y * kiln_probe(probes, probe, 5u).rgb + n.y * n.z * kiln_probe(probes, probe, 6u).rgb +
                       n.x * n.z * kiln_probe(probes, probe, 8u).rgb);
  e += 0.2477079561 * (2.0 * n.z * n.z - n.x * n.x - n.y * n.y) * kiln_probe(probes, probe, 7u).rgb;
  e += 0.4290427654 * (n.x * n.x - n.y * n.y) * kiln_probe(probes, probe, 9u).rgb;
  return max(e, vec3(0.0));
}

vec2 kiln_octahedral(vec3 d) {
  vec2 p = d.xy / (abs(d.x) + abs(d.y) + abs(d.z));
  if (d.z < 0.0) p = (1.0 - abs(p.yx)) * vec2(p.x < 0.0 ? -1.0 : 1.0, p.y < 0.0 ? -1.0 : 1.0);
  return 0.5 * p + 0.5;
}

// Mean and mean square of the distance that a probe sees in a direction.
vec2 kiln_probe_distance(highp sampler2D distances, uint probe, vec3 direction) {
  vec2 p = kiln_octahedral(direction) * 16.0 + 0.5, low = floor(p), f = p - low;
  uint across = uint(textureSize(distances, 0).x) / 18u;
  ivec2 at = ivec2(low) + ivec2(int(probe % across), int(probe / across)) * 18;
  vec2 below = mix(texelFetch(distances, at, 0).xy, texelFetch(distances, at + ivec2(1, 0), 0).xy, f.x);
  vec2 above = mix(texelFetch(distances, at + ivec2(0, 1), 0).xy, texelFetch(distances, at + ivec2(1, 1), 0).xy, f.x);
  return mix(below, above, f.y);
}

// Chebyshev's bound of the share of distances beyond, cubed.
float kiln_probe_sees(highp sampler2D distances, uint probe, vec3 place, vec3 from) {
  vec3 d = from - place;
  float r = length(d);
  if (!(r > 0.0)) return 1.0;
  vec2 m = kiln_probe_distance(distances, probe, d / r);
  if (!(r > m.x)) return 1.0;
  float variance = abs(m.y - m.x * m.x), beyond = r - m.x, share = variance / (variance + beyond * beyond);
  return share * share * share;
}

// The brick, counted from the volume's first, at a point in finest spacings.
uint kiln_find_brick(KilnProbeVolume v, highp usampler2D bricks, vec3 at) {
  float root = float(3u << (v.levels - 1u));
  uvec3 cell = min(uvec3(max(at / root, vec3(0.0))), v.roots - 1u);
  uint brick = cell.x + v.roots.x * (cell.y + v.roots.y * cell.z);
  for (uint level = 1u; level < v.levels; ++level) {
    uint children = kiln_brick(bricks, v.first_brick + brick, 1u).y;
    if (children == 0u) break;
    uvec4 first = kiln_brick(bricks, v.first_brick + children, 0u);
    uvec3 upper = uvec3(greaterThanEqual(at, vec3(first.xyz) + float(3u << first.w)));
    brick = children + upper.x + 2u * upper.y + 4u * upper.z;
  }
  return brick;
}

// 0 at a neighbour of larger spacing, 1 from one cell off.
float kiln_brick_fade(uvec4 head, uint coarser, vec3 at) {
  float nearest = 1.0, cell = float(1u << head.w);
  vec3 low = (at - vec3(head.xyz)) / cell, high = 3.0 - low;
  for (int side = 0; side < 27 && coarser != 0u; ++side) {
    if ((coarser >> uint(side) & 1u) == 0u) continue;
    ivec3 s = ivec3(side % 3, side / 3 % 3, side / 9) - 1;
    float away = 0.0;
    for (int k = 0; k < 3; ++k) away = max(away, s[k] < 0 ? low[k] : s[k] > 0 ? high[k] : 0.0);
    nearest = min(nearest, away);
  }
  return max(nearest, 0.0);
}

// E between the probes of a cell, and 1; (0, 0, 0, 0) where none has light.
vec4 kiln_brick_light(KilnProbeVolume v, highp usampler2D bricks, highp sampler2D probes, highp sampler2D distances,
                      uint brick, vec3 at, vec3 position, vec3 n, float bias) {
  uvec4 head = kiln_brick(bricks, v.first_brick + brick, 0u);
  vec3 local = clamp((at - vec3(head.xyz)) / float(1u << head.w), 0.0, 3.0);
  uvec3 first = min(uvec3(local), uvec3(2u));
  vec3 share = local - vec3(first), from = position + n * (bias * v.spacing * float(1u << head.w));
  vec4 sum = vec4(0.0);
  for (uint corner = 0u; corner < 8u; ++corner) {
    uvec3 upper = uvec3(corner & 1u, corner >> 1u & 1u, corner >> 2u), point = first + upper;
    vec3 w = mix(1.0 - share, share, vec3(upper));
    float trilinear = w.x * w.y * w.z;
    uint index = point.x + 4u * (point.y + 4u * point.z);
    uint probe = kiln_brick(bricks, v.first_brick + brick, 2u + index / 4u)[index % 4u];
    vec4 place = kiln_probe(probes, probe, 0u);
    if (place.w > 1.5 || !(trilinear > 0.0)) continue;  // inactive
    vec3 to_probe = place.xyz - position;
    float distance = length(to_probe), facing = distance > 0.0 ? dot(to_probe, n) / distance : 1.0;
    float half_way = 0.5 * (facing + 1.0), weight = dot(n, n) > 0.0 ? half_way * half_way + 0.2 : 1.0;
    if (v.visibility) weight *= kiln_probe_sees(distances, probe, place.xyz, from);
    weight = max(1.0e-6, weight);
    if (weight < 0.2) weight *= weight * weight / 0.04;
    sum += vec4(kiln_probe_irradiance(probes, probe, n), 1.0) * (trilinear * weight);
  }
  return sum.w > 0.0 ? vec4(sum.rgb / sum.w, 1.0) : vec4(0.0);
}

// E at a point of a surface with unit normal n, and a weight: 1 inside the volume, falling to 0 at one of its coarsest
// spacings outside; 0 where it has no light. bias: in spacings of a brick; 0.1 is what the tests of leaks use. Of
// several volumes: begin with the finest, and give the next the weight that is left.
vec4 kiln_probe_light(KilnProbeVolume v, highp usampler2D bricks, highp sampler2D probes, highp sampler2D distances,
                      vec3 position, vec3 n, float bias) {
  vec3 at = (position - v.low) / v.spacing, end = vec3(v.roots * (3u << (v.levels - 1u)));
  vec3 inside = clamp(at, vec3(0.0), end);
  float off = length(at - inside) / float(1u << (v.levels - 1u)), left = 1.0;
  if (!(off < 1.0)) return vec4(0.0);
  uint brick = kiln_find_brick(v, bricks, inside);
  vec4 sum = vec4(0.0);
  for (uint level = 0u; level < v.levels; ++level) {
    uvec4 head = kiln_brick(bricks, v.first_brick + brick, 0u), links = kiln_brick(bricks, v.first_brick + brick, 1u);
    bool is_root = links.x == brick;
    float own = is_root ? 1.0 : kiln_brick_fade(head, links.z, inside);
    if (own > 0.0) {
      vec4 light = kiln_brick_light(v, bricks, probes, distances, brick, inside, position, n, bias);
      own *= light.w;
      sum += vec4(light.rgb, 1.0) * (left * own);
      left *= 1.0 - own;
    }
    if (is_root || !(left > 0.0)) break;
    brick = links.x;
  }
  return sum.w > 0.0 ? vec4(sum.rgb / sum.w, 1.0 - off) : vec4(0.0);
}
