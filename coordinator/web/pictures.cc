#include "coordinator/web/pictures.h"

#include <immintrin.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>

#include "coordinator/service/streams/picture_files.h"

namespace lightmill {
namespace {

constexpr double kLeastSpacing = 0.5;   // seconds between two pictures of a job
constexpr double kSpacingPerCost = 20;  // and this many times what the last one took

constexpr size_t kHeadBytes = 16;

std::string head(const char* magic, const Image& image) {
  const uint32_t sizes[] = {static_cast<uint32_t>(image.width), static_cast<uint32_t>(image.height),
                            static_cast<uint32_t>(image.channels)};
  return std::string(magic, 4).append(reinterpret_cast<const char*>(sizes), sizeof sizes);
}

double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

Pictures::Picture Pictures::get(const JobId& job, Kind kind) {
  const JobStatus status = farm_.job(job);
  const uint64_t version = status.version;
  // A first look may come while there are no samples.
  const bool waits = status.state == JobState::kRunning && status.packets_done == 0;
  const Key key{job, kind};
  std::shared_ptr<Slot> slot;
  {
    const std::lock_guard lock(mutex_);
    slot = touch(key);
  }
  Picture picture;
  {
    const std::lock_guard lock(slot->mutex);
    const double begin = seconds();
    if (!slot->image || (slot->version != version && begin >= slot->next)) {
      slot->image = std::make_shared<const Image>(kind == Kind::kBeauty ? farm_.display_image(job)
                                                                        : farm_.error_map(job));
      slot->version = version;
      const double end = seconds();
      // A job without samples has no commits that could be delayed.
      slot->next = end + (waits ? kLeastSpacing : std::max(kLeastSpacing, kSpacingPerCost * (end - begin)));
    }
    picture = {slot->image, slot->version == version && !waits};
  }
  const std::lock_guard lock(mutex_);
  slot->bytes = picture.image->data.size() * sizeof(float);
  forget_some(key);
  return picture;
}

void Pictures::keep(const JobId& job, std::shared_ptr<const Image> image) {
  const std::lock_guard lock(mutex_);
  const Key key{job, std::nullopt};
  Slot& slot = *touch(key);
  slot.bytes = image->data.size() * sizeof(float);
  slot.image = std::move(image);
  forget_some(key);
}

std::shared_ptr<const Image> Pictures::kept(const JobId& job) {
  const std::lock_guard lock(mutex_);
  const Key key{job, std::nullopt};
  return slots_.contains(key) ? touch(key)->image : nullptr;
}

std::shared_ptr<Pictures::Slot>& Pictures::touch(const Key& key) {
  std::shared_ptr<Slot>& slot = slots_[key];
  if (!slot) slot = std::make_shared<Slot>();
  std::erase(order_, key);
  order_.push_back(key);
  return slot;
}

void Pictures::forget_some(const Key& but) {
  size_t bytes = 0;
  for (const auto& [key, slot] : slots_) bytes += slot->bytes;
  for (auto key = order_.begin(); bytes > kMaxBytes && key != order_.end();) {
    if (*key == but) {
      ++key;
      continue;
    }
    bytes -= slots_[*key]->bytes;
    slots_.erase(*key);
    key = order_.erase(key);
  }
}

std::string half_picture(const Image& image) {
  std::string bytes = head("LMH1", image) + std::string(2 * image.data.size(), '\0');
  char* out = bytes.data() + kHeadBytes;
  for (const float value : image.data) {
    // Infinity would make a hole of what is only bright.
    const float finite = std::isnan(value) ? value : std::clamp(value, -65504.0f, 65504.0f);
    const uint16_t half = _cvtss_sh(finite, _MM_FROUND_TO_NEAREST_INT | _MM_FROUND_NO_EXC);
    std::memcpy(out, &half, sizeof half);
    out += 2;
  }
  return bytes;
}

std::string float_picture(const Image& image) {
  const size_t bytes = image.data.size() * sizeof(float);
  return head("LMF1", image).append(reinterpret_cast<const char*>(image.data.data()), bytes);
}

std::string exr_file(const Farm& farm, const JobId& job, const std::string& name) {
  Image image;
  const ChannelImage aovs = farm.aovs(job, &image);
  ImageWriteOptions options;
  options.metadata = farm.image_metadata(job);
  options.layers = &aovs;
  return image_file(image, options, name, ".exr");
}

std::string png_file(const Image& image, const ViewTransform& view, const std::string& name) {
  ImageWriteOptions options;
  options.view = view;
  return image_file(image, options, name, ".png");
}

}  // namespace lightmill
