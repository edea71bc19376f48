#pragma once
// Distinct identifier types, so that a job can't be passed where a worker is meant.
#include <compare>
#include <cstdint>
#include <functional>
#include <string>

namespace lightmill {

/// Coordinator-issued, never reused, printable ("j7", "w12").
template <class Tag>
struct StringId {
  std::string value;
  auto operator<=>(const StringId&) const = default;  // NOLINT(modernize-use-nullptr): a 0 of its own
  bool empty() const { return value.empty(); }
};
using JobId = StringId<struct JobTag>;
using WorkerId = StringId<struct WorkerTag>;

/// A tile's index within its job, from 0, in lease order.
struct TileId {
  int64_t value = -1;
  auto operator<=>(const TileId&) const = default;  // NOLINT(modernize-use-nullptr): a 0 of its own
};

}  // namespace lightmill

template <class Tag>
struct std::hash<lightmill::StringId<Tag>> {
  size_t operator()(const lightmill::StringId<Tag>& id) const noexcept {
    return std::hash<std::string>{}(id.value);
  }
};
