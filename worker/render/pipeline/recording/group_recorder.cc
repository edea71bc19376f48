#include "worker/render/pipeline/recording/group_recorder.h"

#include <algorithm>

#include "worker/render/renderer.h"

namespace lightmill {

void GroupRecorder::begin_packet() {
  sums_.begin_packet();
  light_.splat_groups.clear();
}

void GroupRecorder::begin_pass() {
  std::fill(light_.radiance.begin(), light_.radiance.end(), std::array<float, 3>{});
}

void GroupRecorder::add_sample(const StageContext& context, int quantum_exponent, const Wavefront& w,
                               size_t slot, const std::array<Units, 3>& whole) {
  sums_.add_sample(context, quantum_exponent, w, slot, &light_.radiance[slot * light_.count], whole);
}

void GroupRecorder::add_splats(std::span<const Splat> splats, PartialBuilder& builder) {
  const std::vector<uint8_t>& groups = light_.splat_groups;
  std::array<size_t, kMaxLightGroups + 1> begin{};
  for (const uint8_t group : groups) ++begin[group + 1];
  for (size_t group = 1; group < begin.size(); ++group) begin[group] += begin[group - 1];
  std::array<size_t, kMaxLightGroups + 1> at = begin;
  sorted_.resize(splats.size());
  for (size_t i = 0; i < splats.size(); ++i) sorted_[at[groups[i]]++] = splats[i];
  for (size_t group = 0; group < light_.count; ++group) {
    const std::span own = std::span(sorted_).subspan(begin[group], begin[group + 1] - begin[group]);
    if (!own.empty()) builder.add_group_splats(group, own);
  }
  forget_splats();
}

void GroupRecorder::finish_packet(const Packet& packet, PartialBuilder& builder) {
  for (size_t group = 0; group < sums_.layers(); ++group)
    builder.add_group(group, packet.cell_x, packet.cell_y, sums_.layer(group));
}

}  // namespace lightmill
