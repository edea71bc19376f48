#include "coordinator/merge/quarantine.h"

#include <algorithm>
#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>

#include "common/base/digest.h"
#include "coordinator/store/data_folder.h"

namespace lightmill {
namespace {

namespace fs = std::filesystem;
constexpr const char* kBytes = ".partial";
constexpr const char* kText = ".json";
constexpr size_t kNumberDigits = 8;

/// The number that a file's name begins with; 0 for what is not ours.
uint64_t number_of(const fs::path& path) {
  const std::string name = path.filename().string();
  if (name.size() < kNumberDigits) return 0;
  uint64_t number = 0;
  for (size_t i = 0; i < kNumberDigits; ++i) {
    if (name[i] < '0' || name[i] > '9') return 0;
    number = number * 10 + static_cast<uint64_t>(name[i] - '0');
  }
  return number;
}

std::string padded(uint64_t number) {
  const std::string digits = std::to_string(number);
  return std::string(kNumberDigits - std::min(kNumberDigits, digits.size()), '0') + digits;
}

}  // namespace

Quarantine::Quarantine(const std::string& folder) : folder_(folder) {
  std::error_code error;
  fs::create_directories(folder, error);
  if (error) throw Error(ErrorKind::kFailed, folder + ": can't make the folder: " + error.message());
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    next_ = std::max(next_, number_of(entry.path()) + 1);
  }
}

void Quarantine::make_room(uint64_t bytes) {
  struct Entry {
    std::vector<fs::path> files;
    uint64_t bytes = 0;
  };
  std::map<uint64_t, Entry> entries;
  std::error_code error;
  uint64_t total = bytes;
  for (const fs::directory_entry& file : fs::directory_iterator(folder_, error)) {
    const uint64_t number = number_of(file.path());
    if (number == 0) continue;
    const uint64_t size = file.file_size(error);
    if (error) continue;
    entries[number].files.push_back(file.path());
    entries[number].bytes += size;
    total += size;
  }
  while (!entries.empty() && (entries.size() >= kMostEntries || total > kMostBytes)) {
    for (const fs::path& path : entries.begin()->second.files) fs::remove(path, error);
    total -= entries.begin()->second.bytes;
    entries.erase(entries.begin());
  }
}

void Quarantine::keep(const LeaseKey& lease, const WorkerId& worker, const std::string& reason,
                      std::string_view bytes) {
  const std::lock_guard lock(mutex_);
  const std::string_view kept = bytes.substr(0, kMostBytes / 4);
  const nlohmann::json text = {{"job", lease.job.value},     {"tile", lease.tile.value},
                               {"attempt", lease.attempt},   {"worker", worker.value},
                               {"reason", reason},           {"bytes", bytes.size()},
                               {"sha256", sha256_hex(bytes)}};
  make_room(kept.size());
  // Only the coordinator's own numbers go into a name: ids come from a stranger.
  const std::string name = folder_ + "/" + padded(next_++);
  write_file_atomically(name + kBytes, std::string(kept));
  write_file_atomically(name + kText,
                        text.dump(2, ' ', false, nlohmann::json::error_handler_t::replace) + "\n");
}

}  // namespace lightmill
