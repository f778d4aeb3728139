// Shared state of the importer's parts: the file, its structure and the list of findings.
#pragma once

#include <string>
#include <vector>

#include "common/base/status.h"
#include "coordinator/scene/document/gltf_document.h"
#include "coordinator/scene/import/gltf_model.h"
#include "coordinator/scene/import/import.h"

namespace kiln {

struct ImportContext {
  const GltfDocument& document;
  const GltfModel& model;
  const BakeSettings& settings;

  // An error headed by the file's path.
  tl::unexpected<Error> bad(const std::string& what) const;
};

using ImportNotes = std::vector<ImportNote>;
void add_note(ImportNotes& notes, ImportNote::Kind kind, std::string what);

// "mesh 3 'wall'": how messages name an element. The end of a long name is left out.
std::string element(const char* kind, size_t index, const std::string& name);

// Collects the elements to which one finding applies and writes one sentence:
// "3 nodes have no size: node 1 'a', node 2 'b', node 3".
class Finding {
 public:
  void add(std::string name) { names_.push_back(std::move(name)); }
  bool empty() const { return names_.empty(); }
  size_t size() const { return names_.size(); }
  // "3 nodes: a, b, c, ..."; `one` and `many` name the things counted.
  std::string list(const char* one, const char* many) const;

 private:
  std::vector<std::string> names_;
};

}  // namespace kiln
