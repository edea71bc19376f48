#include "worker/render/scene/textures/noise.h"

#include <cmath>
#include <cstdint>

namespace lightmill {
namespace {

/// Perlin's permutation of 0-255.
constexpr uint8_t kPermutation[256] = {
    151, 160, 137, 91,  90,  15,  131, 13,  201, 95,  96,  53,  194, 233, 7,   225, 140, 36,  103, 30,
    69,  142, 8,   99,  37,  240, 21,  10,  23,  190, 6,   148, 247, 120, 234, 75,  0,   26,  197, 62,
    94,  252, 219, 203, 117, 35,  11,  32,  57,  177, 33,  88,  237, 149, 56,  87,  174, 20,  125, 136,
    171, 168, 68,  175, 74,  165, 71,  134, 139, 48,  27,  166, 77,  146, 158, 231, 83,  111, 229, 122,
    60,  211, 133, 230, 220, 105, 92,  41,  55,  46,  245, 40,  244, 102, 143, 54,  65,  25,  63,  161,
    1,   216, 80,  73,  209, 76,  132, 187, 208, 89,  18,  169, 200, 196, 135, 130, 116, 188, 159, 86,
    164, 100, 109, 198, 173, 186, 3,   64,  52,  217, 226, 250, 124, 123, 5,   202, 38,  147, 118, 126,
    255, 82,  85,  212, 207, 206, 59,  227, 47,  16,  58,  17,  182, 189, 28,  42,  223, 183, 170, 213,
    119, 248, 152, 2,   44,  154, 163, 70,  221, 153, 101, 155, 167, 43,  172, 9,   129, 22,  39,  253,
    19,  98,  108, 110, 79,  113, 224, 232, 178, 185, 112, 104, 218, 246, 97,  228, 251, 34,  242, 193,
    238, 210, 144, 12,  191, 179, 162, 241, 81,  51,  145, 235, 249, 14,  239, 107, 49,  192, 214, 31,
    181, 199, 106, 157, 184, 84,  204, 176, 115, 121, 50,  45,  127, 4,   150, 254, 138, 236, 205, 93,
    222, 114, 67,  29,  24,  72,  243, 141, 128, 195, 78,  66,  215, 61,  156, 180};

int permute(int i) { return kPermutation[i & 255]; }

/// The gradient of a lattice point times the offset from it.
float gradient(int x, int y, int z, float dx, float dy, float dz) {
  const int h = permute(permute(permute(x) + y) + z) & 15;
  const float a = h < 8 || h == 12 || h == 13 ? dx : dy;
  const float b = h < 4 || h == 12 || h == 13 ? dy : dz;
  return (h & 1 ? -a : a) + (h & 2 ? -b : b);
}

float smooth(float t) { return t * t * t * (t * (t * 6 - 15) + 10); }
float mix(float t, float a, float b) { return (1 - t) * a + t * b; }

/// Finite and within what an int can hold.
float usable(float x) { return std::fabs(x) < 0x1p30f ? x : 0; }

constexpr float kLacunarity = 1.99f;  // not 2: octaves would share their zeros

NoisePoint scaled(const NoisePoint& p, float s) { return {p.x * s, p.y * s, p.z * s}; }

}  // namespace

float gradient_noise(const NoisePoint& p) {
  const float x = usable(p.x), y = usable(p.y), z = usable(p.z);
  const float fx = std::floor(x), fy = std::floor(y), fz = std::floor(z);
  const float dx = x - fx, dy = y - fy, dz = z - fz;
  // Cells of the period, so that neighbours stay in int.
  const int ix = static_cast<int>(fx) & 255, iy = static_cast<int>(fy) & 255, iz = static_cast<int>(fz) & 255;
  const float wx = smooth(dx), wy = smooth(dy), wz = smooth(dz);
  float plane[2];
  for (int k = 0; k < 2; ++k) {
    float row[2];
    for (int j = 0; j < 2; ++j) {
      const float ey = dy - static_cast<float>(j), ez = dz - static_cast<float>(k);
      row[j] =
          mix(wx, gradient(ix, iy + j, iz + k, dx, ey, ez), gradient(ix + 1, iy + j, iz + k, dx - 1, ey, ez));
    }
    plane[k] = mix(wy, row[0], row[1]);
  }
  return mix(wz, plane[0], plane[1]);
}

float fractal_noise(const NoisePoint& p, float omega, int octaves) {
  float sum = 0, frequency = 1, weight = 1;
  for (int i = 0; i < octaves; ++i) {
    sum += weight * gradient_noise(scaled(p, frequency));
    frequency *= kLacunarity;
    weight *= omega;
  }
  return sum;
}

float turbulence(const NoisePoint& p, float omega, int octaves) {
  float sum = 0, frequency = 1, weight = 1;
  for (int i = 0; i < octaves; ++i) {
    sum += weight * std::fabs(gradient_noise(scaled(p, frequency)));
    frequency *= kLacunarity;
    weight *= omega;
  }
  return sum;
}

}  // namespace lightmill
