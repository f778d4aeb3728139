// A pass of its own rather than a callback of the parser: that callback walks an array's elements again for
// each of them, which takes hours for a million nodes.
#include "coordinator/scene/document/json_weight.h"

#include <nlohmann/json.hpp>

namespace kiln {
namespace {

using nlohmann::json;

// Measured: the JSON value in our document and in the parser's, and what the parser and the importer make of
// an element of a list at the root.
constexpr uint64_t kValue = 64, kObject = 300, kValueOfExtension = 360, kTimesTheText = 4;

uint64_t bytes_of_element(std::string_view list) {
  return list == "materials" ? 4000 : 500;
}

class Scale final : public nlohmann::json_sax<json> {
 public:
  JsonWeight weight;

  bool null() override { return value(); }
  bool boolean(bool) override { return value(); }
  bool number_integer(number_integer_t) override { return value(); }
  bool number_unsigned(number_unsigned_t) override { return value(); }
  bool number_float(number_float_t, const string_t&) override { return value(); }
  bool string(string_t&) override { return value(); }
  bool binary(binary_t&) override { return value(); }
  bool start_object(std::size_t) override {
    weight.bytes += depth_ == 2 ? bytes_of_element(list_) : kObject;
    return open();
  }
  bool end_object() override { return close(); }
  bool start_array(std::size_t) override { return open(); }
  bool end_array() override { return close(); }
  bool key(string_t& name) override {
    if (depth_ == 1) list_ = name;
    weight.bytes += kValue;  // the member's own node and name
    if (!extension_ && (name == "extensions" || name == "extras")) extension_ = depth_;
    return true;
  }
  bool parse_error(std::size_t position, const std::string&, const json::exception&) override {
    weight.bad_at = position;
    return false;
  }

 private:
  bool value() {
    weight.bytes += extension_ ? kValueOfExtension : kValue;
    if (depth_ == extension_) extension_ = 0;
    return true;
  }
  bool open() {
    weight.bytes += extension_ ? kValueOfExtension : kValue;
    weight.too_deep = ++depth_ > kMaxJsonDepth;
    return !weight.too_deep;
  }
  bool close() {
    if (--depth_ == extension_) extension_ = 0;
    return true;
  }

  int depth_ = 0;
  int extension_ = 0;  // depth of the object whose member "extensions" or "extras" is being read; 0: none
  std::string list_;   // member of the root
};

}  // namespace

JsonWeight weigh_json(std::string_view source) {
  Scale scale;
  json::sax_parse(source, &scale);
  scale.weight.bytes += kTimesTheText * source.size();
  return scale.weight;
}

}  // namespace kiln
