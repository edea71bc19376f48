#include "worker/render/guiding/training/missing_light.h"

#include <algorithm>
#include <cmath>
#include <cstdio>
#include <memory>
#include <utility>
#include <vector>

#include "common/base/parallel.h"
#include "worker/render/guiding/training/vertex_cubes.h"
#include "worker/render/pipeline/connections/guided_density.h"
#include "worker/render/pipeline/connections/joined_vertices.h"
#include "worker/render/plan/camera_preview.h"
#include "worker/render/plan/recorded_cell.h"

namespace lightmill {
namespace {

/// Most camera paths of the preview pass, and light paths; fewer for an image so small that they would take
/// longer than it. This many arrivals of light paths are enough, looked for in rounds of this many
/// wavefronts.
constexpr int64_t kCameraPaths = int64_t{1} << 14, kCameraPathsPerPixel = 4;
constexpr int64_t kLightPaths = int64_t{1} << 17, kLightPathsPerPixel = 16;
constexpr size_t kArrivals = size_t{1} << 14, kArrivalRound = 32;
/// Photons count around a point as far as this part of the visible scene's extent, on surfaces that lie and
/// face like its own.
constexpr float kRadius = 1.0f / 64, kFlat = 0.2f, kLeastCosine = 0.9f;
constexpr float kLeastRadius = 1e-9f;  // of a scene that extends about 1

bool on_surface(const Vertex& v) { return v.kind() != kPhaseFunction; }
Lane mean_of(const Vec3<Lane>& rgb) { return (rgb.x + rgb.y + rgb.z) * (1.0f / 3); }

/// Extent of most of what is visible, along the longest axis.
float extent_of(const std::vector<Vertex>& seen) {
  float extent = 0;
  for (int axis = 0; axis < 3; ++axis) {
    std::vector<float> x;
    x.reserve(seen.size());
    for (const Vertex& v : seen) x.push_back(v.f[Vertex::kP + axis]);
    std::sort(x.begin(), x.end());
    extent = std::max(extent, x[x.size() - 1 - x.size() / 50] - x[x.size() / 50]);
  }
  return extent;
}

class MissingLightPreview {
 public:
  explicit MissingLightPreview(const StageContext& context)
      : context_(context),
        pilot_pixels_(context.grid, std::min(kCameraPaths, kCameraPathsPerPixel * context.grid.crop.area())) {
    context_.pixel_subset = pilot_pixels_.pixel_subset;
    context_.imaging_ratio = 1;
    context_.response = nullptr;
  }

  MissingLight run(int threads) {
    find_seen(threads);
    if (seen_.empty()) return {};
    find_arrivals(threads);
    radius_ = kRadius * extent_of(seen_);
    if (arrivals_.empty() || !(radius_ > kLeastRadius)) return {};
    const double light = mean_light(threads);
    const VertexCubes cubes(arrivals_, radius_);
    constexpr size_t kChunk = 256;
    std::vector<MissingLight> sums((seen_.size() + kChunk - 1) / kChunk);
    parallel_for(sums.size(), threads, [&](size_t i) {
      const size_t end = std::min(seen_.size(), (i + 1) * kChunk);
      for (size_t k = i * kChunk; k < end; ++k) gather_at(seen_[k], cubes, light, &sums[i]);
    });
    MissingLight sum;
    for (const MissingLight& s : sums) {
      for (size_t k = 0; k < sum.parts.size(); ++k) sum.parts[k] += s.parts[k];
    }
    const MissingShare all = sum.up_to(2 * kPhotonDepth);
    const double image = light + all.never + all.seldom;
    if (!(image > 0) || !std::isfinite(image)) return {};
    sum.image = image;
    const double per_light = 1 / image;
    for (MissingShare& part : sum.parts) {
      part.all *= per_light, part.never *= per_light, part.seldom *= per_light;
      part.noise *= per_light * per_light;
    }
    return sum;
  }

