#pragma once
// Sums of the light of light groups (common/job/light_groups.h) over a packet.
#include <array>
#include <span>
#include <vector>

#include "worker/render/pipeline/recording/part_sums.h"

namespace lightmill {

struct Packet;  // renderer.h

class GroupRecorder {
 public:
  explicit GroupRecorder(const LightGroups& groups) : light_(groups.size()), sums_(groups.size()) {}
  /// Where the wavefront keeps the light of groups; null if there are fewer than two.
  GroupedLight* light() { return sums_.layers() > 0 ? &light_ : nullptr; }

  void begin_packet();
  /// Before a pass of camera samples.
  void begin_pass();
  /// Adds the light of groups of a camera sample, whose colour is `whole`.
  void add_sample(const StageContext& context, int quantum_exponent, const Wavefront& w, size_t slot,
                  const std::array<Units, 3>& whole);
  /// Hands `splats`, all since the last time, to the tile, each to its group.
  void add_splats(std::span<const Splat> splats, PartialBuilder& builder);
  void forget_splats() { light_.splat_groups.clear(); }
  void finish_packet(const Packet& packet, PartialBuilder& builder);

 private:
  GroupedLight light_;
  PartSums sums_;
  std::vector<Splat> sorted_;  // splats by group
};

}  // namespace lightmill
