#include "worker/render/plan/analysis/stage_kernels.h"

#include "common/job/features.h"

namespace lightmill {
namespace {

/// Why diffuse kernels don't do to find points on lights (kernel_set.h); null if they do.
const char* needs_general_lights(const LightTable& lights) {
  if (!lights.patterns.empty()) return "an emitter varies over its surface";
  if (lights.any_delta || lights.any_infinite()) return "a light has no surface";
  if (lights.any_flat_lamp || lights.any_facing) return "a lamp has no surface";
  if (lights.any_moving()) return "a light moves";
  if (!lights.tree.empty()) return "lights are many";
  if (!lights.guide.empty()) return "there is a next-event guide";
  if (lights.has_emission_guide()) return "light paths of a light go where it pays";
  return nullptr;
}

/// The same for paths.
const char* needs_general_kernels(const RenderScene& s, const LightTable& table) {
  if (s.any_media()) return s.any_panes ? "there are panes" : "there are media";
  if (!s.only_diffuse || s.kinds_present > 1) return "a material in use is not diffuse";
  if (s.any_texture || s.any_tangent || s.any_colors || s.any_mix)
    return "a colour or a normal map varies over a surface";
  if (!s.caustics.empty()) return "camera paths go by a photon guide";
  if (const char* lights = needs_general_lights(table)) return lights;
  if (s.any_fibres) return "there are fibres";
  if (s.any_instances()) return "there are instances";
  return nullptr;
}

}  // namespace

StageKernels stage_kernels(const RenderScene& s, const LightTable& lights) {
  const auto least = [](bool diffuse) { return diffuse ? KernelSet::kDiffuse : KernelSet::kSurfaces; };
  if (s.any_media()) return {KernelSet::kMedia, KernelSet::kMedia, KernelSet::kMedia};
  if (s.overrides & kGeneralKernels) return {};
  return {.paths = least(!needs_general_kernels(s, lights)),
          .next_event = least(s.only_diffuse_joined && !needs_general_lights(lights)),
          .joins = least(s.only_diffuse_joined)};
}

std::string reason_of(const RenderScene& s, const LightTable& lights, const StageKernels& kernels) {
  const char* const general = needs_general_kernels(s, lights);
  if (!general) return "every surface is diffuse and of one colour, and a few of them give the light";
  if (kernels.joins != KernelSet::kDiffuse) return general;
  return std::string(general) +
         (kernels.next_event == KernelSet::kDiffuse
              ? "; but all that is joined is diffuse, and those kernels are, too"
              : "; but vertices that are joined are diffuse, and those kernels are, too");
}

}  // namespace lightmill
