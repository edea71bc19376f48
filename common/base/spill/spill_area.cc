#include "common/base/spill/spill_area.h"

#include <fcntl.h>
#include <sys/mman.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include "common/base/error.h"

namespace lightmill {
namespace {

constexpr std::chrono::milliseconds kLook{5};

std::string folder_or_default(std::string folder) {
  if (!folder.empty()) return folder;
  const char* const named = std::getenv("TMPDIR");
  return named && *named ? named : "/var/tmp";
}

Error no_file(const std::string& folder, const std::string& why) {
  return Error(ErrorKind::kFailed,
               folder + ": large arrays have no room in memory, and can't be kept there: " + why +
                   "; give more memory, or a folder with room");
}

/// Bytes of files that are mapped into this process and in memory; 0 if the system does not say.
uint64_t mapped_bytes(int statm) {
  std::array<char, 128> text{};
  if (statm < 0 || pread(statm, text.data(), text.size() - 1, 0) <= 0) return 0;
  unsigned long long size = 0, resident = 0, shared = 0;
  if (std::sscanf(text.data(), "%llu %llu %llu", &size, &resident, &shared) != 3) return 0;
  return shared * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
}

}  // namespace

SpillArea::SpillArea(uint64_t max_bytes, std::string folder)
    : max_bytes_(max_bytes), folder_(folder_or_default(std::move(folder))) {}

SpillArea::~SpillArea() = default;  // the thread is stopped first, as the last member

bool SpillArea::take(uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  if (bytes > max_bytes_ || taken_ > max_bytes_ - bytes) return false;
  taken_ += bytes;
  return true;
}

void SpillArea::give_back(uint64_t bytes) {
  const std::lock_guard lock(mutex_);
  taken_ -= bytes;
}

int SpillArea::create_file() const {
  std::error_code ignored;
  std::filesystem::create_directories(folder_, ignored);  // what it was for fails below
  std::string path = folder_ + "/lightmill-XXXXXX";
  const int file = mkostemp(path.data(), O_CLOEXEC);
  if (file < 0) throw no_file(folder_, std::strerror(errno));
  unlink(path.c_str());
  return file;
}

void* SpillArea::grow_file(int file, void* at, size_t old_bytes, size_t bytes) {
  // Room on the disk is made sure of here: a write to a mapped page that finds none would end the process.
  const int failed =
      posix_fallocate(file, static_cast<off_t>(old_bytes), static_cast<off_t>(bytes - old_bytes));
  if (failed) throw no_file(folder_, std::strerror(failed));
  const std::lock_guard lock(mutex_);
  void* const to = at ? mremap(at, old_bytes, bytes, MREMAP_MAYMOVE)
                      : mmap(nullptr, bytes, PROT_READ | PROT_WRITE, MAP_SHARED, file, 0);
  if (to == MAP_FAILED) throw no_file(folder_, std::strerror(errno));
  if (at) mapped_.erase(at);
  mapped_[to] = bytes;
  if (!keeper_.joinable()) keeper_ = std::jthread([this](const std::stop_token& stop) { keep_bound(stop); });
  return to;
}

void SpillArea::expect_random_reads() {
  const std::lock_guard lock(mutex_);
  for (const auto& [at, bytes] : mapped_) madvise(at, bytes, MADV_RANDOM);
}

void SpillArea::drop_file(int file, void* at, size_t bytes) {
  {
    const std::lock_guard lock(mutex_);
    mapped_.erase(at);
    if (at) munmap(at, bytes);
  }
  close(file);
}

void SpillArea::keep_bound(const std::stop_token& stop) {
  const int statm = open("/proc/self/statm", O_RDONLY | O_CLOEXEC);
  const uint64_t others = mapped_bytes(statm);  // the program itself
  std::unique_lock lock(mutex_);
  while (!wake_.wait_for(lock, stop, kLook, [&] { return stop.stop_requested(); })) {
    const uint64_t room = std::max(max_bytes_ - taken_, max_bytes_ / 4);
    if (mapped_bytes(statm) < others + room) continue;
    // The pages stay in the system's cache while nothing else wants the memory, so most come back quickly.
    for (const auto& [at, bytes] : mapped_) madvise(at, bytes, MADV_DONTNEED);
  }
  if (statm >= 0) close(statm);
}

}  // namespace lightmill
