#include <set>

#include "common/atlas/site_picker.h"
#include "coordinator/bake/neighbours/surface_window.h"
#include "tests/analytic/scene_maker.h"
#include "tests/seams/pieces.h"

namespace kiln {
namespace {

struct Graph {
  Atlas atlas;
  SiteGeometry sites;
  SurfaceLinks links;
  Graph(const Scene& scene, float density, unsigned threads = 2)
      : atlas(test::packed(scene, density)),
        sites(site_geometry(scene, atlas, threads)),
        links(surface_links(scene, atlas, sites, threads)) {}
};

// Mean of all valid points, by the picker.
TEST(SiteGeometry, IsTheMeanOfTheTexelsPoints) {
  const Scene scene = test::wall_of_eight().add(test::mantle(0.5f, 1, 12, 1), test::moved({1, 0, 2})).scene;
  const Graph g(scene, 7);
  for (uint32_t s = 0; s < g.sites.size(); ++s) {
    DVec3 position(0.0);
    SitePicker picker(g.atlas, s);
    for (uint32_t i = 0; i < picker.count(); ++i) {
      const SitePick p = picker.at(i);
      const Instance& instance = scene.instances[p.instance];
      const Mesh& m = scene.meshes[instance.mesh];
      const UVec3& t = m.triangles[p.triangle];
      position +=
          DVec3(transform_point(instance.to_world, m.positions[t.x] * (1 - p.b1 - p.b2) +
                                                       m.positions[t.y] * p.b1 + m.positions[t.z] * p.b2));
    }
    position /= picker.count();
    ASSERT_LT(length(position - DVec3(g.sites.position[s])), 1e-4) << s;  // texels measure 0.14
    ASSERT_NEAR(length(g.sites.normal[s]), 1, 1e-5);
    ASSERT_NEAR(g.sites.texel_size[s], 1.0 / 7, 0.02);
  }
}

// A wall made of eight panels of differing tessellation is one surface: all sites within a radius are found,
// whichever panel they are on.
TEST(SurfaceWindow, FindsAllOfASurfaceInPieces) {
  const Graph g(test::wall_of_eight().scene, 8);
  SurfaceWindow window(g.sites, g.links);
  const float radius = 0.45f;
  size_t missed = 0, all = 0, across = 0;
  for (uint32_t s = 0; s < g.sites.size(); ++s) {
    const auto found = window.around(s, radius);
    ASSERT_EQ(found[0], s);
    const std::set<uint32_t> set(found.begin(), found.end());
    ASSERT_EQ(set.size(), found.size());
    for (uint32_t o = 0; o < g.sites.size(); ++o) {
      const bool near = length(g.sites.position[o] - g.sites.position[s]) <= radius;
      if (!near) ASSERT_FALSE(set.count(o));
      all += near;
      missed += near && !set.count(o);
      across += near && g.sites.placement[o] != g.sites.placement[s];
    }
  }
  EXPECT_GT(across, all / 20);
  EXPECT_LT(missed, all / 200);  // slivers at the rim of a window
}

// Two rooms' floors on either side of a thin wall, and walls against floors: nothing is found beyond an edge.
TEST(SurfaceWindow, EndsAtEdgesAndWalls) {
  test::SceneMaker maker;
  const uint32_t grey = maker.lambert(Vec3(0.5f));
  maker.quad({0, 0, 0}, {0, 0, 4}, {4, 0, 0}, grey);      // a floor under both rooms
  maker.box({1.98f, 0, -1}, {2.02f, 3, 5}, false, grey);  // the wall
  const Scene scene = maker.take();
  AtlasSettings settings;
  settings.layout = AtlasSettings::Layout::kPack;
  settings.texels_per_metre = 8;
  for (const bool cut : {true, false}) {
    settings.cut_contacts = cut;
    Atlas atlas = *build_atlas(scene, settings);
    // Uncut charts with contacts known: what layout atlas would have.
    if (!cut) {
      settings.cut_contacts = true;
      atlas.contacts = build_atlas(scene, settings)->contacts;
    }
    ASSERT_FALSE(atlas.contacts.empty());
    const SiteGeometry sites = site_geometry(scene, atlas, 2);
    const SurfaceLinks links = surface_links(scene, atlas, sites, 2);
    SurfaceWindow window(sites, links);
    for (uint32_t s = 0; s < sites.size(); ++s)
      for (const uint32_t o : window.around(s, 0.8f)) {
        ASSERT_GT(dot(sites.normal[s], sites.normal[o]), 0.9f);
        if (sites.normal[s].y > 0.5f && sites.position[s].y < 0.1f)
          ASSERT_GE((sites.position[s].x - 2) * (sites.position[o].x - 2), 0)
              << sites.position[s].x << " " << sites.position[o].x << " cut " << cut;
      }
  }
}

TEST(SurfaceLinks, AreTheSameForAnyNumberOfThreads) {
  const Scene scene = test::wall_of_eight().scene;
  const Graph one(scene, 8, 1), three(scene, 8, 3);
  EXPECT_EQ(one.links.first, three.links.first);
  EXPECT_EQ(one.links.link, three.links.link);
  EXPECT_TRUE(one.sites.position == three.sites.position);
  for (uint32_t s = 0; s < one.sites.size(); ++s)
    for (const uint32_t o : one.links.of(s)) {
      const auto back = one.links.of(o);
      ASSERT_TRUE(std::binary_search(back.begin(), back.end(), s));
    }
}

}  // namespace
}  // namespace kiln
