#include "common/unwrap/face_grid.h"

namespace kiln {

FaceGrid::FaceGrid(std::span<const Triangle2> faces) : faces_(faces) {
  DVec2 size(0.0);  // faces begin at (0, 0)
  for (const Triangle2& t : faces) size = glm::max(size, DVec2(t.max_x(), t.max_y()));
  const double longest = std::max(size.x, size.y);
  contact_ = 1e-6 * longest;  // corners are floats
  const double cells = std::clamp(static_cast<double>(faces.size()), 1.0, 1048576.0);
  // Square cells, about as many as faces; at most that many along an axis.
  const double edge = std::max(std::sqrt(size.x * size.y / cells), longest / std::min(cells, 4096.0));
  if (edge > 0) {
    columns_ = static_cast<uint32_t>(size.x / edge) + 1;
    rows_ = static_cast<uint32_t>(size.y / edge) + 1;
    cells_per_unit_ = DVec2(1.0 / edge);
  }
  head_.assign(size_t{columns_} * rows_, kEnd);
}

// Cells that the face touches, row by row.
template <class Visit>
void FaceGrid::for_each_cell(const Triangle2& face, const Visit& visit) const {
  Triangle2 t = face;
  for (DVec2& c : t.c) c *= cells_per_unit_;
  const auto cell = [](double at, uint32_t count) {
    return static_cast<uint32_t>(std::clamp(at, 0.0, count - 1.0));
  };
  const uint32_t bottom = cell(t.max_y(), rows_);
  for (uint32_t y = cell(t.min_y(), rows_); y <= bottom; ++y) {
    const XRange range = x_range_in_strip(t, y, y + 1.0);
    if (range.empty()) continue;
    const uint32_t right = cell(range.hi, columns_);
    for (uint32_t x = cell(range.lo, columns_); x <= right; ++x)
      if (!visit(size_t{y} * columns_ + x)) return;
  }
}

void FaceGrid::add(uint32_t face) {
  for_each_cell(faces_[face], [&](size_t cell) {
    links_.push_back({face, head_[cell]});
    head_[cell] = static_cast<uint32_t>(links_.size() - 1);
    return true;
  });
}

bool FaceGrid::add_if_free(uint32_t face) {
  const Triangle2& t = faces_[face];
  if (area2(t) < 0) return false;
  bool free = true;
  for_each_cell(t, [&](size_t cell) {
    for (uint32_t link = head_[cell]; link != kEnd && free; link = links_[link].next)
      free = !interiors_meet(t, faces_[links_[link].face], contact_);
    return free;
  });
  if (free) add(face);
  return free;
}

}  // namespace kiln
