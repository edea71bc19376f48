#include "common/base/spill/spill_array.h"

#include <unistd.h>

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <new>
#include <string>

#include "common/base/error.h"

namespace lightmill {
namespace {

/// Files grow by this at least: each time costs several calls of the system.
constexpr size_t kFileStep = size_t{64} << 20;

/// Not through the mapping, each page of which would cost a fault and be held by this process.
void write_file(int file, const void* from, size_t bytes, size_t at) {
  const char* data = static_cast<const char*>(from);
  while (bytes > 0) {
    const ssize_t written = pwrite(file, data, bytes, static_cast<off_t>(at));
    if (written < 0 && errno == EINTR) continue;
    if (written <= 0)
      throw Error(ErrorKind::kFailed,
                  std::string("a large array can't be written to its file: ") + std::strerror(errno));
    data += written, at += static_cast<size_t>(written), bytes -= static_cast<size_t>(written);
  }
}

}  // namespace

SpillBytes::~SpillBytes() {
  if (in_file()) {
    area_->drop_file(file_, data_, capacity_);
    return;
  }
  std::free(data_);
  if (area_) area_->give_back(capacity_);
}

void SpillBytes::swap(SpillBytes& other) noexcept {
  std::swap(area_, other.area_);
  std::swap(data_, other.data_);
  std::swap(size_, other.size_);
  std::swap(capacity_, other.capacity_);
  std::swap(file_, other.file_);
}

void SpillBytes::resize(size_t bytes) {
  if (bytes > capacity_) {
    const size_t ahead = bytes + capacity_ / 4;
    if (in_file() || (!grow_in_memory(ahead) && !grow_in_memory(bytes))) grow_in_file(ahead);
  }
  size_ = bytes;
}

void SpillBytes::append(const void* from, size_t bytes) {
  const size_t old = size_;
  resize(old + bytes);
  if (in_file()) {
    write_file(file_, from, bytes, old);
  } else if (bytes > 0) {
    std::memcpy(data_ + old, from, bytes);
  }
}

/// False if there is no room. realloc moves pages of large blocks and copies nothing, so that there are never
/// two of them.
bool SpillBytes::grow_in_memory(size_t capacity) {
  const size_t more = capacity - capacity_;
  if (area_ && !area_->take(more)) return false;
  void* const to = std::realloc(data_, capacity);
  if (!to) {
    if (area_) area_->give_back(more);
    throw std::bad_alloc();
  }
  data_ = static_cast<char*>(to);
  capacity_ = capacity;
  return true;
}

void SpillBytes::grow_in_file(size_t capacity) {
  capacity = (capacity + kFileStep - 1) / kFileStep * kFileStep;
  if (in_file()) {
    data_ = static_cast<char*>(area_->grow_file(file_, data_, capacity_, capacity));
    capacity_ = capacity;
    return;
  }
  const int file = area_->create_file();
  void* to = nullptr;
  try {
    to = area_->grow_file(file, nullptr, 0, capacity);
    write_file(file, data_, size_, 0);
  } catch (...) {
    area_->drop_file(file, to, to ? capacity : 0);
    throw;
  }
  std::free(data_);
  area_->give_back(capacity_);
  data_ = static_cast<char*>(to);
  capacity_ = capacity;
  file_ = file;
}

}  // namespace lightmill
