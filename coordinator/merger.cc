#include "coordinator/merger.h"

#include "coordinator/job_store.h"
#include "coordinator/store_check.h"

namespace lightmill {

Merger::Open Merger::open(const JobId& job, const RenderSettings& settings) {
  std::shared_ptr<Slot> slot;
  {
    const std::lock_guard lock(mutex_);
    if (slots_.size() >= kMaxLoaded && !slots_.contains(job)) {
      std::erase_if(slots_, [](const auto& item) { return item.second.use_count() == 1; });
    }
    std::shared_ptr<Slot>& entry = slots_[job];
    if (!entry) entry = std::make_shared<Slot>();
    slot = entry;
  }
  Open open(slot);
  if (slot->layers) return open;
  auto layers = std::make_unique<Layers>();
  const LayerSnapshot snapshot = store_.snapshot(job);
  const FilmGrid& grid = settings.grid;
  layers->film = snapshot.film.empty() ? Film(grid) : Film::restore(snapshot.film);
  layers->batches = snapshot.batches.empty() ? BatchFilm(grid) : BatchFilm::restore(snapshot.batches);
  store_.for_each_spooled(job, [&](const std::string& bytes) {
    const Partial partial = decode_partial(bytes);
    layers->film.fold(partial);
    layers->batches.fold(partial);
    layers->spool_bytes += static_cast<double>(bytes.size());
  });
  check_film(job, settings, store_.tiles(job), layers->film);
  layers->reference = store_.reference(job);
  slot->layers = std::move(layers);
  return open;
}

void Merger::checkpoint(const JobId& job, Open& layers) {
  store_.checkpoint(job, {layers->film.snapshot(), layers->batches.snapshot()});
  layers->spool_bytes = 0;
}

}  // namespace lightmill
