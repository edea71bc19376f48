#include "worker/render/scene/textures/procedural.h"

#include <algorithm>
#include <cmath>

#include "worker/render/math/angle.h"
#include "worker/render/scene/textures/noise.h"

namespace lightmill {
namespace {

/// The point in texture space.
NoisePoint texture_space(const Transform& t, const Vec3d& p) {
  const auto row = [&](size_t i) {
    return static_cast<float>(t.m[i][0] * p.x + t.m[i][1] * p.y + t.m[i][2] * p.z + t.m[i][3]);
  };
  return {row(0), row(1), row(2)};
}

bool odd(float x) { return std::fmod(x, 2.0f) != 0; }

float windy(const NoisePoint& p) {
  const float gust = fractal_noise({0.1f * p.x, 0.1f * p.y, 0.1f * p.z}, 0.5f, 3);
  return std::fabs(gust) * fractal_noise(p, 0.5f, 6);
}

/// Control points of the veins' colours along [0, 1], a cubic Bezier curve from each; pbrt-v4's.
constexpr float kVeins[9][3] = {{0.58f, 0.58f, 0.6f}, {0.58f, 0.58f, 0.6f}, {0.58f, 0.58f, 0.6f},
                                {0.5f, 0.5f, 0.5f},   {0.6f, 0.59f, 0.58f}, {0.58f, 0.58f, 0.6f},
                                {0.58f, 0.58f, 0.6f}, {0.2f, 0.2f, 0.33f},  {0.58f, 0.58f, 0.6f}};
constexpr int kVeinSegments = 6;

Rgb marble(const NoiseTexture& texture, NoisePoint p) {
  p = {p.x * texture.scale, p.y * texture.scale, p.z * texture.scale};
  const float phase = p.y + texture.variation * fractal_noise(p, texture.roughness, texture.octaves);
  const float in_turns = std::fabs(phase) < 1e6f ? phase * (0.5f * kInvPi) : 0;
  float sine, cosine;
  sincos_2pi(in_turns - std::floor(in_turns), &sine, &cosine);
  const float t = std::clamp(0.5f + 0.5f * sine, 0.0f, 1.0f) * kVeinSegments;
  const int first = std::min(static_cast<int>(t), kVeinSegments - 1);
  const float x = t - static_cast<float>(first), y = 1 - x;
  const float w[4] = {y * y * y, 3 * x * y * y, 3 * x * x * y, x * x * x};
  float c[3] = {0, 0, 0};
  for (int i = 0; i < 4; ++i) {
    for (int k = 0; k < 3; ++k) c[k] += 1.5f * w[i] * kVeins[first + i][k];
  }
  return {c[0], c[1], c[2]};
}

}  // namespace

MappedPoint map_point(const UvMapping& m, const TexturePoint& at) {
  if (m.kind == MappingKind::kUv) {
    // The mixed terms only where there are any, so that none of them rounds.
    if (m.sv_u == 0 && m.su_v == 0) return {m.su * at.u + m.du, m.sv * at.v + m.dv};
    return {m.su * at.u + m.sv_u * at.v + m.du, m.sv * at.v + m.su_v * at.u + m.dv};
  }
  const NoisePoint p = texture_space(m.world_to_texture, at.p);
  if (m.kind == MappingKind::kPlanar) {
    const auto along = [&](const Vec3d& a) { return static_cast<float>(p.x * a.x + p.y * a.y + p.z * a.z); };
    return {m.du + along(m.s_axis), m.dv + along(m.t_axis)};
  }
  const float r = std::sqrt(p.x * p.x + p.y * p.y);
  if (m.kind == MappingKind::kSpherical) return {2 * turns(r, p.z), turns(p.y, p.x)};
  const float azimuth = turns(p.y, p.x) + 0.5f;  // pi + atan2 in turns, atan2 being in (-pi, pi]
  return {azimuth > 1 ? azimuth - 1 : azimuth, p.z};
}

bool second_square(const CheckerboardTexture& board, const TexturePoint& at) {
  if (board.solid) {
    const NoisePoint p = texture_space(board.mapping.world_to_texture, at.p);
    return odd(std::floor(p.x) + std::floor(p.y) + std::floor(p.z));
  }
  const MappedPoint m = map_point(board.mapping, at);
  return odd(std::floor(m.s) + std::floor(m.t));
}

Rgb bilerp(const BilerpTexture& b, const TexturePoint& at) {
  const MappedPoint m = map_point(b.mapping, at);
  const float s = m.s, t = m.t;
  const auto mix = [&](float c00, float c01, float c10, float c11) {
    return (1 - s) * ((1 - t) * c00 + t * c01) + s * ((1 - t) * c10 + t * c11);
  };
  return {mix(b.v00.r, b.v01.r, b.v10.r, b.v11.r), mix(b.v00.g, b.v01.g, b.v10.g, b.v11.g),
          mix(b.v00.b, b.v01.b, b.v10.b, b.v11.b)};
}

bool inside_dot(const MappedPoint& at) {
  constexpr float kRadius = 0.35f, kMaxShift = 0.5f - kRadius;
  const float s = std::floor(at.s + 0.5f), t = std::floor(at.t + 0.5f);
  const auto noise = [&](float ds, float dt) { return gradient_noise({s + ds, t + dt, 0.5f}); };
  if (!(noise(0.5f, 0.5f) > 0)) return false;
  const float ds = at.s - (s + kMaxShift * noise(1.5f, 2.8f)),
              dt = at.t - (t + kMaxShift * noise(4.5f, 9.8f));
  return ds * ds + dt * dt < kRadius * kRadius;
}

Rgb noise_color(const NoiseTexture& texture, const TexturePoint& at) {
  const NoisePoint p = texture_space(texture.world_to_texture, at.p);
  if (texture.kind == NoiseKind::kMarble) return marble(texture, p);
  const float x = texture.kind == NoiseKind::kWindy ? windy(p)
                  : texture.kind == NoiseKind::kWrinkled
                      ? turbulence(p, texture.roughness, texture.octaves)
                      : fractal_noise(p, texture.roughness, texture.octaves);
  return {x, x, x};
}

}  // namespace lightmill
