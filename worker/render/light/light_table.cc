#include "worker/render/light/light_table.h"

namespace lightmill {

void LightTable::add(LightType light_type, const std::array<float, kLightFloats>& record, double power) {
  if (light_type == kInfiniteLight) infinite.push_back(count());
  if (light_type == kPointLight) {
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
  const std::size_t n = type.size();
  double total = 0;
  for (double p : powers_) total += p;
  std::vector<double> q(n);
  for (std::size_t i = 0; i < n; ++i) {
    q[i] = total > 0 ? powers_[i] / total : 1.0 / static_cast<double>(n);
    records[i * kLightFloats + kLightSelect] = static_cast<float>(q[i]);
  }
  // Walker/Vose: columns of height 1/n, each holding at most two lights.
  alias_keep.assign(n, 1.0f);
  alias.resize(n);
  std::vector<std::size_t> small, large;
  for (std::size_t i = 0; i < n; ++i) {
    alias[i] = static_cast<int32_t>(i);
    q[i] *= static_cast<double>(n);
    (q[i] < 1 ? small : large).push_back(i);
  }
  while (!small.empty() && !large.empty()) {
    const std::size_t s = small.back(), l = large.back();
    small.pop_back();
    alias_keep[s] = static_cast<float>(q[s]);
    alias[s] = static_cast<int32_t>(l);
    q[l] -= 1 - q[s];
    if (q[l] < 1) {
      large.pop_back();
      small.push_back(l);
    }
  }
  total_power = total;
  powers_.clear();
}

}  // namespace lightmill
