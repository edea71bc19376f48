#include "worker/render/scene/coincidence/face_chunks.h"

namespace lightmill {
namespace {

/// A mesh of more triangles than this, most of which share no vertex with the next one, is taken as one
/// piece.
constexpr size_t kManyPieces = 4096;

/// Runs of triangles that share no vertex with those outside: the end of each. Coarser than the mesh's parts,
/// as indices are taken as ranges.
std::vector<uint32_t> pieces_of(const TriangleMesh& mesh) {
  struct Run {
    uint32_t end, least, most;
  };
  std::vector<Run> runs;
  uint32_t end = 0;
  for (const auto& t : mesh.triangles) {
    Run run{++end, std::min({t[0], t[1], t[2]}), std::max({t[0], t[1], t[2]})};
    while (!runs.empty() && runs.back().most >= run.least) {
      run.least = std::min(run.least, runs.back().least);
      run.most = std::max(run.most, runs.back().most);
      runs.pop_back();
    }
    runs.push_back(run);
  }
  if (runs.size() > kManyPieces && runs.size() > mesh.triangles.size() / 4) return {end};
  std::vector<uint32_t> ends;
  for (const Run& run : runs) ends.push_back(run.end);
  return ends;
}

}  // namespace

std::vector<Chunk> face_chunks(const PlacedMesh& mesh, uint32_t number, const float* positions) {
  uint32_t first = 0, piece = 0;
  const std::vector<uint32_t> ends = pieces_of(*mesh.mesh);
  std::vector<Chunk> chunks;
  chunks.reserve(ends.size() + mesh.mesh->triangles.size() / kChunk);
  for (const uint32_t end : ends) {
    for (; first < end; first += std::min(kChunk, end - first)) {
      Chunk c{{}, 0, number, first, std::min(kChunk, end - first), piece, {}, {}};
      Box parts[kParts];
      for (uint32_t k = 0; k < c.count; ++k) parts[k / kPart].add(face_box(mesh, positions, first + k));
      for (const Box& part : parts) c.box.add(part);
      c.room = static_cast<float>(2 * same_within(c.box.largest(), mesh.rounding));
      c.box = c.box.grown(c.room);
      if (!(c.box.largest() < HUGE_VALF)) continue;
      for (size_t k = 0; k < kParts; ++k) c.set_part(k, parts[k]);
      chunks.push_back(c);
    }
    ++piece;
  }
  return chunks;
}

}  // namespace lightmill
