#include "worker/render/guiding/training/light_path_preview.h"

#include <algorithm>
#include <cmath>

#include "common/base/parallel.h"
#include "worker/render/light/light_record.h"
#include "worker/render/plan/recorded_cell.h"

namespace lightmill {
namespace {

/// Most camera paths that are followed, and about as many light paths; fewer for an image so small that they
/// would take longer than it.
constexpr int64_t kPreviewPaths = int64_t{1} << 15, kPreviewPathsPerPixel = 8;

/// What a light path brought, and how it set out.
struct PreviewArrival {
  uint32_t pixel = 0;
  Channels rgb{};
  int32_t group = 0, cell = -1;  // -1: its direction can't be guided
  float density = 0;             // of the direction on its square, over that of an even draw
  bool second_half = false, splat = false;
};

class LightPathPreview {
 public:
  LightPathPreview(const StageContext& context, const EmissionGroups& groups)
      : context_(context),
        groups_(groups),
        pilot_pixels_(context.grid,
                      std::min(kPreviewPaths, kPreviewPathsPerPixel * context.grid.crop.area())),
        values_(context.grid, pilot_pixels_),
        arrivals_(pilot_pixels_.cells.size()),
        noise_(pilot_pixels_.cells.size()) {
    context_.pixel_subset = pilot_pixels_.pixel_subset;
  }

  LightPathSums run(int threads) {
    parallel_for(pilot_pixels_.cells.size(), threads, [&](size_t i) { preview_cell(i); });
    values_.finish();
    LightPathSums sums;
    sums.groups.resize(groups_.count());
    for (const std::vector<PreviewArrival>& arrivals : arrivals_) {
      for (const PreviewArrival& a : arrivals) {
        EmissionGroupSums& to = sums.groups[static_cast<size_t>(a.group)];
        const double x = square(a);
        to.all[a.second_half] += x;
        if (a.cell < 0) {
          to.without_direction[a.second_half] += x;
        } else {
          to.cells[a.second_half][static_cast<size_t>(a.cell)] += x * double{a.density};
        }
      }
    }
    for (const std::vector<PixelNoise>& noise : noise_) sums.rest += weighed_sum(noise, values_);
    return sums;
  }

 private:
  double square(const PreviewArrival& a) const {
    const PixelValue value = values_.of(a.pixel);
    return a.splat ? double{context_.filter.splat_noise} * value.square_beside(a.rgb, value.splat_share)
                   : value.square_beside(a.rgb, value.camera_share);
  }

  /// All samples of one cell of the pilot pixels.
  void preview_cell(size_t i) {
    noise_[i] = record_cell(
        context_, pilot_pixels_, i, false, &values_,
        [&](const StrategyRecorder& recorder, size_t k, int block) {
          const StrategyContribution& c = recorder.contributions[k];
          if (c.light_slot < 0) return true;
          arrivals_[i].push_back(arrival(c, recorder.light_starts[static_cast<size_t>(c.light_slot)]));
          arrivals_[i].back().second_half = block > 0;
          return false;
        });
  }

  PreviewArrival arrival(const StrategyContribution& c, const PathStart& start) const {
    PreviewArrival a;
    a.pixel = c.pixel;
    a.rgb = {c.rgb[0], c.rgb[1], c.rgb[2]};
    a.group = groups_.of[static_cast<size_t>(start.light)];
    a.splat = c.t == 1;
    // An emitter joined to the camera has no direction.
    if (c.s > 1) set_direction(start, &a);
    return a;
  }

  void set_direction(const PathStart& start, PreviewArrival* a) const {
    const LightRecord<float> r(context_.lights, start.light);
    const Vec3<float> d{start.direction[0], start.direction[1], start.direction[2]};
    float x = 0, y = 0;
    switch (groups_.shape[static_cast<size_t>(a->group)]) {
      case EmissionShape::kNone:
        return;
      case EmissionShape::kDisk: {
        const Frame<float> frame(r.vec(kLightN));
        x = dot(d, frame.s);
        y = dot(d, frame.t);
        a->density = 4 * kInvPi;
        break;
      }
      case EmissionShape::kSphere: {
        sphere_to_square(d, &x, &y);
        const LightType type = context_.lights.type[static_cast<size_t>(start.light)];
        a->density = type == kTriangleLight ? 2 * std::fabs(dot(d, r.vec(kLightN)))
                     : type == kSpotLight   ? 2 / r.scalar(5)
                                            : 1;
        break;
      }
    }
    a->cell = square_cell(y, kEmissionSide) * kEmissionSide + square_cell(x, kEmissionSide);
  }

  StageContext context_;
  const EmissionGroups& groups_;
  PilotPixels pilot_pixels_;
  PilotValues values_;
  // By cell of the pilot pixels.
  std::vector<std::vector<PreviewArrival>> arrivals_;
  std::vector<std::vector<PixelNoise>> noise_;  // of camera paths without connections
};

}  // namespace

LightPathSums preview_light_paths(const StageContext& context, const EmissionGroups& groups, int threads) {
  return LightPathPreview(context, groups).run(threads);
}

}  // namespace lightmill
