#include "common/error/batch_film.h"

#include <algorithm>
#include <cmath>
#include <cstring>
#include <limits>
#include <utility>

#include "common/base/error.h"
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
/// Of fewer boxes the error of an image is mostly chance: 95 % of what it may be reaches from nothing to
/// three times what is estimated, and a normal distribution does not describe it.
constexpr size_t kLeastIntervalBoxes = 16;
constexpr const char* kWhat = "batch film snapshot";

size_t index(int64_t i) { return static_cast<size_t>(i); }

/// From one batch to all samples folded so far, also those of batches that are not complete.
BoxError scaled(const BatchError& error, double scale) {
  BoxError result;
  result.relmse = error.relmse * scale;
  if (error.interval)
    result.relmse_low = error.interval->low * scale, result.relmse_high = error.interval->high * scale;
  return result;
}

}  // namespace

BatchFilm::BatchFilm(const FilmGrid& grid) : grid_(grid), tracked_(grid) {}

void BatchFilm::merge_pairs() {
  std::vector<Batch> merged((batches_.size() + 3) / 4 * 2);
  for (size_t i = 0; i < batches_.size(); ++i) {
    Batch& from = batches_[i];
    Batch& to = merged[i / 4 * 2 + i % 2];
    to.samples += from.samples;
    if (to.sums.pixels.empty()) {
      to.sums = std::move(from.sums);
    } else if (!from.sums.pixels.empty()) {
      to.sums += from.sums;
    }
  }
  while (!merged.empty() && merged.back().samples == 0) merged.pop_back();
  batches_ = std::move(merged);
  group_ *= 2;
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
  if (batch.sums.pixels.empty()) batch.sums = tracked_.empty_sums();

  const double quantum = std::ldexp(1.0, partial.quantum_exponent);
  // Splats stand for one light path per pixel sample; a plan may have traced more or fewer.
  const double paths = static_cast<double>(partial.light_paths);
  const double splat_quantum =
      paths > 0 ? quantum * static_cast<double>(r.area() * partial.tile.samples()) / paths : 0;
  if (!partial.camera.empty()) tracked_.add_camera(r, partial.camera.data(), quantum, &batch.sums);
  CropWalk crop_index(grid_);
  size_t hint = 0;
  for (const Partial::SplatSum& splat : partial.splats) {  // ascending by pixel
    const int64_t pixel = crop_index(splat.pixel);
    if (pixel >= 0) tracked_.add_splat(pixel, splat.sum, splat_quantum, &hint, &batch.sums);
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
  return tracked_.count() > 0 ? samples / static_cast<double>(grid_.crop.area()) : 0;
}

void BatchFilm::estimate(ErrorPoint* point) const {
  const auto [batches, replicates] = complete_batches();
  point->batches = static_cast<int>(batches.size());
  point->relmse.reset();
  point->relmse_low.reset();
  point->relmse_high.reset();
  point->boxes = {};
  if (batches.size() < 2) return;
  const auto batch_spp = static_cast<double>(kSuperblockSamples * group_);
  const double scale = batch_spp / spp();
  std::vector<const float*> sums;
  for (const Batch* batch : batches) sums.push_back(batch->sums.pixels.data());
  const BatchError error = estimate_batch_error(sums, replicates, tracked_.layout(), batch_spp);
  const BoxError of_pixels = scaled(error, scale);
  point->relmse = of_pixels.relmse, point->relmse_low = of_pixels.relmse_low,
  point->relmse_high = of_pixels.relmse_high;
  // The larger the boxes, the fewer they are, and the less do two replicates say: what the sequences gain is
  // then taken to be what they gain of the next smaller ones.
  double gain = error.gain;
  for (size_t i = 0; i < kBoxSides.size(); ++i) {
    const int side = kBoxSides[i];
    const PixelLayout layout = tracked_.box_layout(side);
    if (layout.width == 0 || layout.rows == 0) continue;
    std::vector<std::vector<float>> boxes;
    for (size_t b = 0; b < batches.size(); ++b) {
      boxes.push_back(tracked_.box_sums(batches[b]->sums, side));
      sums[b] = boxes.back().data();
    }
    const double pixels = side * side;
    const BatchError of_boxes = estimate_batch_error(sums, replicates, layout, batch_spp * pixels, gain);
    point->boxes[i] = scaled(of_boxes, scale * pixels);
    if (layout.width * layout.rows < kLeastIntervalBoxes)
      point->boxes[i].relmse_low = point->boxes[i].relmse_high = {};
    gain = of_boxes.gain;
  }
}

int BatchFilm::error_map_block() const { return tracked_.all() ? 4 : 16; }

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
  for (int64_t at = 0; at < tracked_.count(); ++at) {
    const int64_t pixel = tracked_.pixel(at);
    const size_t cell = index(pixel / width / block) * index(columns) + index(pixel % width / block);
    ++counts[cell];
    for (size_t value = 3 * index(at); value < 3 * index(at + 1); ++value) {
      double mean = 0, squares = 0;
      for (const Batch* batch : batches)
        mean += static_cast<double>(batch->sums.pixels[value]) / (batch_spp * n);
      for (const Batch* batch : batches) {
        const double deviation = static_cast<double>(batch->sums.pixels[value]) / batch_spp - mean;
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
  for (const Batch& batch : batches_)
    size += kBatchHeadBytes + (batch.sums.pixels.size() + batch.sums.boxes.size()) * sizeof(float);
  Sealer sealer(kMagic, kVersion, size);
  sealer.write(w.bytes());
  for (const Batch& batch : batches_) {
    ByteWriter head;
    head.put<int64_t>(batch.samples);
    head.put<uint8_t>(!batch.sums.pixels.empty());
    sealer.write(head.bytes());
    for (const auto* values : {&batch.sums.pixels, &batch.sums.boxes})
      sealer.write({reinterpret_cast<const char*>(values->data()), values->size() * sizeof(float)});
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
  // Of large films older versions followed other pixels.
  const bool other_pixels = older && !film.tracked_.all();
  film.batches_.resize(count);
  for (Batch& batch : film.batches_) {
    batch.samples = in.get<int64_t>();
    if (batch.samples < 0) in.fail("count out of range");
    if (in.get<uint8_t>() == 0) continue;
    if (film.tracked_.count() == 0) in.fail("pixels of a film without any");
    if (other_pixels) {
      in.get_bytes(3 * index(kMaxTrackedPixels) * sizeof(float));
      continue;
    }
    batch.sums = film.tracked_.empty_sums();
    for (std::vector<float>* values : {&batch.sums.pixels, &batch.sums.boxes}) {
      const std::string_view from = in.get_bytes(values->size() * sizeof(float));
      if (!from.empty()) std::memcpy(values->data(), from.data(), from.size());
    }
  }
  in.expect_end();
  if (older) film.take_older_batches(other_pixels);
  return film;
}

void BatchFilm::take_older_batches(bool of_other_pixels) {
  std::vector<Batch> older = std::exchange(batches_, {});
  if (group_ > 1 || of_other_pixels) {
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
