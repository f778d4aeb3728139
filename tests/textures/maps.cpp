#include "tests/textures/maps.h"

#include "tests/atlas/shapes.h"

namespace kiln::test {

Baked baked_box(float texels_per_metre, const Field& field, uint32_t mip_levels) {
  Baked b;
  b.scene = scene_of({box(Vec3(2.0f), Uv::kNone)});
  AtlasSettings layout = pack_at(texels_per_metre);
  layout.mip_levels = mip_levels;
  b.settings.mip_levels = mip_levels;
  b.atlas = *build_atlas(b.scene, layout);
  Planes& p = b.map.planes;
  p.width = b.atlas.width;
  p.height = b.atlas.height * b.atlas.pages;
  b.map.page_height = b.atlas.height;
  const char* kNames[] = {"E.R",   "E.G",   "E.B",   "L0.R",  "L0.G",  "L0.B",  "L1x.R",   "L1x.G", "L1x.B",
                          "L1y.R", "L1y.G", "L1y.B", "L1z.R", "L1z.G", "L1z.B", "samples", "error"};
  for (const char* name : kNames) p.add(name);
  b.map.validity.assign(b.atlas.owner.size(), Validity::kEmpty);
  for (size_t t = 0; t < b.atlas.owner.size(); ++t) {
    if (b.atlas.owner[t] == 0) continue;
    b.map.validity[t] = Validity::kMeasured;
    const Light l = field(static_cast<uint32_t>(t % p.width), static_cast<uint32_t>(t / p.width));
    for (size_t c = 0; c < 3; ++c) {
      p.data[c][t] = static_cast<float>(kPi * l.l0[c] * (1 + 2 * l.ratio[2]));
      p.data[3 + c][t] = static_cast<float>(l.l0[c]);
      for (size_t k = 0; k < 3; ++k) p.data[6 + 3 * k + c][t] = static_cast<float>(l.l0[c] * l.ratio[k]);
    }
  }
  for (size_t c = 0; c < 3; ++c) b.map.bounds.push_back({3 + c, {6 + c, 9 + c, 12 + c}});
  return b;
}

Field smooth_light() {
  return [](uint32_t x, uint32_t y) {
    const double u = x / 40.0, v = y / 40.0;
    return Light{{1 + u, 0.9 + 0.8 * u + 0.1 * v, 0.7 + 0.5 * u + 0.4 * v},
                 {0.3 - 0.2 * u, 0.1 + 0.1 * v, 0.4}};
  };
}

Field edge_of_light() {
  return [](uint32_t x, uint32_t y) {
    const double bright = (x + y / 2) % 19 < 9 ? 100 : 1;
    return Light{{bright, bright, 0.5 * bright}, {bright > 50 ? 0.45 : -0.4, 0.1, 0.2}};
  };
}

}  // namespace kiln::test
