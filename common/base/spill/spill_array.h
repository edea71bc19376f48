#pragma once
// An array that grows, in memory or in a mapped file.
//
//   SpillArray<float> values(area);        // area: a bound (spill_area.h), or null: memory without one
//   values.append(block.data(), block.size());
//   use(values.data()[i]);
#include <cstddef>
#include <memory>
#include <span>
#include <type_traits>
#include <utility>

#include "common/base/spill/spill_area.h"

namespace lightmill {

/// Bytes of such an array. Once it has moved to a file, for want of room, it stays there.
class SpillBytes {
 public:
  explicit SpillBytes(std::shared_ptr<SpillArea> area = nullptr) : area_(std::move(area)) {}
  SpillBytes(SpillBytes&& other) noexcept { swap(other); }
  SpillBytes& operator=(SpillBytes&& other) noexcept {
    swap(other);
    return *this;
  }
  ~SpillBytes();

  char* data() { return data_; }
  const char* data() const { return data_; }
  size_t size() const { return size_; }
  bool in_file() const { return file_ >= 0; }
  /// Of memory that is its own: none of a file's.
  size_t memory_bytes() const { return in_file() ? 0 : capacity_; }
  /// What is new is not set. Throws std::bad_alloc, or Error(kFailed) where a file has no room.
  void resize(size_t bytes);
  void append(const void* from, size_t bytes);

 private:
  void swap(SpillBytes& other) noexcept;
  bool grow_in_memory(size_t capacity);
  void grow_in_file(size_t capacity);

  std::shared_ptr<SpillArea> area_;
  char* data_ = nullptr;
  size_t size_ = 0, capacity_ = 0;
  int file_ = -1;
};

template <class T>
class SpillArray {
  static_assert(std::is_trivially_copyable_v<T>);

 public:
  explicit SpillArray(std::shared_ptr<SpillArea> area = nullptr) : bytes_(std::move(area)) {}

  T* data() { return reinterpret_cast<T*>(bytes_.data()); }
  const T* data() const { return reinterpret_cast<const T*>(bytes_.data()); }
  size_t size() const { return bytes_.size() / sizeof(T); }
  std::span<T> span() { return {data(), size()}; }
  std::span<const T> span() const { return {data(), size()}; }
  size_t memory_bytes() const { return bytes_.memory_bytes(); }
  bool in_file() const { return bytes_.in_file(); }

  /// What is new is not set. This and append() throw std::bad_alloc, or Error(kFailed) where a disk is full.
  void resize(size_t count) { bytes_.resize(count * sizeof(T)); }
  void append(const T* values, size_t count) { bytes_.append(values, count * sizeof(T)); }

 private:
  SpillBytes bytes_;
};

}  // namespace lightmill
