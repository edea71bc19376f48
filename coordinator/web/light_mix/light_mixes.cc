#include "coordinator/web/light_mix/light_mixes.h"

#include <algorithm>
#include <exception>
#include <utility>

#include "common/image/light_groups/light_mix.h"
#include "coordinator/core/low_priority.h"
#include "coordinator/web/film_mark.h"

namespace lightmill {
namespace {

// Commits of a job wait while its light is read.
constexpr double kJobTimePerRead = 20;  // from one reading of a job to the next, so many times what it took
constexpr double kRestPerRead = 2;      // after each one, whoever's

size_t bytes_of(const MixedLight& light) {
  return (light.light.image.data.size() + light.small.image.data.size()) * sizeof(float);
}

/// What reduced() makes one pixel of, so many by so many.
int block_of_side(const Image& image, int side) {
  return (std::max(image.width, image.height) + side - 1) / side;
}

ChannelImage small_of(const ChannelImage& light) {
  ChannelImage small;
  if (block_of_side(light.image, kSmallMix) == 1) return small;
  small.channels = light.channels;
  at_low_priority([&] { small.image = reduced(light.image, kSmallMix); });
  return small;
}

/// The smallest block with which there are so few pixels.
int mix_block(const PixelRect& crop, int64_t most_pixels) {
  const auto blocks = [](int pixels, int block) { return int64_t{(pixels + block - 1) / block}; };
  int block = 1;
  while (blocks(crop.width(), block) * blocks(crop.height(), block) > std::max<int64_t>(most_pixels, 1))
    ++block;
  return block;
}

/// Where the values of image and groups are (Film::light_groups_for_display).
LightLayers layers_of(const LightGroups& groups) {
  LightLayers layers;
  layers.picture = {0, 1, 2};
  for (const std::string& name : groups) {
    const size_t first = 3 + 3 * layers.groups.size();
    layers.groups.push_back({name, {first, first + 1, first + 2}, {}});
  }
  return layers;
}

}  // namespace

Image mixed_image(const MixedLight& light, std::span<const LightFactor> factors, int side) {
  const Image& whole = light.light.image;
  // The mix of means is the mean of mixes.
  const bool small = side > 0 && !light.small.channels.empty() &&
                     block_of_side(whole, side) == block_of_side(whole, kSmallMix);
  Image image;
  at_low_priority(
      [&] { image = mix_colour(small ? light.small : light.light, layers_of(light.groups), factors).image; });
  return image;
}

LightMixes::LightMixes(const Farm& farm, int64_t most_pixels, size_t most_bytes)
    : farm_(farm), most_pixels_(most_pixels), most_bytes_(most_bytes), thread_([this] { run(); }) {}

LightMixes::~LightMixes() {
  {
    const std::lock_guard lock(mutex_);
    stopping_ = true;
    wake_.notify_all();
  }
  thread_.join();
}

std::optional<LightMixes::Answer> LightMixes::get(const JobStatus& job) {
  if (job.packets_done == 0) return std::nullopt;
  const std::string mark = film_mark(job);
  const std::lock_guard lock(mutex_);
  const auto found = kept_.find(job.id);
  const bool there = found != kept_.end();
  const bool current = there && found->second.light->mark == mark;
  if (!there || (!current && Clock::now() >= found->second.next)) {
    wishes_.add(job.id);
    wake_.notify_all();
  }
  if (!there) return std::nullopt;
  found->second.used = ++uses_;
  return Answer{found->second.light, current};
}

void LightMixes::run() {
  std::unique_lock lock(mutex_);
  while (!stopping_) {
    wake_.wait(lock, [&] { return stopping_ || !wishes_.empty(); });
    const std::optional<JobId> job = wishes_.take();
    if (stopping_ || !job) continue;
    lock.unlock();
    const Clock::time_point next = read(*job);
    lock.lock();
    wake_.wait_until(lock, next, [&] { return stopping_; });
  }
}

LightMixes::Clock::time_point LightMixes::read(const JobId& job) {
  const Clock::time_point begin = Clock::now();
  const auto after = [&](double times) {
    const Clock::time_point now = Clock::now();
    return now + std::chrono::duration_cast<Clock::duration>(times * (now - begin));
  };
  try {
    const JobStatus status = farm_.job(job);
    MixedLight light;
    light.mark = film_mark(status);
    {
      const std::lock_guard lock(mutex_);
      const auto found = kept_.find(job);
      if (found != kept_.end() && found->second.light->mark == light.mark) return begin;
    }
    light.groups = status.settings.light_groups;
    const auto values = static_cast<int64_t>(3 * (light.groups.size() + 1));
    light.block = mix_block(status.settings.grid.crop, std::min(most_pixels_, kMostValues / values));
    light.light = farm_.light_groups(job, light.block);
    // A film that nothing was folded into knows of no groups yet.
    if (light.light.channels.empty() || light.light.image.channels != values) return after(kRestPerRead);
    const Clock::time_point next = after(kJobTimePerRead), rested = after(kRestPerRead);
    light.small = small_of(light.light);
    keep(job, std::make_shared<const MixedLight>(std::move(light)), next);
    return rested;
  } catch (const std::exception&) {
    // The job's own note says what is wrong with its film; it is tried again when it is asked for again.
  }
  return after(kRestPerRead);
}

void LightMixes::keep(const JobId& job, std::shared_ptr<const MixedLight> light, Clock::time_point next) {
  const std::lock_guard lock(mutex_);
  kept_[job] = {std::move(light), next, ++uses_};
  wishes_.remove(job);  // whoever finds it out of date asks again
  size_t bytes = 0;
  for (const auto& [id, kept] : kept_) bytes += bytes_of(*kept.light);
  while (bytes > most_bytes_ && kept_.size() > 1) {
    const auto oldest = std::min_element(kept_.begin(), kept_.end(), [](const auto& a, const auto& b) {
      return a.second.used < b.second.used;
    });
    bytes -= bytes_of(*oldest->second.light);
    kept_.erase(oldest);
  }
}

}  // namespace lightmill
