#pragma once
// What a sensor makes of a sample's radiance.
#include <algorithm>

#include "common/scene/description.h"

namespace lightmill {

class FilmResponse {
 public:
  explicit FilmResponse(const FilmDescription& film);
  /// True if it changes anything.
  bool is_needed() const { return mixes_ || most_ > 0; }
  /// True if colours may come out negative.
  bool is_signed() const { return signed_; }

  /// Mixes the colours of a contribution.
  void mix(float* r, float* g, float* b) const {
    const float in[3] = {*r, *g, *b};
    float* out[3] = {r, g, b};
    for (int i = 0; i < 3; ++i) *out[i] = m_[3 * i] * in[0] + m_[3 * i + 1] * in[1] + m_[3 * i + 2] * in[2];
  }
  /// The factor by which a whole sample is scaled down (pbrt's "maxcomponentvalue"), of its XYZ.
  float limit(float r, float g, float b) const {
    if (!(most_ > 0)) return 1;
    const float x = 0.4123908f * r + 0.3575843f * g + 0.1804808f * b,
                y = 0.2126390f * r + 0.7151687f * g + 0.0721923f * b,
                z = 0.0193308f * r + 0.1191948f * g + 0.9505322f * b;
    const float largest = std::max({x, y, z});
    return largest > most_ ? most_ / largest : 1;
  }

 private:
  float m_[9];
  float most_;
  bool mixes_ = false, signed_ = false;
};

}  // namespace lightmill
