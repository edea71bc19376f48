#pragma once
// Memory for large arrays within a bound. What has no room lies in files, which the system maps and pages.
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <unordered_map>

namespace lightmill {

/// A bound shared by the arrays of one owner (spill_array.h). Thread-safe.
class SpillArea {
 public:
  /// The arrays take up to `max_bytes` of memory together. Those that have no room are kept in files in
  /// `folder` (empty: $TMPDIR, or else /var/tmp, as /tmp may be memory), which have no names there and are
  /// gone with them. Pages of such files are memory that the system takes back when it wants to; to hold to
  /// the bound on machines that have more, they are let go when there are too many.
  explicit SpillArea(uint64_t max_bytes, std::string folder = "");
  ~SpillArea();
  SpillArea(const SpillArea&) = delete;
  SpillArea& operator=(const SpillArea&) = delete;

  /// Whether there is room for so much more memory, which is then taken.
  bool take(uint64_t bytes);
  void give_back(uint64_t bytes);

  /// A new file, open for reading and writing. Throws Error(kFailed) if there can be none.
  int create_file() const;
  /// Makes a file of `old_bytes` that is mapped at `at` (null: not yet) larger. Returns where it is mapped
  /// now. Throws Error(kFailed) if the disk has no room; then all is as before.
  void* grow_file(int file, void* at, size_t old_bytes, size_t bytes);
  /// What is in files is read here and there from now on, so the system need not read more than is asked for.
  void expect_random_reads();
  /// Ends the mapping and closes the file.
  void drop_file(int file, void* at, size_t bytes);

 private:
  /// Lets pages go, every few milliseconds.
  void keep_bound(const std::stop_token& stop);

  const uint64_t max_bytes_;
  const std::string folder_;
  std::mutex mutex_;
  uint64_t taken_ = 0;
  std::unordered_map<void*, size_t> mapped_;
  std::condition_variable_any wake_;
  std::jthread keeper_;  // from the first file on
};

}  // namespace lightmill
