#include "coordinator/scene/import/ies_lights.h"

#include <cstring>
#include <map>

#include "common/base/format.h"
#include "coordinator/scene/document/uri.h"
#include "coordinator/scene/import/accessors.h"
#include "coordinator/scene/import/ies_profile.h"
#include "coordinator/scene/import/lights.h"
#include "coordinator/scene/import/records.h"

namespace kiln {
namespace {

using Kind = ImportNote::Kind;
constexpr const char* kExtension = "EXT_lights_ies";
constexpr const char* kMimeType = "application/x-ies-lm-63";
constexpr size_t kMaxBytes = size_t{64} << 20;

struct Profile {
  std::string name;
  IesProfile table;
  int32_t texture = -1;
};

std::string word_of(const GltfValue& value, const char* name) {
  const GltfValue* found = value.find(name);
  return found ? found->word : std::string();
}

Expected<Bytes> profile_bytes(const ImportContext& context, const GltfValue& light, const std::string& who) {
  if (const std::string uri = word_of(light, "uri"); !uri.empty()) {
    auto bytes = read_uri(context.document.path.parent_path(), uri);
    if (!bytes) return context.bad(text("{}: {}", who, bytes.error().message));
    return bytes;
  }
  if (!light.find("bufferView")) return context.bad(text("{} has neither uri nor bufferView", who));
  if (word_of(light, "mimeType") != kMimeType)
    return context.bad(text("{}: its mimeType is '{}', not {}", who, word_of(light, "mimeType"), kMimeType));
  KILN_TRY(const auto view, view_bytes(context, light.index("bufferView")));
  return Bytes(view.begin(), view.end());
}

Expected<Profile> read_profile(const ImportContext& context, const GltfValue& light, size_t index,
                               std::vector<Texture>& textures, ImportNotes& notes) {
  Profile out;
  out.name = word_of(light, "name");
  const std::string who = element("IES profile", index, out.name);
  KILN_TRY(const Bytes bytes, profile_bytes(context, light, who));
  if (bytes.size() > kMaxBytes)
    return context.bad(text("{} has {} bytes; up to {} are read", who, bytes.size(), kMaxBytes));
  auto table = parse_ies({reinterpret_cast<const char*>(bytes.data()), bytes.size()});
  if (!table) return context.bad(text("{}: {}", who, table.error().message));
  out.table = std::move(*table);
  if (out.table.tilted)
    add_note(notes, Kind::kApproximated, text("{}: its factors for tilted lamps are not used", who));
  KILN_TRY_STATUS(
      context.document.budget->take(out.table.candela.size() * sizeof(float), "its IES profiles"));
  Texture candela;
  candela.name = who;
  candela.width = static_cast<uint32_t>(out.table.vertical.size());
  candela.height = static_cast<uint32_t>(out.table.horizontal.size());
  candela.channels = 1;
  candela.format = TexelFormat::kFloat32;
  candela.wrap_s = candela.wrap_t = Wrap::kClamp;
  const std::vector<float> values(out.table.candela.begin(), out.table.candela.end());
  candela.texels.resize(values.size() * sizeof(float));
  std::memcpy(candela.texels.data(), values.data(), candela.texels.size());
  out.texture = static_cast<int32_t>(textures.size());
  textures.push_back(std::move(candela));
  return out;
}

Expected<Record> make_record(const ImportContext& context, const PlacedNode& at, const GltfValue& use,
                             const GltfValue& light, const Profile& profile) {
  const std::string who = node_name(context, at.node);
  Record record;
  record.type = "ies";
  record.name = !profile.name.empty() ? profile.name : who;
  std::vector<double> color{1, 1, 1};
  if (use.find("color")) {
    const auto file = use.numbers("color", 3);
    if (!file) return context.bad(text("{}: the color of its {} is not three numbers", who, kExtension));
    for (size_t c = 0; c < 3; ++c) color[c] = std::clamp((*file)[c], 0.0, 1.0);  // as the extension specifies
  }
  const double multiplier = use.number_or("multiplier", 1);
  if (!(multiplier >= 0) || !std::isfinite(static_cast<float>(multiplier)))
    return context.bad(text("{}: multiplier {} is not a valid scale", who, multiplier));
  put_numbers(record, "color", color);
  put_numbers(record, "intensity", {multiplier});
  put_numbers(record, "vertical", profile.table.vertical);
  put_numbers(record, "horizontal", profile.table.horizontal);
  TextureUse candela;
  candela.texture = profile.texture;
  put_texture(record, "candela", candela);
  KILN_TRY(std::string word, [&]() -> Expected<std::string> {
    const GltfValue* extras = light.find("extras");
    return extras ? bake_word(context, "IES profile", *extras) : std::string();
  }());
  KILN_TRY(const std::string node_word, bake_word(context, who, context.model.nodes[at.node].extras));
  if (!node_word.empty()) word = node_word;
  put_word(record, "bake", word.empty() ? "full" : word);
  return record;
}

}  // namespace

Expected<std::vector<PlacedLight>> read_ies_lights(const ImportContext& context,
                                                   const std::vector<PlacedNode>& nodes,
                                                   std::vector<Texture>& textures, ImportNotes& notes) {
  std::vector<PlacedLight> placed;
  const auto root = context.model.extensions.find(kExtension);
  const GltfValue* lights = root == context.model.extensions.end() ? nullptr : root->second.find("lights");
  std::map<int, Profile> profiles;
  Finding aimless;
  for (const PlacedNode& at : nodes) {
    const auto& extensions = context.model.nodes[at.node].extensions;
    const auto use = extensions.find(kExtension);
    if (use == extensions.end()) continue;
    const int index = use->second.index("light");
    const size_t count = lights ? lights->items.size() : 0;
    if (index < 0 || static_cast<size_t>(index) >= count)
      return context.bad(
          text("{}: IES profile {} does not exist, there are {}", node_name(context, at.node), index, count));
    const auto slot = static_cast<size_t>(index);
    if (!profiles.count(index)) {
      KILN_TRY(profiles[index], read_profile(context, lights->items[slot], slot, textures, notes));
    }
    KILN_TRY(Record record, make_record(context, at, use->second, lights->items[slot], profiles[index]));
    KILN_TRY_STATUS(take_light(context, record));
    if (rigid_part(at.to_world, record.to_world))
      placed.push_back({at.node, std::move(record)});
    else
      aimless.add(node_name(context, at.node));
  }
  if (!aimless.empty())
    add_note(notes, Kind::kWarning,
             text("IES lights whose transform leaves no direction are left out: take away scales of 0, in {}",
                  aimless.list("node", "nodes")));
  return placed;
}

}  // namespace kiln
