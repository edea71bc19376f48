#include "worker/render/plan/analysis/light_media.h"

#include <algorithm>
#include <map>
#include <set>

#include "worker/render/pipeline/pipeline.h"
#include "worker/render/pipeline/walks/medium_walk.h"
#include "worker/render/pipeline/walks/straight_line.h"
#include "worker/render/renderer.h"

namespace lightmill {
namespace {

constexpr int kCells = 16, kDepth = 4;

using Arrivals = std::vector<MediaWork::Arrival>;

Arrivals preview_around(const StageContext& context) {
  Arrivals arrivals;
  Wavefront w;
  w.media = std::make_shared<MediaWork>();
  w.media->arrivals = &arrivals;
  const CellRect cells = context.grid.cells();
  const int columns = cells.x1 - cells.x0, count = columns * (cells.y1 - cells.y0);
  for (int i = 0; i < std::min(kCells, count); ++i) {
    const int cell = static_cast<int>(int64_t{i} * count / std::min(kCells, count));
    render_packet(context, {cell % columns, cell / columns, 0, 1}, 0, w, nullptr);
  }
  return arrivals;
}

/// The sides of a light of declared `sides` by what was met on them.
int32_t sides_by(const Arrivals& arrivals, LightType type, int32_t sides) {
  int32_t medium[2] = {sides & kMaxMedia, sides >> kMediumBits & kMaxMedia};
  const bool one = medium[0] == medium[1];
  for (const bool outside : {false, true}) {
    std::map<int32_t, int> votes;
    for (const MediaWork::Arrival& a : arrivals) {
      // Only surfaces have sides.
      if (a.outside == outside || is_at_a_point(type) || type >= kInfiniteLight) ++votes[a.medium];
    }
    const auto most =
        std::max_element(votes.begin(), votes.end(), [](auto& a, auto& b) { return a.second < b.second; });
    // A ray may have slipped through an edge.
    constexpr int kEnough = 4;
    if (most == votes.end() || most->second < kEnough + 9 * votes[medium[outside]]) continue;
    medium[outside] = most->first;
    if (one) medium[!outside] = most->first;
  }
  return medium_sides(medium[0], medium[1]);
}

}  // namespace

void find_light_media(const Accel& accel, const Camera& camera, const PixelFilter& filter, int width,
                      int height, const SourceLocation& where, RenderScene* scene) {
  if (!scene->any_media() || scene->lights.count() == 0) return;
  scene->outer_medium = scene->camera_medium;
  for_each_transition(*scene, accel, {0, 0, 0}, normalize(Vec3<float>{0.3f, 0.9f, 0.31f}), 0,
                      [&](int32_t, int32_t far) {
                        scene->outer_medium = far;
                        return true;
                      });
  StageContext context{*scene, accel, camera, filter, {width, height, {0, 0, width, height}}};
  context.strategies = kNextEvent;
  context.max_depth = kDepth;
  std::map<int32_t, Arrivals> by_light;
  for (const MediaWork::Arrival& a : preview_around(context)) by_light[a.light].push_back(a);

  std::vector<int32_t>& media = scene->lights.media;
  const std::vector<int32_t> declared = media;
  std::map<int32_t, std::set<int32_t>> found;  // by declared sides
  for (const auto& [light, arrivals] : by_light) {
    const auto i = static_cast<size_t>(light);
    if (scene->lights.type[i] == kVolumeLight) continue;  // it is the medium
    media[i] = sides_by(arrivals, scene->lights.type[i], declared[i]);
    found[declared[i]].insert(media[i]);
  }
  size_t mended = 0;
  for (size_t i = 0; i < media.size(); ++i) {
    // Lights that nothing met, such as most triangles of a large one, are taken to be like the others.
    const auto others = found.find(declared[i]);
    if (!by_light.contains(static_cast<int32_t>(i)) && others != found.end() && others->second.size() == 1)
      media[i] = *others->second.begin();
    mended += media[i] != declared[i];
  }
  if (mended == 0) return;
  scene->warnings.push_back({where, Severity::kWarning,
                             std::to_string(mended) + " of " + std::to_string(media.size()) +
                                 " lights stand in another medium than their MediumInterface says; what "
                                 "camera paths are in when they "
                                 "get there is taken"});
}

}  // namespace lightmill
