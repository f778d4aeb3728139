// The canary: irregular triangles under a sun, a lamp and a sky, sampled with the real integrator.
// Its digest names the class of machines whose bytes agree.
#include "common/base/hash.h"
#include "worker/bake/baker.h"
#include "worker/integrators/integrator.h"

namespace kiln {
namespace {

Record record(std::string type, std::vector<Property> properties, const Mat4x3& to_world = Mat4x3(1.0f)) {
  return {std::move(type), "canary", to_world, std::move(properties)};
}

Scene canary_scene() {
  Scene scene;
  Mesh mesh;
  mesh.name = "heap";
  for (uint32_t t = 0; t < 256; ++t) {
    const auto coordinate = [&](uint32_t k) { return unit_float(hash_combine(t, k)); };
    const Vec3 centre = Vec3(coordinate(0), coordinate(1), coordinate(2)) * 4.0f - Vec3(2.0f);
    Vec3 p[3];
    for (uint32_t k = 0; k < 3; ++k)
      p[k] = centre + Vec3(coordinate(3 + 3 * k), coordinate(4 + 3 * k), coordinate(5 + 3 * k)) - Vec3(0.5f);
    const Vec3 n = normalize_or(cross(p[1] - p[0], p[2] - p[0]), Vec3(0, 1, 0));
    for (const Vec3& corner : p) {
      mesh.positions.push_back(corner);
      mesh.normals.push_back(n);
    }
    mesh.triangles.push_back({3 * t, 3 * t + 1, 3 * t + 2});
    mesh.source_triangle.push_back(t);
  }
  scene.meshes.push_back(std::move(mesh));
  scene.instances.push_back({0, 0, Mat4x3(1.0f), "heap", 0, 0, 0});
  scene.materials.push_back(record("metallic_roughness", {{"base_color", {0.7, 0.6, 0.5, 1}, "", {}},
                                                          {"metallic", {0.3}, "", {}},
                                                          {"roughness", {0.4}, "", {}},
                                                          {"double_sided", {1}, "", {}}}));
  Mat4x3 high(1.0f);
  high[3] = Vec3(0, 3, 0);
  scene.lights.push_back(record("point", {{"intensity", {10}, "", {}}}, high));
  scene.lights.push_back(record("directional", {{"angle", {1}, "", {}}}));
  scene.lights.push_back(record("environment", {{"radiance", {0.3, 0.4, 0.5}, "", {}}}));
  return scene;
}

}  // namespace

Expected<std::string> numeric_class(const std::string& isa) {
  std::vector<std::string> warnings;
  KILN_TRY(const auto surfaces, Surfaces::create(canary_scene(), warnings));
  KILN_TRY(const auto tracer, Tracer::create(surfaces->scene(), *surfaces, isa, 1));
  KILN_TRY(const Lights lights, Lights::create(*surfaces, warnings));
  TransportSettings settings;
  settings.max_bounces = 4;
  const auto integrator =
      Integrator::create(*surfaces, *tracer, lights, settings, find_features(*surfaces, lights));
  const auto workspace = integrator->make_workspace();
  Sha256 hash;
  for (uint32_t i = 0; i < 64; ++i) {
    Integrator::Task task{surfaces->at(0, 4 * i, 0.25f, 0.5f), SampleStream(1, i, i), {}};
    integrator->sample(std::span(&task, 1), *workspace);
    const RadianceSamples& radiance = task.radiance;
    for (int k = 0; k < radiance.count; ++k) {
      hash.add(std::as_bytes(std::span(&radiance.items[k].direction, 1)));
      hash.add(std::as_bytes(std::span(&radiance.items[k].contribution, 1)));
    }
  }
  return isa + "-" + hash.finish().hex().substr(0, 16);
}

}  // namespace kiln
