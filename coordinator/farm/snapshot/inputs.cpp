// Lists the files that a bake reads.
#include <algorithm>
#include <map>
#include <nlohmann/json.hpp>

#include "common/base/format.h"
#include "coordinator/farm/snapshot/option_files.h"
#include "coordinator/farm/snapshot/snapshot.h"
#include "coordinator/scene/document/gltf_document.h"
#include "coordinator/scene/document/uri.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;
using Inputs = std::map<std::string, fs::path>;  // by path in the snapshot

const json* member(const json& value, const char* name) {
  if (!value.is_object()) return nullptr;
  const auto it = value.find(name);
  return it == value.end() ? nullptr : &*it;
}

// The value at a path of member names, or null.
const json* at(const json& value, std::initializer_list<const char*> names) {
  const json* here = &value;
  for (const char* name : names)
    if (!here || !(here = member(*here, name))) return nullptr;
  return here;
}

// Every file reference in a glTF: core and the extensions that import reads.
std::vector<std::string> named_uris(const json& root) {
  std::vector<std::string> uris;
  const auto add = [&](const json* uri) {
    if (uri && uri->is_string() && !uri->get_ref<const std::string&>().starts_with("data:"))
      uris.push_back(uri->get<std::string>());
  };
  const auto add_all = [&](const json* list) {
    if (list && list->is_array())
      for (const json& element : *list) add(member(element, "uri"));
  };
  add_all(member(root, "buffers"));
  add_all(member(root, "images"));
  add_all(at(root, {"extensions", "EXT_lights_ies", "lights"}));
  if (const json* scenes = member(root, "scenes"); scenes && scenes->is_array())
    for (const json& scene : *scenes) add(at(scene, {"extras", "kiln", "environment", "image"}));
  return uris;
}

// What is allowed of the files that a scene names.
class Fence {
 public:
  Fence(const fs::path& scene, const InputRules& rules) : scene_(scene), rules_(rules) {
    std::error_code code;
    folder_ = fs::canonical(scene.parent_path(), code);
  }

  // Whether there is a file to send. Errors: what is there is none, or lies elsewhere. `who` names it.
  Expected<bool> admits(const fs::path& file, const std::string& who) const {
    std::error_code code;
    if (!fs::exists(fs::symlink_status(file, code)) || !fs::exists(file, code)) return false;
    if (!fs::is_regular_file(file, code))
      return fail(ErrorKind::kInvalidInput,
                  text("{}: {} is no file but a folder, a pipe or a device", scene_.string(), who));
    const fs::path real = fs::canonical(file, code);
    if (rules_.allow_outside || lies_inside(real)) return true;
    return fail(ErrorKind::kInvalidInput,
                text("{}: {} is {}, outside the scene's folder {}, and is not sent: copy it there, or say "
                     "--allow-outside if you mean it",
                     scene_.string(), who, real.string(), folder_.string()));
  }
  // A file of an option is the user's wish unless the scene's own job file names it.
  Expected<bool> admits_option(const fs::path& file, const char* option, const BakeSettings& settings) const {
    const auto source = settings.source.find(option);
    const fs::path own = fs::path(scene_).replace_extension(".kiln.json").filename();
    const bool by_scene = rules_.own_job_file && source != settings.source.end() &&
                          source->second == "job file " + own.string();
    if (by_scene) return admits(file, text("the {} that {} names", option, own.string()));
    std::error_code code;
    return fs::is_regular_file(file, code);
  }

 private:
  bool lies_inside(const fs::path& real) const {
    return std::mismatch(folder_.begin(), folder_.end(), real.begin(), real.end()).first == folder_.end();
  }

  const fs::path& scene_;
  const InputRules& rules_;
  fs::path folder_;
};

Status add_named(const fs::path& scene, const Fence& fence, Inputs& inputs) {
  // Reads the buffers too, so that a glTF that import would refuse is refused here.
  KILN_TRY(const GltfDocument document, read_gltf_document(scene));
  const json root = json::parse(document.json, nullptr, false);
  if (root.is_discarded()) return fail(ErrorKind::kInvalidInput, text("{}: no JSON", scene.string()));
  const fs::path folder = scene.parent_path();
  for (const std::string& uri : named_uris(root)) {
    const auto file = resolve_uri(folder, uri);
    if (!file) return fail(ErrorKind::kInvalidInput, text("{}: {}", scene.string(), file.error().message));
    const std::string path = file->lexically_relative(folder).generic_string();
    if (inputs.count(path)) continue;
    KILN_TRY(const bool is_there, fence.admits(*file, path));
    if (is_there) inputs.emplace(path, *file);
  }
  return {};
}

}  // namespace

Expected<std::vector<InputFile>> list_inputs(const fs::path& given, const BakeSettings& settings,
                                             const InputRules& rules) {
  std::error_code code;
  const fs::path scene = fs::absolute(given, code).lexically_normal();
  const Fence fence(scene, rules);
  Inputs inputs;
  KILN_TRY_STATUS(add_named(scene, fence, inputs));
  const fs::path own = fs::path(scene).replace_extension(".kiln.json");
  KILN_TRY(const bool has_own, fence.admits(own, own.filename().string()));
  if (has_own) inputs.emplace(own.filename().generic_string(), own);
  for (const FileOption& option : kFileOptions) {
    const std::string& value = settings.*option.value;
    if (!names_file(option, value)) continue;
    const fs::path file = fs::absolute(value, code).lexically_normal();
    KILN_TRY(const bool is_there, fence.admits_option(file, option.name, settings));
    if (!is_there) return fail(ErrorKind::kInvalidInput, text("--{} {}: no such file", option.name, value));
    if (!inputs.emplace(path_of_option(option, value), file).second)
      return fail(
          ErrorKind::kInvalidInput,
          text("{}: a file of the scene lies in {}, where files of options are put: rename that folder",
               scene.string(), kOptions));
  }
  std::vector<InputFile> files{{scene.filename().generic_string(), scene}};
  inputs.erase(files[0].path);
  for (const auto& [path, source] : inputs) files.push_back({path, source});
  return files;
}

}  // namespace kiln
