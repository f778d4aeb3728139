// Colour lookups for previews: materials, textures, sky and lightmap.
#pragma once

#include "common/atlas/atlas_lookup.h"
#include "common/scene/scene.h"
#include "coordinator/bake/lightmap/lightmap.h"
#include "coordinator/output/look/fragment.h"

namespace kiln {

class SurfaceLook {
 public:
  // `textures` off: colours come from the factors alone.
  SurfaceLook(const Scene& scene, const Atlas& atlas, const Lightmap& map, bool textures = true);
  Vec4 base_color(const Fragment& f) const;  // linear, alpha by the material's alpha mode
  Vec3 emission(const Fragment& f) const;    // radiance
  // Irradiance by bilinear lookup; false if the texel has no value or does not exist.
  bool irradiance(const Fragment& f, Vec3& e) const;
  bool irradiance_at(uint32_t page, const Vec2& texels, Vec3& e) const;  // the same at a place of the atlas
  size_t texel(const Fragment& f) const;  // nearest lightmap texel; the object must receive
  bool receives(const Fragment& f) const { return lookup_.holds(f.instance, f.triangle); }
  bool visible(const Fragment& f) const;  // culling and alpha
  bool solid(const Fragment& f) const;    // alpha alone
  // Whether a fragment is blended over what is behind it: facing the camera, but not solid.
  bool is_veil(const Fragment& f) const;
  bool has_veils() const;  // whether any material may give one
  bool double_sided(uint32_t instance) const {
    return looks_[scene_.instances[instance].material].double_sided;
  }
  Vec3 sky(const Vec3& direction) const;

 private:
  struct Look {
    Vec4 color{1.0f};
    TextureUse color_texture, emission_texture;
    Vec3 emission{0.0f};
    float cutoff = 0.5f;
    bool opaque = true, blended = false, double_sided = false, unlit = false;
  };
  Vec2 texel_coordinates(const Fragment& f, uint32_t& page) const;
  Vec4 texture(const TextureUse& use, const Fragment& f) const;
  Vec2 interpolate(const std::vector<Vec2>& values, const Fragment& f) const;

  const Scene& scene_;
  const Atlas& atlas_;
  AtlasLookup lookup_;
  const Lightmap& map_;
  const bool textures_;
  std::vector<Look> looks_;
  const Record* environment_ = nullptr;
};

}  // namespace kiln
