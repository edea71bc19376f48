#include "common/film/film.h"

#include <algorithm>
#include <cmath>
#include <stdexcept>

#include "common/base/error.h"
#include "common/film/crop_walk.h"
#include "common/film/packing.h"
#include "common/film/signed_sum.h"
#include "common/film/stored_layer.h"
#include "common/film/unit_planes.h"
#include "common/image/fill_holes.h"
#include "common/job/pixel_interleave.h"
#include "common/job/settings.h"

namespace lightmill {

namespace {

constexpr uint32_t kFilmMagic = 0x6d66694c;          // "Lifm"
constexpr uint32_t kVersion = 2, kPlainVersion = 1;  // of films that are interleaved, or are not
constexpr const char* kFilmSnapshot = "film snapshot";

size_t index(int64_t i) { return static_cast<size_t>(i); }

/// Adds and returns true if the sum has left the range.
bool add(ExactRgb* to, const ExactRgb& from) {
  bool left = false;
  for (int c = 0; c < 3; ++c) {
    const Units before = to->c[c];
    to->c[c] += from.c[c];
    // Both had the other sign.
    left |= is_negative((before ^ to->c[c]) & (from.c[c] ^ to->c[c]));
  }
  return left;
}

void subtract(ExactRgb* to, const ExactRgb& from) {
  for (int c = 0; c < 3; ++c) to->c[c] -= from.c[c];
}

constexpr size_t kLayerHeadBytes = 3;

void put_layer(const std::vector<ExactRgb>& layer, ByteRange range, Sealer* out) {
  ByteWriter w;
  w.put<uint8_t>(!layer.empty());
  w.put<uint8_t>(range.low);
  w.put<uint8_t>(range.high);
  out->write(w.bytes());
  for_planes(std::span(layer), range, [&](std::string_view planes) { out->write(planes); });
}

}  // namespace

Film::Film(const FilmGrid& grid) : grid_(grid), cell_samples_(index(grid.cells().count()), 0) {}

void Film::fold(const Partial& partial) {
  if (partial.grid != grid_) throw Error(ErrorKind::kFailed, "partial was rendered for another film");
  if (has_quantum_ && partial.quantum_exponent != quantum_exponent_) {
    throw Error(ErrorKind::kFailed, "partial was rendered under another plan: its quantum differs");
  }
  const PixelRect r = grid_.pixels(partial.tile.cells);
  if (!partial.camera.empty() && partial.camera.size() != index(r.area())) {
    throw Error(ErrorKind::kFailed, "partial has a camera layer of another size than its tile");
  }
  aovs_.check(partial, !has_quantum_);
  const auto crop_area = index(grid_.crop.area());
  if (!partial.camera.empty() && camera_.empty()) camera_.resize(crop_area);
  if (!partial.splats.empty() && splat_.empty()) splat_.resize(crop_area);

  // The camera's sums and the splats before the first one that lies outside; false if there is such a one.
  const auto for_each = [&](auto&& f) {
    const ExactRgb* from = partial.camera.data();
    for (int y = r.y0; !partial.camera.empty() && y < r.y1; ++y) {
      ExactRgb* to = &camera_[index(int64_t{y - grid_.crop.y0} * grid_.crop.width() + r.x0 - grid_.crop.x0)];
      for (int x = r.x0; x < r.x1; ++x) f(to++, *from++);
    }
    CropWalk crop_index(grid_);
    for (const Partial::SplatSum& splat : partial.splats) {
      const int64_t at = crop_index(splat.pixel);
      if (at < 0) return false;
      f(&splat_[index(at)], splat.sum);
    }
    return true;
  };
  bool overflow = false;
  const bool inside = for_each([&](ExactRgb* to, const ExactRgb& sum) { overflow |= add(to, sum); });
  if (!inside || overflow) {
    for_each(subtract);
    throw Error(ErrorKind::kFailed, inside
                                        ? "film sums overflow: the scene is brighter than its plan allows for"
                                        : "partial has a splat outside the crop window");
  }

  has_quantum_ = true;
  quantum_exponent_ = partial.quantum_exponent;
  if (!partial.camera.empty()) {
    const CellRect all = grid_.cells();
    const CellRect& cells = partial.tile.cells;
    for (int cy = cells.y0; cy < cells.y1; ++cy) {
      for (int cx = cells.x0; cx < cells.x1; ++cx) {
        cell_samples_[index(int64_t{cy - all.y0} * all.width() + cx - all.x0)] += partial.tile.samples();
      }
    }
  }
  light_paths_ += partial.light_paths;
  aovs_.fold(partial, {camera_, splat_, cell_samples_, light_paths_});
  counters_ += partial.counters;
  cpu_seconds_ += partial.cpu_seconds;
}

int64_t Film::cell_samples(int cx, int cy) const {
  const CellRect all = grid_.cells();
  if (cx < all.x0 || cx >= all.x1 || cy < all.y0 || cy >= all.y1) {
    throw std::logic_error("Film::cell_samples: no such cell");
  }
  return cell_samples_[index(int64_t{cy - all.y0} * all.width() + cx - all.x0)];
}

Image Film::resolve(bool with_camera, bool with_splats) const {
  const PixelRect& crop = grid_.crop;
  Image image(crop.width(), crop.height());
  const double light_spp =
      static_cast<double>(light_paths_) / static_cast<double>(grid_.light_paths_per_spp());
  with_splats = with_splats && !splat_.empty() && light_paths_ > 0;
  const PixelInterleave interleave(grid_);
  size_t of_packets = 0;
  for (int y = crop.y0; y < crop.y1; ++y) {
    for (int x = crop.x0; x < crop.x1; ++x, ++of_packets) {
      const int64_t samples = with_camera ? cell_samples(x / kCellSize, y / kCellSize) : 0;
      const size_t i = index(interleave.film_index(x, y));
      for (size_t c = 0; c < 3; ++c) {
        double value = 0;
        if (samples > 0)
          value +=
              from_signed_units(camera_[of_packets].c[c], quantum_exponent_) / static_cast<double>(samples);
        if (with_splats) value += from_signed_units(splat_[i].c[c], quantum_exponent_) / light_spp;
        image.data[3 * i + c] = static_cast<float>(value);
      }
    }
  }
  return image;
}

Image Film::resolve() const { return resolve(true, true); }

double Film::mean_magnitude() const {
  const Image image = resolve();
  double sum = 0;
  for (const float x : image.data) sum += std::isfinite(x) ? std::fabs(double{x}) : 0;
  return sum / static_cast<double>(std::max<size_t>(image.data.size(), 1));
}

Image Film::resolve_for_display() const {
  if (!has_holes()) return resolve();
  const PixelRect& crop = grid_.crop;
  const PixelInterleave interleave(grid_);
  std::vector<uint8_t> known(index(crop.area()));
  for (int y = crop.y0; y < crop.y1; ++y) {
    for (int x = crop.x0; x < crop.x1; ++x) {
      known[index(interleave.film_index(x, y))] = cell_samples(x / kCellSize, y / kCellSize) > 0;
    }
  }
  Image image = resolve(true, false);
  fill_holes(known, &image);
  const Image splats = resolve(false, true);
  for (size_t i = 0; i < image.data.size(); ++i) image.data[i] += splats.data[i];
  return image;
}

bool Film::has_holes() const {
  return std::find(cell_samples_.begin(), cell_samples_.end(), 0) != cell_samples_.end();
}

AovFilm::Colour Film::colour() const {
  const double light_spp =
      static_cast<double>(light_paths_) / static_cast<double>(grid_.light_paths_per_spp());
  return {camera_,
          splat_,
          quantum_exponent_,
          light_spp,
          [this](int cx, int cy) { return cell_samples(cx, cy); },
          light_paths_};
}

ChannelImage Film::resolve_aovs() const { return aovs_.resolve(grid_, colour()); }

ChannelImage Film::light_groups_for_display(int block) const {
  return aovs_.light_groups(grid_, colour(), has_holes(), block);
}

std::string Film::snapshot() const {
  ByteWriter w;
  for (const int v : {grid_.width, grid_.height, grid_.crop.x0, grid_.crop.y0, grid_.crop.x1, grid_.crop.y1,
                      quantum_exponent_}) {
    w.put<int32_t>(v);
  }
  w.put<uint8_t>(has_quantum_);
  w.put<double>(cpu_seconds_);
  const RenderCounters& n = counters_;
  for (const uint64_t v : {light_paths_, n.camera_paths, n.light_paths, n.closest_hit_rays, n.shadow_rays,
                           n.zero_connections_skipped, n.rouletted_connections, n.nonfinite}) {
    w.put<uint64_t>(v);
  }
  for (const int64_t samples : cell_samples_) w.put<int64_t>(samples);
  const ByteRange camera = used_bytes(std::span(camera_)), splat = used_bytes(std::span(splat_));
  ByteWriter aovs;
  aovs_.write(&aovs);
  Sealer sealer(kFilmMagic, grid_.interleaved ? kVersion : kPlainVersion,
                w.bytes().size() + 2 * kLayerHeadBytes + plane_bytes(camera_.size(), camera) +
                    plane_bytes(splat_.size(), splat) + aovs.bytes().size());
  sealer.write(w.bytes());
  put_layer(camera_, camera, &sealer);
  put_layer(splat_, splat, &sealer);
  sealer.write(aovs.bytes());
  return sealer.finish();
}

Film Film::restore(std::string_view bytes) {
  FilmGrid grid;
  grid.interleaved = sealed_version(kFilmMagic, bytes, kFilmSnapshot) != kPlainVersion;
  const std::string raw =
      unseal(kFilmMagic, grid.interleaved ? kVersion : kPlainVersion, bytes, kFilmSnapshot);
  ByteReader in(raw, kFilmSnapshot);
  int quantum = 0;
  for (int* v :
       {&grid.width, &grid.height, &grid.crop.x0, &grid.crop.y0, &grid.crop.x1, &grid.crop.y1, &quantum}) {
    *v = in.get<int32_t>();
  }
  if (grid.width < 1 || grid.height < 1 || int64_t{grid.width} * grid.height > kMaxPixels ||
      grid.crop.empty() || grid.crop.x0 < 0 || grid.crop.y0 < 0 || grid.crop.x1 > grid.width ||
      grid.crop.y1 > grid.height) {
    in.fail("film size out of range");
  }
  Film film(grid);
  film.quantum_exponent_ = quantum;
  film.has_quantum_ = in.get<uint8_t>() != 0;
  film.cpu_seconds_ = in.get<double>();
  RenderCounters& n = film.counters_;
  for (uint64_t* v : {&film.light_paths_, &n.camera_paths, &n.light_paths, &n.closest_hit_rays,
                      &n.shadow_rays, &n.zero_connections_skipped, &n.rouletted_connections, &n.nonfinite}) {
    *v = in.get<uint64_t>();
  }
  bool any_samples = false;
  for (int64_t& samples : film.cell_samples_) {
    samples = in.get<int64_t>();
    if (samples < 0) in.fail("negative count");
    any_samples |= samples > 0;
  }
  const auto crop_area = index(grid.crop.area());
  film.camera_ = get_stored_layer(crop_area, &in);
  film.splat_ = get_stored_layer(crop_area, &in);
  if (any_samples && film.camera_.empty()) in.fail("samples without a camera layer");
  film.aovs_.read(&in, grid);
  in.expect_end();
  return film;
}

}  // namespace lightmill
