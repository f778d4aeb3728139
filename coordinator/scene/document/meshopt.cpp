#include "coordinator/scene/document/meshopt.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <vector>

#include "common/base/check.h"
#include "common/base/format.h"

namespace kiln {
namespace {

constexpr uint8_t kAttributeHeader = 0xa0, kTriangleHeader = 0xe1, kIndexHeader = 0xd1;
constexpr size_t kGroup = 16;  // elements whose bytes share a width
constexpr size_t kBlockBytes = 8192, kMostInBlock = 256;
constexpr size_t kLeastTail = 32;   // bytes
constexpr size_t kTableBytes = 16;  // at the end of packed triangles
constexpr size_t kIndexTail = 4;

tl::unexpected<Error> bad(std::string what) {
  return fail(ErrorKind::kInvalidInput, std::move(what));
}

// Bytes from the front; after the first one too many it gives zeros and is spent.
class Reader {
 public:
  explicit Reader(std::span<const std::byte> bytes) : bytes_(bytes) {}

  uint8_t byte() {
    if (at_ < bytes_.size()) return static_cast<uint8_t>(bytes_[at_++]);
    spent_ = true;
    return 0;
  }
  // Seven bits a byte, the lowest first, at most five bytes.
  uint32_t varint() {
    uint32_t value = 0;
    for (uint32_t shift = 0; shift < 35; shift += 7) {
      const uint32_t group = byte();
      value |= (group & 127) << shift;
      if (group < 128) break;
    }
    return value;
  }
  bool spent() const { return spent_; }
  size_t left() const { return bytes_.size() - at_; }

 private:
  std::span<const std::byte> bytes_;
  size_t at_ = 0;
  bool spent_ = false;
};

uint8_t unzigzag8(uint8_t v) {
  return static_cast<uint8_t>((v >> 1) ^ -(v & 1));
}
uint32_t unzigzag32(uint32_t v) {
  return (v >> 1) ^ (0u - (v & 1));
}

// Appendix A, attributes: the differences of one byte of 16 elements, in 0, 2, 4 or 8 bits each, the highest
// bits first; all bits set: the difference follows as a byte of its own, after the packed ones.
void read_group(Reader& reader, uint32_t width, std::array<uint8_t, kGroup>& out) {
  out.fill(0);
  if (width == 0) return;
  if (width == 3) {
    for (uint8_t& v : out) v = reader.byte();
    return;
  }
  const uint32_t bits = width == 1 ? 2 : 4, per_byte = 8 / bits;
  const auto escape = static_cast<uint8_t>((1u << bits) - 1);
  for (size_t i = 0; i < kGroup; i += per_byte) {
    const uint32_t packed = reader.byte();
    for (uint32_t k = 0; k < per_byte; ++k)
      out[i + k] = static_cast<uint8_t>(packed >> (8 - bits * (k + 1)) & escape);
  }
  for (uint8_t& v : out)
    if (v == escape) v = reader.byte();
}

// One byte of `count` elements, `stride` apart; `last` is that of the element before and becomes that of the
// last.
void read_channel(Reader& reader, size_t count, size_t stride, uint8_t& last, std::byte* out) {
  const size_t groups = (count + kGroup - 1) / kGroup;
  std::array<uint8_t, kMostInBlock / kGroup / 4> widths{};
  for (size_t i = 0; i < (groups + 3) / 4; ++i) widths[i] = reader.byte();
  std::array<uint8_t, kGroup> differences;
  for (size_t g = 0; g < groups; ++g) {
    read_group(reader, widths[g / 4] >> (g % 4 * 2) & 3, differences);
    for (size_t i = 0; i < std::min(kGroup, count - g * kGroup); ++i) {
      last = static_cast<uint8_t>(last + unzigzag8(differences[i]));
      out[(g * kGroup + i) * stride] = static_cast<std::byte>(last);
    }
  }
}

size_t block_elements(size_t stride) {
  return std::min(kMostInBlock, kBlockBytes / stride & ~(kGroup - 1));
}

size_t tail_bytes(size_t stride) {
  return std::max(kLeastTail, stride);
}

Status unpack_attributes(const MeshoptLayout& layout, std::span<const std::byte> packed,
                         std::span<std::byte> out) {
  const size_t stride = layout.stride, tail = tail_bytes(stride);
  if (packed.size() < 1 + tail)
    return bad(
        text("its packed attributes are {} bytes, fewer than the {} of none", packed.size(), 1 + tail));
  if (static_cast<uint8_t>(packed[0]) != kAttributeHeader)
    return bad(text("its packed attributes begin with {:#x} where version 0 begins with {:#x}",
                    static_cast<uint8_t>(packed[0]), kAttributeHeader));
  std::array<uint8_t, 256> last;  // the last element so far; at first the one at the end of the data
  std::memcpy(last.data(), &packed[packed.size() - stride], stride);
  Reader reader(packed.subspan(1, packed.size() - 1 - tail));
  const size_t most = block_elements(stride);
  for (size_t begin = 0; begin < layout.count; begin += most) {
    const size_t count = std::min(most, layout.count - begin);
    for (size_t channel = 0; channel < stride; ++channel)
      read_channel(reader, count, stride, last[channel], &out[begin * stride + channel]);
    if (reader.spent())
      return bad(text("its packed attributes end before element {} of {}", begin + count, layout.count));
  }
  if (reader.left() != 0) return bad(text("{} bytes of its packed attributes are left over", reader.left()));
  return {};
}

// Writes indices of 2 or 4 bytes; remembers whether one did not fit.
class IndexWriter {
 public:
  IndexWriter(std::span<std::byte> out, size_t stride) : out_(out), stride_(stride) {}
  void put(uint32_t index) {
    std::memcpy(&out_[at_], &index, stride_);  // little-endian, as glTF and this machine
    at_ += stride_;
    too_large_ |= stride_ == 2 && index > 0xffff;
  }
  bool too_large() const { return too_large_; }

