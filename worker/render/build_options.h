#pragma once
// How a scene is built for rendering; none of it shows in its pixels.
#include <cstdint>
#include <functional>
#include <string>

namespace lightmill {

/// No bound of the memory of textures.
inline constexpr uint64_t kUnboundedTextures = ~uint64_t{0};

class Renderer;

struct BuildOptions {
  // Implicit: most callers care about threads only.
  BuildOptions(int thread_limit = 0, uint64_t max_texture_bytes = kUnboundedTextures)
      : threads(thread_limit), texture_bytes(max_texture_bytes) {}

  int threads;               // that read images and build the tree; 0: one per processor
  uint64_t texture_bytes;    // of memory for images on surfaces; what has no room is read where it is needed.
                             // Grids of media may take what images leave; beyond, they are in files
  std::string spill_folder;  // of these; empty: spill_area.h chooses
  bool normalised_light = true;  // normalised_light.h; false: what is recorded has the scene's brightness
  bool unused_textures = false;  // images that nothing in use shows are read, too, to be checked
  /// Called with a renderer of the scene before anything is learnt of it, which may take seconds: what it
  /// renders is right, but noisier. Empty: nobody wants to see it.
  std::function<void(const Renderer&)> when_built;
};

}  // namespace lightmill
