#include "common/film/aov_film.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include "common/base/error.h"
#include "common/film/halves/layer_sums.h"
#include "common/film/packing.h"
#include "common/film/signed_sum.h"
#include "common/film/stored_layer.h"
#include "common/job/pixel_interleave.h"

namespace lightmill {

namespace {

size_t entry(int64_t i) { return static_cast<size_t>(i); }

/// What resolve needs of one pixel.
struct PixelSums {
  const AovSums& sums;
  const AovFilm::Colour& colour;
  const std::vector<ExactRgb>& direct_splat;
  const std::vector<GroupLayers>&groups, &lobes;
  const HalfFilm& half;
  const MatteFilm& mattes;
  size_t pixel;       // in packet order
  size_t film_pixel;  // the same one's place in the image
  size_t cell;        // the one that it is in, and its place there
  size_t in_cell;
  int64_t samples;
  int64_t half_samples;

  Units of(AovLayer layer, int c) const { return sums.layers[layer][pixel].c[c]; }
  int64_t hits() const { return static_cast<int64_t>(of(kDepthLayer, 1)); }
  /// Of a layer that counts its own.
  int64_t hits_of(AovLayer layer) const { return static_cast<int64_t>(of(layer, 2)); }
  /// What all but radiance is a mean over, hits among it; and the number of camera samples.
  int64_t weights() const {
    return sums.spec.weighted ? static_cast<int64_t>(of(kWeightsLayer, 0)) : samples;
  }
  int64_t count() const { return sums.spec.weighted ? static_cast<int64_t>(of(kWeightsLayer, 1)) : samples; }

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

  static ExactRgb at(const std::vector<ExactRgb>& layer, size_t i) {
    return layer.empty() ? ExactRgb{} : layer[i];
  }
  /// What part `part` has of a sum `whole`, by of(i) of the `count` parts with layers. The last part has what
  /// the others leave.
  template <class Of>
  static ExactRgb part_of(size_t part, size_t count, const ExactRgb& whole, const Of& of) {
    if (part < count) return of(part);
    ExactRgb left = whole;
    for (size_t i = 0; i < count; ++i) {
      const ExactRgb other = of(i);
      for (int c = 0; c < 3; ++c) left.c[c] -= other.c[c];
    }
    return left;
  }
  // Sums of one of the light groups or lobes, of camera samples and of splats; of a group's half, too.
  ExactRgb camera_of(const std::vector<GroupLayers>& parts, size_t part) const {
    return part_of(part, parts.size(), at(colour.camera, pixel),
                   [&](size_t i) { return at(parts[i].camera, pixel); });
  }
  ExactRgb splat_of(const std::vector<GroupLayers>& parts, size_t part) const {
    return part_of(part, parts.size(), at(colour.splat, film_pixel),
                   [&](size_t i) { return at(parts[i].splat, film_pixel); });
  }
  ExactRgb half_camera(size_t group) const {
    return part_of(group, groups.size(), half.camera(pixel),
                   [&](size_t i) { return half.group_camera(i, pixel); });
  }
  ExactRgb half_splat(size_t group) const {
    return part_of(group, groups.size(), half.splat(film_pixel),
                   [&](size_t i) { return half.group_splat(i, film_pixel); });
  }

  float* put_light(const std::vector<GroupLayers>& parts, size_t part, float* out) const {
    const ExactRgb camera = camera_of(parts, part), splat = splat_of(parts, part);
    for (int c = 0; c < 3; ++c) {
      double value = 0;
      if (samples > 0)
        value += from_signed_units(camera.c[c], colour.quantum_exponent) / static_cast<double>(samples);
      if (colour.light_spp > 0)
        value += from_signed_units(splat.c[c], colour.quantum_exponent) / colour.light_spp;
      *out++ = static_cast<float>(value);
    }
    return out;
  }
  float* put_difference(size_t group, float* out) const {
    const ExactRgb camera = camera_of(groups, group), camera_half = half_camera(group),
                   splat = splat_of(groups, group), splat_half = half_splat(group);
    for (int c = 0; c < 3; ++c)
      *out++ = static_cast<float>(difference(c, camera, camera_half, splat, splat_half));
    return out;
  }

