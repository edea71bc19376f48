#pragma once
// Names as numbers, by the Cryptomatte specification 1.2.0 (Psyop): a name's id is the MurmurHash3 of its
// UTF-8 bytes, as the bits of a float.
#include <cstdint>
#include <string>
#include <string_view>

namespace lightmill {

/// MurmurHash3_x86_32 (Appleby) with seed 0.
uint32_t murmur_hash3(std::string_view bytes);
/// "uint32_to_float32": the hash as a float's bits. Where they would be a zero, a denormal, an infinity or
/// NaN, the lowest bit of the exponent is flipped, so that programs may copy and compare the float.
uint32_t cryptomatte_bits(std::string_view name);
float cryptomatte_id(std::string_view name);
/// The bits as a manifest has them: 8 hexadecimal digits.
std::string cryptomatte_hex(std::string_view name);
/// What the names of all attributes of Cryptomatte begin with.
inline constexpr std::string_view kMatteAttributes = "cryptomatte/";
/// "cryptomatte/f834d0a/": what the names of a layer's attributes in a file begin with.
std::string cryptomatte_prefix(std::string_view layer);

}  // namespace lightmill
