#include "coordinator/service/scenes/uploads.h"

#include "coordinator/core/farm.h"

namespace lightmill {

std::shared_ptr<Uploads::Open> Uploads::open(const Key& key, uint64_t size, double now) {
  const std::lock_guard lock(mutex_);
  std::erase_if(open_, [&](const auto& entry) {
    return entry.first != key && now - entry.second->last > kIdleSeconds;
  });
  const auto found = open_.find(key);
  if (found == open_.end() && open_.size() >= kMaxOpen)
    throw LimitReached("too many files are being uploaded at once; try again in a moment");
  if (found != open_.end()) {
    found->second->last = now;
    return found->second;
  }
  auto entry = std::make_shared<Open>(blobs_.begin(key.second, size), size);
  entry->last = now;
  open_.emplace(key, entry);
  return entry;
}

Uploads::Progress Uploads::put(const std::string& user, const std::string& digest, uint64_t size,
                               uint64_t offset, std::string_view bytes, double now) {
  if (size > max_bytes_) {
    throw LimitReached("a file of more than " + std::to_string(max_bytes_) +
                       " bytes (the coordinator's --max-bundle-mb)");
  }
  if (blobs_.missing({digest}, BlobStore::kVerifyBytes).empty()) {
    if (blobs_.size(digest) != size)
      throw Error(ErrorKind::kUsage, "blob " + digest + " has another size than it says");
    return {size, true};
  }
  const Key key{user, digest};
  const std::shared_ptr<Open> entry = open(key, size, now);
  const std::lock_guard lock(entry->mutex);
  if (entry->ended) return {0, blobs_.contains(digest)};  // while we waited
  const auto end = [&] {
    entry->ended = true;
    const std::lock_guard all(mutex_);
    const auto found = open_.find(key);
    if (found != open_.end() && found->second == entry) open_.erase(found);
  };
  try {
    if (entry->size != size)
      throw Error(ErrorKind::kUsage, "blob " + digest + " was announced with another size; send it again");
    if (offset != entry->received) return {entry->received, false};
    entry->writer.write(bytes);
    entry->received += bytes.size();
    if (entry->received < size) return {entry->received, false};
    entry->writer.finish();
  } catch (...) {
    end();
    throw;
  }
  end();
  return {size, true};
}

}  // namespace lightmill
