#include "common/scene/measured/tensor_file.h"

#include <bit>
#include <cstring>

#include "common/base/error.h"
#include "common/scene/problem_list.h"

namespace lightmill {
namespace {

constexpr size_t kMaxFields = 64, kMaxName = 256, kMaxDimensions = 8;
/// Bytes of a number, by type: none, then 8- to 64-bit integers (unsigned and signed), 16- to 64-bit floats.
constexpr size_t kTypeBytes[kTensorTypes] = {0, 1, 1, 2, 2, 4, 4, 8, 8, 2, 4, 8};
static_assert(std::endian::native == std::endian::little);

/// Takes values from the front.
class Cursor {
 public:
  explicit Cursor(std::string_view data) : left_(data) {}
  std::string_view take(size_t bytes) {
    if (left_.size() < bytes) fail_scene("is truncated: it ends within its list of fields");
    const std::string_view taken = left_.substr(0, bytes);
    left_.remove_prefix(bytes);
    return taken;
  }
  template <class T>
  T number() {
    T value;
    std::memcpy(&value, take(sizeof value).data(), sizeof value);
    return value;
  }

 private:
  std::string_view left_;
};

TensorField read_field(Cursor& in, std::string_view data) {
  TensorField field;
  const size_t length = in.number<uint16_t>();
  if (length > kMaxName) fail_scene("has a field whose name is longer than 256 bytes");
  field.name = in.take(length);
  const size_t dimensions = in.number<uint16_t>();
  const std::string named = "field " + in_quotes(field.name);
  if (dimensions == 0 || dimensions > kMaxDimensions)
    fail_scene("has a " + named + " of " + std::to_string(dimensions) + " dimensions");
  field.type = in.number<uint8_t>();
  if (field.type == 0 || field.type >= kTensorTypes) fail_scene("has a " + named + " of unknown type");
  const auto offset = in.number<uint64_t>();
  size_t bytes = kTypeBytes[field.type];
  const bool begins = offset <= data.size();
  const size_t room = begins ? data.size() - offset : 0;
  for (size_t i = 0; i < dimensions; ++i) {
    const auto size = in.number<uint64_t>();
    if (size == 0) fail_scene("has an empty " + named);
    if (!begins || size > room / bytes) fail_scene("is truncated: it ends within the " + named);
    bytes *= size;
    field.shape.push_back(size);
  }
  field.bytes = data.substr(offset, bytes);
  return field;
}

}  // namespace

size_t TensorField::count() const { return bytes.size() / kTypeBytes[type]; }

float TensorField::number(size_t i) const {
  float value;
  std::memcpy(&value, bytes.data() + i * sizeof value, sizeof value);
  return value;
}

std::vector<TensorField> parse_tensor_file(std::string_view data) {
  constexpr std::string_view kMagic("tensor_file\0", 12);
  if (!data.starts_with(kMagic)) fail_scene("is no tensor file: it does not begin with \"tensor_file\"");
  Cursor in(data.substr(kMagic.size()));
  const auto major = in.number<uint8_t>(), minor = in.number<uint8_t>();
  if (major != 1 || minor != 0) {
    fail_scene("is a tensor file of version " + std::to_string(major) + "." + std::to_string(minor) +
               "; only 1.0 is known");
  }
  const auto count = in.number<uint32_t>();
  if (count > kMaxFields) fail_scene("has more than 64 fields");
  std::vector<TensorField> fields;
  for (uint32_t i = 0; i < count; ++i) {
    TensorField field = read_field(in, data);
    for (const TensorField& other : fields) {
      if (other.name == field.name) fail_scene("has the field " + in_quotes(field.name) + " twice");
    }
    fields.push_back(std::move(field));
  }
  return fields;
}

}  // namespace lightmill
