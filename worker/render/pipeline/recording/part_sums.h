#pragma once
// Sums of the parts that camera samples' light is divided into, over a packet: light groups or lobes. The
// last part has no sums, as it has what the others leave of the whole.
#include <array>
#include <cstdint>
#include <span>
#include <vector>

#include "worker/render/pipeline/context.h"

namespace lightmill {

class PartSums {
 public:
  /// `parts`: 0 for none.
  explicit PartSums(size_t parts) : layers_(parts > 0 ? parts - 1 : 0) {}
  /// How many parts have sums.
  size_t layers() const { return layers_; }

  void begin_packet();
  /// Rounds the light of a camera sample's parts, all of them, and adds it. Its colour is `whole`. Where sums
  /// have no sign the parts stay parts of the whole, so that what they leave for the last one is not
  /// negative; nor is anything left by rounding where the last one is dark. `light`: mixed as the sensor
  /// does.
  void add_sample(const StageContext& context, int quantum_exponent, const Wavefront& w, size_t slot,
                  std::array<float, 3>* light, const std::array<Units, 3>& whole);
  /// The packet's sums of a part, until the next call.
  std::span<const ExactRgb, kCellPixels> layer(size_t part);

 private:
  bool add_narrow(double scale, float weight, const std::array<float, 3>* light,
                  const std::array<Units, 3>& whole, int64_t* to) const;

  size_t layers_;
  // Sums of the packet's cell, by pixel and part. Samples that are not too bright add to 64 bits, which lie
  // close together: with all in 128 bits a packet's sums would not fit into the cache.
  std::vector<int64_t> narrow_;
  std::vector<ExactRgb> wide_;  // the other samples'; empty until there is one
  std::vector<ExactRgb> layer_;
};

}  // namespace lightmill
