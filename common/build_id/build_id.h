#pragma once
// Which program this is: workers and coordinator must be of one build to share a job.
#include <string>

namespace lightmill {

/// The project's version, e.g. "0.1.0".
std::string project_version();

/// One line that is equal for programs built together and run on the same C library, e.g.
/// "lightmill 0.1.0 (a1b2c3d) schema 1, Embree 3.13.5, OpenImageIO 2.4.7, libc 2.36".
/// Embree and OpenImageIO are those found at configure time, so that a program that links neither gives
/// the same id; libc is the one that runs, because its math functions pick the bits.
std::string build_id();

}  // namespace lightmill
