#include "worker/render/light/light_table.h"

#include <algorithm>
#include <cmath>

#include "worker/render/light/alias_table.h"

namespace lightmill {
namespace {

/// With a tree, lights at infinity are chosen this often: nothing tells which of the two matter where.
constexpr float kInfinityShare = 0.5f;

/// Puts the sphere around the box.
void enclose(LightBound* b) {
  double diagonal2 = 0;
  for (int i = 0; i < 3; ++i) {
    b->center[i] = 0.5 * (b->lo[i] + b->hi[i]);
    diagonal2 += (b->hi[i] - b->lo[i]) * (b->hi[i] - b->lo[i]);
  }
  b->radius = 0.5 * std::sqrt(diagonal2);
}

/// Bounds of a light that is not at infinity.
LightBound bound_of(LightType type, const float* r, double power) {
  LightBound b;
  const auto set = [&](const double(*points)[3], int count) {
    for (int i = 0; i < 3; ++i) {
      b.lo[i] = b.hi[i] = points[0][i];
      for (int k = 1; k < count; ++k) {
        b.lo[i] = std::min(b.lo[i], points[k][i]);
        b.hi[i] = std::max(b.hi[i], points[k][i]);
      }
    }
    enclose(&b);
  };
  if (type == kVolumeLight) {
    for (int i = 0; i < 3; ++i) {
      b.lo[i] = b.hi[i] = double{r[kLightP + i]};
      for (const int edge : {kLightE1, kLightE2, kLightN}) {
        b.lo[i] += std::min(double{r[edge + i]}, 0.0);
        b.hi[i] += std::max(double{r[edge + i]}, 0.0);
      }
    }
    enclose(&b);
    b.intensity = power / (4 * M_PI);
    b.cos_emission = -1;
    return b;
  }
  // In its brightest direction: kLightArea is 1 for a light at a point.
  const double brightest =
      (double{r[kLightRadiance]} + r[kLightRadiance + 1] + r[kLightRadiance + 2]) / 3 * double{r[kLightArea]};
  double p[3][3];
  for (int i = 0; i < 3; ++i) {
    p[0][i] = r[kLightP + i];
    p[1][i] = p[0][i] + r[kLightE1 + i];
    p[2][i] = p[0][i] + r[kLightE2 + i];
  }
  if (type == kRectangleLamp || type == kEllipseLamp) {
    double corners[4][3];
    for (int i = 0; i < 3; ++i) {
      const double c = p[0][i], x = double{r[kLightE1 + i]}, y = double{r[kLightE2 + i]};
      corners[0][i] = c + x + y, corners[1][i] = c + x - y, corners[2][i] = c - x + y,
      corners[3][i] = c - x - y;
    }
    set(corners, 4);
    std::copy(r + kLightN, r + kLightN + 3, b.axis);
    b.intensity = brightest;
    return b;
  }
  if (type == kTriangleLight) {
    set(p, 3);
    std::copy(r + kLightN, r + kLightN + 3, b.axis);
    b.two_sided = r[kLightTwoSided] > 0;
    b.intensity = power / (M_PI * (b.two_sided ? 2 : 1));
    return b;
  }
  set(p, 1);
  b.intensity = power / (4 * M_PI);
  b.cos_emission = -1;
  if (type == kSphereLight || type == kFacingLamp) {
    b.radius = double{r[3]};
    for (int i = 0; i < 3; ++i) {
      b.lo[i] -= b.radius;
      b.hi[i] += b.radius;
    }
  }
  if (type == kSpotLight || (type == kFacingLamp && r[5] > 0)) {
    std::copy(r + kLightN, r + kLightN + 3, b.axis);
    b.cos_emission = 1 - double{r[5]};
    b.intensity = brightest;
  } else if (type == kProjectionLight) {
    std::copy(r + kLightN, r + kLightN + 3, b.axis);
    b.cos_emission = double{r[5]};
    b.intensity = power / (2 * M_PI * (1 - double{r[5]}));
  }
  return b;
}

}  // namespace

void LightTable::add(LightType light_type, const std::array<float, kLightFloats>& record, double power) {
  if (light_type == kInfiniteLight) infinite.push_back(count());
  any_flat_lamp = any_flat_lamp || light_type == kRectangleLamp || light_type == kEllipseLamp;
  any_facing = any_facing || light_type == kFacingLamp;
  any_sun = any_sun || (light_type == kInfiniteLight && record[4] == kSunCone);
  any_spot = any_spot || light_type == kSpotLight;
  any_distant = any_distant || light_type == kDistantLight;
  if (is_at_a_point(light_type) || light_type == kDistantLight) {
    any_delta = true;
  } else {
    only_delta = false;
  }
  if (light_type == kSphereLight) any_sphere = true;
  type.push_back(light_type);
  records.insert(records.end(), record.begin(), record.end());
  powers_.push_back(power);
}

void LightTable::meet_lamps() {
  for (int32_t i = 0; i < count(); ++i) {
    const LightType t = type[static_cast<size_t>(i)];
    if (t == kRectangleLamp || t == kEllipseLamp || t == kFacingLamp) lamps.push_back(i);
  }
}

namespace {

/// Makes normal, axis and area fit the rest of a record. Normals keep their side.
void mend_record(LightType type, float* r) {
  if (type == kVolumeLight) return;
  float* n = r + kLightN;
  const float area = type == kTriangleLight   ? 0.5f
                     : type == kRectangleLamp ? 4.0f
                     : type == kEllipseLamp   ? static_cast<float>(M_PI)
                                              : 0.0f;  // of the parallelogram of the edges
  if (area > 0) {
    const float *a = r + kLightE1, *b = r + kLightE2;
    const float c[3] = {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
    const float length = std::sqrt(c[0] * c[0] + c[1] * c[1] + c[2] * c[2]);
    if (!(length > 0)) return;
    const float side = n[0] * c[0] + n[1] * c[1] + n[2] * c[2] < 0 ? -1.0f : 1.0f;
    for (int i = 0; i < 3; ++i) n[i] = side * c[i] / length;
    r[kLightArea] = area * length;
    return;
  }
  const float length = std::sqrt(n[0] * n[0] + n[1] * n[1] + n[2] * n[2]);
  for (int i = 0; length > 0 && i < 3; ++i) n[i] /= length;
}

}  // namespace

void LightTable::record_at(int32_t light, float time, float* record) const {
  const auto i = static_cast<size_t>(light);
  std::copy_n(&records[i * kLightFloats], kLightFloats, record);
  const MovingLight& m = moving[i];
  if (m.segments == 0) return;
  const float at = time * static_cast<float>(m.segments);  // exact: a power of two
  const int32_t step = std::min(static_cast<int32_t>(at), m.segments - 1);
  const float f = at - static_cast<float>(step);
  const float* from = &moving_steps[(m.first + static_cast<size_t>(step)) * kMovingFloats];
  for (int k = 0; k < kMovingFloats; ++k) record[k] = from[k] + (from[k + kMovingFloats] - from[k]) * f;
  mend_record(type[i], record);
}

void LightTable::set_moving(int32_t light, const std::vector<float>& steps) {
  const auto i = static_cast<size_t>(light);
  float* record = &records[i * kLightFloats];
  moving.resize(type.size());
  moving[i] = {moving_steps.size() / kMovingFloats, static_cast<int32_t>(steps.size() / kMovingFloats) - 1};
  moving_steps.insert(moving_steps.end(), steps.begin(), steps.end());
  const double area = double{record[kLightArea]};
  std::copy_n(steps.begin(), kMovingFloats, record);
  mend_record(type[i], record);
  if (type[i] == kTriangleLight) powers_[i] *= double{record[kLightArea]} / area;
}

void LightTable::darken(int32_t light) {
  const auto i = static_cast<size_t>(light);
  std::fill_n(&records[i * kLightFloats + kLightRadiance], 3, 0.0f);
  powers_[i] = 0;
}

void LightTable::hide(RayKinds kinds) {
  if (kinds == 0) return;
  hidden.resize(type.size());
  hidden.back() |= kinds;
  if (is_hidden(hidden.back(), kScatteredRays)) powers_.back() = 0;
}

void LightTable::add_pattern(const EmitterPattern& pattern) {
  pattern_of.resize(type.size(), -1);
  pattern_of.back() = static_cast<int32_t>(patterns.size());
  patterns.push_back(pattern);
}

namespace {

/// Weights of a choice by power, of which a small part is even. So a dim light next to one a billion times as
/// bright is found, at the cost of at most that part of the samples.
std::vector<double> guarded(const std::vector<double>& powers) {
  constexpr double kEvenPart = 1.0 / 16;
  double total = 0, lit = 0;
  for (const double p : powers) {
    total += p;
    lit += p > 0;
  }
  std::vector<double> weights = powers;
  for (double& w : weights) w = w > 0 ? (1 - kEvenPart) * w / total + kEvenPart / lit : 0;
  return weights;
}

}  // namespace

void LightTable::finish() {
  if (!patterns.empty()) pattern_of.resize(type.size(), -1);
  if (!hidden.empty()) hidden.resize(type.size());
  if (!moving.empty()) moving.resize(type.size());
  choose_emitters_by(guarded(powers_));
  direct_keep = alias_keep;
  direct_alias = alias;
  for (size_t i = 0; i < powers_.size(); ++i)
    records[i * kLightFloats + kLightDirectSelect] = records[i * kLightFloats + kLightSelect];
  double most = 0;
  for (const double power : powers_) {
    total_power += power;
    most = std::max(most, power);
  }
  unequal = std::any_of(powers_.begin(), powers_.end(),
                        [&](double power) { return power > 0 && power < most * kUnequal; });
  build_tree();
  powers_.clear();
}

void LightTable::choose_emitters_by(const std::vector<double>& weights) {
  const std::vector<double> probability = build_alias_table(weights, &alias_keep, &alias);
  for (std::size_t i = 0; i < probability.size(); ++i)
    records[i * kLightFloats + kLightSelect] = static_cast<float>(probability[i]);
}

/// To what the light takes up on its way, where it may shine to all sides.
void LightTable::widen(size_t light, LightBound* bound) const {
  const MovingLight& m = moving[light];
  std::array<float, kLightFloats> record;
  std::copy_n(&records[light * kLightFloats], kLightFloats, record.begin());
  for (size_t step = 0; step <= static_cast<size_t>(m.segments); ++step) {
    std::copy_n(&moving_steps[(m.first + step) * kMovingFloats], kMovingFloats, record.begin());
    const LightBound there = bound_of(type[light], record.data(), powers_[light]);
    for (size_t i = 0; i < 3; ++i) {
      bound->lo[i] = std::min(bound->lo[i], there.lo[i]);
      bound->hi[i] = std::max(bound->hi[i], there.hi[i]);
    }
  }
  enclose(bound);
  bound->cos_emission = -1;
}

void LightTable::build_tree() {
  std::vector<LightBound> bounds;
  std::vector<double> far;
  for (size_t i = 0; i < type.size(); ++i) {
    if (type[i] == kInfiniteLight || type[i] == kDistantLight) {
      at_infinity.push_back(static_cast<int32_t>(i));
      far.push_back(powers_[i]);
    } else if (powers_[i] > 0) {
      bounds.push_back(bound_of(type[i], &records[i * kLightFloats], powers_[i]));
      if (any_moving() && moving[i].segments > 0) widen(i, &bounds.back());
      bounds.back().light = static_cast<int32_t>(i);
    }
  }
  if (bounds.size() <= static_cast<size_t>(kAliasLights)) return;
  tree.build(std::move(bounds), count());
  for (size_t i = 0; i < type.size(); ++i) records[i * kLightFloats + kLightDirectSelect] = 0;
  if (far.empty()) return;
  infinity_share = kInfinityShare;
  const std::vector<double> probability = build_alias_table(guarded(far), &direct_keep, &direct_alias);
  for (size_t k = 0; k < far.size(); ++k) {
    records[static_cast<size_t>(at_infinity[k]) * kLightFloats + kLightDirectSelect] =
        static_cast<float>(probability[k]) * infinity_share;
  }
}

}  // namespace lightmill
