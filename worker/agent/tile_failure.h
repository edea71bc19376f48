#pragma once
// Why a tile could not be rendered.
#include <exception>
#include <new>
#include <string>

#include "common/base/error.h"
#include "common/farm/farm_types.h"
#include "common/sandbox/sandbox.h"

namespace lightmill::agent {

struct TileFailure {
  std::string text;  // one line; empty: it did not fail
  FailureKind kind = FailureKind::kTile;
};

inline TileFailure failure_of(const std::exception& thrown) {
  TileFailure failure{failure_text(thrown)};
  if (dynamic_cast<const std::bad_alloc*>(&thrown)) failure.kind = FailureKind::kMemory;
  const auto* error = dynamic_cast<const Error*>(&thrown);
  if (error && error->kind() == ErrorKind::kBadScene) failure.kind = FailureKind::kScene;
  return failure;
}

}  // namespace lightmill::agent
