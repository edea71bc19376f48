#include "worker/render/scene/textures/noise.h"

#include <cmath>

#include "worker/render/scene/textures/gradient_noise.h"

namespace lightmill {
namespace {

constexpr float kLacunarity = 1.99f;  // not 2: octaves would share their zeros

NoisePoint scaled(const NoisePoint& p, float s) { return {p.x * s, p.y * s, p.z * s}; }

}  // namespace

float gradient_noise(const NoisePoint& p) { return gradient_noise<float>({p.x, p.y, p.z}); }

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
