#include "worker/render/scene/materials/mix.h"

#include <algorithm>
#include <cmath>
#include <vector>

#include "worker/render/sampling/sobol.h"
#include "worker/render/scene/media/subsurface_body.h"

namespace lightmill {
namespace {

float share_at(const RenderScene& scene, const FloatInput& in, const TexturePoint& at) {
  const float x = in.texture >= 0 ? scene.textures.evaluate(in.texture, at).r : in.value;
  return std::isfinite(x) ? std::clamp(x, 0.0f, 1.0f) : 0.0f;
}

/// Weights of a mix's parts by Blender's rules.
struct Weights {
  float first, second;
};
Weights weights_of(const RenderScene& scene, const MaterialEntry& e, const TexturePoint& at) {
  if (e.mix_rule == MixRule::kAddShader) return {1, 1};
  const float amount = share_at(scene, {e.scale, e.texture_color}, at);
  if (e.mix_rule == MixRule::kMixShader) return {1 - amount, amount};
  const float of_rest = 1 - share_at(scene, e.mix_metallic, at);
  return {1, (e.mix_rule == MixRule::kBody ? 1 - amount : amount) * of_rest};
}

/// Probability of the second part.
float chance_of_second(const RenderScene& scene, const MaterialEntry& e, const Weights& w) {
  // Glass as often as it is seen, and never alone under a coat. Of a body and its surface mostly the body.
  constexpr float kBodyChance = 0.7f;
  if (e.mix_rule == MixRule::kBody) return kBodyChance * w.second;
  if (e.mix_rule == MixRule::kTransmission) return e.mix_coated ? 0.9f * w.second : w.second;
  const float first = w.first * scene.materials[static_cast<size_t>(e.mix_first)].brightness;
  const float second = w.second * scene.materials[static_cast<size_t>(e.mix_second)].brightness;
  if (first + second > 0) return second / (first + second);
  // Neither scatters: one that is there at all.
  return scene.materials[static_cast<size_t>(e.mix_first)].passed ? 1.0f : 0.0f;
}

/// A uniform in [0, 1) that is the same for the same point.
float uniform_of(int32_t prim, const float p[3]) {
  uint32_t h = hash32(static_cast<uint32_t>(prim));
  for (int i = 0; i < 3; ++i) h = hash_combine(h, float_bits(p[i] + 0.0f));  // -0 is 0
  return static_cast<float>(h >> 8) * 0x1p-24f;
}

/// Whether the material is body `body`, or has it among its parts.
bool leads_to(const RenderScene& scene, int32_t material, int32_t body) {
  std::vector<int32_t> open{material};
  while (!open.empty()) {
    const auto at = static_cast<size_t>(open.back());
    open.pop_back();
    const MaterialEntry& e = scene.materials[at];
    if (e.kind == kMix) {
      open.push_back(e.mix_first);
      open.push_back(e.mix_second);
    } else if (enters_bodies<float>(e.kind) &&
               static_cast<int32_t>(scene.material_params[at * kBsdfParams + kBodyNumberSlot]) == body) {
      return true;
    }
  }
  return false;
}

}  // namespace

MixChoice resolve_mix(const RenderScene& scene, int32_t material, int32_t prim, const float p[3],
                      const TexturePoint& at, float u, int32_t body) {
  if (u < 0) u = uniform_of(prim, p);
  MixChoice choice{material, 1, u};
  const FloatInput& opacity = scene.materials[static_cast<size_t>(material)].opacity;
  if (body < 0 && (opacity.texture >= 0 || opacity.value < 1)) {
    // It was stopped with this probability.
    const float stops = share_at(scene, opacity, at);
    if (stops > 0) choice.scale = 1 / stops;
  }
  for (;;) {
    const MaterialEntry& e = scene.materials[static_cast<size_t>(choice.material)];
    if (e.kind != kMix) return choice;
    if (e.mix_rule == MixRule::kChance) {
      const float amount = e.texture_color >= 0 ? scene.textures.evaluate(e.texture_color, at).r : e.scale;
      choice.material = choose_lobe(amount, &choice.u) ? e.mix_second : e.mix_first;
      continue;
    }
    if (body >= 0) {
      choice.material = leads_to(scene, e.mix_first, body) ? e.mix_first : e.mix_second;
      continue;
    }
    const Weights w = weights_of(scene, e, at);
    const float second = chance_of_second(scene, e, w);
    const bool is_second = choose_lobe(second, &choice.u);
    choice.scale *= is_second ? w.second / second : w.first / (1 - second);
    choice.material = is_second ? e.mix_second : e.mix_first;
  }
}

}  // namespace lightmill
