#include "common/scene/description.h"

#include <algorithm>

#include "common/scene/spectrum/spectrum.h"
#include "common/scene/transform.h"

namespace lightmill {

/// What no channel of black_body_radiance exceeds, with room to spare.
constexpr float kBrightestBlackBody = 300;

Rgb brightest(const MediumDescription& medium) {
  Rgb most = medium.emission;
  if (!medium.grid) return most;
  const auto largest = [](const VolumeField& f) {
    return *std::max_element(f.values.begin(), f.values.end());
  };
  float factor = 1;
  if (medium.grid->emission) factor = largest(*medium.grid->emission);
  if (medium.grid->file) factor = medium.grid->file->temperature.empty() ? 0 : kBrightestBlackBody;
  if (medium.grid->temperature) {
    // The hottest is the brightest in no channel, but near enough for a bound within a factor of 3.
    const Rgb c = black_body_radiance(largest(*medium.grid->temperature));
    factor *= 3 * std::max({c.r, c.g, c.b});
  }
  return {most.r * factor, most.g * factor, most.b * factor};
}

bool is_empty(const MediumDescription& m) {
  if (m.grid && (m.grid->sigma_a || m.grid->sigma_s)) return false;
  return is_black(m.sigma_a) && is_black(m.sigma_s);
}

bool surface_flips_normal(const ShapeDescription& shape) {
  // A sphere's outward normal stays outward under a mirror; only a winding is swapped by one.
  if (std::holds_alternative<SphereShape>(shape.kind)) return shape.reverse_orientation;
  return shape.reverse_orientation != (determinant3(shape.object_to_world) < 0);
}

int mix_in_a_cycle(const std::vector<MaterialDescription>& materials) {
  enum class State : uint8_t { kNew, kOpen, kDone };
  std::vector<State> state(materials.size(), State::kNew);
  // Depth first without recursion: a file may nest mixes as deeply as it likes.
  std::vector<std::pair<size_t, size_t>> open;  // material, child to look at next
  for (size_t root = 0; root < materials.size(); ++root) {
    if (state[root] != State::kNew) continue;
    open.push_back({root, 0});
    state[root] = State::kOpen;
    while (!open.empty()) {
      auto& [material, next] = open.back();
      const auto* mix = std::get_if<MixMaterial>(&materials[material].kind);
      if (mix == nullptr || next == mix->materials.size()) {
        state[material] = State::kDone;
        open.pop_back();
        continue;
      }
      const int child = mix->materials[next++];
      if (child < 0) continue;
      const auto c = static_cast<size_t>(child);
      if (state[c] == State::kOpen) return static_cast<int>(material);
      if (state[c] == State::kNew) {
        state[c] = State::kOpen;
        open.push_back({c, 0});
      }
    }
  }
  return -1;
}

}  // namespace lightmill
