#include "common/scene/gltf/json/container.h"

#include <array>
#include <bit>
#include <cstdint>
#include <cstring>

#include "common/scene/gltf/json/json.h"
#include "common/scene/problem_list.h"

namespace lightmill {
namespace {

static_assert(std::endian::native == std::endian::little, "glTF's numbers are little-endian");

constexpr uint32_t kMagic = 0x46546C67, kJsonChunk = 0x4E4F534A, kBinaryChunk = 0x004E4942;

[[noreturn]] void fail_container(const std::string& message) { throw GltfProblem{"", message}; }

uint32_t word_at(const std::string& bytes, size_t offset) {
  uint32_t x;
  std::memcpy(&x, bytes.data() + offset, sizeof x);
  return x;
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  if (c >= 'a' && c <= 'f') return c - 'a' + 10;
  if (c >= 'A' && c <= 'F') return c - 'A' + 10;
  return -1;
}

std::string percent_decoded(std::string_view text) {
  std::string out;
  for (size_t i = 0; i < text.size(); ++i) {
    const bool code =
        text[i] == '%' && i + 2 < text.size() && hex_digit(text[i + 1]) >= 0 && hex_digit(text[i + 2]) >= 0;
    out += code ? static_cast<char>(hex_digit(text[i + 1]) * 16 + hex_digit(text[i + 2])) : text[i];
    if (code) i += 2;
  }
  return out;
}

std::string base64_decoded(std::string_view text) {
  static constexpr auto kValues = [] {
    std::array<int8_t, 256> v{};
    v.fill(-1);
    constexpr std::string_view kAlphabet = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
    for (size_t i = 0; i < kAlphabet.size(); ++i)
      v[static_cast<unsigned char>(kAlphabet[i])] = static_cast<int8_t>(i);
    v['-'] = 62, v['_'] = 63;  // of the alphabet for URLs
    return v;
  }();
  while (text.ends_with('=') || text.ends_with('\n')) text.remove_suffix(1);
  std::string out;
  out.reserve(text.size() / 4 * 3 + 3);
  uint32_t bits = 0;
  int have = 0;
  for (const char c : text) {
    if (c == '\n' || c == '\r' || c == ' ') continue;  // lines of a mail
    const signed char value = kValues[static_cast<unsigned char>(c)];
    if (value < 0) fail_container("the data URI holds a character that is not base64");
    bits = bits << 6 | static_cast<unsigned char>(value);
    have += 6;
    if (have >= 8) {
      have -= 8;
      out += static_cast<char>(bits >> have & 0xff);
    }
  }
  if (have >= 6) fail_container("the data URI is cut off");
  return out;
}

}  // namespace

GltfContainer open_gltf_container(std::string contents) {
  constexpr size_t kHeader = 12, kChunkHeader = 8, kPadding = 3;  // bytes; chunks are padded to 4
  if (contents.size() < 4 || word_at(contents, 0) != kMagic) return {std::move(contents), std::nullopt};
  if (contents.size() < kHeader) fail_container("the .glb file is cut off within its header");
  if (const uint32_t version = word_at(contents, 4); version != 2)
    fail_container("this .glb file is of version " + std::to_string(version) +
                   "; convert it: gltf-pipeline -i old.glb -o new.glb");
  // What its header says of its length is wrong in many files; the chunks are what counts.
  const size_t length = contents.size();
  GltfContainer out;
  bool first = true;
  for (size_t at = kHeader; at + kChunkHeader <= length; first = false) {
    const size_t size = word_at(contents, at);
    const uint32_t type = word_at(contents, at + 4);
    at += kChunkHeader;
    const bool wanted = first || (type == kBinaryChunk && !out.binary);
    if (wanted && size > length - at + kPadding) {
      fail_container("the .glb file is cut off: a chunk of " + std::to_string(size) + " bytes has " +
                     std::to_string(length - at));
    }
    if (first && type != kJsonChunk) fail_container("the .glb file must begin with a JSON chunk");
    if (first) out.json = contents.substr(at, size);
    if (type == kBinaryChunk && !out.binary) out.binary = contents.substr(at, size);
    if (size > length - at) break;
    at += size;
  }
  if (first) fail_container("the .glb file has no JSON chunk");
  return out;
}

std::optional<std::string> decode_data_uri(const std::string& uri) {
  if (!uri.starts_with("data:")) return std::nullopt;
  const size_t comma = uri.find(',');
  if (comma == std::string::npos) fail_container("the data URI has no data");
  const std::string_view header = std::string_view(uri).substr(0, comma);
  const std::string_view data = std::string_view(uri).substr(comma + 1);
  return header.ends_with(";base64") ? base64_decoded(data) : percent_decoded(data);
}

std::string path_of_uri(const std::string& uri) {
  const size_t colon = uri.find(':');
  if (colon != std::string::npos && uri.find('/') > colon)
    fail_container("the URI " + in_quotes(uri) + " is no file beside the scene; save it there and name it");
  return percent_decoded(uri);
}

}  // namespace lightmill
