#pragma once
// Textures at render time: the small texture graph over images.
#include <array>
#include <cstddef>
#include <memory>
#include <vector>

#include "common/scene/description.h"
#include "worker/render/build_options.h"
#include "worker/render/math/vec.h"
#include "worker/render/scene/textures/image_map.h"
#include "worker/render/scene/textures/texture_cache.h"

namespace lightmill {

class GraphProgram;

/// Values of graphs at one point, worked out together with those of other points.
struct KnownValues {
  static constexpr int kMost = 4;
  int count;
  int texture[kMost];
  Rgb value[kMost];
};

/// The ray that meets the point, for graphs that ask; without one it comes along the normal, from the camera.
struct RayAtPoint {
  Vec3<float> towards{};  // unit, to where it comes from
  float length = 0;       // in scene units
  int32_t depth = 0;      // scattering events before
  bool camera = true, shadow = false, diffuse = false, glossy = false, singular = false, transmitted = false;
};

/// Where a texture is looked up.
struct TexturePoint {
  float u = 0, v = 0;                      // surface coordinates
  Vec3d p{};                               // position in scene units
  std::array<float, 4> color{1, 1, 1, 1};  // of the vertices, interpolated
  Vec3<float> n{0, 0, 1};                  // unit geometric normal, of either side
  float second_u = 0, second_v = 0;        // of the mesh's second set
  Vec3<float> ns{0, 0, 0};                 // unit shading normal where it is known, for graphs; else zero
  const KnownValues* known = nullptr;      // of graphs
  const RayAtPoint* ray = nullptr;         // for graphs
};

/// All textures of a scene, evaluated per point.
class TextureTable {
 public:
  /// Reads the images on `options.threads` threads. They take up to `options.texture_bytes`. Images without
  /// room are checked once and read again where they are needed, through a TextureCache, with the same bits.
  /// Throws Error(kBadScene) for the first that can't be read, and Error(kFailed) if images inside another
  /// file, which are always kept, take more. Images whose entry in `in_use` is false are not read and never
  /// looked up; an empty `in_use` means all.
  explicit TextureTable(const std::vector<TextureDescription>& textures, const BuildOptions& options = 1,
                        const std::vector<bool>& in_use = {});
  /// Value of texture `id` at a point; floats come as grey.
  Rgb evaluate(int id, const TexturePoint& at) const;
  /// Values of a graph at eight points, with the bits that evaluate() has.
  void evaluate_graph(int id, const TexturePoint at[8], Rgb values[8]) const;
  bool is_graph(int id) const { return id >= 0 && !graphs_.empty() && graphs_[static_cast<size_t>(id)]; }
  bool any_graph() const { return !graphs_.empty(); }
  /// Whether a graph asks for the ray.
  bool any_of_ray() const { return any_of_ray_; }
  /// The direction of the scene's space that a shading normal stands for which graph `id` gave.
  Vec3<float> normal_of_graph(int id, const Rgb& given) const;
  /// Begins to fetch the texels that evaluate() will read, if the texture is an image.
  void prefetch(int id, const TexturePoint& at) const;
  /// The image behind texture `id`, or null if it is of another kind or not in use.
  const ImageMap* image(int id) const {
    const int at = image_of_[static_cast<size_t>(id)];
    return at < 0 ? nullptr : &images_[static_cast<size_t>(at)];
  }
  size_t size() const { return nodes_.size(); }
  /// Number of images that were not read, as nothing in use shows them.
  size_t unused_images() const { return unused_images_; }
  /// Bytes of texels in memory, and of the cache at its fullest.
  uint64_t bytes() const { return bytes_; }
  /// Number of images that are read where they are needed.
  size_t cached_images() const;
  /// Throws Error(kFailed) if an image could be read when the table was made, but not since. What was
  /// evaluated after that is void.
  void throw_if_unreadable() const {
    if (cache_) cache_->throw_if_failed();
  }

 private:
  Rgb input(const SpectrumInput& in, const TexturePoint& at) const;
  std::vector<TextureKind> nodes_;
  std::unique_ptr<TextureCache> cache_;  // null: all images are in memory
  uint64_t bytes_ = 0;
  size_t unused_images_ = 0;
  std::vector<ImageMap> images_;
  std::vector<std::shared_ptr<const GraphProgram>> graphs_;  // per node, null if it is no graph; empty: none
  bool any_of_ray_ = false;
  std::vector<int> image_of_;  // per node, -1 if it is not an image or not in use
};

}  // namespace lightmill
