// The image of a film and its light groups, to look at while they are mixed: Film::light_groups_for_display.
#include <algorithm>
#include <utility>
#include <vector>

#include "common/film/aov_film.h"
#include "common/film/signed_sum.h"
#include "common/image/fill_holes.h"
#include "common/job/pixel_interleave.h"

namespace lightmill {

namespace {

/// The image and its groups in blocks of pixels, where each pixel was added once.
struct BlockMeans {
  Image sums;
  std::vector<uint32_t> counts;  // pixels of a block that were added

  /// Turns the sums into means. Returns which blocks have any pixels.
  std::vector<uint8_t> divide() {
    std::vector<uint8_t> known(counts.size());
    const auto channels = static_cast<size_t>(sums.channels);
    for (size_t i = 0; i < counts.size(); ++i) {
      known[i] = counts[i] > 0;
      if (counts[i] < 2) continue;
      for (size_t c = 0; c < channels; ++c) sums.data[i * channels + c] /= static_cast<float>(counts[i]);
    }
    return known;
  }
};

/// What is added for a pixel: of camera samples, of splats, or of both. `groups` have layers but the last.
struct LightSums {
  const AovFilm::Colour& colour;
  const std::vector<GroupLayers>& groups;
  bool with_camera, with_splats;

  /// Into 3 values of the image and 3 of each group.
  void add(size_t pixel, size_t film_pixel, int64_t samples, float* out) const {
    const bool camera = with_camera && samples > 0 && !colour.camera.empty();
    const bool splats = with_splats && colour.light_spp > 0 && !colour.splat.empty();
    const ExactRgb none;
    const ExactRgb& camera_whole = camera ? colour.camera[pixel] : none;
    const ExactRgb& splat_whole = splats ? colour.splat[film_pixel] : none;
    ExactRgb camera_left = camera_whole, splat_left = splat_whole;
    const auto put = [&](const ExactRgb& of_camera, const ExactRgb& of_splats) {
      for (int c = 0; c < 3; ++c) {
        double value = 0;
        if (camera)
          value += from_signed_units(of_camera.c[c], colour.quantum_exponent) / static_cast<double>(samples);
        if (splats) value += from_signed_units(of_splats.c[c], colour.quantum_exponent) / colour.light_spp;
        *out++ += static_cast<float>(value);
      }
    };
    put(camera_whole, splat_whole);
    for (const GroupLayers& group : groups) {
      const ExactRgb& of_camera = camera && !group.camera.empty() ? group.camera[pixel] : none;
      const ExactRgb& of_splats = splats && !group.splat.empty() ? group.splat[film_pixel] : none;
      put(of_camera, of_splats);
      for (int c = 0; c < 3; ++c) {
        camera_left.c[c] -= of_camera.c[c];
        splat_left.c[c] -= of_splats.c[c];
      }
    }
    put(camera_left, splat_left);  // the last group has what the others leave
  }
};

BlockMeans add_blocks(const FilmGrid& grid, const LightSums& light, int block) {
  const PixelRect& crop = grid.crop;
  const int width = (crop.width() + block - 1) / block, height = (crop.height() + block - 1) / block;
  const int channels = 3 * (static_cast<int>(light.groups.size()) + 2);
  BlockMeans blocks{Image(width, height, channels),
                    std::vector<uint32_t>(static_cast<size_t>(width) * static_cast<size_t>(height))};
  const PixelInterleave interleave(grid);
  size_t pixel = 0;
  for (int y = crop.y0; y < crop.y1; ++y) {
    for (int x = crop.x0; x < crop.x1; ++x, ++pixel) {
      const auto film_pixel = static_cast<size_t>(interleave.film_index(x, y));
      const int64_t samples = light.colour.samples(x / kCellSize, y / kCellSize);
      if (!light.with_splats && samples == 0) continue;
      const auto columns = static_cast<size_t>(crop.width()), side = static_cast<size_t>(block);
      const size_t at =
          film_pixel / columns / side * static_cast<size_t>(width) + film_pixel % columns / side;
      ++blocks.counts[at];
      light.add(pixel, film_pixel, samples, &blocks.sums.data[at * static_cast<size_t>(channels)]);
    }
  }
  return blocks;
}

}  // namespace

ChannelImage AovFilm::light_groups(const FilmGrid& grid, const Colour& colour, bool holes, int block) const {
  const LightGroups& groups = sums_.spec.groups;
  ChannelImage result;
  if (groups.empty()) return result;
  result.channels = {"R", "G", "B"};
  for (std::string& channel : aov_channels(kAovLightGroups, groups))
    result.channels.push_back(std::move(channel));
  if (!holes) {
    BlockMeans all = add_blocks(grid, {colour, groups_, true, true}, block);
    all.divide();
    result.image = std::move(all.sums);
    return result;
  }
  // Splats lie everywhere, so only what camera samples see is filled in.
  BlockMeans camera = add_blocks(grid, {colour, groups_, true, false}, block);
  fill_holes(camera.divide(), &camera.sums);
  result.image = std::move(camera.sums);
  BlockMeans splats = add_blocks(grid, {colour, groups_, false, true}, block);
  splats.divide();
  for (size_t i = 0; i < result.image.data.size(); ++i) result.image.data[i] += splats.sums.data[i];
  return result;
}

}  // namespace lightmill
