#include "coordinator/scene/document/uri.h"

#include <array>

#include "common/base/files.h"
#include "common/base/format.h"

namespace kiln {
namespace fs = std::filesystem;
namespace {

tl::unexpected<Error> bad(std::string what) {
  return fail(ErrorKind::kInvalidInput, std::move(what));
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

std::string percent_decode(const std::string& in) {
  std::string out;
  for (size_t i = 0; i < in.size(); ++i) {
    const int high = in[i] == '%' && i + 2 < in.size() ? hex_digit(in[i + 1]) : -1;
    const int low = high >= 0 ? hex_digit(in[i + 2]) : -1;
    if (low >= 0) i += 2;
    out.push_back(low >= 0 ? static_cast<char>(high * 16 + low) : in[i]);
  }
  return out;
}

// "name:" at the start, as in http: or C:.
bool has_scheme(const std::string& uri) {
  const size_t colon = uri.find(':');
  return colon != std::string::npos && uri.find_first_of("/?#%") > colon;
}

std::string shortened(const std::string& uri) {
  return uri.size() <= 80 ? uri : uri.substr(0, 77) + "...";
}

Expected<Bytes> decode_base64(std::string_view in) {
  static const std::array<int8_t, 256> digits = [] {
    std::array<int8_t, 256> table;
    table.fill(-1);
    const std::string_view alphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < alphabet.size(); ++i)
      table[static_cast<uint8_t>(alphabet[i])] = static_cast<int8_t>(i);
    return table;
  }();
  while (!in.empty() && in.back() == '=') in.remove_suffix(1);
  Bytes out;
  out.reserve(in.size() / 4 * 3 + 3);
  uint32_t bits = 0;
  int have = 0;
  for (size_t i = 0; i < in.size(); ++i) {
    const int8_t digit = digits[static_cast<uint8_t>(in[i])];
    if (digit < 0) return bad(text("character {} of its base64 text is not base64", i));
    bits = bits << 6 | static_cast<uint32_t>(digit);
    have += 6;
    if (have >= 8) {
      have -= 8;
      out.push_back(static_cast<std::byte>(bits >> have & 0xff));
    }
  }
  return out;
}

Expected<Bytes> decode_data_uri(const std::string& uri) {
  const size_t comma = uri.find(',');
  if (comma == std::string::npos) return bad("its data: URI has no comma");
  const std::string_view head = std::string_view(uri).substr(0, comma);
  if (!head.ends_with(";base64")) return bad("its data: URI is not base64");
  return decode_base64(std::string_view(uri).substr(comma + 1));
}

}  // namespace

Expected<fs::path> resolve_uri(const fs::path& folder, const std::string& uri) {
  if (has_scheme(uri)) return bad(text("'{}' is not a relative URI", shortened(uri)));
  const std::string decoded = percent_decode(uri);
  if (decoded.empty() || decoded.find('\0') != std::string::npos) return bad("its URI names no file");
  const fs::path relative = fs::path(decoded).lexically_normal();
  if (relative.is_absolute()) return bad(text("'{}' is an absolute path", shortened(uri)));
  if (!relative.empty() && *relative.begin() == "..")
    return bad(text("'{}' leaves the folder of the scene", shortened(uri)));
  return folder / relative;
}

Expected<Bytes> read_uri(const fs::path& folder, const std::string& uri) {
  if (uri.starts_with("data:")) return decode_data_uri(uri);
  KILN_TRY(const fs::path path, resolve_uri(folder, uri));
  std::error_code code;
  if (!fs::exists(path, code)) return bad(text("missing file {}", shortened(uri)));
  return read_file(path);
}

}  // namespace kiln
