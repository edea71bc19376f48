#include "common/image/cryptomatte/cryptomatte_hash.h"

#include <bit>
#include <cstdio>
#include <cstring>

namespace lightmill {
namespace {

constexpr uint32_t kLowestExponentBit = 1u << 23, kExponentMask = 255;
constexpr size_t kPrefixDigits = 7;

std::string hex(uint32_t value) {
  char text[9];
  std::snprintf(text, sizeof text, "%08x", value);
  return text;
}

uint32_t mixed(uint32_t block) { return std::rotl(block * 0xcc9e2d51u, 15) * 0x1b873593u; }

}  // namespace

uint32_t murmur_hash3(std::string_view bytes) {
  uint32_t hash = 0;
  const auto size = static_cast<uint32_t>(bytes.size());
  for (; bytes.size() >= sizeof hash; bytes.remove_prefix(sizeof hash)) {
    uint32_t block;
    std::memcpy(&block, bytes.data(), sizeof block);  // little-endian, as all machines that we run on
    hash = std::rotl(hash ^ mixed(block), 13) * 5 + 0xe6546b64u;
  }
  uint32_t tail = 0;
  std::memcpy(&tail, bytes.data(), bytes.size());
  if (!bytes.empty()) hash ^= mixed(tail);
  hash ^= size;
  hash = (hash ^ hash >> 16) * 0x85ebca6bu;
  hash = (hash ^ hash >> 13) * 0xc2b2ae35u;
  return hash ^ hash >> 16;
}

uint32_t cryptomatte_bits(std::string_view name) {
  const uint32_t hash = murmur_hash3(name), exponent = hash >> 23 & kExponentMask;
  return exponent == 0 || exponent == kExponentMask ? hash ^ kLowestExponentBit : hash;
}

float cryptomatte_id(std::string_view name) { return std::bit_cast<float>(cryptomatte_bits(name)); }

std::string cryptomatte_hex(std::string_view name) { return hex(cryptomatte_bits(name)); }

std::string cryptomatte_prefix(std::string_view layer) {
  return std::string(kMatteAttributes) + hex(murmur_hash3(layer)).substr(0, kPrefixDigits) + "/";
}

}  // namespace lightmill
