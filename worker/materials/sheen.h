// Directional albedo of the sheen layer of KHR_materials_sheen: the albedo of the Charlie lobe (Estevez &
// Kulla 2017, Production Friendly Microfacet Sheen BRDF) with the extension's masking term, for a sheen
// colour of 1 and capped at 1.
#pragma once

namespace kiln {

// Albedo and its mean 2 int albedo(cos) cos dcos. Bilinear in roughness and the root of the cosine; the mean
// is that of the interpolant, so that a lobe built from both has exactly this albedo.
class SheenAlbedo {
 public:
  static constexpr int kRows = 8;  // cells along roughness

  SheenAlbedo() = default;  // black
  explicit SheenAlbedo(float roughness);
  float at(float cos) const;
  float mean() const { return mean_; }

  // Where it lies in the table: between two rows, whose means over the cosine others may tabulate too.
  int row() const { return row_; }
  float blend() const { return blend_; }
  // Of a row itself.
  static SheenAlbedo of_row(int row) { return SheenAlbedo(static_cast<float>(row) / kRows); }

 private:
  int row_ = 0;
  float blend_ = 0.0f;
  float mean_ = 0.0f;
};

}  // namespace kiln