 private:
  /// Finds where camera paths come to what can be joined after mirrors and smooth glass alone.
  void find_seen(int threads) {
    std::vector<std::vector<Vertex>> found(pilot_pixels_.cells.size());
    std::vector<uint64_t> paths(found.size());
    parallel_for(found.size(), threads, [&](size_t i) {
      const auto wavefront = std::make_unique<Wavefront>();
      Wavefront& w = *wavefront;
      prepare(context_, &w);
      const CellRect rect = pilot_pixels_.rect(i);
      for (int64_t j = 0; j < pilot_pixels_.samples; ++j)
        follow_sample(rect, pilot_pixels_.index(j), w, &found[i]);
      paths[i] = w.counters.camera_paths;
    });
    for (size_t i = 0; i < found.size(); ++i) {
      seen_.insert(seen_.end(), found[i].begin(), found[i].end());
      camera_paths_ += static_cast<double>(paths[i]);
    }
  }
  void follow_sample(const CellRect& rect, int64_t s, Wavefront& w, std::vector<Vertex>* found) const {
    w.slots.begin_superblock(context_, rect.x0, rect.y0, superblock_of_sample(s), context_.pixel_subset);
    std::array<bool, kWavefront> ended{};
    follow_camera_paths(context_, s, kPhotonDepth, w, [&](int depth) {
      for (const Vertex& v : w.vertices) {
        bool& end = ended[static_cast<size_t>(v.path())];
        if (!end && depth > 1 && on_surface(v)) found->push_back(v);
        end = true;
      }
      w.paths.end(ended);
    });
  }

  void find_arrivals(int threads) {
    const auto wavefronts = static_cast<size_t>(
        std::min(kLightPaths, kLightPathsPerPixel * context_.grid.crop.area()) / kWavefront);
    const auto trace = [&](size_t number) {
      std::vector<Vertex> arrivals = arrivals_of_wavefront(context_, number);
      std::erase_if(arrivals, [](const Vertex& v) { return !on_surface(v); });
      return arrivals;
    };
    const size_t traced =
        trace_wavefronts(0, wavefronts, kArrivalRound, kArrivals, threads, trace, &arrivals_);
    light_paths_ = static_cast<double>(traced * kWavefront);
  }

  /// Mean of a pixel over the image: what is found without this light, or by emitter hits that happened.
  double mean_light(int threads) const {
    struct Sums {
      double camera = 0, splats = 0, camera_paths = 0, light_paths = 0;
    };
    std::vector<Sums> sums(pilot_pixels_.cells.size());
    parallel_for(sums.size(), threads, [&](size_t i) {
      const auto add_sample = [&](const StrategyRecorder& recorder, const RenderCounters& counters, int) {
        for (const StrategyContribution& c : recorder.contributions)
          (c.t == 1 ? sums[i].splats : sums[i].camera) += double{c.rgb[0] + c.rgb[1] + c.rgb[2]} / 3;
        sums[i].camera_paths += static_cast<double>(counters.camera_paths);
        sums[i].light_paths += static_cast<double>(counters.light_paths);
      };
      record_samples(context_, pilot_pixels_, i, false, add_sample);
    });
    Sums all;
    for (const Sums& s : sums) {
      all.camera += s.camera;
      all.splats += s.splats;
      all.camera_paths += s.camera_paths;
      all.light_paths += s.light_paths;
    }
    const double film_paths = 1 / double{context_.splat_scale};
    const double splats =
        all.light_paths > 0 ? all.splats * film_paths / all.light_paths / static_cast<double>(pixels()) : 0;
    return splats + all.camera / std::max(all.camera_paths, 1.0);
  }
  int64_t pixels() const { return int64_t{context_.grid.width} * context_.grid.height; }

