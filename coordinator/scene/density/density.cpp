#include "coordinator/scene/density/density.h"

#include "common/base/format.h"
#include "common/base/parallel.h"
#include "coordinator/scene/density/factors.h"

namespace kiln {
namespace {

Bounds bounds_of(const Scene& scene, const Instance& instance) {
  const Mesh& mesh = scene.meshes[instance.mesh];
  Bounds bounds;
  for (const UVec3& t : mesh.triangles)
    for (int k = 0; k < 3; ++k) bounds.add(DVec3(transform_point(instance.to_world, mesh.positions[t[k]])));
  return bounds;
}

std::vector<ImportanceBox> all_boxes(const DensityWishes& wishes, const BakeSettings& settings) {
  std::vector<ImportanceBox> boxes = wishes.boxes;
  for (const auto& b : settings.importance_boxes)
    boxes.push_back({DVec3(b.low[0], b.low[1], b.low[2]), DVec3(b.high[0], b.high[1], b.high[2]), b.factor});
  return boxes;
}

double within(double factor) {
  return std::clamp(factor, kMinDensityFactor, kMaxDensityFactor);
}

void note_boxes(const std::vector<ImportanceBox>& boxes, const std::vector<int>& box_of_instance,
                std::vector<std::string>& notes) {
  std::vector<bool> used(boxes.size(), false);
  for (const int b : box_of_instance)
    if (b >= 0) used[static_cast<size_t>(b)] = true;
  for (size_t b = 0; b < boxes.size(); ++b)
    if (!used[b])
      notes.push_back(text(
          "the importance box from ({}, {}, {}) to ({}, {}, {}) changes nothing: {}, or a larger factor "
          "counts there; move it, or take it away",
          boxes[b].low.x, boxes[b].low.y, boxes[b].low.z, boxes[b].high.x, boxes[b].high.y, boxes[b].high.z,
          boxes[b].factor > 1 ? "it touches no object" : "no object lies wholly inside"));
}

}  // namespace

DensityFactors density_factors(const Scene& scene, const DensityWishes& wishes,
                               const BakeSettings& settings) {
  DensityFactors result;
  const std::vector<ImportanceBox> boxes = all_boxes(wishes, settings);
  const bool cameras = settings.importance_cameras && !wishes.cameras.empty();
  if (settings.importance_cameras && wishes.cameras.empty())
    result.notes.push_back(
        "--importance-cameras changes nothing: the scene has no perspective camera; add one, or take it "
        "away");
  if (wishes.by_instance.empty() && boxes.empty() && !cameras && settings.small_objects == 0) return result;

  std::vector<float> factors(scene.instances.size(), 1.0f);
  std::vector<int> box(scene.instances.size(), -1);
  parallel_for(factors.size(), [&](size_t i) {
    const Instance& instance = scene.instances[i];
    const Bounds bounds = bounds_of(scene, instance);
    double factor = wishes.by_instance.empty() ? 1.0 : double{wishes.by_instance[i]};
    box[i] = box_of(scene, instance, bounds, boxes);
    if (box[i] >= 0) factor *= boxes[static_cast<size_t>(box[i])].factor;
    const double view =
        cameras ? view_factor(bounds, wishes.cameras, settings.camera_distance, settings.unseen_density)
                : 1.0;
    factor *= to_step(view * size_factor(bounds, settings.small_objects));
    factors[i] = static_cast<float>(within(factor));
  });
  note_boxes(boxes, box, result.notes);
  if (std::any_of(factors.begin(), factors.end(), [](float f) { return f != 1.0f; }))
    result.by_instance = std::move(factors);
  return result;
}

double most_density_factor(const DensityWishes& wishes, const BakeSettings& settings) {
  double said = 1, boxed = 1;
  if (!wishes.by_instance.empty())
    said = *std::max_element(wishes.by_instance.begin(), wishes.by_instance.end());
  for (const ImportanceBox& box : all_boxes(wishes, settings)) boxed = std::max(boxed, box.factor);
  return within(said * boxed);
}

}  // namespace kiln
