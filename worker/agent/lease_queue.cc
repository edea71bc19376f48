#include "worker/agent/lease_queue.h"

#include <algorithm>
#include <chrono>
#include <utility>

namespace lightmill::agent {

namespace {
/// More leases than this are never held, whatever the thread count: their buffers cost memory, and what this
/// worker holds another one can't render.
constexpr size_t kMaxHeld = 4;
/// Leases with packets left to hand out that keep the threads busy across the end of a tile.
constexpr int kAhead = 2;
constexpr double kNewest = 1 / 8.0;  // weight of the newest packet in the mean time
}  // namespace

PacketList::PacketList(const TileSpec& tile)
    : tile_(tile), cells_(tile.cells.count()), first_block_(block_of_sample(tile.sample_begin)) {
  blocks_ = tile.samples() <= 0 ? 0 : block_of_sample(tile.sample_end - 1) - first_block_ + 1;
}

Packet PacketList::operator[](int64_t index) const {
  const int64_t cell = index % cells_;
  const int64_t block = first_block_ + index / cells_;
  Packet packet;
  packet.cell_x = tile_.cells.x0 + static_cast<int>(cell % tile_.cells.width());
  packet.cell_y = tile_.cells.y0 + static_cast<int>(cell / tile_.cells.width());
  packet.sample_begin = std::max(block_begin(block), tile_.sample_begin);
  packet.sample_end = std::min(block_end(block), tile_.sample_end);
  return packet;
}

ActiveLease::ActiveLease(LeaseGrant granted, std::shared_ptr<const PacketRenderer> ready)
    : lease(std::move(granted)),
      renderer(std::move(ready)),
      builder(renderer->grid(), lease.tile, renderer->quantum_exponent(), renderer->has_camera_layer(),
              renderer->has_splat_layer(), renderer->aovs()),
      packets_(lease.tile) {}

bool LeaseQueue::has_room() const {
  if (held_.size() >= kMaxHeld || pilot_ || pilot_running_) return false;
  int64_t waiting_packets = 0;
  int waiting_leases = 0;
  double waiting_samples = 0;
  for (const auto& lease : rendering_) {
    const int64_t left = lease->packets_.size() - lease->next_;
    waiting_packets += left;
    waiting_leases += left > 0;
    const TileSpec& tile = lease->lease.tile;
    waiting_samples += static_cast<double>(left * tile.cells.count() * tile.samples()) /
                       static_cast<double>(std::max<int64_t>(1, lease->packets_.size()));
  }
  if (waiting_packets < threads_) return true;
  if (waiting_leases >= kAhead || sample_seconds_ < 0) return false;
  return waiting_samples * sample_seconds_ < lead_ * threads_;
}

void LeaseQueue::set_lead(double seconds) {
  const std::lock_guard lock(mutex_);
  lead_ = seconds;
}

void LeaseQueue::measure(const Work& work) {
  const double seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - work.begun).count();
  const auto samples =
      static_cast<double>(std::max<int64_t>(1, work.packet.sample_end - work.packet.sample_begin));
  const double newest = seconds / samples;
  sample_seconds_ = sample_seconds_ < 0 ? newest : sample_seconds_ + kNewest * (newest - sample_seconds_);
}

bool LeaseQueue::wait_for_room() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return closed_ || !growing_ || has_room(); });
  return !closed_ && growing_;
}

void LeaseQueue::hold(const LeaseKey& key) {
  const std::lock_guard lock(mutex_);
  held_.insert(key);
}

void LeaseQueue::start(std::shared_ptr<ActiveLease> lease) {
  const std::lock_guard lock(mutex_);
  if (!held_.count(key_of(lease->lease))) return;  // lost while it was loading
  if (lease->packets_.size() == 0) {
    finished_.push_back({lease, {"the tile is empty"}});
  } else {
    rendering_.push_back(std::move(lease));
  }
  changed_.notify_all();
}

void LeaseQueue::release(const LeaseKey& key) {
  const std::lock_guard lock(mutex_);
  held_.erase(key);
  if (pilot_running_ == key) pilot_running_.reset();
  changed_.notify_all();
}

