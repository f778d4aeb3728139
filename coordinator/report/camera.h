// Where pictures are seen from.
#pragma once

#include <string>

#include "common/atlas/atlas.h"
#include "coordinator/bake/lightmap/lightmap.h"
#include "coordinator/scene/import/import.h"

namespace kiln {

// What --camera asks for: a camera of the file by name, or "X,Y,Z:X,Y,Z[:FOV]" (place, target, vertical
// degrees). Nothing is asked for: the first camera of the file that shows something, else one that is chosen
// by what it shows: objects, surfaces and distances of many kinds, light and shadow, few back faces. Rays of
// the coordinator find that out; the same camera for any number of threads. Errors (kUsage): a name that no
// camera has, which lists those there are; coordinates that are none.
Expected<Camera> preview_camera(const ImportResult& imported, const Atlas& atlas, const Lightmap& map,
                                const std::string& wish = "");

// Before any ray: would preview_camera refuse the wish?
Status check_camera(const ImportResult& imported, const std::string& wish);

// The one that is chosen, whatever cameras the file has.
Camera choose_camera(const ImportResult& imported, const Atlas& atlas, const Lightmap& map);

// At `eye`, looking along `forward`, upright.
Camera look_along(const Vec3& eye, const Vec3& forward, float vertical_fov, std::string name);

}  // namespace kiln
