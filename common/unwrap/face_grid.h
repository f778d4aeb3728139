// A grid over the faces of a chart in progress, to test whether a further face overlaps one already added.
#pragma once

#include <span>
#include <vector>

#include "common/raster/triangle2.h"

namespace kiln {

class FaceGrid {
 public:
  // `faces`: all faces that may be added; they outlive the grid. None is added yet.
  explicit FaceGrid(std::span<const Triangle2> faces);
  void add(uint32_t face);
  // Adds the face unless it overlaps one that was added (contact and rounding do not count) or is flipped.
  bool add_if_free(uint32_t face);

 private:
  template <class Visit>
  void for_each_cell(const Triangle2& face, const Visit& visit) const;

  static constexpr uint32_t kEnd = ~0u;
  struct Link {
    uint32_t face, next;
  };
  std::span<const Triangle2> faces_;
  DVec2 cells_per_unit_{0.0};
  uint32_t columns_ = 1, rows_ = 1;
  double contact_ = 0;
  std::vector<uint32_t> head_;  // by cell
  std::vector<Link> links_;
};

}  // namespace kiln