  double value(Aovs aov, int c) const {
    switch (aov) {
      case kAovAlbedo:
        return weights() > 0 ? albedo_of(of(kAlbedoLayer, c), weights()) : 0;
      case kAovNormal:
        return weights() > 0 ? normal_of(of(kNormalLayer, c), weights()) : 0;
      case kAovDepth:
        return hits() > 0 ? depth_of(of(kDepthLayer, 0), hits(), sums.spec.frame) : 0;
      case kAovPosition:
        return hits() > 0 ? position_of(of(kPositionLayer, c), hits(), sums.spec.frame, c) : 0;
      case kAovAlpha:
        return weights() > 0 ? static_cast<double>(hits()) / static_cast<double>(weights()) : 0;
      case kAovDirect:
        return light(false, c);
      case kAovIndirect:
        return light(true, c);
      case kAovVariance:
        return variance_of(of(kVarianceLayer, c), weights(), samples > 0 ? colour.camera[pixel].c[c] : 0,
                           samples, count(), colour.quantum_exponent);
      case kAovDifference:
        return difference(c);
      case kAovUv:
        return hits_of(kUvLayer) > 0 ? uv_of(of(kUvLayer, c), hits_of(kUvLayer)) : 0;
      case kAovMotion:
        return hits_of(kMotionLayer) > 0 ? motion_of(of(kMotionLayer, c), hits_of(kMotionLayer)) : 0;
      case kAovDiffuseAlbedo:
        return weights() > 0 ? albedo_of(of(kDiffuseAlbedoLayer, c), weights()) : 0;
      case kAovSpecularAlbedo:
        return weights() > 0 ? albedo_of(of(kAlbedoLayer, c) - of(kDiffuseAlbedoLayer, c), weights()) : 0;
      case kAovObjectId:
        return mattes.id(cell, in_cell, kObjectMatte);
      case kAovMaterialId:
        return mattes.id(cell, in_cell, kMaterialMatte);
      default:
        return static_cast<double>(count());
    }
  }

  /// sqrt(a (1 - a)) (A - B) of a value of sums: `mean(sum, count)` of the half A and of the rest B
  /// (half_film.h). 0 where one of them has no samples.
  template <class Mean>
  static double scaled_difference(const ExactRgb& whole, const ExactRgb& half, double count, double of_half,
                                  const Mean& mean) {
    if (!(of_half > 0) || !(count > of_half)) return 0;
    ExactRgb rest = whole;
    for (int c = 0; c < 3; ++c) rest.c[c] -= half.c[c];
    const double share = of_half / count;
    return std::sqrt(share * (1 - share)) * (mean(half, of_half) - mean(rest, count - of_half));
  }

  /// Of the colour.
  double difference(int c) const {
    return difference(c, at(colour.camera, pixel), half.camera(pixel), at(colour.splat, film_pixel),
                      half.splat(film_pixel));
  }
  double difference(int c, const ExactRgb& camera, const ExactRgb& camera_half, const ExactRgb& splat,
                    const ExactRgb& splat_half) const {
    const auto mean = [&](const ExactRgb& sum, double count) {
      return from_signed_units(sum.c[c], colour.quantum_exponent) / count;
    };
    double value = 0;
    if (!colour.camera.empty()) {
      value += scaled_difference(camera, camera_half, static_cast<double>(samples),
                                 static_cast<double>(half_samples), mean);
    }
    if (!colour.splat.empty()) {
      // Of splats light_spp counts: the half's share of it is that of its light paths.
      const double of_half = colour.light_spp * static_cast<double>(half.light_paths()) /
                             static_cast<double>(std::max<uint64_t>(colour.light_paths, 1));
      value += scaled_difference(splat, splat_half, colour.light_spp, of_half, mean);
    }
    return value;
  }

