#pragma once
// Sums the splats of a tile exactly. They may fall anywhere in the crop window.
#include <cstdint>
#include <memory>
#include <span>
#include <vector>

#include "common/film/partial.h"

namespace lightmill {

/// Significant bits that a splat keeps before it is summed. The error is 2^-17 of something as noisy as a
/// single light path, without bias. A quarter less has to be sent, as the bits of noise can't be compressed.
inline constexpr int kSplatBits = 16;

class SplatFrame {
 public:
  SplatFrame();  // empty: nothing can be added
  SplatFrame(const FilmGrid& grid, int quantum_exponent);
  SplatFrame(SplatFrame&&) noexcept;
  SplatFrame& operator=(SplatFrame&&) noexcept;
  ~SplatFrame();
  bool empty() const { return !impl_; }
  /// Rounds splats to kSplatBits and to the quantum and adds them. Those outside the crop window are ignored.
  /// Returns what can't be represented and was dropped; amounts are by light path. Thread-safe.
  Dropped add(std::span<const Splat> splats);
  /// The sums, ascending by pixel, without zeros. Call once, in the end.
  std::vector<SplatSum> take();

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace lightmill
