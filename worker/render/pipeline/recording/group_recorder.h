#pragma once
// Sums of the light of light groups (common/job/light_groups.h) over a packet.
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "worker/render/pipeline/context.h"

namespace lightmill {

struct Packet;  // renderer.h

class GroupRecorder {
 public:
  explicit GroupRecorder(const LightGroups& groups) : light_(groups.size()), layers_(group_layers(groups)) {}
  /// Where the wavefront keeps the light of groups; null if there are fewer than two.
  GroupedLight* light() { return layers_ > 0 ? &light_ : nullptr; }

  void begin_packet();
  /// Before a pass of camera samples.
  void begin_pass();
  /// Rounds the light of groups of a camera sample, whose colour is `whole`, and adds it to the sums. Where
  /// sums have no sign the groups stay parts of the whole, so that what they leave for the last one is not
  /// negative.
  void add_sample(const StageContext& context, int quantum_exponent, const Wavefront& w, size_t slot,
                  const std::array<Units, 3>& whole);
  /// Hands `splats`, all since the last time, to the tile, each to its group.
  void add_splats(std::span<const Splat> splats, PartialBuilder& builder);
  void forget_splats() { light_.splat_groups.clear(); }
  void finish_packet(const Packet& packet, PartialBuilder& builder);

 private:
  bool add_narrow(double scale, float weight, const std::array<float, 3>* light,
                  const std::array<Units, 3>& whole, int64_t* to);

  GroupedLight light_;
  const size_t layers_;
  // Sums of the packet's cell, by pixel and group. Samples that are not too bright add to 64 bits, which lie
  // close together: with all in 128 bits a packet's sums would not fit into the cache.
  std::vector<int64_t> narrow_;
  std::vector<ExactRgb> wide_;  // the other samples'; empty until there is one
  std::vector<ExactRgb> layer_;
  std::vector<Splat> sorted_;  // splats by group
};

}  // namespace lightmill
