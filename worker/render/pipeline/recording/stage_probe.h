#pragma once
// Measures a wavefront for benches: the time in each stage, and the rays that it casts. A wavefront without a
// probe pays one test of a pointer for each call of a stage.
#include <array>
#include <chrono>
#include <cstdint>
#include <utility>
#include <vector>

#include "worker/render/accel/accel.h"
#include "worker/render/pipeline/work_items.h"

namespace lightmill {

/// The five stages. The shadow caster counts as two: forming connections and testing them.
enum class Stage { kProduce, kCast, kBounce, kConnect, kOcclude, kFilm, kOther };
inline constexpr size_t kStages = 7;
inline constexpr std::array<const char*, kStages> kStageNames = {"produce", "cast", "bounce", "connect",
                                                                 "occlude", "film", "other"};

class StageProbe {
 public:
  /// Makes `stage` the one that time counts for, and returns the one before.
  Stage enter(Stage stage) {
    const auto now = std::chrono::steady_clock::now();
    seconds_[static_cast<size_t>(stage_)] += std::chrono::duration<double>(now - since_).count();
    since_ = now;
    return std::exchange(stage_, stage);
  }
  /// Wall time in each stage since start(), up to the last change of stage.
  const std::array<double, kStages>& seconds() const { return seconds_; }
  void start() {
    seconds_ = {};
    since_ = std::chrono::steady_clock::now();
  }

  // Rays in the order cast, if they are wanted. Of a closest-hit ray only origin and direction are set.
  struct Segment {
    float ox, oy, oz, dx, dy, dz, tfar;
  };
  bool keep_rays = false;
  std::vector<Segment> closest, occlusion;
  void cast(const Paths& paths) {
    for (int i = 0; keep_rays && i < paths.active_count; ++i) {
      const TracedRay& r = paths.rays[paths.active[i]];
      closest.push_back(
          {r.origin[0], r.origin[1], r.origin[2], r.direction[0], r.direction[1], r.direction[2], 0});
    }
  }
  void occluded(const ShadowRays& q) {
    for (int i = 0; keep_rays && i < q.count; ++i)
      occlusion.push_back({q.ox[i], q.oy[i], q.oz[i], q.dx[i], q.dy[i], q.dz[i], q.tfar[i]});
  }

 private:
  std::array<double, kStages> seconds_{};
  std::chrono::steady_clock::time_point since_ = std::chrono::steady_clock::now();
  Stage stage_ = Stage::kOther;
};

/// Counts time for a stage until the end of the scope.
class StageScope {
 public:
  StageScope(Wavefront& wavefront, Stage stage) : probe_(wavefront.probe) {
    if (probe_) before_ = probe_->enter(stage);
  }
  ~StageScope() {
    if (probe_) probe_->enter(before_);
  }
  StageScope(const StageScope&) = delete;
  StageScope& operator=(const StageScope&) = delete;

 private:
  StageProbe* probe_;
  Stage before_ = Stage::kOther;
};

}  // namespace lightmill
