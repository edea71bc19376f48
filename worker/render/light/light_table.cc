#include "worker/render/light/light_table.h"

#include "worker/render/light/alias_table.h"

namespace lightmill {

void LightTable::add(LightType light_type, const std::array<float, kLightFloats>& record, double power) {
  if (light_type == kInfiniteLight) infinite.push_back(count());
  any_spot = any_spot || light_type == kSpotLight;
  any_distant = any_distant || light_type == kDistantLight;
  if (light_type == kPointLight || light_type == kSpotLight || light_type == kDistantLight) {
    any_delta = true;
  } else {
    only_delta = false;
  }
  if (light_type == kSphereLight) any_sphere = true;
  type.push_back(light_type);
  records.insert(records.end(), record.begin(), record.end());
  powers_.push_back(power);
}

void LightTable::finish() {
  const std::vector<double> probability = build_alias_table(powers_, &alias_keep, &alias);
  for (std::size_t i = 0; i < probability.size(); ++i) {
    records[i * kLightFloats + kLightSelect] = static_cast<float>(probability[i]);
    total_power += powers_[i];
  }
  powers_.clear();
}

}  // namespace lightmill
