#include "coordinator/scene/document/gltf_document.h"

#include <sys/stat.h>

#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>

#include "common/base/files.h"
#include "common/base/format.h"
#include "coordinator/scene/document/expand.h"
#include "coordinator/scene/document/glb.h"
#include "coordinator/scene/document/gltf_numbers.h"
#include "coordinator/scene/document/json_weight.h"
#include "coordinator/scene/document/other_formats.h"
#include "coordinator/scene/document/uri.h"
#include "coordinator/scene/document/variants.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

using nlohmann::json;

constexpr uint64_t kMaxJsonBytes = uint64_t{1} << 30;
constexpr uint64_t kMaxFileBytes = uint64_t{1} << 32;  // a GLB ends there

tl::unexpected<Error> bad(const fs::path& path, const std::string& what) {
  return fail(ErrorKind::kInvalidInput, text("{}: {}", path.string(), what));
}

// Weighs the text before it is parsed.
Expected<json> parse_json(std::string_view source, const fs::path& path, ImportBudget& budget) {
  if (source.size() > kMaxJsonBytes) return bad(path, text("{} bytes of JSON are too many", source.size()));
  if (source.starts_with("\xef\xbb\xbf")) source.remove_prefix(3);
  const JsonWeight weight = weigh_json(source);
  if (weight.too_deep) return bad(path, text("its JSON is nested more than {} levels deep", kMaxJsonDepth));
  if (weight.bad_at) return bad(path, text("its JSON does not parse at byte {}", weight.bad_at));
  KILN_TRY_STATUS(budget.take(weight.bytes, "its JSON"));
  try {
    json root = json::parse(source);
    if (!root.is_object()) return bad(path, "its JSON is not an object");
    return root;
  } catch (const json::exception& error) {
    return bad(path, text("its JSON does not parse: {}", error.what()));
  }
}

// The array member of that name, or an empty array.
Expected<json> array_member(const json& root, const char* name, const fs::path& path) {
  const auto it = root.find(name);
  if (it == root.end()) return json::array();
  if (!it->is_array()) return bad(path, text("\"{}\" is not an array", name));
  for (size_t i = 0; i < it->size(); ++i)
    if (!(*it)[i].is_object()) return bad(path, text("\"{}\": element {} is not an object", name, i));
  return *it;
}

std::string string_member(const json& object, const char* name) {
  const auto it = object.find(name);
  return it != object.end() && it->is_string() ? it->get<std::string>() : std::string();
}

std::vector<std::string> words_of(const json& root, const char* name) {
  std::vector<std::string> words;
  const auto it = root.find(name);
  if (it == root.end() || !it->is_array()) return words;
  for (const json& word : *it)
    if (word.is_string()) words.push_back(word.get<std::string>());
  return words;
}

bool is_fallback(const json& buffer) {
  const auto extensions = buffer.find("extensions");
  return extensions != buffer.end() && extensions->is_object() &&
         (extensions->contains("EXT_meshopt_compression") || extensions->contains("KHR_meshopt_compression"));
}

// Whether the first character that is no space is a brace or a bracket.
bool is_json(std::span<const std::byte> file) {
  std::string_view text(reinterpret_cast<const char*>(file.data()), file.size());
  if (text.starts_with("\xef\xbb\xbf")) text.remove_prefix(3);
  const size_t first = text.find_first_not_of(" \t\r\n");
  return first != std::string_view::npos && (text[first] == '{' || text[first] == '[');
}

using SharedBytes = std::shared_ptr<const Bytes>;

// The files that a glTF names, each counted and read once, however often and by whatever names it is named.
class NamedFiles {
 public:
  NamedFiles(fs::path folder, ImportBudget& budget) : folder_(std::move(folder)), budget_(budget) {}

  // Counts the file of a URI, if there is one, towards the size of the scene.
  void count(const std::string& uri) {
    if (const auto file = find(uri)) count(*file);
  }
  Expected<SharedBytes> read(const std::string& uri) {
    const auto file = find(uri);
    if (!file) {
      KILN_TRY(Bytes bytes, read_uri(folder_, uri));
      return std::make_shared<const Bytes>(std::move(bytes));
    }
    count(*file);
    SharedBytes& known = read_[key(*file)];
    if (known) return known;
    KILN_TRY_STATUS(budget_.take(static_cast<uint64_t>(file->st_size), text("buffer '{}'", uri)));
    KILN_TRY(Bytes bytes, read_uri(folder_, uri));
    return known = std::make_shared<const Bytes>(std::move(bytes));
  }

