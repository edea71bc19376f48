#include "coordinator/merge/merger.h"

#include "coordinator/farm/sharing/film_bytes.h"
#include "coordinator/merge/store_check.h"
#include "coordinator/store/job_store.h"

namespace lightmill {
namespace {

/// Layers are evicted with a checkpoint where the spool is at least this share of them: writing a snapshot
/// takes time by the layers' size, folding a spool once more by the spool's, each time anew.
constexpr double kSpoolWorthACheckpoint = 1 / 8.0;

/// What is wrong with stored bytes is damage. That the store fails is not.
template <class Action>
void as_damage(Action&& action) {
  try {
    action();
  } catch (const StoreError&) {
    throw;
  } catch (const Error& error) {
    throw DamagedLayers(error.what());
  }
}

}  // namespace

Merger::Open Merger::open(const JobId& job, const RenderSettings& settings) {
  Open open = hold(job, settings);
  if (!open.slot_->layers) open.slot_->layers = load(job, settings);
  return open;
}

Merger::Open Merger::hold(const JobId& job, const RenderSettings& settings) {
  Slot* slot = nullptr;
  {
    std::unique_lock lock(mutex_);
    room_.wait(lock, [&] { return !waiting_; });
    std::unique_ptr<Slot>& entry = slots_[job];
    if (!entry) {
      entry = std::make_unique<Slot>();
      entry->job = job;
    }
    slot = entry.get();
    ++slot->users;
    slot->last_used = ++uses_;
  }
  Open open(std::unique_ptr<Slot, Release>(slot, {this}));
  make_room(slot, film_bytes(settings));  // also of layers in memory, which grow when the job is extended
  return open;
}

std::unique_ptr<Merger::Layers> Merger::load(const JobId& job, const RenderSettings& settings) {
  auto layers = std::make_unique<Layers>();
  load_film(job, settings, *layers);
  try {
    layers->reference = store_.reference(job);
  } catch (const DamagedLayers& damage) {  // of which rendering again mends nothing
    throw Error(ErrorKind::kFailed, std::string("the reference image: ") + damage.what());
  }
  return layers;
}

void Merger::load_film(const JobId& job, const RenderSettings& settings, Layers& layers) {
  const FilmGrid& grid = settings.grid;
  {
    const LayerSnapshot snapshot = store_.snapshot(job);
    as_damage([&] {
      layers.film = snapshot.film.empty() ? Film(grid) : Film::restore(snapshot.film);
      layers.batches = snapshot.batches.empty() ? BatchFilm(grid) : BatchFilm::restore(snapshot.batches);
    });
  }
  store_.for_each_spooled(job, [&](const std::string& bytes) {
    as_damage([&] {
      const Partial partial = decode_partial(bytes);
      layers.film.fold(partial);
      layers.batches.fold(partial);
    });
    layers.spool_bytes += static_cast<double>(bytes.size());
  });
  const std::vector<TileRecord> tiles = store_.tiles(job);
  as_damage([&] { check_film(job, settings, tiles, layers.film); });
}

void Merger::replace(const JobId& job, Open& open, std::unique_ptr<Layers> layers) {
  open.slot_->layers.reset();  // if the store fails now, what it had is loaded again
  store_.checkpoint(job, {layers->film.snapshot(), layers->batches.snapshot()}, keep_partials_);
  layers->reference = store_.reference(job);
  layers->spool_bytes = 0;
  open.slot_->layers = std::move(layers);
}

/// Wants the slot locked. Evicts what nobody uses, then waits for those in use. Nobody waits for whoever
/// waits here, as what they take does not count meanwhile.
void Merger::make_room(Slot* slot, double wanted) {
  std::unique_lock lock(mutex_);
  if (slot->layers && slot->bytes >= wanted) return;
  if (!slot->layers) ++loads_;
  bytes_ -= slot->bytes;
  slot->bytes = 0;
  room_.wait(lock, [&] { return !waiting_; });
  waiting_ = true;
  while (bytes_ > 0 && bytes_ + wanted > max_bytes_) {
    Slot* oldest = nullptr;
    for (const auto& [id, other] : slots_) {
      if (other->users > 0 || other->bytes == 0) continue;
      if (!oldest || other->last_used < oldest->last_used) oldest = other.get();
    }
    if (!oldest) {
      room_.wait(lock);
      continue;
    }
    ++oldest->users;
    lock.unlock();
    evict(oldest);
    release(oldest);
    lock.lock();
  }
  slot->bytes = wanted;
  bytes_ += wanted;
  waiting_ = false;
  room_.notify_all();
}

void Merger::evict(Slot* slot) {
  const std::lock_guard lock(slot->mutex);
  if (!slot->layers) return;
  try {
    if (slot->layers->spool_bytes > kSpoolWorthACheckpoint * slot->bytes) {
      store_.checkpoint(slot->job, {slot->layers->film.snapshot(), slot->layers->batches.snapshot()},
                        keep_partials_);
    }
  } catch (const std::exception&) {
    // What is in the store is enough to load it again; the store tells of its failure itself.
  }
  slot->layers.reset();
}

void Merger::release(Slot* slot) {
  const std::lock_guard lock(mutex_);
  if (--slot->users > 0) return;
  room_.notify_all();
  if (slot->layers) return;
  bytes_ -= slot->bytes;
  slots_.erase(JobId(slot->job));
}

void Merger::checkpoint(const JobId& job, Open& layers, bool final) {
  if (!store_.keeps_layers()) return;
  store_.checkpoint(job, {layers->film.snapshot(), layers->batches.snapshot()}, keep_partials_ && !final);
  layers->spool_bytes = 0;
}

double Merger::bytes() const {
  const std::lock_guard lock(mutex_);
  return bytes_;
}

uint64_t Merger::loads() const {
  const std::lock_guard lock(mutex_);
  return loads_;
}

}  // namespace lightmill
