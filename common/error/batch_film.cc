#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "common/base/error.h"
#include "common/error/error_curve.h"
#include "common/error/error_estimate.h"
#include "common/film/crop_walk.h"
#include "common/film/packing.h"
#include "common/film/signed_sum.h"
#include "common/job/replicates.h"
#include "common/job/settings.h"

namespace lightmill {

namespace {

constexpr uint32_t kMagic = 0x6662694c;  // "Libf"
constexpr uint32_t kVersion = 4;
// Versions before replicates: of films that are interleaved, or are not.
constexpr uint32_t kOneSequenceVersion = 3, kPlainVersion = 2;
constexpr size_t kBatchHeadBytes = 9;
constexpr int64_t kRun = 8;  // tracked pixels beside each other, where not all are
constexpr const char* kWhat = "batch film snapshot";

size_t index(int64_t i) { return static_cast<size_t>(i); }

/// from_signed_units(units, 0), without a call of ldexp for each, and quickly where 64 bits hold it.
double to_double(Units units) {
  const auto low = static_cast<int64_t>(units);
  if (units == static_cast<Units>(low)) return static_cast<double>(low);
  const Units size = magnitude(units);
  const double value = static_cast<double>(static_cast<uint64_t>(size >> 64)) * 0x1p64 +
                       static_cast<double>(static_cast<uint64_t>(size));
  return is_negative(units) ? -value : value;
}

/// Adds `sum`, in units of `unit`, to the three values from `rgb` on.
void add_sum(const ExactRgb& sum, double unit, float* rgb) {
  for (int c = 0; c < 3; ++c) rgb[c] += static_cast<float>(to_double(sum.c[c]) * unit);
}

/// A bijection of 64-bit words with good avalanche (the finalizer of SplitMix64; Steele et al. 2014).
uint64_t mix(uint64_t x) {
  x += 0x9e3779b97f4a7c15u;
  x = (x ^ (x >> 30)) * 0xbf58476d1ce4e5b9u;
  x = (x ^ (x >> 27)) * 0x94d049bb133111ebu;
  return x ^ (x >> 31);
}

}  // namespace

BatchFilm::BatchFilm(const FilmGrid& grid) : grid_(grid), interleave_(grid) {
  const int64_t pixels = grid.crop.area();
  tracked_pixels_ = std::min(pixels, kMaxTrackedPixels);
  if (tracked_pixels_ == pixels) return;
  // One run of pixels of each of equal strata: the estimate looks at a pixel's neighbours.
  const int64_t runs = pixels / kRun, strata = kMaxTrackedPixels / kRun;
  tracked_.resize(index(strata));
  for (int64_t i = 0; i < strata; ++i) {
    const int64_t begin = i * runs / strata, end = (i + 1) * runs / strata;
    const auto offset =
        static_cast<int64_t>(mix(static_cast<uint64_t>(i)) % static_cast<uint64_t>(end - begin));
    tracked_[index(i)] = begin + offset;
  }
  const PixelRect& crop = grid.crop;
  tracked_places_.reserve(index(tracked_pixels_));
  for (int64_t at = 0; at < tracked_pixels_; ++at) {
    const int64_t pixel = tracked_[index(at / kRun)] * kRun + at % kRun;
    const FilmPixel p = interleave_.to_packet(crop.x0 + static_cast<int>(pixel % crop.width()),
                                              crop.y0 + static_cast<int>(pixel / crop.width()));
    tracked_places_.push_back({static_cast<uint32_t>(int64_t{p.y - crop.y0} * crop.width() + p.x - crop.x0),
                               static_cast<uint32_t>(at)});
  }
  std::sort(tracked_places_.begin(), tracked_places_.end(),
            [](const TrackedPlace& a, const TrackedPlace& b) { return a.in_packets < b.in_packets; });
}

PixelLayout BatchFilm::layout() const {
  if (tracked_.empty()) return {index(grid_.crop.width()), index(grid_.crop.height())};
  return {index(kRun), tracked_.size(), {index(kRun) - 1, 0}, {index(kRun) - 1, 0}};
}

void BatchFilm::merge_pairs() {
  std::vector<Batch> merged((batches_.size() + 3) / 4 * 2);
  for (size_t i = 0; i < batches_.size(); ++i) {
    Batch& from = batches_[i];
    Batch& to = merged[i / 4 * 2 + i % 2];
    to.samples += from.samples;
    if (to.rgb.empty()) {
      to.rgb = std::move(from.rgb);
    } else if (!from.rgb.empty()) {
      for (size_t k = 0; k < to.rgb.size(); ++k) to.rgb[k] += from.rgb[k];
    }
  }
  while (!merged.empty() && merged.back().samples == 0) merged.pop_back();
  batches_ = std::move(merged);
  group_ *= 2;
}

void BatchFilm::add_camera(const PixelRect& r, const ExactRgb* from, double unit, float* rgb) const {
  const PixelRect& crop = grid_.crop;
  if (tracked_.empty()) {
    for (int y = r.y0; y < r.y1; ++y) {
      for (int x = r.x0; x < r.x1; ++x) add_sum(*from++, unit, rgb + 3 * interleave_.film_index(x, y));
    }
    return;
  }
  for (int y = r.y0; y < r.y1; ++y, from += r.width()) {
    const int64_t begin = int64_t{y - crop.y0} * crop.width() + r.x0 - crop.x0, end = begin + r.width();
    const auto first = std::lower_bound(
        tracked_places_.begin(), tracked_places_.end(), begin,
        [](const TrackedPlace& place, int64_t at) { return int64_t{place.in_packets} < at; });
    // What is tracked of a row is asked for first: it is far apart, and memory is slow.
    auto last = first;
    for (; last != tracked_places_.end() && last->in_packets < end; ++last)
      __builtin_prefetch(from + (last->in_packets - begin));
    for (auto place = first; place != last; ++place)
      add_sum(from[place->in_packets - begin], unit, rgb + 3 * int64_t{place->at});
  }
}

void BatchFilm::fold(const Partial& partial) {
  if (partial.grid != grid_) throw Error(ErrorKind::kFailed, "partial was rendered for another film");
  const PixelRect r = grid_.pixels(partial.tile.cells);
  if (!partial.camera.empty() && partial.camera.size() != index(r.area())) {
    throw Error(ErrorKind::kFailed, "partial has a camera layer of another size than its tile");
  }
  const int64_t begin = superblock_of_sample(partial.tile.sample_begin);
  const int64_t end = superblock_of_sample(partial.tile.sample_end - 1) + 1;
  if (end > replicate_run_end(begin)) {
    mixed_samples_ += r.area() * partial.tile.samples();
    return;
  }
  const ReplicateBlock block = replicate_of(begin);
  const int64_t first = block.superblock, last = first + end - begin - 1;
  while (first / group_ != last / group_ || kReplicates * (first / group_) + block.replicate >= kMaxBatches)
    merge_pairs();
  const auto batch_index = index(kReplicates * (first / group_) + block.replicate);
  if (batches_.size() <= batch_index) batches_.resize(batch_index + 1);
  Batch& batch = batches_[batch_index];
  if (batch.rgb.empty()) batch.rgb.resize(3 * index(tracked_pixels_));

  const double quantum = std::ldexp(1.0, partial.quantum_exponent);
  // Splats stand for one light path per pixel sample; a plan may have traced more or fewer.
  const double paths = static_cast<double>(partial.light_paths);
  const double splat_quantum =
      paths > 0 ? quantum * static_cast<double>(r.area() * partial.tile.samples()) / paths : 0;
  if (!partial.camera.empty()) add_camera(r, partial.camera.data(), quantum, batch.rgb.data());
  CropWalk crop_index(grid_);
  auto run = tracked_.begin();
  for (const Partial::SplatSum& splat : partial.splats) {  // ascending by pixel
    const int64_t pixel = crop_index(splat.pixel);
    if (pixel < 0) continue;
    int64_t at = pixel;
    if (!tracked_.empty()) {
      while (run != tracked_.end() && *run < pixel / kRun) ++run;
      if (run == tracked_.end() || *run != pixel / kRun) continue;
      at = (run - tracked_.begin()) * kRun + pixel % kRun;
    }
    add_sum(splat.sum, splat_quantum, &batch.rgb[3 * index(at)]);
  }
  batch.samples += r.area() * partial.tile.samples();
}

BatchFilm::Complete BatchFilm::complete_batches() const {
  const int64_t full = grid_.crop.area() * kSuperblockSamples * group_;
  Complete complete;
  for (size_t i = 0; i < batches_.size(); ++i) {
    if (batches_[i].samples != full) continue;
    complete.batches.push_back(&batches_[i]);
    complete.replicates.push_back(static_cast<int>(i) % kReplicates);
  }
  return complete;
}

double BatchFilm::spp() const {
  auto samples = static_cast<double>(mixed_samples_);
  for (const Batch& batch : batches_) samples += static_cast<double>(batch.samples);
  return tracked_pixels_ > 0 ? samples / static_cast<double>(grid_.crop.area()) : 0;
}

void BatchFilm::estimate(ErrorPoint* point) const {
  const Complete complete = complete_batches();
  point->batches = static_cast<int>(complete.batches.size());
  point->relmse.reset();
  point->relmse_low.reset();
  point->relmse_high.reset();
  if (complete.batches.size() < 2) return;
  std::vector<const float*> sums;
  sums.reserve(complete.batches.size());
  for (const Batch* batch : complete.batches) sums.push_back(batch->rgb.data());
  const auto batch_spp = static_cast<double>(kSuperblockSamples * group_);
  const BatchError error = estimate_batch_error(sums, complete.replicates, layout(), batch_spp);
  // From one batch to all samples folded so far, also those of batches that are not complete.
  const double scale = batch_spp / spp();
  point->relmse = error.relmse * scale;
  if (!error.half_width) return;
  point->relmse_low = std::max(0.0, error.relmse - *error.half_width) * scale;
  point->relmse_high = (error.relmse + *error.half_width) * scale;
}

int BatchFilm::error_map_block() const { return tracked_.empty() ? 4 : 16; }

Image BatchFilm::error_map(int block) const {
  const std::vector<const Batch*> batches = complete_batches().batches;
  if (batches.size() < 2 || block < 1) return {};
  const auto n = static_cast<double>(batches.size());
  const auto batch_spp = static_cast<double>(kSuperblockSamples * group_);
  const double scale = n * batch_spp / spp();
  const int width = grid_.crop.width();
  const int columns = (width + block - 1) / block, rows = (grid_.crop.height() + block - 1) / block;
  std::vector<double> sums(index(columns) * index(rows));
  std::vector<int64_t> counts(sums.size());
  for (int64_t at = 0; at < tracked_pixels_; ++at) {
    const int64_t pixel = tracked_.empty() ? at : tracked_[index(at / kRun)] * kRun + at % kRun;
    const size_t cell = index(pixel / width / block) * index(columns) + index(pixel % width / block);
    ++counts[cell];
    for (size_t value = 3 * index(at); value < 3 * index(at + 1); ++value) {
      double mean = 0, squares = 0;
      for (const Batch* batch : batches) mean += static_cast<double>(batch->rgb[value]) / (batch_spp * n);
      for (const Batch* batch : batches) {
        const double deviation = static_cast<double>(batch->rgb[value]) / batch_spp - mean;
        squares += deviation * deviation;
      }
      sums[cell] += squares / (n * (n - 1)) / (mean * mean + 1e-2);
    }
  }
  Image map(columns, rows, 1);
  for (size_t i = 0; i < sums.size(); ++i) {
    map.data[i] = counts[i] > 0 ? static_cast<float>(scale * sums[i] / (3 * static_cast<double>(counts[i])))
                                : std::numeric_limits<float>::quiet_NaN();
  }
  return map;
}

std::string BatchFilm::snapshot() const {
  ByteWriter w;
  for (const int v :
       {grid_.width, grid_.height, grid_.crop.x0, grid_.crop.y0, grid_.crop.x1, grid_.crop.y1}) {
    w.put<int32_t>(v);
  }
  w.put<uint8_t>(grid_.interleaved);
  w.put<int64_t>(group_);
  w.put<int64_t>(mixed_samples_);
  w.put<uint32_t>(static_cast<uint32_t>(batches_.size()));
  size_t size = w.bytes().size();
  for (const Batch& batch : batches_) size += kBatchHeadBytes + batch.rgb.size() * sizeof(float);
  Sealer sealer(kMagic, kVersion, size);
  sealer.write(w.bytes());
  for (const Batch& batch : batches_) {
    ByteWriter head;
    head.put<int64_t>(batch.samples);
    head.put<uint8_t>(!batch.rgb.empty());
    sealer.write(head.bytes());
    sealer.write({reinterpret_cast<const char*>(batch.rgb.data()), batch.rgb.size() * sizeof(float)});
  }
  return sealer.finish();
}

BatchFilm BatchFilm::restore(std::string_view bytes) {
  FilmGrid grid;
  const uint32_t version = sealed_version(kMagic, bytes, kWhat);
  const bool older = version == kOneSequenceVersion || version == kPlainVersion;
  const std::string raw = unseal(kMagic, older ? version : kVersion, bytes, kWhat);
  ByteReader in(raw, kWhat);
  for (int* v : {&grid.width, &grid.height, &grid.crop.x0, &grid.crop.y0, &grid.crop.x1, &grid.crop.y1}) {
    *v = in.get<int32_t>();
  }
  grid.interleaved = older ? version == kOneSequenceVersion : in.get<uint8_t>() != 0;
  const bool empty = grid.width == 0;
  if (!empty && (grid.width < 1 || grid.height < 1 || int64_t{grid.width} * grid.height > kMaxPixels ||
                 grid.crop.empty() || grid.crop.x0 < 0 || grid.crop.y0 < 0 || grid.crop.x1 > grid.width ||
                 grid.crop.y1 > grid.height)) {
    in.fail("film size out of range");
  }
  BatchFilm film = empty ? BatchFilm() : BatchFilm(grid);
  film.group_ = in.get<int64_t>();
  if (!older) film.mixed_samples_ = in.get<int64_t>();
  const auto count = in.get<uint32_t>();
  if (film.group_ < 1 || film.group_ > kMaxSampleIndex || film.mixed_samples_ < 0 || count > kMaxBatches)
    in.fail("count out of range");
  film.batches_.resize(count);
  for (Batch& batch : film.batches_) {
    batch.samples = in.get<int64_t>();
    if (batch.samples < 0) in.fail("count out of range");
    if (in.get<uint8_t>() == 0) continue;
    if (film.tracked_pixels_ == 0) in.fail("pixels of a film without any");
    const std::string_view values = in.get_bytes(3 * index(film.tracked_pixels_) * sizeof(float));
    batch.rgb.resize(3 * index(film.tracked_pixels_));
    std::memcpy(batch.rgb.data(), values.data(), values.size());
  }
  in.expect_end();
  if (older) film.take_older_batches();
  return film;
}

void BatchFilm::take_older_batches() {
  std::vector<Batch> older = std::exchange(batches_, {});
  if (group_ > 1) {
    for (const Batch& batch : older) mixed_samples_ += batch.samples;
    group_ = 1;
    return;
  }
  batches_.resize(older.size() + 1);
  for (size_t k = 0; k < older.size(); ++k) {
    const ReplicateBlock block = replicate_of(static_cast<int64_t>(k));
    const auto to = index(kReplicates * block.superblock + block.replicate);
    if (to >= batches_.size()) batches_.resize(to + 1);
    batches_[to] = std::move(older[k]);
  }
  while (!batches_.empty() && batches_.back().samples == 0) batches_.pop_back();
}

}  // namespace lightmill