  /// Adds what photons bring to the camera vertex `seen`, per camera path of the preview pass. `light`: of a
  /// pixel.
  void gather_at(const Vertex& seen, const VertexCubes& cubes, double light, MissingLight* sum) const {
    std::array<int32_t, kLanes> near{};
    int count = 0;
    const Vec3<float> p = seen.vec(Vertex::kP), n = seen.vec(Vertex::kNg);
    cubes.around(p, [&](int32_t i) {
      const Vertex& a = arrivals_[static_cast<size_t>(i)];
      const Vec3<float> d = a.vec(Vertex::kP) - p;
      if (!(dot(d, d) < radius_ * radius_) || std::fabs(dot(d, n)) > kFlat * radius_ ||
          std::fabs(dot(a.vec(Vertex::kNg), n)) < kLeastCosine)
        return;
      near[static_cast<size_t>(count++)] = i;
      if (count == kLanes) add(seen, near, std::exchange(count, 0), light, sum);
    });
    if (count > 0) add(seen, near, count, light, sum);
  }
  /// The first `count` of the arrivals `near`.
  void add(const Vertex& seen, const std::array<int32_t, kLanes>& near, int count, double light,
           MissingLight* sum) const {
    const LaneMask active = LaneMask(lane_index<Lane>() < count);
    VertexLanes<Lane> v = load_vertices(&seen, LaneInt{});
    v.params.tables = context_.scene.bsdf_tables.data();
    const VertexLanes<Lane> l =
        load_vertices(arrivals_.data(), gather(near.data(), select(active, lane_index<Lane>(), LaneInt{})));
    const Frame<Lane> frame(v.ns);
    const BsdfEval<Lane> f = eval_bsdf<Lane>(v.kind, active, v.params, local_viewer(context_, v, frame, v.wo),
                                             frame.to_local(l.wo), Mode::kRadiance);
    const Lane pdf = camera_density(context_.scene, v, l.wo, active, f.pdf);
    const Lane value = mean_of(v.throughput * l.throughput * f.f), chance = l.dvc * pdf;
    const double each = 1 / (M_PI * double{radius_} * double{radius_} * light_paths_ * camera_paths_);
    for (int k = 0; k < count; ++k) {
      const double brings = double{lane(value, k)}, meets = double{lane(chance, k)};
      if (!(brings > 0) || !std::isfinite(brings) || !(meets >= 0)) continue;
      const auto events = static_cast<size_t>(lane(l.depth, k) + seen.depth() - 1);
      MissingShare& part = sum->parts[events];
      part.all += brings * each;
      if (meets == 0) {
        part.never += brings * each;
        continue;
      }
      part.noise += brings * each * (brings / meets);
      if (brings > meets * light * static_cast<double>(pixels())) {
        part.seldom += brings * each;
        part.emitter_hits += meets * each;
      }
    }
  }

  StageContext context_;
  PilotPixels pilot_pixels_;
  std::vector<Vertex> seen_, arrivals_;
  double camera_paths_ = 0, light_paths_ = 0;
  float radius_ = 0;
};

}  // namespace

MissingShare MissingLight::up_to(int max_depth) const {
  MissingShare sum;
  for (size_t k = 0; k < parts.size() && k <= static_cast<size_t>(std::max(max_depth, 0)); ++k)
    sum += parts[k];
  return sum;
}

MissingLight estimate_missing_light(const StageContext& context, int threads) {
  // Light paths can't be followed among fibres.
  if (!context.scene.any_delta || context.scene.any_fibres) return {};
  return MissingLightPreview(context).run(threads);
}

std::string missing_light_text(const MissingShare& missing) {
  constexpr double kLittle = 0.01;
  const double lacks = missing.never + missing.seldom;
  if (lacks < kLittle) return {};
  const bool never = missing.never >= kLittle / 2, seldom = missing.seldom >= kLittle / 2;
  char share[32], chance[32];
  std::snprintf(share, sizeof share, "about %.2g %%", 100 * lacks);
  std::snprintf(chance, sizeof chance, "one camera path in %.1g", 1 / missing.emitter_hits);
  return std::string(share) +
         " of the image's light is missing, and the estimate of its error does not know: off mirrors or "
         "through smooth glass it comes to what is only seen in mirrors or through smooth glass, from "
         "lights " +
         (never ? "at a point or far away, which no path meets" : "") + (never && seldom ? ", and " : "") +
         (seldom ? "so small that " + std::string(chance) + " meets them" : "") +
         "; larger lights would show it, or glass and mirrors that are a little rough";
}

}  // namespace lightmill
