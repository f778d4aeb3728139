// Directional albedo of the sheen layer of KHR_materials_sheen: the albedo of the Charlie lobe (Estevez &
// Kulla 2017, Production Friendly Microfacet Sheen BRDF) with the extension's masking term, for a sheen
// colour of 1 and capped at 1.
#pragma once

namespace kiln {

// Albedo and its mean 2 int albedo(cos) cos dcos. Bilinear in roughness and the root of the cosine; the mean
// is that of the interpolant, so that a lobe built from both has exactly this albedo.
struct SheenAlbedo {
  explicit SheenAlbedo(float roughness);
  float at(float cos) const;
  float mean() const { return mean_; }

 private:
  int row_;
  float blend_;
  float mean_;
};

}  // namespace kiln
