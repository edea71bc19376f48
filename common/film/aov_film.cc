#include "common/film/aov_film.h"

#include "common/base/error.h"
#include "common/film/packing.h"
#include "common/film/signed_sum.h"
#include "common/film/unit_planes.h"
#include "common/job/pixel_interleave.h"

namespace lightmill {

namespace {

size_t entry(int64_t i) { return static_cast<size_t>(i); }

/// What resolve needs of one pixel.
struct PixelSums {
  const AovSums& sums;
  const AovFilm::Colour& colour;
  const std::vector<ExactRgb>& direct_splat;
  size_t pixel;       // in packet order
  size_t film_pixel;  // the same one's place in the image
  int64_t samples;

  Units of(AovLayer layer, int c) const { return sums.layers[layer][pixel].c[c]; }
  int64_t hits() const { return static_cast<int64_t>(of(kDepthLayer, 1)); }

  /// Direct light, or the rest: `indirect`. The difference is taken of exact sums.
  double light(bool indirect, int c) const {
    const auto mean = [&](Units whole, Units direct, double count) {
      return from_signed_units(indirect ? whole - direct : direct, colour.quantum_exponent) / count;
    };
    double value = 0;
    if (samples > 0) {
      value += mean(colour.camera[pixel].c[c], of(kDirectLayer, c), static_cast<double>(samples));
    }
    if (colour.light_spp > 0 && !colour.splat.empty()) {
      const Units direct = direct_splat.empty() ? 0 : direct_splat[film_pixel].c[c];
      value += mean(colour.splat[film_pixel].c[c], direct, colour.light_spp);
    }
    return value;
  }

  double value(Aovs aov, int c) const {
    switch (aov) {
      case kAovAlbedo:
        return samples > 0 ? albedo_of(of(kAlbedoLayer, c), samples) : 0;
      case kAovNormal:
        return samples > 0 ? normal_of(of(kNormalLayer, c), samples) : 0;
      case kAovDepth:
        return hits() > 0 ? depth_of(of(kDepthLayer, 0), hits(), sums.spec.frame) : 0;
      case kAovPosition:
        return hits() > 0 ? position_of(of(kPositionLayer, c), hits(), sums.spec.frame, c) : 0;
      case kAovAlpha:
        return samples > 0 ? static_cast<double>(hits()) / static_cast<double>(samples) : 0;
      case kAovDirect:
        return light(false, c);
      case kAovIndirect:
        return light(true, c);
      case kAovVariance:
        return variance_of(of(kVarianceLayer, c), samples > 0 ? colour.camera[pixel].c[c] : 0, samples,
                           colour.quantum_exponent);
      default:
        return static_cast<double>(samples);
    }
  }
};

}  // namespace

void AovFilm::check(const Partial& partial, bool first) const {
  if (!first && partial.aovs.spec != sums_.spec) {
    throw Error(ErrorKind::kFailed, "partial has other AOVs than the film: \"" +
                                        aov_names(partial.aovs.spec.set) + "\", not \"" +
                                        aov_names(sums_.spec.set) + "\"");
  }
}

void AovFilm::fold(const Partial& partial) {
  const AovSums& from = partial.aovs;
  if (from.spec.set == 0) return;
  const FilmGrid& grid = partial.grid;
  const auto crop_area = entry(grid.crop.area());
  sums_.spec = from.spec;
  const PixelRect r = grid.pixels(partial.tile.cells);
  for (size_t layer = 0; layer < kAovLayers; ++layer) {
    const ExactRgb* source = from.layers[layer].data();
    if (from.layers[layer].empty()) continue;
    std::vector<ExactRgb>& target = sums_.layers[layer];
    if (target.empty()) target.resize(crop_area);
    for (int y = r.y0; y < r.y1; ++y) {
      ExactRgb* to = &target[entry(int64_t{y - grid.crop.y0} * grid.crop.width() + r.x0 - grid.crop.x0)];
      for (int x = r.x0; x < r.x1; ++x) *to++ += *source++;
    }
  }
  if (!from.direct_splats.empty() && direct_splat_.empty()) direct_splat_.resize(crop_area);
  for (const SplatSum& splat : from.direct_splats) {
    direct_splat_[entry(grid.crop_index(splat.pixel))] += splat.sum;
  }
}

ChannelImage AovFilm::resolve(const FilmGrid& grid, const Colour& colour) const {
  ChannelImage result;
  const Aovs set = sums_.spec.set;
  result.channels = aov_channels(set);
  if (set == 0) return result;
  const PixelRect& crop = grid.crop;
  result.image = Image(crop.width(), crop.height(), static_cast<int>(result.channels.size()));
  const PixelInterleave interleave(grid);
  size_t pixel = 0;
  for (int y = crop.y0; y < crop.y1; ++y) {
    for (int x = crop.x0; x < crop.x1; ++x, ++pixel) {
      const size_t film_pixel = entry(interleave.film_index(x, y));
      const PixelSums at{sums_, colour,     direct_splat_,
                         pixel, film_pixel, colour.samples(x / kCellSize, y / kCellSize)};
      float* out = &result.image.data[film_pixel * result.channels.size()];
      for (Aovs aov = 1; aov <= kAllAovs; aov <<= 1) {
        if (!(set & aov)) continue;
        const int channels = aov & (kAovDepth | kAovAlpha | kAovSamples) ? 1 : 3;
        for (int c = 0; c < channels; ++c) *out++ = static_cast<float>(at.value(aov, c));
      }
    }
  }
  return result;
}

void AovFilm::write(ByteWriter* out) const {
  if (empty()) return;
  const AovFrame& frame = sums_.spec.frame;
  out->put<uint32_t>(sums_.spec.set);
  out->put<int32_t>(frame.scale_exponent);
  for (const double x : frame.origin) out->put<double>(x);
  const auto put = [&](const std::vector<ExactRgb>& layer) {
    const ByteRange range = used_bytes(std::span(layer));
    out->put<uint8_t>(!layer.empty());
    out->put<uint8_t>(range.low);
    out->put<uint8_t>(range.high);
    append_planes(std::span(layer), range, &out->bytes());
  };
  for (const std::vector<ExactRgb>& layer : sums_.layers) put(layer);
  put(direct_splat_);
}

void AovFilm::read(ByteReader* in, const FilmGrid& grid) {
  if (in->rest().empty()) return;
  sums_.spec.set = in->get<uint32_t>();
  AovFrame& frame = sums_.spec.frame;
  frame.scale_exponent = in->get<int32_t>();
  for (double& x : frame.origin) x = in->get<double>();
  if (sums_.spec.set == 0 || (sums_.spec.set & ~kAllAovs)) in->fail("unknown AOVs");
  const auto get = [&](std::vector<ExactRgb>* layer) {
    const bool present = in->get<uint8_t>() != 0;
    ByteRange range;
    range.low = in->get<uint8_t>();
    range.high = in->get<uint8_t>();
    if (!range.valid()) in->fail("unknown layout");
    if (!present) return;
    const auto pixels = entry(grid.crop.area());
    const std::string_view planes = in->get_bytes(plane_bytes(pixels, range));
    layer->resize(pixels);
    read_planes(planes, range, std::span(*layer));
  };
  for (size_t layer = 0; layer < kAovLayers; ++layer) {
    get(&sums_.layers[layer]);
    if (sums_.layers[layer].empty() == needs_layer(sums_.spec.set, static_cast<int>(layer))) {
      in->fail("an AOV's layer is missing");
    }
  }
  get(&direct_splat_);
}

}  // namespace lightmill
