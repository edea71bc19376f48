#pragma once
// Where a contribution of the lens strategy lands on the film.
#include <bit>

#include "worker/render/pipeline/context.h"

namespace lightmill {

/// Set in a target whose filter weight is negative: contributions themselves are not, so that what is tested
/// and weighed of them on the way needs no sign. Pixels have no such bit (kMaxPixels).
inline constexpr int32_t kNegativeSplat = 1 << 30;

/// Draws a pixel of the filter's footprint around raster position (x, y) with uniforms u and v.
struct SplatTarget {
  LaneInt pixel{};           // with kNegativeSplat
  Lane weight{};             // size of the filter weight; 0 if no pixel of the crop window receives it
  Lane inv_light_samples{};  // 1 / n_light of mis.h at the pixel
  SplatTarget(const StageContext& context, Lane x, Lane y, Lane u, Lane v, LaneMask active) {
    inv_light_samples = splat<Lane>(1.0f / context.light_samples);
    const PixelRect& crop = context.grid.crop;
    // A sphere has no edge: what a filter receives beyond the raster belongs to pixels elsewhere in it.
    const auto* sphere = std::get_if<SphericalCamera>(&context.camera);
    const PixelRect reach = sphere ? PixelRect{0, 0, context.grid.width, context.grid.height} : crop;
    // Written so that NaN fails; 64 pixels is more than any filter's radius.
    const auto near = [](Lane p, int lo, int hi) {
      return mask_and(LaneMask(p > static_cast<float>(lo - 64)), LaneMask(p < static_cast<float>(hi + 64)));
    };
    LaneMask in = mask_and(active, mask_and(near(x, reach.x0, reach.x1), near(y, reach.y0, reach.y1)));
    if (!any(in)) return;
    Lane wx, wy;
    LaneInt ix = context.filter.x.choose_pixel(select(in, x, Lane{}), u, &wx);
    LaneInt iy = context.filter.y.choose_pixel(select(in, y, Lane{}), v, &wy);
    if (sphere) wrap(*sphere, &ix, &iy);
    const auto within = [](LaneInt i, int lo, int hi) {
      return mask_and(LaneMask(i >= splat_int<Lane>(lo)), LaneMask(i < splat_int<Lane>(hi)));
    };
    in = mask_and(in, mask_and(within(ix, crop.x0, crop.x1), within(iy, crop.y0, crop.y1)));
    pixel = select(in, iy * context.grid.width + ix, LaneInt{});
    weight = select(in, wx * wy, Lane{});
    if (context.filter.is_signed()) {
      pixel = select(LaneMask(weight < 0.0f), pixel | kNegativeSplat, pixel);
      weight = abs(weight);
    }
    if (!context.effort) return;
    float inv_samples[kLanes];
    store(inv_samples, inv_light_samples);
    for (unsigned bits = mask_bits(in); bits; bits &= bits - 1) {
      const int l = std::countr_zero(bits);
      inv_samples[l] = 1.0f / context.effort->light_samples_at(lane(ix, l), lane(iy, l));
    }
    inv_light_samples = load<Lane>(inv_samples);
  }

 private:
  static void wrap(const SphericalCamera& sphere, LaneInt* ix, LaneInt* iy) {
    int32_t xs[kLanes], ys[kLanes];
    for (int l = 0; l < kLanes; ++l) {
      xs[l] = lane(*ix, l);
      ys[l] = lane(*iy, l);
      sphere.wrap(&xs[l], &ys[l]);
    }
    *ix = load_int<Lane>(xs);
    *iy = load_int<Lane>(ys);
  }
};

}  // namespace lightmill
