// Shared state of a material's import: its record, its textures and the list of findings.
#pragma once

#include "coordinator/scene/import/context.h"
#include "coordinator/scene/import/records.h"
#include "coordinator/scene/import/textures.h"

namespace kiln {

inline const GltfValue* find_extension(const GltfExtensions& extensions, const char* name) {
  const auto it = extensions.find(name);
  return it == extensions.end() ? nullptr : &it->second;
}

// A texture info inside an extension; without a texture if absent.
GltfTextureInfo texture_info(const GltfValue& extension, const char* name);

class MaterialReader {
 public:
  MaterialReader(Record& record, std::string who, TextureSet& textures, ImportNotes& notes)
      : record_(record), who_(std::move(who)), textures_(textures), notes_(notes) {}

  // Stores a texture reference, unless it is absent or unusable, which is reported.
  void texture(const char* property, const GltfTextureInfo& info, TextureRequest::Role role,
               bool keep_alpha = false);
  void numbers(const char* property, std::vector<double> values) {
    put_numbers(record_, property, std::move(values));
  }
  // Stores a factor; values outside its range are clamped and reported.
  double clamped(const char* name, double value, double low, double high);
  // The same for a number of an extension.
  double factor(const GltfValue& extension, const char* name, double otherwise, double high = 1) {
    return clamped(name, extension.number_or(name, otherwise), 0, high);
  }
  // The same for a colour.
  std::vector<double> color(const GltfValue& extension, const char* name, double otherwise, double high = 1);
  void note(ImportNote::Kind kind, const std::string& what);

 private:
  Record& record_;
  std::string who_;
  TextureSet& textures_;
  ImportNotes& notes_;
};

}  // namespace kiln