void LeaseQueue::start_pilot(PilotLease pilot) {
  const std::lock_guard lock(mutex_);
  if (!held_.count(key_of(pilot.lease))) return;
  pilot_ = std::move(pilot);
  changed_.notify_all();
}

std::optional<PilotLease> LeaseQueue::take_pilot() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return closed_ || pilot_; });
  if (closed_) return std::nullopt;
  pilot_running_ = key_of(pilot_->lease);
  return std::exchange(pilot_, std::nullopt);
}

std::optional<LeaseQueue::Work> LeaseQueue::take() {
  std::unique_lock lock(mutex_);
  while (!closed_) {
    for (const auto& lease : rendering_) {
      if (lease->next_ == lease->packets_.size()) continue;
      ++lease->unfinished_;
      Work work{lease, lease->packets_[lease->next_++], std::chrono::steady_clock::now()};
      if (has_room()) changed_.notify_all();  // time to lease ahead
      return work;
    }
    changed_.wait(lock);
  }
  return std::nullopt;
}

void LeaseQueue::finish(const Work& work, const TileFailure& failure) {
  const std::lock_guard lock(mutex_);
  ActiveLease& lease = *work.lease;
  measure(work);
  --lease.unfinished_;
  if (!failure.text.empty() && lease.failure_.text.empty()) {
    lease.failure_ = failure;
    lease.next_ = lease.packets_.size();  // the rest would be thrown away
  }
  if (lease.unfinished_ == 0 && lease.next_ == lease.packets_.size()) retire(work.lease);
  if (has_room()) changed_.notify_all();
}

void LeaseQueue::retire(const std::shared_ptr<ActiveLease>& lease) {
  const auto position = std::find(rendering_.begin(), rendering_.end(), lease);
  if (position == rendering_.end()) return;
  rendering_.erase(position);
  if (!lease->lost_) finished_.push_back({lease, lease->failure_});
  changed_.notify_all();
}

std::optional<LeaseQueue::Finished> LeaseQueue::take_finished() {
  std::unique_lock lock(mutex_);
  changed_.wait(lock, [&] { return closed_ || !finished_.empty(); });
  if (closed_) return std::nullopt;
  Finished finished = std::move(finished_.front());
  finished_.pop_front();
  return finished;
}

std::vector<LeaseKey> LeaseQueue::held() const {
  const std::lock_guard lock(mutex_);
  return {held_.begin(), held_.end()};
}

bool LeaseQueue::is_held(const LeaseKey& key) const {
  const std::lock_guard lock(mutex_);
  return held_.count(key) != 0;
}

void LeaseQueue::lose(const std::vector<LeaseKey>& keys) {
  const std::lock_guard lock(mutex_);
  for (const LeaseKey& key : keys) {
    held_.erase(key);
    if (pilot_ && key_of(pilot_->lease) == key) pilot_.reset();
    std::erase_if(finished_, [&](const Finished& finished) { return key_of(finished.lease->lease) == key; });
    const auto position = std::find_if(rendering_.begin(), rendering_.end(),
                                       [&](const auto& lease) { return key_of(lease->lease) == key; });
    if (position == rendering_.end()) continue;
    const std::shared_ptr<ActiveLease> lease = *position;
    lease->lost_ = true;
    lease->next_ = lease->packets_.size();
    if (lease->unfinished_ == 0) retire(lease);
  }
  changed_.notify_all();
}

void LeaseQueue::stop_growing() {
  const std::lock_guard lock(mutex_);
  growing_ = false;
  changed_.notify_all();
}

bool LeaseQueue::wait_until_empty(double seconds) const {
  std::unique_lock lock(mutex_);
  return changed_.wait_for(lock, std::chrono::duration<double>(seconds), [&] {
    return closed_ || held_.empty();
  }) && held_.empty();
}

void LeaseQueue::close() {
  const std::lock_guard lock(mutex_);
  closed_ = true;
  changed_.notify_all();
}

}  // namespace lightmill::agent
