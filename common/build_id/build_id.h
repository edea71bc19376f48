#pragma once
// Which program this is: workers and coordinator must be of one build to share a job.
#include <string>

namespace lightmill {

/// The project's version, e.g. "0.1.0".
std::string project_version();

/// One line that is equal for programs built from the same sources and run on the same C library, e.g.
/// "lightmill 0.1.0 (source a1b2c3d4e5f6) schema 1, Embree 3.13.5, OpenImageIO 2.4.7, Draco 1.5.5,
/// libc 2.36". The digest is over all sources that a partial, its merge or the protocol depends on. Embree
/// and OpenImageIO are those found at configure time, so that a program that links neither gives the same id
/// (an OpenImageIO that runs with another version is refused: common/image/image_library.h); libc is the one
/// that runs, because its math functions pick the bits.
std::string build_id();

}  // namespace lightmill