 private:
  std::span<std::byte> out_;
  size_t stride_, at_ = 0;
  bool too_large_ = false;
};

// The last 16 of something; 0 is the latest.
template <class T>
class Recent {
 public:
  void push(const T& value) { values_[at_++ & 15] = value; }
  const T& at(uint32_t back) const { return values_[(at_ - 1 - back) & 15]; }

 private:
  std::array<T, 16> values_{};
  uint32_t at_ = 0;
};

struct Edge {
  uint32_t from = 0, to = 0;
};

// Appendix A, triangles. A code byte a triangle: an edge of a recent one and a corner, or three corners.
class TriangleReader {
 public:
  TriangleReader(std::span<const std::byte> data, std::span<const std::byte> table)
      : data_(data), table_(table) {}

  std::array<uint32_t, 3> read(uint8_t code) {
    if (code >= 0xf0) return whole(code);
    const Edge edge = edges_.at(code >> 4);
    uint32_t corner;
    const uint32_t how = code & 15;
    bool is_new = true;
    if (how == 0) {
      corner = next_++;
    } else if (how < 13) {
      corner = vertices_.at(how);
      is_new = false;
    } else {
      corner = last_ = how == 13 ? last_ - 1 : how == 14 ? last_ + 1 : last_ + unzigzag32(data_.varint());
    }
    if (is_new) vertices_.push(corner);
    edges_.push({corner, edge.to});
    edges_.push({edge.from, corner});
    return {edge.from, edge.to, corner};
  }
  bool spent() const { return data_.spent(); }
  size_t left() const { return data_.left(); }

 private:
  // How a corner is told: 0 the next vertex, 1 to 14 a recent one, 15 by its distance from the last so told.
  std::array<uint32_t, 3> whole(uint8_t code) {
    const bool by_table = code < 0xfe;
    const uint32_t pair = by_table ? static_cast<uint8_t>(table_[code & 15]) : data_.byte();
    const uint32_t how[3] = {code == 0xff ? 15u : 0u, pair >> 4, pair & 15};
    if (!by_table && pair == 0) next_ = 0;
    std::array<uint32_t, 3> corner{};
    // Vertices of all corners are counted and looked up before any distance is read.
    for (int k = 0; k < 3; ++k)
      if (how[k] == 0)
        corner[static_cast<size_t>(k)] = next_++;
      else if (how[k] < 15 || by_table)
        corner[static_cast<size_t>(k)] = vertices_.at(how[k] - 1);
    for (int k = 0; k < 3; ++k)
      if (how[k] == 15 && !by_table) corner[static_cast<size_t>(k)] = last_ += unzigzag32(data_.varint());
    for (int k = 0; k < 3; ++k)
      if (k == 0 || how[k] == 0 || (how[k] == 15 && !by_table))
        vertices_.push(corner[static_cast<size_t>(k)]);
    edges_.push({corner[1], corner[0]});
    edges_.push({corner[2], corner[1]});
    edges_.push({corner[0], corner[2]});
    return corner;
  }

