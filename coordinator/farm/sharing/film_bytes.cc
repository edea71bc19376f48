#include "coordinator/farm/sharing/film_bytes.h"

#include <algorithm>

#include "common/error/batch_film.h"
#include "common/film/aov_layers.h"
#include "common/film/cryptomatte/matte_sums.h"

namespace lightmill {
namespace {

constexpr double kFixedBytes = 1 << 20;
constexpr double kBytesPerReferencePixel = 3 * sizeof(float);
constexpr double kBytesPerTrackedPixel = 3 * sizeof(float);  // of each batch
constexpr double kPixelsPerBox = TrackedPixels::kBoxSide * TrackedPixels::kBoxSide;
constexpr double kBytesPerSplatPixel = 12;  // encoded: 10 to 14

}  // namespace

double film_bytes(const RenderSettings& settings) {
  const auto pixels = static_cast<double>(settings.grid.crop.area());
  const bool undecided = needs_pilot(settings);
  int sums = 0;  // layers of one exact sum a pixel
  if (undecided || has_camera_layer(settings)) ++sums;
  if (undecided || has_splat_layer(settings)) ++sums;
  for (int layer = 0; layer < kAovLayers; ++layer) {
    if (settings.aovs && needs_layer(settings.aovs, layer)) sums += layer == kDirectLayer ? 2 : 1;
  }
  const bool weighted = undecided ? !settings.uniform_sampling : !plan_of(settings).allocation.uniform();
  if (settings.aovs && weighted) ++sums;
  const auto groups = static_cast<int>(group_layers(settings.light_groups));
  sums += groups * (undecided || has_splat_layer(settings) ? 2 : 1);
  if (settings.aovs & kAovDifference) sums *= 2;
  // Lobes have no difference.
  sums += static_cast<int>(lobe_layers(settings.aovs)) * (undecided || has_splat_layer(settings) ? 2 : 1);
  const double mattes = settings.aovs & kAovsOfCounts ? kMatteBytesPerPixel : 0;
  const int64_t superblocks = (settings.spp + kSuperblockSamples - 1) / kSuperblockSamples;
  const double batches =
      std::min<double>(static_cast<double>(superblocks), static_cast<double>(BatchFilm::kMaxBatches));
  const double tracked = std::min<double>(pixels, static_cast<double>(BatchFilm::kMaxTrackedPixels));
  return kFixedBytes +
         pixels * (sums * static_cast<double>(sizeof(ExactRgb)) + mattes + kBytesPerReferencePixel) +
         (tracked + (pixels > tracked ? pixels / kPixelsPerBox : 0)) * batches * kBytesPerTrackedPixel;
}

double splat_layer_bytes(const RenderSettings& settings) {
  return has_splat_layer(settings) ? kBytesPerSplatPixel * static_cast<double>(settings.grid.crop.area()) : 0;
}

}  // namespace lightmill
