// The KHR_materials_* extensions that light transport reads, as scene.h documents their properties.
#pragma once

#include "coordinator/scene/import/material_reader.h"

namespace kiln {

// Index of refraction, specular, transmission, volume, clearcoat and sheen of the material.
// Transmission alone, without what it does inside.
void put_plain_transmission(const GltfMaterial& material, MaterialReader& reader);
void put_layers(const GltfMaterial& material, MaterialReader& reader);

}  // namespace kiln
