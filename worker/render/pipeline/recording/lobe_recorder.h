#pragma once
// Sums of the light of lobes (common/job/lobes.h) over a packet.
#include <array>
#include <memory>
#include <span>
#include <vector>

#include "worker/render/pipeline/recording/part_sums.h"

namespace lightmill {

struct Packet;  // renderer.h

class LobeRecorder {
 public:
  explicit LobeRecorder(Aovs set)
      : light_(set & kAovLobes ? std::make_unique<LobedLight>() : nullptr),
        sums_(set & kAovLobes ? kLobeParts : 0) {}
  /// Where the wavefront keeps the light of lobes; null if nobody asks.
  LobedLight* light() { return light_.get(); }

  // As of GroupRecorder.
  void begin_packet();
  void begin_pass();
  void add_sample(const StageContext& context, int quantum_exponent, const Wavefront& w, size_t slot,
                  const std::array<Units, 3>& whole);
  /// Adds `splats`, all since the last time, to the tile's lobes. The tile gets them itself, too.
  void add_splats(std::span<const Splat> splats, PartialBuilder& builder);
  void forget_splats();
  void finish_packet(const Packet& packet, PartialBuilder& builder);

 private:
  std::unique_ptr<LobedLight> light_;
  PartSums sums_;
  std::array<std::vector<Splat>, kLobeParts - 1> sorted_;  // by part
};

}  // namespace lightmill
