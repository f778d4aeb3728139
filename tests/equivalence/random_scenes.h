// Scenes out of a seed: rooms with boxes and spheres of all kinds of materials under all kinds of lights.
#pragma once

#include "common/scene/scene.h"

namespace kiln::test {

constexpr uint32_t kRandomScenes = 20;

// Decided by the seed alone. Each has an emissive surface; without
// `other_lights` there is nothing beside emissive surfaces and the environment.
Scene random_scene(uint32_t seed, bool other_lights);

// The same with a rectangle and a disc light in the middle of the room. `alone`: its surfaces do not shine.
Scene with_area_lights(Scene scene, uint32_t seed, bool alone);

// A small room with what the bits of Feature name, and no more.
Scene scene_of(uint32_t features);

}  // namespace kiln::test
