#pragma once
// Gradient noise over a lane type: the same bits for all of them.
#include <cstdint>

#include "worker/render/math/vec.h"

namespace lightmill {

/// Perlin's permutation of 0-255.
inline constexpr int32_t kNoisePermutation[256] = {
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

/// gradient_noise of noise.h.
template <class F>
inline F gradient_noise(const Vec3<F>& p) {
  using I = IntOf<F>;
  const auto usable = [](F x) { return select(MaskOf<F>(abs(x) < 0x1p30f), x, F{}); };
  const auto permute = [](I i) { return gather(kNoisePermutation, i & 255); };
  const auto smooth = [](F t) { return t * t * t * (t * (t * 6.0f - 15.0f) + 10.0f); };
  const auto mix = [](F t, F a, F b) { return (1.0f - t) * a + t * b; };
  // The gradient of a lattice point, by its number, times the offset from it.
  const auto gradient = [&](I number, F dx, F dy, F dz) {
    const I h = permute(number) & 15;
    const MaskOf<F> last = mask_or(MaskOf<F>(h == 12), MaskOf<F>(h == 13));
    const F a = select(mask_or(MaskOf<F>(h < 8), last), dx, dy);
    const F b = select(mask_or(MaskOf<F>(h < 4), last), dy, dz);
    return select(MaskOf<F>((h & 1) != 0), -a, a) + select(MaskOf<F>((h & 2) != 0), -b, b);
  };
  const F x = usable(p.x), y = usable(p.y), z = usable(p.z);
  const F fx = floor(x), fy = floor(y), fz = floor(z);
  const F dx = x - fx, dy = y - fy, dz = z - fz;
  // Cells of the period, so that neighbours stay in int.
  const I ix = to_int(fx) & 255, iy = to_int(fy) & 255, iz = to_int(fz) & 255;
  const I here = permute(ix), next = permute(ix + 1);
  const F wx = smooth(dx), wy = smooth(dy), wz = smooth(dz);
  F plane[2];
  for (int k = 0; k < 2; ++k) {
    F row[2];
    for (int j = 0; j < 2; ++j) {
      const F ey = dy - static_cast<float>(j), ez = dz - static_cast<float>(k);
      row[j] = mix(wx, gradient(permute(here + iy + j) + iz + k, dx, ey, ez),
                   gradient(permute(next + iy + j) + iz + k, dx - 1.0f, ey, ez));
    }
    plane[k] = mix(wy, row[0], row[1]);
  }
  return mix(wz, plane[0], plane[1]);
}

}  // namespace lightmill
