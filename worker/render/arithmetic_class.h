#pragma once
// The arithmetic class of this machine: the digest of a small built-in render that exercises every kernel.
#include <string>

namespace lightmill {

/// Equal digests mean equal bits: such machines may share a job. Rendered once per process; takes seconds.
std::string arithmetic_class();

}  // namespace lightmill