  /// Of a feature.
  double difference(Aovs feature, int c) const {
    const AovLayer layer =
        feature == kAovAlbedo ? kAlbedoLayer : (feature == kAovNormal ? kNormalLayer : kDepthLayer);
    const ExactRgb& whole = sums.layers[layer][pixel];
    const ExactRgb part = half.layer(layer, pixel);
    if (feature == kAovDepth && (part.c[1] == 0 || part.c[1] == whole.c[1]))
      return 0;  // no hits in one of them
    const int64_t of_half =
        sums.spec.weighted ? static_cast<int64_t>(half.layer(kWeightsLayer, pixel).c[0]) : half_samples;
    return scaled_difference(whole, part, static_cast<double>(weights()), static_cast<double>(of_half),
                             [&](const ExactRgb& sum, double count) {
                               const auto n = static_cast<int64_t>(count);
                               if (feature == kAovAlbedo) return albedo_of(sum.c[c], n);
                               if (feature == kAovNormal) return normal_of(sum.c[c], n);
                               return depth_of(sum.c[0], static_cast<int64_t>(sum.c[1]), sums.spec.frame);
                             });
  }
};

void fold_parts(const FilmGrid& grid, const PixelRect& tile, const std::vector<GroupSums>& from,
                std::vector<GroupLayers>* parts) {
  parts->resize(from.size());
  for (size_t i = 0; i < from.size(); ++i) {
    add_rectangle(grid, tile, from[i].camera, false, &(*parts)[i].camera);
    add_splats(grid, from[i].splats, false, &(*parts)[i].splat);
  }
}

void put_parts(const std::vector<GroupLayers>& parts, ByteWriter* out) {
  for (const GroupLayers& part : parts) {
    put_stored_layer(part.camera, out);
    put_stored_layer(part.splat, out);
  }
}

void get_parts(size_t pixels, ByteReader* in, std::vector<GroupLayers>* parts) {
  for (GroupLayers& part : *parts) {
    part.camera = get_stored_layer(pixels, in);
    if (part.camera.empty()) in->fail("a part of light is missing");
    part.splat = get_stored_layer(pixels, in);
  }
}

int channels_of(Aovs aov) {
  if (aov & (kAovDepth | kAovAlpha | kAovSamples | kAovsOfIds)) return 1;
  return aov & (kAovUv | kAovMotion) ? 2 : 3;
}

/// The AOVs whose channels come before those of halves, groups and mattes, and after them (aov_channels).
constexpr Aovs kFirstAovs = kAovLightGroups - 1, kLastAovs = kAllAovs & ~(kAovUv - 1) & ~kAovLobes;

/// Whether a snapshot says of a layer if it is there. Of the oldest layers it always does.
bool is_stored(const AovSpec& spec, size_t layer) {
  return layer < kWeightsLayer || has_layer(spec, static_cast<int>(layer));
}

}  // namespace

void AovFilm::check(const Partial& partial, bool first) const {
  if (!first && partial.aovs.spec != sums_.spec) {
    throw Error(ErrorKind::kFailed, "partial has other AOVs than the film: \"" +
                                        aov_names(partial.aovs.spec.set) + "\", not \"" +
                                        aov_names(sums_.spec.set) + "\"");
  }
  const int64_t cells = partial.aovs.spec.set & kAovsOfCounts ? partial.tile.cells.count() : 0;
  if (std::ssize(partial.mattes.cells) != cells)
    throw Error(ErrorKind::kFailed, "partial has counts for Cryptomatte of another size than its tile");
  mattes_.check(partial.mattes);
}

void AovFilm::fold(const Partial& partial, const Whole& whole) {
  const AovSums& from = partial.aovs;
  if (from.spec.set == 0) return;
  const FilmGrid& grid = partial.grid;
  sums_.spec = from.spec;
  const PixelRect r = grid.pixels(partial.tile.cells);
  for (size_t layer = 0; layer < kAovLayers; ++layer)
    add_rectangle(grid, r, from.layers[layer], false, &sums_.layers[layer]);
  add_splats(grid, from.direct_splats, false, &direct_splat_);
  fold_parts(grid, r, from.groups, &groups_);
  fold_parts(grid, r, from.lobes, &lobes_);
  if (from.spec.set & kAovsOfCounts) mattes_.fold(grid, partial.tile.cells, partial.mattes);
  if (from.spec.set & kAovDifference) {
    half_.fold(partial, {whole.camera, whole.splat, sums_, groups_, whole.cell_samples, whole.light_paths});
  }
}

ChannelImage AovFilm::resolve(const FilmGrid& grid, const Colour& colour) const {
  ChannelImage result;
  const Aovs set = sums_.spec.set;
  const LightGroups& groups = sums_.spec.groups;
  result.channels = aov_channels(set, groups);
  if (set == 0) return result;
  result.attributes = mattes_.attributes(set);
  const PixelRect& crop = grid.crop;
  const CellRect cells = grid.cells();
  result.image = Image(crop.width(), crop.height(), static_cast<int>(result.channels.size()));
  const PixelInterleave interleave(grid);
  size_t pixel = 0;
  for (int y = crop.y0; y < crop.y1; ++y) {
    for (int x = crop.x0; x < crop.x1; ++x, ++pixel) {
      const size_t film_pixel = entry(interleave.film_index(x, y));
      const int cx = x / kCellSize, cy = y / kCellSize;
      const auto cell = entry(int64_t{cy - cells.y0} * cells.width() + cx - cells.x0);
      const PixelSums at{sums_,
                         colour,
                         direct_splat_,
                         groups_,
                         lobes_,
                         half_,
                         mattes_,
                         pixel,
                         film_pixel,
                         cell,
                         entry(int64_t{y % kCellSize} * kCellSize + x % kCellSize),
                         colour.samples(cx, cy),
                         half_.samples(cell)};
      float* out = &result.image.data[film_pixel * result.channels.size()];
      const auto put_values = [&](Aovs some) {
        for (Aovs left = set & some; left; left &= left - 1) {
          const Aovs aov = left & ~(left - 1);
          for (int c = 0; c < channels_of(aov); ++c) *out++ = static_cast<float>(at.value(aov, c));
        }
      };
      put_values(kFirstAovs);
      for (Aovs aov = 1; set & kAovDifference && aov <= kAllAovs; aov <<= 1) {
        if (!(set & kAovsOfHalves & aov)) continue;
        for (int c = 0; c < channels_of(aov); ++c) *out++ = static_cast<float>(at.difference(aov, c));
      }
      for (size_t i = 0; i < groups.size(); ++i) out = at.put_light(groups_, i, out);
      for (size_t i = 0; set & kAovDifference && i < groups.size(); ++i) out = at.put_difference(i, out);
      for (int matte = 0; matte < kMattes; ++matte) {
        if (!(set & kAovOfMatte[matte])) continue;
        mattes_.ranks(cell, at.in_cell, static_cast<Matte>(matte), at.weights(), out);
        out += 2 * kMatteRanks;
      }
      put_values(kLastAovs);
      for (size_t i = 0; set & kAovLobes && i < kLobeParts; ++i) out = at.put_light(lobes_, i, out);
    }
  }
  return result;
}

void AovFilm::write(ByteWriter* out) const {
  if (empty()) return;
  const AovFrame& frame = sums_.spec.frame;
  out->put<uint32_t>(packed_set(sums_.spec));
  out->put<int32_t>(frame.scale_exponent);
  for (const double x : frame.origin) out->put<double>(x);
  if (sums_.spec.set & kAovLightGroups) {
    const std::string groups = light_groups_text(sums_.spec.groups);
    out->put<uint32_t>(static_cast<uint32_t>(groups.size()));
    out->put_bytes(groups);
  }
  for (size_t layer = 0; layer < kAovLayers; ++layer) {
    if (is_stored(sums_.spec, layer)) put_stored_layer(sums_.layers[layer], out);
  }
  put_stored_layer(direct_splat_, out);
  put_parts(groups_, out);
  put_parts(lobes_, out);
  if (sums_.spec.set & kAovDifference) half_.write(sums_.spec.weighted, out);
  if (sums_.spec.set & kAovsOfCounts) mattes_.write(out);
}

void AovFilm::read(ByteReader* in, const FilmGrid& grid) {
  if (in->rest().empty()) return;
  unpack_set(in->get<uint32_t>(), &sums_.spec);
  AovFrame& frame = sums_.spec.frame;
  frame.scale_exponent = in->get<int32_t>();
  for (double& x : frame.origin) x = in->get<double>();
  if (sums_.spec.set == 0 || (sums_.spec.set & ~kAllAovs)) in->fail("unknown AOVs");
  if (sums_.spec.set & kAovLightGroups) {
    const auto size = in->get<uint32_t>();
    sums_.spec.groups = light_groups_of_text(std::string(in->get_bytes(size)));
  }
  const auto pixels = entry(grid.crop.area());
  for (size_t layer = 0; layer < kAovLayers; ++layer) {
    if (!is_stored(sums_.spec, layer)) continue;
    sums_.layers[layer] = get_stored_layer(pixels, in);
    if (sums_.layers[layer].empty() == has_layer(sums_.spec, static_cast<int>(layer))) {
      in->fail("an AOV's layer is missing");
    }
  }
  direct_splat_ = get_stored_layer(pixels, in);
  groups_.resize(group_layers(sums_.spec.groups));
  get_parts(pixels, in, &groups_);
  lobes_.resize(lobe_layers(sums_.spec.set));
  get_parts(pixels, in, &lobes_);
  if (sums_.spec.set & kAovDifference) half_.read(in, grid, sums_.spec.weighted, groups_.size());
  if (sums_.spec.set & kAovsOfCounts) mattes_.read(in, grid);
}

}  // namespace lightmill
