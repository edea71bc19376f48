#include "common/scene/mesh/ply_header.h"

#include <charconv>
#include <optional>

#include "common/base/error.h"
#include "common/scene/problem_list.h"

namespace lightmill {
namespace {

constexpr size_t kMaxHeaderBytes = 1 << 16;
constexpr size_t kMaxProperties = 256;

struct TypeName {
  std::string_view name;
  PlyType type;
};
constexpr TypeName kTypes[] = {
    {"char", PlyType::kInt8},       {"int8", PlyType::kInt8},       {"uchar", PlyType::kUint8},
    {"uint8", PlyType::kUint8},     {"short", PlyType::kInt16},     {"int16", PlyType::kInt16},
    {"ushort", PlyType::kUint16},   {"uint16", PlyType::kUint16},   {"int", PlyType::kInt32},
    {"int32", PlyType::kInt32},     {"uint", PlyType::kUint32},     {"uint32", PlyType::kUint32},
    {"float", PlyType::kFloat32},   {"float32", PlyType::kFloat32}, {"double", PlyType::kFloat64},
    {"float64", PlyType::kFloat64},
};

PlyType type_named(std::string_view name) {
  for (const TypeName& t : kTypes) {
    if (t.name == name) return t.type;
  }
  fail_scene("has a property of unknown type " + in_quotes(name));
}

std::vector<std::string_view> words_of(std::string_view line) {
  std::vector<std::string_view> words;
  for (size_t i = 0; i < line.size();) {
    while (i < line.size() && (line[i] == ' ' || line[i] == '\t' || line[i] == '\r')) ++i;
    const size_t begin = i;
    while (i < line.size() && line[i] != ' ' && line[i] != '\t' && line[i] != '\r') ++i;
    if (i > begin) words.push_back(line.substr(begin, i - begin));
  }
  return words;
}

PlyFormat format_named(std::string_view name) {
  if (name == "ascii") return PlyFormat::kAscii;
  if (name == "binary_little_endian") return PlyFormat::kLittleEndian;
  if (name == "binary_big_endian") return PlyFormat::kBigEndian;
  fail_scene("has the unknown format " + in_quotes(name));
}

void add_property(const std::vector<std::string_view>& words, PlyHeader* header) {
  if (header->elements.empty()) fail_scene("has a property before any element");
  PlyElement& element = header->elements.back();
  if (element.properties.size() >= kMaxProperties) fail_scene("has more than 256 properties in an element");
  PlyProperty p;
  if (words.size() == 3) {
    p.type = type_named(words[1]);
    p.name = words[2];
  } else if (words.size() == 5 && words[1] == "list") {
    p.is_list = true;
    p.count_type = type_named(words[2]);
    p.type = type_named(words[3]);
    p.name = words[4];
    if (!is_ply_integer(p.count_type)) fail_scene("has a list whose count is not an integer");
  } else {
    fail_scene("has a malformed property line");
  }
  element.properties.push_back(std::move(p));
}

}  // namespace

size_t ply_type_size(PlyType type) {
  constexpr size_t kSizes[] = {1, 1, 2, 2, 4, 4, 4, 8};
  return kSizes[static_cast<size_t>(type)];
}

PlyHeader parse_ply_header(std::string_view data) {
  PlyHeader header;
  if (!data.starts_with("ply\n") && !data.starts_with("ply\r\n"))
    fail_scene("is no PLY file: it does not begin with \"ply\"");
  std::optional<PlyFormat> format;
  size_t at = data.find('\n') + 1;
  for (;;) {
    const size_t end = data.find('\n', at);
    if (end == std::string_view::npos || end > kMaxHeaderBytes) fail_scene("has no \"end_header\"");
    const auto words = words_of(data.substr(at, end - at));
    at = end + 1;
    if (words.empty() || words[0] == "comment" || words[0] == "obj_info") continue;
    if (words[0] == "end_header") break;
    if (words[0] == "format" && words.size() == 3) {
      format = format_named(words[1]);
    } else if (words[0] == "element" && words.size() == 3) {
      PlyElement element;
      element.name = words[1];
      const auto [stop, error] =
          std::from_chars(words[2].data(), words[2].data() + words[2].size(), element.count);
      if (error != std::errc() || stop != words[2].data() + words[2].size()) {
        fail_scene("has a malformed count of " + in_quotes(element.name));
      }
      header.elements.push_back(std::move(element));
    } else if (words[0] == "property") {
      add_property(words, &header);
    } else {
      fail_scene("has an unknown header line " + in_quotes(words[0]));
    }
  }
  if (!format) fail_scene("names no format");
  header.format = *format;
  header.bytes = at;
  return header;
}

}  // namespace lightmill
