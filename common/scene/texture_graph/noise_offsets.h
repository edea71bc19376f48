#pragma once
// Offsets between the noises that one texture is made of.
#include <bit>
#include <cstdint>

#include "common/scene/texture_graph/jenkins_hash.h"

namespace lightmill {

/// How far noise `seed` of so many dimensions lies along `axis`: 100 to 200.
inline float noise_offset(int dimensions, int seed, int axis) {
  const uint32_t a = std::bit_cast<uint32_t>(static_cast<float>(seed)),
                 b = std::bit_cast<uint32_t>(static_cast<float>(axis));
  const uint32_t h = dimensions == 1 ? jenkins_hash<uint32_t>(a) : jenkins_hash<uint32_t>(a, b);
  return 100 + unit_float(h) * 100;
}

}  // namespace lightmill
