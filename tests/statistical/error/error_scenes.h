#pragma once
// Six small scenes with noise of different kinds, to judge error estimates by, and independent runs of them.
#include <memory>
#include <string>
#include <vector>

#include "common/film/partial.h"
#include "common/job/settings.h"
#include "worker/render/renderer.h"

namespace lightmill::test {

struct ErrorScene {
  std::string name;
  SceneDescription scene;
  RenderSettings settings;  // of any seed and number of samples
};

/// diffuse (pt), glossy (bdpt), caustic (pt: fireflies), environment (pt), point-glass (bdpt: all of the
/// caustic is splats), splats (lt); `side` x `side` pixels. `gaussian`: through pbrt's default filter, by
/// which neighbours share splats, instead of a box of one pixel.
std::vector<ErrorScene> error_scenes(int side, bool gaussian = false);

/// Renders superblocks of one scene. Single-threaded.
class SuperblockRenderer {
 public:
  SuperblockRenderer(const ErrorScene& scene, uint64_t seed);
  /// The partial of samples [16 index, 16 (index + 1)) of the whole image.
  Partial render(int64_t index);

 private:
  RenderSettings settings_;
  std::unique_ptr<Renderer> renderer_;
  std::unique_ptr<Workspace> workspace_;
};

}  // namespace lightmill::test
