#include "worker/render/guiding/training/emission_groups.h"

#include <algorithm>
#include <numeric>

#include "worker/render/light/light_record.h"

namespace lightmill {
namespace {

Vec3<float> corner(const LightRecord<float>& r, int k) {
  const Vec3<float> p = r.vec(kLightP);
  return k == 0 ? p : p + r.vec(k == 1 ? kLightE1 : kLightE2);
}

/// Whether two triangles are of one flat lamp: they face the same way and share a corner.
bool are_one_lamp(const LightRecord<float>& a, const LightRecord<float>& b) {
  if (a.scalar(kLightTwoSided) != b.scalar(kLightTwoSided)) return false;
  if (one_minus_cos(a.vec(kLightN), b.vec(kLightN)) > 1e-5f) return false;
  const float side2 = dot(b.vec(kLightE1), b.vec(kLightE1));
  for (int i = 0; i < 3; ++i) {
    for (int k = 0; k < 3; ++k) {
      const Vec3<float> apart = corner(a, i) - corner(b, k);
      if (dot(apart, apart) < 1e-8f * side2) return true;
    }
  }
  return false;
}

EmissionShape shape_of(const LightTable& lights, int32_t light) {
  const LightType type = lights.type[static_cast<size_t>(light)];
  if (type == kTriangleLight) {
    return LightRecord<float>(lights, light).scalar(kLightTwoSided) > 0 ? EmissionShape::kSphere
                                                                        : EmissionShape::kDisk;
  }
  return type == kPointLight || type == kSpotLight ? EmissionShape::kSphere : EmissionShape::kNone;
}

}  // namespace

EmissionGroups::EmissionGroups(const LightTable& lights) {
  for (int32_t i = 0; i < lights.count(); ++i) {
    const LightRecord<float> r(lights, i);
    const auto is_triangle = [&](int32_t k) {
      return k >= 0 && lights.type[static_cast<size_t>(k)] == kTriangleLight;
    };
    if (!is_triangle(i) || !is_triangle(i - 1) || !are_one_lamp(LightRecord<float>(lights, i - 1), r)) {
      chosen.push_back(0);
      shape.push_back(shape_of(lights, i));
    }
    of.push_back(static_cast<int32_t>(count()) - 1);
    chosen.back() += double{r.scalar(kLightSelect)};
  }
  if (count() <= kMostEmissionGroups) return;
  constexpr size_t kRest = kMostEmissionGroups - 1;
  std::vector<size_t> by_power(count());
  std::iota(by_power.begin(), by_power.end(), size_t{0});
  std::stable_sort(by_power.begin(), by_power.end(),
                   [&](size_t a, size_t b) { return chosen[a] > chosen[b]; });
  const std::vector<double> all_chosen = std::move(chosen);
  const std::vector<EmissionShape> all_shapes = std::move(shape);
  chosen.assign(kMostEmissionGroups, 0);
  shape.assign(kMostEmissionGroups, EmissionShape::kNone);
  std::vector<int32_t> number(by_power.size());
  for (size_t k = 0; k < by_power.size(); ++k) {
    const size_t to = std::min(k, kRest);
    number[by_power[k]] = static_cast<int32_t>(to);
    chosen[to] += all_chosen[by_power[k]];
    if (to < kRest) shape[to] = all_shapes[by_power[k]];
  }
  for (int32_t& group : of) group = number[static_cast<size_t>(group)];
}

}  // namespace lightmill
