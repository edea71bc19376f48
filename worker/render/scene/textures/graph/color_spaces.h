#pragma once
// Hue, saturation, and value or lightness of colours; hues in turns.
#include "worker/render/scene/textures/graph/graph_functions.h"

namespace lightmill::graph {

/// `lightness`: HSL instead of HSV.
template <class F>
inline void rgb_to_hues(const F c[3], bool lightness, F out[3]) {
  const F high = max(c[0], max(c[1], c[2])), low = min(c[0], min(c[1], c[2])), spread = high - low;
  const F red = quotient(c[1] - c[2], spread), green = quotient(c[2] - c[0], spread) + 2.0f,
          blue = quotient(c[0] - c[1], spread) + 4.0f;
  F h = select(MaskOf<F>(c[0] == high), red, select(MaskOf<F>(c[1] == high), green, blue)) * (1.0f / 6.0f);
  h = select(MaskOf<F>(h < 0.0f), h + 1.0f, h);
  out[0] = select(MaskOf<F>(spread == 0.0f), F{}, h);
  if (!lightness) {
    out[1] = select(MaskOf<F>(high == 0.0f), F{}, quotient(spread, high));
    out[2] = high;
    return;
  }
  const F l = min(splat<F>(1.0f), (high + low) * 0.5f);
  const F s = quotient(spread, select(MaskOf<F>(l > 0.5f), 2.0f - high - low, high + low));
  out[1] = select(MaskOf<F>(spread == 0.0f), F{}, s);
  out[2] = l;
}

template <class F>
inline void hues_to_rgb(const F h[3], bool lightness, F out[3]) {
  const F turn = (h[0] - floor(h[0])) * 6.0f;
  const F pure[3] = {clamp(abs(turn - 3.0f) - 1.0f, 0.0f, 1.0f), clamp(2.0f - abs(turn - 2.0f), 0.0f, 1.0f),
                     clamp(2.0f - abs(turn - 4.0f), 0.0f, 1.0f)};
  const F chroma = (1.0f - abs(h[2] * 2.0f - 1.0f)) * h[1];
  for (int i = 0; i < 3; ++i) {
    out[i] = lightness ? (pure[i] - 0.5f) * chroma + h[2] : ((pure[i] - 1.0f) * h[1] + 1.0f) * h[2];
  }
}

}  // namespace lightmill::graph
