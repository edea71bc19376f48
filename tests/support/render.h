#pragma once
// Rendering in tests, through the same partials and film as the farm.
#include <functional>

#include "common/film/partial.h"
#include "common/image/image.h"
#include "common/job/settings.h"
#include "common/scene/description.h"
#include "tests/support/statistics.h"
#include "worker/render/math/vec.h"
#include "worker/render/renderer.h"

namespace lightmill::test {

/// Settings over the scene's film.
RenderSettings settings_for(const SceneDescription& scene, Integrator integrator, int64_t spp, int max_depth,
                            uint64_t seed = 1);

/// How packets are handed out: in order, in reverse, or scattered.
enum class PacketOrder { kForward, kReverse, kScattered };

/// One partial of the whole crop window and all samples.
Partial render_partial(const SceneDescription& scene, const RenderSettings& settings, int threads = 1,
                       PacketOrder order = PacketOrder::kForward);

/// The same of a scene that is built already.
Partial render_partial(const Renderer& renderer, int threads = 1, PacketOrder order = PacketOrder::kForward);

/// One partial of sample indices [begin, end) of the whole crop window.
Partial render_samples(const Renderer& renderer, int64_t begin, int64_t end);

/// One partial of all sample indices of some cells.
Partial render_cells(const Renderer& renderer, const CellRect& cells);

/// A point of the scene in the space that the renderer has it in.
Vec3<float> placed(const Renderer& renderer, const Vec3d& p);

/// Independent images, of a seed each. settings.spp is split over `batches` and must be a multiple of 16 *
/// batches.
struct Batches {
  std::vector<Image> images;
  RenderCounters counters;
  /// The mean over pixels [rect] of channel `c` (-1: all) in every batch.
  Estimate mean(const PixelRect& rect, int c = -1) const;
  Estimate mean(int c = -1) const;
  /// The same of any functional of an image.
  Estimate of(const std::function<double(const Image&)>& value) const;
};
Batches render_batches(const SceneDescription& scene, const RenderSettings& settings, int batches,
                       int threads = 1);

/// The mean over the image, one to a seed from 1 to 16, of the scene that `world` was built for.
Estimate mean_over_seeds(const Renderer& world, RenderSettings settings);

/// "pt", "bdpt" or "lt" for messages and parameterised test names.
inline std::string name_of(Integrator i) { return integrator_name(i); }

}  // namespace lightmill::test
