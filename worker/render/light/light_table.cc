#include "worker/render/light/light_table.h"

#include <algorithm>
#include <cmath>

#include "worker/render/light/alias_table.h"

namespace lightmill {
namespace {

/// With a tree, lights at infinity are chosen this often: nothing tells which of the two matter where.
constexpr float kInfinityShare = 0.5f;

/// Bounds of a light that is not at infinity.
LightBound bound_of(LightType type, const float* r, double power) {
  LightBound b;
  const auto set = [&](const double(&points)[3][3], int count) {
    for (int i = 0; i < 3; ++i) {
      b.lo[i] = b.hi[i] = points[0][i];
      for (int k = 1; k < count; ++k) {
        b.lo[i] = std::min(b.lo[i], points[k][i]);
        b.hi[i] = std::max(b.hi[i], points[k][i]);
      }
      b.center[i] = 0.5 * (b.lo[i] + b.hi[i]);
    }
    double diagonal2 = 0;
    for (int i = 0; i < 3; ++i) diagonal2 += (b.hi[i] - b.lo[i]) * (b.hi[i] - b.lo[i]);
    b.radius = 0.5 * std::sqrt(diagonal2);
  };
  if (type == kVolumeLight) {
    double diagonal2 = 0;
    for (int i = 0; i < 3; ++i) {
      b.lo[i] = b.hi[i] = double{r[kLightP + i]};
      for (const int edge : {kLightE1, kLightE2, kLightN}) {
        b.lo[i] += std::min(double{r[edge + i]}, 0.0);
        b.hi[i] += std::max(double{r[edge + i]}, 0.0);
      }
      b.center[i] = 0.5 * (b.lo[i] + b.hi[i]);
      diagonal2 += (b.hi[i] - b.lo[i]) * (b.hi[i] - b.lo[i]);
    }
    b.radius = 0.5 * std::sqrt(diagonal2);
    b.intensity = power / (4 * M_PI);
    b.cos_emission = -1;
    return b;
  }
  double p[3][3];
  for (int i = 0; i < 3; ++i) {
    p[0][i] = r[kLightP + i];
    p[1][i] = p[0][i] + r[kLightE1 + i];
    p[2][i] = p[0][i] + r[kLightE2 + i];
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
  if (type == kSphereLight) {
    b.radius = double{r[3]};
    for (int i = 0; i < 3; ++i) {
      b.lo[i] -= b.radius;
      b.hi[i] += b.radius;
    }
  } else if (type == kSpotLight) {
    std::copy(r + kLightN, r + kLightN + 3, b.axis);
    b.cos_emission = 1 - double{r[5]};
    b.intensity = (double{r[kLightRadiance]} + r[kLightRadiance + 1] + r[kLightRadiance + 2]) / 3;
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

void LightTable::build_tree() {
  std::vector<LightBound> bounds;
  std::vector<double> far;
  for (size_t i = 0; i < type.size(); ++i) {
    if (type[i] == kInfiniteLight || type[i] == kDistantLight) {
      at_infinity.push_back(static_cast<int32_t>(i));
      far.push_back(powers_[i]);
    } else if (powers_[i] > 0) {
      bounds.push_back(bound_of(type[i], &records[i * kLightFloats], powers_[i]));
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
