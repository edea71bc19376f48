#pragma once
// Where a contribution of the lens strategy lands on the film.
#include <bit>

#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Draws a pixel of the filter's footprint around raster position (x, y) with uniforms u and v.
struct SplatTarget {
  LaneInt pixel{};
  Lane weight{};  // filter weight; 0 if no pixel of the crop window receives it
  Lane inv_light_samples{};  // 1 / n_light of mis.h at the pixel
  SplatTarget(const StageContext& context, Lane x, Lane y, Lane u, Lane v, LaneMask active) {
    int32_t pixels[kLanes] = {};
    float weights[kLanes] = {};
    inv_light_samples = splat<Lane>(1.0f / context.light_samples);
    float inv_samples[kLanes];
    store(inv_samples, inv_light_samples);
    const PixelRect& crop = context.grid.crop;
    // A sphere has no edge: what a filter receives beyond the raster belongs to pixels elsewhere in it.
    const auto* sphere = std::get_if<SphericalCamera>(&context.camera);
    const PixelRect reach = sphere ? PixelRect{0, 0, context.grid.width, context.grid.height} : crop;
    for (unsigned bits = mask_bits(active); bits; bits &= bits - 1) {
      const int l = std::countr_zero(bits);
      const float px = lane(x, l), py = lane(y, l);
      // Written so that NaN fails; 64 pixels is more than any filter's radius.
      if (!(px > static_cast<float>(reach.x0) - 64 && px < static_cast<float>(reach.x1) + 64 &&
            py > static_cast<float>(reach.y0) - 64 && py < static_cast<float>(reach.y1) + 64)) {
        continue;
      }
      float wx, wy;
      int ix = context.filter.x.choose_pixel(px, lane(u, l), &wx);
      int iy = context.filter.y.choose_pixel(py, lane(v, l), &wy);
      if (sphere) sphere->wrap(&ix, &iy);
      if (ix < crop.x0 || ix >= crop.x1 || iy < crop.y0 || iy >= crop.y1) continue;
      pixels[l] = iy * context.grid.width + ix;
      weights[l] = wx * wy;
      if (context.effort) inv_samples[l] = 1.0f / context.effort->light_samples_at(ix, iy);
    }
    pixel = load_int<Lane>(pixels);
    weight = load<Lane>(weights);
    inv_light_samples = load<Lane>(inv_samples);
  }
};

}  // namespace lightmill
