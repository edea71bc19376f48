#pragma once
// Where a splat of light tracing lands on the film.
#include <cmath>

#include "worker/render/pipeline/context.h"

namespace lightmill {

/// The place of a splat at raster position (x, y). All pixels in reach of the filter receive their part of it
/// (spread_splats).
struct SplatTarget {
  LaneInt pixel{};   // that it is in, or the nearest one of the crop window
  LaneMask valid{};  // false: too far from the crop window

  SplatTarget(const StageContext& context, Lane x, Lane y, LaneMask active) {
    const auto* sphere = round_sphere(context.camera);
    const PixelRect& crop = context.grid.crop;
    // A sphere has no edge: what a filter receives beyond the raster belongs to pixels elsewhere in it.
    const PixelRect bounds = sphere ? PixelRect{0, 0, context.grid.width, context.grid.height} : crop;
    // A pixel reaches as far as the filter around its centre. Written so that NaN fails.
    const auto near = [](Lane p, int lo, int hi, float radius) {
      const float beyond = radius - 0.5f;
      return mask_and(LaneMask(p >= static_cast<float>(lo) - beyond),
                      LaneMask(p < static_cast<float>(hi) + beyond));
    };
    const PixelFilter& filter = context.filter;
    valid = mask_and(active, mask_and(near(x, bounds.x0, bounds.x1, filter.x.radius()),
                                      near(y, bounds.y0, bounds.y1, filter.y.radius())));
    if (!any(valid)) return;
    x = select(valid, x, Lane{});
    y = select(valid, y, Lane{});
    LaneInt ix = to_int(floor(x)), iy = to_int(floor(y));
    if (sphere) wrap(*sphere, &ix, &iy);
    if (filter.is_one_pixel()) {
      const auto within = [](LaneInt i, int lo, int hi) {
        return mask_and(LaneMask(i >= splat_int<Lane>(lo)), LaneMask(i < splat_int<Lane>(hi)));
      };
      valid = mask_and(valid, mask_and(within(ix, crop.x0, crop.x1), within(iy, crop.y0, crop.y1)));
    }
    const auto clamped = [](LaneInt i, int lo, int hi) {
      i = select(LaneMask(i < splat_int<Lane>(lo)), splat_int<Lane>(lo), i);
      return select(LaneMask(i >= splat_int<Lane>(hi)), splat_int<Lane>(hi - 1), i);
    };
    ix = clamped(ix, crop.x0, crop.x1);
    iy = clamped(iy, crop.y0, crop.y1);
    pixel = iy * context.grid.width + ix;
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

/// Divides splats at raster positions (x, y) among pixels: calls add(lane, pixel, filter weight) for the
/// first `count` lanes. `u` are uniform numbers for small weights.
template <class Add>
void spread_splats(const StageContext& context, Lane x, Lane y, const float* u, int count, Add&& add) {
  const PixelFilter& filter = context.filter;
  const int width = context.grid.width;
  const PixelRect& crop = context.grid.crop;
  const auto* sphere = round_sphere(context.camera);
  // On a sphere what is beyond the raster belongs to pixels elsewhere in it.
  const FilterReach<Lane> reach =
      sphere ? FilterReach<Lane>(filter, x, y) : FilterReach<Lane>(filter, x, y, crop);
  for (int l = 0; l < count; ++l) {
    float small = u[l];
    reach.each(l, [&](int i, int j, float f) {
      if (!filter.is_kept(&f, &small)) return;
      if (sphere) {
        sphere->wrap(&i, &j);
        if (i < crop.x0 || i >= crop.x1 || j < crop.y0 || j >= crop.y1) return;
      }
      add(l, j * width + i, f);
    });
  }
}

/// One of the pixels that a splat is given to, which stands for all of them.
struct DrawnSplat {
  int32_t pixel;  // row-major in the full frame; -1: it is beside the crop window
  float weight;   // filter weight of that pixel, as it stands for all
};
/// Draws it for raster position (x, y) in proportion to the filter's size, with uniform `u`.
inline DrawnSplat draw_splat(const StageContext& context, float x, float y, float u) {
  const FilterReach<float> reach(context.filter, x, y);
  float all = 0;
  reach.each(0, [&](int, int, float f) { all += std::fabs(f); });
  float left = u * all, weight = 0;
  int px = 0, py = 0;
  reach.each(0, [&](int i, int j, float f) {
    if (left >= 0) px = i, py = j, weight = std::copysign(all, f);
    left -= std::fabs(f);
  });
  if (const auto* sphere = round_sphere(context.camera)) sphere->wrap(&px, &py);
  const PixelRect& crop = context.grid.crop;
  const bool inside = px >= crop.x0 && px < crop.x1 && py >= crop.y0 && py < crop.y1;
  return {inside ? py * context.grid.width + px : -1, weight};
}

}  // namespace lightmill
