#include "coordinator/report/html.h"

#include <algorithm>
#include <numeric>

#include "common/base/format.h"

namespace kiln {
namespace {

constexpr const char* kStyle =
    "body{font:15px/1.45 system-ui,sans-serif;margin:2em auto;max-width:72em;padding:0 "
    "1em;color:#222;background:#fafafa}"
    "h1{font-weight:600}h2{margin-top:1.6em;border-bottom:1px solid "
    "#ccc}img{max-width:100%;image-rendering:auto}"
    "figure{display:inline-block;margin:0 1em 1em "
    "0;vertical-align:top;max-width:100%}figcaption{color:#555;max-width:34em}"
    "table{border-collapse:collapse}td,th{padding:.15em .9em .15em 0;text-align:left}.dim{color:#888}"
    "@media(prefers-color-scheme:dark){body{color:#ddd;background:#181818}figcaption{color:#aaa}text{fill:#"
    "ccc}}";

std::string base64(std::span<const std::byte> data) {
  static const char* kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
  std::string out;
  for (size_t i = 0; i < data.size(); i += 3) {
    uint32_t v = 0;
    for (size_t k = 0; k < 3; ++k)
      v = v << 8 | (i + k < data.size() ? static_cast<uint32_t>(data[i + k]) : 0);
    for (size_t k = 0; k < 4; ++k) out += i + k > data.size() ? '=' : kDigits[v >> (18 - 6 * k) & 63];
  }
  return out;
}

}  // namespace

std::string escape(std::string_view s) {
  std::string out;
  for (char c : s) {
    if (c == '<')
      out += "&lt;";
    else if (c == '>')
      out += "&gt;";
    else if (c == '&')
      out += "&amp;";
    else
      out += c;
  }
  return out;
}

std::string embedded(std::span<const std::byte> png, std::string_view caption) {
  return text(
      "<figure><img src=\"data:image/png;base64,{}\" alt=\"{}\"><figcaption>{}</figcaption></figure>\n",
      base64(png), escape(caption), escape(caption));
}

std::string page_head(const std::string& title) {
  return "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><meta name=\"viewport\" "
         "content=\"width=device-width\"><title>Kiln: " +
         escape(title) + "</title><style>" + kStyle + "</style>\n<h1>" + escape(title) + "</h1>\n";
}

std::vector<size_t> by_texels(const std::vector<ObjectPlan>& objects) {
  std::vector<size_t> order(objects.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&](size_t a, size_t b) { return objects[a].texels > objects[b].texels; });
  return order;
}

std::string objects_table_html(const std::vector<ObjectPlan>& objects) {
  constexpr size_t kShown = 200;
  uint64_t all = 0, shown = 0;
  for (const ObjectPlan& o : objects) all += o.texels;
  const auto share = [&](uint64_t texels) {
    return 100.0 * static_cast<double>(texels) / static_cast<double>(std::max<uint64_t>(1, all));
  };
  std::string out =
      "<table><tr><th>object</th><th>mesh</th><th>material</th><th>charts</th><th>texels</th><th>share</"
      "th><th>to "
      "sample</th><th>texels per metre</th><th>area</th><th>factor</th></tr>\n";
  const std::vector<size_t> order = by_texels(objects);
  for (size_t i = 0; i < std::min(kShown, order.size()); ++i) {
    const ObjectPlan& o = objects[order[i]];
    shown += o.texels;
    out += text(
        "<tr><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{}</td><td>{:.1f} "
        "%</td><td>{}</td><td>{:.3g}</td>"
        "<td>{:.4g} m\u00b2</td><td>{:.3g}</td></tr>\n",
        escape(o.name), escape(o.mesh), escape(o.material), o.charts, o.texels, share(o.texels),
        o.valid_texels, o.texels_per_metre, o.square_metres, o.factor);
  }
  if (order.size() > kShown)
    out += text(
        "<tr class=\"dim\"><td>{} more</td><td></td><td></td><td></td><td>{}</td><td>{:.1f} %</td></tr>\n",
        order.size() - kShown, all - shown, share(all - shown));
  return out + "</table>\n";
}

}  // namespace kiln
