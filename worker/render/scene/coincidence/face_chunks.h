#pragma once
// Runs of neighbouring triangles of a mesh, and boxes around them: where no boxes meet, no faces do.
#include <algorithm>
#include <array>
#include <cmath>
#include <cstdint>
#include <vector>

#include "worker/render/scene/coincidence/placed_mesh.h"

namespace lightmill {

/// Triangles of a chunk, and of each of its parts.
constexpr uint32_t kParts = 16, kPart = 4, kChunk = kParts * kPart;
struct Box {
  float lo[3] = {HUGE_VALF, HUGE_VALF, HUGE_VALF}, hi[3] = {-HUGE_VALF, -HUGE_VALF, -HUGE_VALF};
  void add(const float* p) {
    for (int i = 0; i < 3; ++i) lo[i] = std::min(lo[i], p[i]), hi[i] = std::max(hi[i], p[i]);
  }
  void add(const Box& b) {
    for (int i = 0; i < 3; ++i) lo[i] = std::min(lo[i], b.lo[i]), hi[i] = std::max(hi[i], b.hi[i]);
  }
  Box grown(float by) const {
    Box b = *this;
    for (int i = 0; i < 3; ++i) b.lo[i] -= by, b.hi[i] += by;
    return b;
  }
  bool meets(const Box& b) const {
    bool meets = true;
    for (int i = 0; i < 3; ++i) meets &= (lo[i] <= b.hi[i]) & (b.lo[i] <= hi[i]);
    return meets;
  }
  float largest() const {
    float most = 0;
    for (int i = 0; i < 3; ++i) most = std::max({most, std::fabs(lo[i]), std::fabs(hi[i])});
    return most;
  }
};

/// Consecutive triangles of one piece, and the box around them with room for rounding.
struct Chunk {
  Box box;
  float room;
  uint32_t mesh, first, count, piece;
  /// The boxes of its parts, with room, in 255ths of its box: a scene has many chunks, and most of them are
  /// looked at in vain.
  uint8_t lo[3][kParts], hi[3][kParts];

  /// Which parts may reach into `into`.
  std::array<uint8_t, kParts> parts_in(const Box& into) const {
    std::array<uint8_t, kParts> meets;
    meets.fill(1);
    for (int i = 0; i < 3; ++i) {
      const float scale = per_step(i);
      const auto step = [&](float x) { return std::clamp((x - box.lo[i]) * scale, 0.0f, 255.0f); };
      const auto from = static_cast<uint8_t>(step(into.lo[i])),
                 to = static_cast<uint8_t>(std::ceil(step(into.hi[i])));
      for (size_t k = 0; k < kParts; ++k) meets[k] &= (lo[i][k] <= to) & (from <= hi[i][k]);
    }
    return meets;
  }
  void set_part(size_t part, const Box& b) {
    for (int i = 0; i < 3; ++i) {
      const float scale = per_step(i);
      const auto step = [&](float x) { return std::clamp((x - box.lo[i]) * scale, 0.0f, 255.0f); };
      lo[i][part] = static_cast<uint8_t>(step(b.lo[i] - room));
      hi[i][part] = static_cast<uint8_t>(std::ceil(step(b.hi[i] + room)));
    }
  }

 private:
  float per_step(int axis) const {
    const float size = box.hi[axis] - box.lo[axis];
    return size > 0 ? 255 / size : 0;
  }
};

/// The box of a triangle.
inline Box face_box(const PlacedMesh& mesh, const float* positions, uint32_t triangle) {
  Box box;
  for (const uint32_t v : mesh.mesh->triangles[triangle]) box.add(positions + 3 * (mesh.first_vertex + v));
  return box;
}

/// The chunks of mesh number `number`, whose pieces are numbered from 0. Those that are not finite are left
/// out.
std::vector<Chunk> face_chunks(const PlacedMesh& mesh, uint32_t number, const float* positions);

}  // namespace lightmill