  Reader data_;
  std::span<const std::byte> table_;
  Recent<uint32_t> vertices_;
  Recent<Edge> edges_;
  uint32_t next_ = 0, last_ = 0;
};

Status unpack_triangles(const MeshoptLayout& layout, std::span<const std::byte> packed,
                        std::span<std::byte> out) {
  const size_t triangles = layout.count / 3;
  if (packed.size() < 1 + triangles + kTableBytes)
    return bad(text("its packed triangles are {} bytes, fewer than the {} that {} need at least",
                    packed.size(), 1 + triangles + kTableBytes, triangles));
  if (static_cast<uint8_t>(packed[0]) != kTriangleHeader)
    return bad(text("its packed triangles begin with {:#x} where version 1 begins with {:#x}",
                    static_cast<uint8_t>(packed[0]), kTriangleHeader));
  TriangleReader reader(packed.subspan(1 + triangles, packed.size() - 1 - triangles - kTableBytes),
                        packed.last(kTableBytes));
  IndexWriter writer(out, layout.stride);
  for (size_t t = 0; t < triangles; ++t) {
    for (const uint32_t corner : reader.read(static_cast<uint8_t>(packed[1 + t]))) writer.put(corner);
    if (reader.spent()) return bad(text("its packed triangles end before triangle {} of {}", t, triangles));
    if (writer.too_large()) return bad(text("an index of triangle {} does not fit in 16 bits", t));
  }
  if (reader.left() != 0) return bad(text("{} bytes of its packed triangles are left over", reader.left()));
  return {};
}

// Appendix A, indices: distances from the last index of one of two sequences.
Status unpack_indices(const MeshoptLayout& layout, std::span<const std::byte> packed,
                      std::span<std::byte> out) {
  if (packed.size() < 1 + layout.count + kIndexTail)
    return bad(text("its packed indices are {} bytes, fewer than the {} that {} need at least", packed.size(),
                    1 + layout.count + kIndexTail, layout.count));
  if (static_cast<uint8_t>(packed[0]) != kIndexHeader)
    return bad(text("its packed indices begin with {:#x} where version 1 begins with {:#x}",
                    static_cast<uint8_t>(packed[0]), kIndexHeader));
  Reader reader(packed.subspan(1, packed.size() - 1 - kIndexTail));
  IndexWriter writer(out, layout.stride);
  uint32_t last[2] = {0, 0};
  for (size_t i = 0; i < layout.count; ++i) {
    const uint32_t v = reader.varint();
    uint32_t& sequence = last[v & 1];
    sequence += unzigzag32(v >> 1);
    writer.put(sequence);
    if (reader.spent()) return bad(text("its packed indices end before index {} of {}", i, layout.count));
    if (writer.too_large()) return bad(text("index {} does not fit in 16 bits", i));
  }
  if (reader.left() != 0) return bad(text("{} bytes of its packed indices are left over", reader.left()));
  return {};
}

template <class T>
T to_whole(float value) {
  return static_cast<T>(static_cast<int>(value + (value >= 0 ? 0.5f : -0.5f)));
}

// Appendix B, octahedral: x and y on the octahedron, z the value of one; w stays.
template <class T>
void unfilter_octahedral(std::span<std::byte> out) {
  constexpr float kOne = static_cast<float>(std::numeric_limits<T>::max());
  for (size_t i = 0; i < out.size(); i += 4 * sizeof(T)) {
    T v[4];
    std::memcpy(v, &out[i], sizeof v);
    float x = v[0], y = v[1];
    const float z = static_cast<float>(v[2]) - std::abs(x) - std::abs(y);
    const float fold = std::min(z, 0.0f);
    x += x >= 0 ? fold : -fold;
    y += y >= 0 ? fold : -fold;
    const float norm = std::sqrt(x * x + y * y + z * z);
    const float scale = norm > 0 ? kOne / norm : 0.0f;
    v[0] = to_whole<T>(x * scale), v[1] = to_whole<T>(y * scale), v[2] = to_whole<T>(z * scale);
    std::memcpy(&out[i], v, sizeof v);
  }
}

// Appendix B, quaternion: the three least components, and in w the scale and which one was left out.
void unfilter_quaternion(std::span<std::byte> out) {
  constexpr float kOne = 32767.0f;
  for (size_t i = 0; i < out.size(); i += 8) {
    int16_t v[4];
    std::memcpy(v, &out[i], sizeof v);
    const float scale = std::sqrt(0.5f) / static_cast<float>(v[3] | 3);
    const float x = static_cast<float>(v[0]) * scale, y = static_cast<float>(v[1]) * scale,
                z = static_cast<float>(v[2]) * scale;
    const float w = std::sqrt(std::max(0.0f, 1 - x * x - y * y - z * z));
    const auto most = static_cast<size_t>(v[3] & 3);
    const float of[4] = {w, x, y, z};
    for (size_t k = 0; k < 4; ++k) {
      const float limited = std::clamp(of[k], -1.0f, 1.0f);
      v[(most + k) & 3] = to_whole<int16_t>(limited * kOne);
    }
    std::memcpy(&out[i], v, sizeof v);
  }
}

// Appendix B, exponential: 8 bits of exponent, 24 of mantissa, to a float.
void unfilter_exponential(std::span<std::byte> out) {
  for (size_t i = 0; i < out.size(); i += 4) {
    int32_t v;
    std::memcpy(&v, &out[i], sizeof v);
    const int32_t mantissa = static_cast<int32_t>(static_cast<uint32_t>(v) << 8) >> 8;
    const float value = std::ldexp(static_cast<float>(mantissa), v >> 24);
    std::memcpy(&out[i], &value, sizeof value);
  }
}

}  // namespace

Status check_meshopt(const MeshoptLayout& l) {
  if (l.mode != MeshoptMode::kAttributes) {
    if (l.stride != 2 && l.stride != 4)
      return bad(text("its stride is {}: indices have 2 or 4 bytes", l.stride));
    if (l.filter != MeshoptFilter::kNone) return bad("it has a filter, which indices have not");
    if (l.mode == MeshoptMode::kTriangles && l.count % 3 != 0)
      return bad(text("its count is {}: triangles have three indices each", l.count));
    return {};
  }
  if (l.stride == 0 || l.stride > 256 || l.stride % 4 != 0)
    return bad(text("its stride is {}: attributes have a multiple of 4, at most 256 bytes", l.stride));
  if (l.filter == MeshoptFilter::kOctahedral && l.stride != 4 && l.stride != 8)
    return bad(text("its stride is {}: the octahedral filter takes 4 or 8 bytes", l.stride));
  if (l.filter == MeshoptFilter::kQuaternion && l.stride != 8)
    return bad(text("its stride is {}: the quaternion filter takes 8 bytes", l.stride));
  return {};
}

size_t most_meshopt_elements(const MeshoptLayout& l, size_t bytes) {
  if (l.mode == MeshoptMode::kIndices) return bytes;
  if (l.mode == MeshoptMode::kTriangles) return 3 * std::min(bytes, SIZE_MAX / 3);
  const size_t least = tail_bytes(l.stride) + 1;  // a block of equal elements is `stride` bytes at least
  return bytes < least ? 0 : ((bytes - least) / l.stride) * block_elements(l.stride);
}

Status unpack_meshopt(const MeshoptLayout& l, std::span<const std::byte> packed, std::span<std::byte> out) {
  KILN_CHECK(out.size() == l.count * l.stride);
  if (l.mode == MeshoptMode::kTriangles) return unpack_triangles(l, packed, out);
  if (l.mode == MeshoptMode::kIndices) return unpack_indices(l, packed, out);
  KILN_TRY_STATUS(unpack_attributes(l, packed, out));
  if (l.filter == MeshoptFilter::kOctahedral && l.stride == 4) unfilter_octahedral<int8_t>(out);
  if (l.filter == MeshoptFilter::kOctahedral && l.stride == 8) unfilter_octahedral<int16_t>(out);
  if (l.filter == MeshoptFilter::kQuaternion) unfilter_quaternion(out);
  if (l.filter == MeshoptFilter::kExponential) unfilter_exponential(out);
  return {};
}

}  // namespace kiln
