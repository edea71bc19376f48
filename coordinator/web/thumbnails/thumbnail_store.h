#pragma once
// Small pictures of jobs, each with a mark that says what it shows: files in a folder, the newest also in
// memory. Both are bounded; the least recently used go first. Thread-safe.
#include <cstdint>
#include <functional>
#include <list>
#include <map>
#include <memory>
#include <mutex>
#include <optional>
#include <string>

#include "common/base/ids.h"

namespace lightmill {

class ThumbnailStore {
 public:
  struct Limits {
    size_t memory_bytes = size_t{16} << 20;
    size_t files = 20000;
    uint64_t file_bytes = uint64_t{256} << 20;
  };
  /// Finds what an earlier process left in the folder, and makes it if it is absent. Empty: in memory only.
  /// `log` hears of a folder that can't be written, once: thumbnails are then in memory only.
  ThumbnailStore(std::string folder, std::function<void(const std::string&)> log, const Limits& limits);

  struct Thumbnail {
    std::shared_ptr<const std::string> png;
    std::string mark;
  };
  /// The newest of a job; reads the file where it is not in memory.
  std::optional<Thumbnail> find(const JobId& job);
  /// Replaces the job's. A mark is made of letters, digits and "-".
  void put(const JobId& job, const std::string& mark, std::string png);

 private:
  struct Entry {
    std::string mark;
    std::shared_ptr<const std::string> png;  // null: only in its file
    uint64_t file_bytes = 0;                 // 0: there is no file
    std::list<JobId>::iterator place;        // in order_
  };
  std::string path(const JobId& job, const Entry& entry) const;
  void load_folder();
  Entry& touch(const JobId& job);
  void write_file(const JobId& job, Entry* entry);
  void remove_file(const JobId& job, Entry* entry);
  void drop_picture(Entry* entry);
  void keep_limits();

  const std::string folder_;
  const std::function<void(const std::string&)> log_;
  const Limits limits_;
  std::mutex mutex_;
  bool told_ = false;  // of a folder that can't be written
  std::map<JobId, Entry> entries_;
  std::list<JobId> order_;  // least recently used first
  size_t memory_bytes_ = 0;
  size_t files_ = 0;
  uint64_t file_bytes_ = 0;
};

}  // namespace lightmill
