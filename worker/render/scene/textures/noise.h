#pragma once
// Gradient noise and its sums, with fixed bits: additions, multiplications and floors only.
namespace lightmill {

/// A point of texture space.
struct NoisePoint {
  float x = 0, y = 0, z = 0;
};

/// Gradient noise (Perlin, "Improving Noise", 2002; gradients as pbrt-v4 picks them): within [-1, 1], 0 at
/// points with integer coordinates, period 256. Coordinates beyond 2^30 or not finite count as 0.
float gradient_noise(const NoisePoint& p);
/// Sum over i < octaves of omega^i noise(1.99^i p): fractional Brownian motion.
float fractal_noise(const NoisePoint& p, float omega, int octaves);
/// The same of absolute values: turbulence.
float turbulence(const NoisePoint& p, float omega, int octaves);

}  // namespace lightmill
