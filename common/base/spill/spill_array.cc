#include "common/base/spill/spill_array.h"

#include <algorithm>
#include <cstdlib>
#include <new>

namespace lightmill {
namespace {

/// Files grow by this at least: each time costs several calls of the system.
constexpr size_t kFileStep = size_t{64} << 20;

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
  } catch (...) {
    area_->drop_file(file, nullptr, 0);
    throw;
  }
  if (size_ > 0) std::memcpy(to, data_, size_);
  std::free(data_);
  area_->give_back(capacity_);
  data_ = static_cast<char*>(to);
  capacity_ = capacity;
  file_ = file;
}

}  // namespace lightmill
