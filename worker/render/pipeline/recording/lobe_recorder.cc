#include "worker/render/pipeline/recording/lobe_recorder.h"

#include <algorithm>

#include "worker/render/renderer.h"

namespace lightmill {

void LobeRecorder::begin_packet() {
  sums_.begin_packet();
  if (light_) forget_splats();
}

void LobeRecorder::begin_pass() {
  if (!light_) return;
  std::vector<std::array<float, 3>>& radiance = light_->light.radiance;
  std::fill(radiance.begin(), radiance.end(), std::array<float, 3>{});
}

void LobeRecorder::add_sample(const StageContext& context, int quantum_exponent, const Wavefront& w,
                              size_t slot, const std::array<Units, 3>& whole) {
  sums_.add_sample(context, quantum_exponent, w, slot, &light_->light.radiance[slot * kLobeParts], whole);
}

void LobeRecorder::add_splats(std::span<const Splat> splats, PartialBuilder& builder) {
  for (std::vector<Splat>& own : sorted_) own.clear();
  for (size_t i = 0; i < splats.size(); ++i) {
    const Splat& splat = splats[i];
    const size_t part = light_->light.splat_groups[i];
    if (part == kEmission) continue;
    const std::array<float, 3>& diffuse = light_->splat_diffuse[i];
    const bool none = diffuse[0] == 0 && diffuse[1] == 0 && diffuse[2] == 0,
               all = diffuse[0] == splat.r && diffuse[1] == splat.g && diffuse[2] == splat.b;
    if (!all || none) sorted_[part].push_back(splat);
    if (none) continue;
    // Each is rounded, so that glossy light is what exact sums leave.
    sorted_[part - kGlossyToDiffuse].push_back({splat.pixel, diffuse[0], diffuse[1], diffuse[2]});
    if (!all) sorted_[part].push_back({splat.pixel, -diffuse[0], -diffuse[1], -diffuse[2]});
  }
  for (size_t part = 0; part < sorted_.size(); ++part) {
    if (!sorted_[part].empty()) builder.add_lobe_splats(part, sorted_[part]);
  }
  forget_splats();
}

void LobeRecorder::forget_splats() {
  light_->light.splat_groups.clear();
  light_->splat_diffuse.clear();
}

void LobeRecorder::finish_packet(const Packet& packet, PartialBuilder& builder) {
  for (size_t part = 0; part < sums_.layers(); ++part)
    builder.add_lobe(part, packet.cell_x, packet.cell_y, sums_.layer(part));
}

}  // namespace lightmill
