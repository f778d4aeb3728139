// MSFT_lod: github.com/KhronosGroup/glTF, extensions/2.0/Vendor/MSFT_lod. The node is level 0, `ids` are the
// lower ones; MSFT_screencoverage tells when to draw them and does not affect the bake.
#include "coordinator/scene/import/levels.h"

#include <algorithm>
#include <map>

#include "common/base/format.h"

namespace kiln {
namespace {

constexpr uint32_t kNone = ~0u;
using Kind = ImportNote::Kind;

// A node's own data, with indices checked.
struct Request {
  uint32_t node = 0;
  std::vector<uint32_t> levels;  // 0 is the node
  uint32_t proxy = kNone;
  uint32_t baked = 0;  // level, without a proxy
  double most_distance = 0;
};

class LevelReader {
 public:
  LevelReader(const ImportContext& context, ImportNotes& notes) : context_(context), notes_(notes) {}

  Expected<Levels> read() {
    KILN_TRY(tree_, read_node_tree(context_));
    const size_t count = context_.model.nodes.size();
    level_of_.assign(count, kNone), proxy_of_.assign(count, kNone), set_of_.assign(count, kNone);
    for (uint32_t node = 0; node < count; ++node) KILN_TRY_STATUS(read_request(node));
    is_root_.assign(count, false);
    for (const uint32_t root : tree_.roots) is_root_[root] = true;
    for (uint32_t set = 0; set < requests_.size(); ++set) KILN_TRY_STATUS(claim(set));
    KILN_TRY_STATUS(check_nesting());
    out_.baked.emplace_back();
    out_.is_proxy.push_back(false);
    at_.resize(count);
    above_.resize(requests_.size());
    for (const uint32_t root : tree_.roots) KILN_TRY_STATUS(walk_scene(root));
    for (uint32_t set = 0; set < requests_.size(); ++set)
      if (above_[set]) KILN_TRY_STATUS(place_set(set));
    if (!clamped_.empty())
      add_note(notes_, Kind::kApproximated,
               text("--lod {}: the coarsest level is baked of {}", context_.settings.lod,
                    clamped_.list("node with fewer levels", "nodes with fewer levels")));
    if (!hidden_.empty())
      add_note(notes_, Kind::kNote,
               text("KHR_node_visibility leaves out {}",
                    hidden_.list("node that is not visible", "nodes that are not visible")));
    return std::move(out_);
  }

 private:
  Status read_request(uint32_t node);
  Expected<uint32_t> read_proxy(uint32_t node, const GltfValue& value);
  Status claim(uint32_t set);
  Status check_nesting();
  Status walk_scene(uint32_t root);
  Status place_set(uint32_t set);
  // `root` and everything below it except proxies.
  Status place_below(uint32_t root, const Affine& above, std::vector<PlacedNode>& out);
  Status check_not_repeated(uint32_t set, const std::vector<PlacedNode>& nodes);
  Expected<uint32_t> proxy_group(uint32_t set);

  std::string name(uint32_t node) const { return node_name(context_, node); }
  tl::unexpected<Error> bad(std::string what) const { return context_.bad(std::move(what)); }

