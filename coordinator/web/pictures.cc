#include "coordinator/web/pictures.h"

#include <OpenImageIO/half.h>

#include <algorithm>
#include <chrono>
#include <cmath>
#include <cstring>

namespace lightmill {
namespace {

constexpr double kLeastSpacing = 0.5;   // seconds between two pictures of a job
constexpr double kSpacingPerCost = 20;  // and this many times what the last one took

double seconds() {
  return std::chrono::duration<double>(std::chrono::steady_clock::now().time_since_epoch()).count();
}

}  // namespace

std::shared_ptr<const Image> Pictures::get(const JobId& job, Kind kind) {
  const uint64_t version = farm_.job(job).version;
  const Key key{job, kind};
  std::shared_ptr<Slot> slot;
  {
    const std::lock_guard lock(mutex_);
    std::shared_ptr<Slot>& entry = slots_[key];
    if (!entry) entry = std::make_shared<Slot>();
    slot = entry;
    std::erase(order_, key);
    order_.push_back(key);
  }
  std::shared_ptr<const Image> image;
  {
    const std::lock_guard lock(slot->mutex);
    const double begin = seconds();
    if (!slot->image || (slot->version != version && begin >= slot->next)) {
      slot->image =
          std::make_shared<const Image>(kind == Kind::kBeauty ? farm_.image(job) : farm_.error_map(job));
      slot->version = version;
      const double end = seconds();
      slot->next = end + std::max(kLeastSpacing, kSpacingPerCost * (end - begin));
    }
    image = slot->image;
  }
  const std::lock_guard lock(mutex_);
  slot->bytes = image->data.size() * sizeof(float);
  forget_some(key);
  return image;
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
  const uint32_t head[] = {static_cast<uint32_t>(image.width), static_cast<uint32_t>(image.height),
                           static_cast<uint32_t>(image.channels)};
  std::string bytes(4 + sizeof head + 2 * image.data.size(), '\0');
  std::memcpy(bytes.data(), "LMH1", 4);
  std::memcpy(bytes.data() + 4, head, sizeof head);
  char* out = bytes.data() + 4 + sizeof head;
  for (const float value : image.data) {
    // Infinity would make a hole of what is only bright.
    const half h(std::isnan(value) ? value : std::clamp(value, -65504.0f, 65504.0f));
    std::memcpy(out, &h, 2);
    out += 2;
  }
  return bytes;
}

}  // namespace lightmill