 private:
  using Key = std::pair<dev_t, ino_t>;
  static Key key(const struct stat& file) { return {file.st_dev, file.st_ino}; }
  std::optional<struct stat> find(const std::string& uri) const {
    if (uri.starts_with("data:")) return std::nullopt;
    const auto path = resolve_uri(folder_, uri);
    struct stat file;
    if (!path || ::stat(path->c_str(), &file) != 0 || !S_ISREG(file.st_mode)) return std::nullopt;
    return file;
  }
  // What the disk holds, because a file may be large and hold nothing.
  void count(const struct stat& file) {
    if (!counted_.insert(key(file)).second) return;
    budget_.add_file(static_cast<uint64_t>(std::min<int64_t>(file.st_size, 512 * int64_t{file.st_blocks})));
  }

  const fs::path folder_;
  ImportBudget& budget_;
  std::set<Key> counted_;
  std::map<Key, SharedBytes> read_;
};

Expected<SharedBytes> read_buffer(const json& buffer, size_t index, const SharedBytes& binary,
                                  NamedFiles& files, const fs::path& path) {
  const std::string where = text("buffer {}", index);
  const auto it = buffer.find("byteLength");
  if (it == buffer.end() || !it->is_number_unsigned())
    return bad(path, where + ": byteLength is not a length");
  const uint64_t length = it->get<uint64_t>();
  SharedBytes data;
  if (buffer.contains("uri")) {
    auto read = files.read(string_member(buffer, "uri"));
    if (!read) return fail(read.error().kind, text("{}: {}: {}", path.string(), where, read.error().message));
    data = std::move(*read);
  } else if (index == 0 && binary) {
    data = binary;
  } else if (is_fallback(buffer)) {
    return std::make_shared<const Bytes>();
  } else {
    return bad(path, where + ": it has neither a URI nor a binary chunk");
  }
  if (data->size() < length)
    return bad(path, text("{}: byteLength says {} bytes, its data has {}", where, length, data->size()));
  return data;
}

GltfImage read_image(const json& image) {
  GltfImage out{string_member(image, "name"), string_member(image, "uri"), -1};
  const auto view = image.find("bufferView");
  if (view != image.end() && view->is_number_unsigned() && view->get<uint64_t>() < uint64_t{1} << 31)
    out.buffer_view = view->get<int64_t>();
  return out;
}

}  // namespace

Expected<GltfDocument> read_gltf_document(const fs::path& path, const std::string& variant) {
  std::error_code unknown;
  if (fs::is_directory(path, unknown)) return bad(path, "it is a folder: name the .gltf or .glb file in it");
  KILN_TRY(const Bytes file, read_file(path, kMaxFileBytes));
  GltfDocument document;
  document.path = path;
  document.budget = std::make_shared<ImportBudget>(path, file.size());
  SharedBytes binary;
  if (is_glb(file)) {
    KILN_TRY(const GlbParts parts, read_glb(file, path.string()));
    document.json = parts.json;
    if (parts.binary) binary = std::make_shared<const Bytes>(parts.binary->begin(), parts.binary->end());
  } else if (path.extension() == ".glb") {
    return bad(path, "corrupt: it does not start with \"glTF\"");
  } else if (!is_json(file)) {
    return bad(path, name_other_format(path, file));
  } else {
    document.json.assign(reinterpret_cast<const char*>(file.data()), file.size());
  }
  KILN_TRY(json root, parse_json(document.json, path, *document.budget));
  NamedFiles files(path.parent_path(), *document.budget);
  KILN_TRY_STATUS(check_gltf_numbers(root, path));
  KILN_TRY(const json buffers, array_member(root, "buffers", path));
  for (size_t i = 0; i < buffers.size(); ++i) {
    KILN_TRY(SharedBytes data, read_buffer(buffers[i], i, binary, files, path));
    document.buffers.push_back(std::move(data));
  }
  const size_t in_file = document.buffers.size();
  KILN_TRY(document.expanded, expand_compressed(root, document.buffers, *document.budget, path));
  document.variants = variant_names(root);
  if (!variant.empty()) KILN_TRY_STATUS(choose_variant(root, document.variants, variant, path.string()));
  if (!document.expanded.empty() || document.buffers.size() > in_file || !variant.empty())
    document.json = root.dump();
  KILN_TRY(const json images, array_member(root, "images", path));
  for (const json& image : images) {
    document.images.push_back(read_image(image));
    files.count(document.images.back().uri);
  }
  document.extensions_used = words_of(root, "extensionsUsed");
  document.extensions_required = words_of(root, "extensionsRequired");
  root.erase("buffers");
  root.erase("images");
  document.structure = root.dump();
  return document;
}

}  // namespace kiln