  const ImportContext& context_;
  ImportNotes& notes_;
  NodeTree tree_;
  std::vector<Request> requests_;
  std::map<std::string_view, std::vector<uint32_t>> named_;  // the first two nodes of a name, once asked for
  std::vector<uint32_t> set_of_, level_of_,
      proxy_of_;                              // by node: set, or kNone; of a lower level; of a proxy
  std::vector<bool> is_root_;                 // by node
  std::vector<std::optional<Affine>> at_;     // by node: transform above a proxy placed in the scene
  std::vector<std::optional<Affine>> above_;  // by set: transform above its node, if placed
  std::vector<uint32_t> role_at_or_above_;    // by node: node, or kNone
  std::vector<uint32_t> group_of_proxy_;      // by node
  Levels out_;
  Finding clamped_, hidden_;
};

Expected<uint32_t> LevelReader::read_proxy(uint32_t node, const GltfValue& value) {
  const auto& nodes = context_.model.nodes;
  if (value.kind == GltfValue::Kind::kWord) {
    if (named_.empty())
      for (uint32_t i = 0; i < nodes.size(); ++i)
        if (std::vector<uint32_t>& same = named_[nodes[i].name]; same.size() < 2) same.push_back(i);
    const auto found = named_.find(value.word);
    if (found == named_.end())
      return bad(text("{}: extras.kiln.proxy is '{}', and no node is called so", name(node), value.word));
    if (found->second.size() > 1)
      return bad(text("{}: extras.kiln.proxy is '{}', which {} and {} are called: give an index", name(node),
                      value.word, name(found->second[0]), name(found->second[1])));
    return found->second[0];
  }
  const double n = value.kind == GltfValue::Kind::kNumber ? value.number : -1;
  if (!(n >= 0 && n < static_cast<double>(nodes.size()) && n == std::floor(n)))
    return bad(text("{}: extras.kiln.proxy is neither the name of a node nor an index below {}", name(node),
                    nodes.size()));
  return static_cast<uint32_t>(n);
}

Status LevelReader::read_request(uint32_t node) {
  const GltfNode& file = context_.model.nodes[node];
  Request r;
  r.node = node;
  r.levels = {node};
  if (const auto lod = file.extensions.find("MSFT_lod"); lod != file.extensions.end()) {
    const auto ids = lod->second.numbers("ids", 0);
    if (!ids) return bad(text("{}: MSFT_lod has no list of ids", name(node)));
    for (const double id : *ids) {
      if (!(id >= 0 && id < static_cast<double>(context_.model.nodes.size()) && id == std::floor(id)))
        return bad(
            text("{}: MSFT_lod names node {}, there are {}", name(node), id, context_.model.nodes.size()));
      r.levels.push_back(static_cast<uint32_t>(id));
    }
  }
  const GltfValue* kiln = file.extras.find("kiln");
  if (const GltfValue* proxy = kiln ? kiln->find("proxy") : nullptr) {
    KILN_TRY(r.proxy, read_proxy(node, *proxy));
    // One of its own levels: that one is baked.
    const auto own = std::find(r.levels.begin(), r.levels.end(), r.proxy);
    if (own == r.levels.begin()) return bad(text("{}: it is its own proxy", name(node)));
    if (own != r.levels.end()) {
      r.baked = static_cast<uint32_t>(own - r.levels.begin());
      r.proxy = kNone;
    }
  }
  if (const GltfValue* most = kiln ? kiln->find("lod_distance") : nullptr) {
    r.most_distance = most->kind == GltfValue::Kind::kNumber ? most->number : 0;
    if (!(r.most_distance > 0 && std::isfinite(r.most_distance)))
      return bad(text("{}: extras.kiln.lod_distance is no distance in metres above 0", name(node)));
  }
  if (r.levels.size() == 1 && r.proxy == kNone) return {};
  if (r.proxy == kNone && r.baked == 0) {
    r.baked = std::min(context_.settings.lod, static_cast<uint32_t>(r.levels.size()) - 1);
    if (r.baked != context_.settings.lod) clamped_.add(name(node));
  }
  set_of_[node] = static_cast<uint32_t>(requests_.size());
  requests_.push_back(std::move(r));
  return {};
}

// Levels belong to one node each. One node may be the proxy of several.
Status LevelReader::claim(uint32_t set) {
  const Request& r = requests_[set];
  for (size_t i = 1; i < r.levels.size(); ++i) {
    const uint32_t level = r.levels[i];
    if (level == r.node) return bad(text("{}: MSFT_lod names the node itself", name(level)));
    if (level_of_[level] != kNone)
      return bad(
          text("{} is a level of {} twice, or of {} too: give each a node of its own, the mesh may be one",
               name(level), name(r.node), name(requests_[level_of_[level]].node)));
    if (set_of_[level] != kNone)
      return bad(text("{}, a level of {}, has levels or a proxy of its own: only level 0 may", name(level),
                      name(r.node)));
    level_of_[level] = set;
    // It replaces its node: if also placed elsewhere, it would be drawn twice.
    const int parent = tree_.parent[level];
    const bool is_root = !context_.model.scenes.empty() && is_root_[level];
    if (parent != tree_.parent[r.node] && (parent != NodeTree::kNone || is_root))
      return bad(text("{} is a level of {} and is placed elsewhere: it must have the same parent or none",
                      name(level), name(r.node)));
  }
  if (r.proxy == kNone) return {};
  if (set_of_[r.proxy] != kNone)
    return bad(text("{}, the proxy of {}, has levels or a proxy of its own", name(r.proxy), name(r.node)));
  proxy_of_[r.proxy] = set;
  return {};
}

// A set, a level or a proxy below another one is meaningless (except a proxy below its own node).
Status LevelReader::check_nesting() {
  const auto has_role = [&](uint32_t node) {
    return set_of_[node] != kNone || level_of_[node] != kNone || proxy_of_[node] != kNone;
  };
  constexpr uint32_t kUnknown = kNone - 1;
  role_at_or_above_.assign(set_of_.size(), kUnknown);
  std::vector<uint32_t> path;
  const auto find = [&](int start) {  // each node is visited once
    path.clear();
    uint32_t found = kNone;
    for (int up = start; up != NodeTree::kNone; up = tree_.parent[static_cast<size_t>(up)]) {
      const auto node = static_cast<uint32_t>(up);
      found = role_at_or_above_[node] != kUnknown ? role_at_or_above_[node] : has_role(node) ? node : kNone;
      path.push_back(node);
      if (found != kNone || role_at_or_above_[node] != kUnknown) break;
    }
    for (const uint32_t node : path) role_at_or_above_[node] = found;
    return found;
  };
  for (uint32_t node = 0; node < set_of_.size(); ++node) {
    find(static_cast<int>(node));
    if (!has_role(node)) continue;
    if (level_of_[node] != kNone && proxy_of_[node] != kNone)
      return bad(text("{} is a level of {} and the proxy of {}", name(node),
                      name(requests_[level_of_[node]].node), name(requests_[proxy_of_[node]].node)));
    const uint32_t above = find(tree_.parent[node]);
    const bool own_proxy = above != kNone && proxy_of_[node] != kNone && set_of_[above] != kNone &&
                           requests_[set_of_[above]].proxy == node;
    if (above != kNone && !own_proxy)
      return bad(
          text("{} is below {}, and both have levels, are levels or are proxies", name(node), name(above)));
  }
  return {};
}

Status LevelReader::walk_scene(uint32_t root) {
  return walk_nodes(context_, root, {}, [&](const PlacedNode& at, const Affine& above) {
    if (proxy_of_[at.node] != kNone) at_[at.node] = above;
    if (proxy_of_[at.node] != kNone || level_of_[at.node] != kNone) return false;
    if (is_hidden(context_, at.node)) {
      hidden_.add(name(at.node));
      return false;
    }
    if (set_of_[at.node] != kNone) above_[set_of_[at.node]] = above;
    out_.standing.push_back(at);
    if (role_at_or_above_[at.node] == kNone) out_.baked[0].push_back(at);
    return true;
  });
}

Status LevelReader::place_below(uint32_t root, const Affine& above, std::vector<PlacedNode>& out) {
  const size_t before = out.size();
  KILN_TRY_STATUS(walk_nodes(context_, root, above, [&](const PlacedNode& at, const Affine&) {
    if (at.node != root && (proxy_of_[at.node] != kNone || is_hidden(context_, at.node))) return false;
    out.push_back(at);
    return true;
  }));
  // A proxy that stands nowhere is placed once for each of its nodes.
  return context_.document.budget->take((out.size() - before) * 2 * sizeof(PlacedNode),
                                        "its levels of detail");
}

Status LevelReader::check_not_repeated(uint32_t set, const std::vector<PlacedNode>& nodes) {
  for (const PlacedNode& at : nodes)
    if (context_.model.nodes[at.node].extensions.count("EXT_mesh_gpu_instancing"))
      return bad(
          text("{}: EXT_mesh_gpu_instancing is not supported below {}, which has levels or a proxy: give "
               "every copy a node of its own",
               name(at.node), name(requests_[set].node)));
  return {};
}

Expected<uint32_t> LevelReader::proxy_group(uint32_t set) {
  const uint32_t proxy = requests_[set].proxy;
  const bool stands = at_[proxy].has_value();
  if (!stands && tree_.parent[proxy] != NodeTree::kNone)
    return bad(text("{}, the proxy of {}, has a parent but is not in the scene", name(proxy),
                    name(requests_[set].node)));
  group_of_proxy_.resize(context_.model.nodes.size(), kNone);
  if (stands && group_of_proxy_[proxy] != kNone) return group_of_proxy_[proxy];
  const auto group = static_cast<uint32_t>(out_.baked.size());
  out_.baked.emplace_back();
  out_.is_proxy.push_back(true);
  KILN_TRY_STATUS(place_below(proxy, stands ? *at_[proxy] : *above_[set], out_.baked.back()));
  group_of_proxy_[proxy] = group;
  return group;
}

Status LevelReader::place_set(uint32_t set) {
  const Request& r = requests_[set];
  const auto index = static_cast<uint32_t>(out_.sets.size());
  DisplaySet made;
  made.node = r.node;
  made.name = name(r.node);
  made.most_distance = r.most_distance;
  uint32_t group;
  if (r.proxy != kNone) {
    KILN_TRY(group, proxy_group(set));
    made.baked = text("proxy {}", name(r.proxy));
  } else {
    group = static_cast<uint32_t>(out_.baked.size());
    out_.baked.emplace_back();
    out_.is_proxy.push_back(false);
    made.baked = text("level {}", r.baked);
  }
  out_.sets.push_back(std::move(made));
  out_.group_of_set.push_back(group);
  for (uint32_t level = 0; level < r.levels.size(); ++level) {
    std::vector<PlacedNode> nodes;
    KILN_TRY_STATUS(place_below(r.levels[level], *above_[set], nodes));
    KILN_TRY_STATUS(check_not_repeated(set, nodes));
    if (r.proxy == kNone && level == r.baked)
      out_.baked[group] = std::move(nodes);
    else
      for (const PlacedNode& at : nodes) out_.shown.push_back({at, index, level});
  }
  return {};
}

}  // namespace

Expected<Levels> read_levels(const ImportContext& context, ImportNotes& notes) {
  return LevelReader(context, notes).read();
}

}  // namespace kiln
