#pragma once
// Bytes as a file, without a disk: readers of scenes take paths.
#include <sys/mman.h>
#include <unistd.h>

#include <cstdlib>
#include <string>
#include <string_view>

#include "common/scene/load.h"

namespace lightmill::fuzz {

/// A scene whose every file has the same bytes, under any name with the wanted extension.
class MemoryFile : public FileSource {
 public:
  explicit MemoryFile(std::string_view bytes) : fd_(memfd_create("fuzz", MFD_CLOEXEC)) {
    while (!bytes.empty()) {
      const ssize_t n = write(fd_, bytes.data(), bytes.size());
      if (n <= 0) abort();
      bytes.remove_prefix(static_cast<size_t>(n));
    }
  }
  ~MemoryFile() override { close(fd_); }
  MemoryFile(const MemoryFile&) = delete;
  MemoryFile& operator=(const MemoryFile&) = delete;
  using FileSource::resolve;
  std::string resolve(const std::string&, std::string*) const override {
    return "/proc/self/fd/" + std::to_string(fd_);
  }

 private:
  int fd_;
};

/// What must hold of a load, whatever came in.
inline void check_load(const LoadResult& result) {
  for (const Problem& problem : result.problems) {
    if (format_problem(problem).find('\n') != std::string::npos) abort();
  }
  if (!result.ok()) return;
  const auto materials = static_cast<int>(result.scene.materials.size());
  for (const ShapeDescription& shape : result.scene.shapes) {
    if (shape.material < 0 || shape.material >= materials) abort();
    const auto* const mesh = std::get_if<MeshShape>(&shape.kind);
    if (!mesh) continue;
    for (const auto& triangle : mesh->mesh->triangles) {
      for (const uint32_t vertex : triangle) {
        if (vertex >= mesh->mesh->positions.size()) abort();
      }
    }
    for (const MeshStep& step : mesh->mesh->later) {
      if (step.positions.size() != mesh->mesh->positions.size()) abort();
      if (step.normals.size() != mesh->mesh->normals.size()) abort();
    }
  }
}

}  // namespace lightmill::fuzz
