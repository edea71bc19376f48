#include "coordinator/web/thumbnails/thumbnail_store.h"

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <utility>
#include <vector>

#include "common/base/error.h"
#include "coordinator/store/data_folder.h"

namespace lightmill {
namespace {

namespace fs = std::filesystem;
constexpr const char* kExtension = ".png";
constexpr char kSeparator = '_';  // between a job's id and the mark
constexpr uint64_t kMostBytesOfFile = 1 << 20;

std::string file_content(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  return {std::istreambuf_iterator<char>(file), {}};
}

}  // namespace

ThumbnailStore::ThumbnailStore(std::string folder, std::function<void(const std::string&)> log,
                               const Limits& limits)
    : folder_(std::move(folder)), log_(std::move(log)), limits_(limits) {
  if (!folder_.empty()) load_folder();
}

std::string ThumbnailStore::path(const JobId& job, const Entry& entry) const {
  return folder_ + "/" + job.value + kSeparator + entry.mark + kExtension;
}

void ThumbnailStore::load_folder() {
  struct Found {
    fs::file_time_type time;
    std::string name;
    uint64_t bytes;
  };
  std::vector<Found> found;
  std::error_code error;
  fs::create_directories(folder_, error);
  for (const fs::directory_entry& file : fs::directory_iterator(folder_, error)) {
    const std::string name = file.path().filename().string();
    const uint64_t bytes = file.file_size(error);
    const auto time = file.last_write_time(error);
    // Whatever is not a whole thumbnail was left by a crash.
    if (error || bytes == 0 || bytes > kMostBytesOfFile || !name.ends_with(kExtension) ||
        name.find(kSeparator) == std::string::npos) {
      fs::remove(file.path(), error);
    } else {
      found.push_back({time, name, bytes});
    }
  }
  std::sort(found.begin(), found.end(), [](const Found& a, const Found& b) { return a.time < b.time; });
  for (const Found& file : found) {
    const size_t split = file.name.find(kSeparator), end = file.name.size() - std::string(kExtension).size();
    const JobId job{file.name.substr(0, split)};
    Entry& entry = touch(job);
    remove_file(job, &entry);  // an older one that a crash left
    entry.mark = file.name.substr(split + 1, end - split - 1);
    entry.file_bytes = file.bytes;
    ++files_;
    file_bytes_ += file.bytes;
  }
  keep_limits();
}

ThumbnailStore::Entry& ThumbnailStore::touch(const JobId& job) {
  const auto [at, is_new] = entries_.try_emplace(job);
  if (!is_new) order_.erase(at->second.place);
  at->second.place = order_.insert(order_.end(), job);
  return at->second;
}

std::optional<ThumbnailStore::Thumbnail> ThumbnailStore::find(const JobId& job) {
  const std::lock_guard lock(mutex_);
  if (!entries_.contains(job)) return std::nullopt;
  Entry& entry = touch(job);
  if (!entry.png) {
    std::string bytes = file_content(path(job, entry));
    if (bytes.size() != entry.file_bytes) {  // somebody removed it
      remove_file(job, &entry);
      order_.erase(entry.place);
      entries_.erase(job);
      return std::nullopt;
    }
    memory_bytes_ += bytes.size();
    entry.png = std::make_shared<const std::string>(std::move(bytes));
  }
  const Thumbnail found{entry.png, entry.mark};
  keep_limits();
  return found;
}

void ThumbnailStore::put(const JobId& job, const std::string& mark, std::string png) {
  const std::lock_guard lock(mutex_);
  Entry& entry = touch(job);
  remove_file(job, &entry);
  drop_picture(&entry);
  entry.mark = mark;
  memory_bytes_ += png.size();
  entry.png = std::make_shared<const std::string>(std::move(png));
  if (!folder_.empty()) write_file(job, &entry);
  keep_limits();
}

void ThumbnailStore::write_file(const JobId& job, Entry* entry) {
  try {
    write_file_atomically(path(job, *entry), *entry->png);
  } catch (const Error& e) {
    if (log_ && !std::exchange(told_, true)) log_(std::string(e.what()) + "; thumbnails stay in memory only");
    return;
  }
  entry->file_bytes = entry->png->size();
  ++files_;
  file_bytes_ += entry->file_bytes;
}

void ThumbnailStore::remove_file(const JobId& job, Entry* entry) {
  if (entry->file_bytes == 0) return;
  std::error_code error;  // what stays is removed by the next process
  fs::remove(path(job, *entry), error);
  --files_;
  file_bytes_ -= entry->file_bytes;
  entry->file_bytes = 0;
}

void ThumbnailStore::drop_picture(Entry* entry) {
  if (entry->png) memory_bytes_ -= entry->png->size();
  entry->png.reset();
}

void ThumbnailStore::keep_limits() {
  for (auto job = order_.begin(); job != order_.end() && std::next(job) != order_.end();) {
    const bool too_much = memory_bytes_ > limits_.memory_bytes;
    const bool too_many = files_ > limits_.files || file_bytes_ > limits_.file_bytes;
    if (!too_much && !too_many) return;
    Entry& entry = entries_.at(*job);
    if (too_many) remove_file(*job, &entry);
    if (too_much || entry.file_bytes == 0) drop_picture(&entry);
    if (entry.file_bytes > 0) {
      ++job;
      continue;
    }
    entries_.erase(*job);
    job = order_.erase(job);
  }
}

}  // namespace lightmill
