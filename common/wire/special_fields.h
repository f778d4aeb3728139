// Internal to common/wire: fields whose bytes differ from what common/base/fields.h makes of their types.
#pragma once

#include "common/base/fields.h"

namespace kiln {

// The rest of the payload as plain text, at most kMaxTextBytes of it: any two versions can read it.
template <class Text>
struct RestOfText {
  Text& text;
  void put(ByteWriter& w) const {
    for (const char c : std::string_view(text).substr(0, kMaxTextBytes)) w.put(c);
  }
  void get(FieldReader& r) {
    const auto rest = r.take_rest();
    text.assign(reinterpret_cast<const char*>(rest.data()), std::min(rest.size(), kMaxTextBytes));
  }
  void parts(auto& v) { v(text); }
};
template <class Text>
RestOfText(Text&) -> RestOfText<Text>;

// Bytes of a piece of a chunk: u32 size, u8 codec (0 raw, 1 zstd), array. What zstd cannot shrink is sent
// raw.
void put_packed(ByteWriter& w, const Bytes& bytes, bool compress);
void get_packed(FieldReader& r, Bytes& bytes, bool& compress);

template <class B, class Flag>
struct PackedBytes {
  B& bytes;
  Flag& compress;
  void put(ByteWriter& w) const { put_packed(w, bytes, compress); }
  void get(FieldReader& r) { get_packed(r, bytes, compress); }
  void parts(auto& v) { v(bytes, compress); }
};
template <class B, class Flag>
PackedBytes(B&, Flag&) -> PackedBytes<B, Flag>;

}  // namespace kiln
