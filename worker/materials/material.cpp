#include "worker/materials/material.h"

#include <optional>

#include "common/base/format.h"

namespace kiln {
namespace {

template <class M>
void try_parse(const Record& record, const Scene& scene, std::optional<Material>& out,
               std::vector<std::string>& warnings) {
  if (out || record.type != M::kType) return;
  RecordReader reader(record);
  out = M::parse(reader, scene);
  for (std::string& sentence : reader.unread()) warnings.push_back(std::move(sentence));
}

template <class... M>
void try_roster(std::variant<M...>*, const Record& record, const Scene& scene, std::optional<Material>& out,
                std::vector<std::string>& warnings) {
  (try_parse<M>(record, scene, out, warnings), ...);
}

}  // namespace

Expected<Material> parse_material(const Record& record, const Scene& scene,
                                  std::vector<std::string>& warnings) {
  std::optional<Material> material;
  try_roster(static_cast<Material*>(nullptr), record, scene, material, warnings);
  if (!material)
    return fail(
        ErrorKind::kInvalidInput,
        text("material '{}' is of type '{}', which this worker does not know", record.name, record.type));
  return *material;
}

}  // namespace kiln
