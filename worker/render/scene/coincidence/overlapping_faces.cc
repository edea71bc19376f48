#include "worker/render/scene/coincidence/overlapping_faces.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <limits>
#include <numeric>
#include <optional>
#include <utility>

#include "common/base/parallel.h"
#include "worker/render/math/lanes.h"
#include "worker/render/scene/coincidence/face_chunks.h"

namespace lightmill {
namespace {

/// Chunks whose partners one thread looks for.
constexpr size_t kBlock = 512;
/// Pairs of triangles that are tested for one chunk, at least.
constexpr size_t kMostTests = size_t{1} << 18;
/// Pairs that may be found for every triangle, and beside these for the whole scene: a wall may have many
/// tiles.
constexpr size_t kPairsOfOne = 8, kMorePairs = size_t{1} << 20;

struct Face {
  FaceCorners p;
  FacePlane plane;
};
/// A triangle that may lie on another one; its plane is found when it is needed.
struct Candidate {
  uint32_t triangle;
  Box box;
  std::optional<Face> face = {};
};

/// Whether two triangles of one plane overlap by more than `margin`: no side of either keeps them apart.
bool overlap(const FaceCorners& p, const FaceCorners& q, const Vec3d& n, double margin) {
  for (const FaceCorners* sides : {&p, &q}) {
    for (size_t k = 0; k < 3; ++k) {
      Vec3d across = cross(n, minus((*sides)[(k + 1) % 3], (*sides)[k]));
      const double size = std::sqrt(along(across, across));
      if (!(size > 0)) return false;
      double lo[2] = {1e300, 1e300}, hi[2] = {-1e300, -1e300};
      for (size_t i = 0; i < 6; ++i) {
        const double at = along(minus(i < 3 ? p[i] : q[i - 3], p[0]), across) / size;
        lo[i / 3] = std::min(lo[i / 3], at), hi[i / 3] = std::max(hi[i / 3], at);
      }
      if (std::min(hi[0] - lo[1], hi[1] - lo[0]) <= margin) return false;
    }
  }
  return true;
}

bool on_each_other(const Face& f, const Face& g, double rounding) {
  const Face &large = f.plane.longest < g.plane.longest ? g : f, &small = &large == &f ? g : f;
  if (std::fabs(along(large.plane.normal, small.plane.normal)) < 0.99) return false;
  const double near = same_within(std::max(f.plane.coordinate, g.plane.coordinate), rounding);
  // Triangles of about this height lie in no plane in particular.
  const auto height = [](const Face& x) { return x.plane.area / x.plane.longest; };
  if (!(std::min(height(f), height(g)) > 16 * near)) return false;
  // The plane of a narrow triangle is less certain away from it.
  const double factor = std::clamp(small.plane.longest / height(large), 1.0, 4.0);
  for (const Vec3d& q : small.p) {
    if (std::fabs(along(minus(q, large.p[0]), large.plane.normal)) > factor * near) return false;
  }
  return overlap(large.p, small.p, large.plane.normal, 4 * near);
}

class Search {
 public:
  Search(const std::vector<PlacedMesh>& meshes, const float* positions)
      : meshes_(meshes), positions_(positions) {}

  std::vector<FacePair> run(int threads) {
    std::vector<std::vector<Chunk>> chunks(meshes_.size());
    parallel_for(meshes_.size(), threads, [&](size_t m) {
      if (meshes_[m].mesh) chunks[m] = face_chunks(meshes_[m], static_cast<uint32_t>(m), positions_);
    });
    size_t count = 0;
    for (const auto& of_mesh : chunks) count += of_mesh.size();
    chunks_.reserve(count);
    uint32_t pieces = 0;
    for (const auto& of_mesh : chunks) {
      for (const Chunk& c : of_mesh) {
        chunks_.push_back(c);
        chunks_.back().piece += pieces;
      }
      if (!of_mesh.empty()) pieces = chunks_.back().piece + 1;
    }
    sort();
    const size_t n = chunks_.size(), blocks = (n + kBlock - 1) / kBlock;
    std::vector<std::vector<FacePair>> found(blocks);
    parallel_for(blocks, threads, [&](size_t b) {
      Block(*this, kMorePairs / blocks, &found[b]).run(b * kBlock, std::min(n, (b + 1) * kBlock));
    });
    std::vector<FacePair> pairs;
    for (const auto& of_block : found) pairs.insert(pairs.end(), of_block.begin(), of_block.end());
    return pairs;
  }

 private:
  /// Along the axis on which boxes are shortest beside all.
  void sort() {
    double extent[3] = {0, 0, 0};
    Box all;
    for (const Chunk& c : chunks_) {
      all.add(c.box);
      for (int i = 0; i < 3; ++i) extent[i] += double{c.box.hi[i]} - c.box.lo[i];
    }
    double least = 1e300;
    for (int i = 0; i < 3; ++i) {
      const double size = double{all.hi[i]} - all.lo[i];
      if (size > 0 && extent[i] / size < least) least = extent[i] / size, axis_ = i;
    }
    std::vector<std::pair<float, uint32_t>> order;
    for (uint32_t i = 0; i < chunks_.size(); ++i) order.emplace_back(chunks_[i].box.lo[axis_], i);
    std::sort(order.begin(), order.end());
    const int y = (axis_ + 1) % 3, z = (axis_ + 2) % 3;
    for (auto* rows : {&start_, &low_[0], &low_[1], &high_[0], &high_[1]}) rows->reserve(order.size());
    for (const auto& [from, i] : order) {
      const Chunk& c = chunks_[i];
      order_.push_back(i);
      start_.push_back(from);
      low_[0].push_back(c.box.lo[y]), high_[0].push_back(c.box.hi[y]);
      low_[1].push_back(c.box.lo[z]), high_[1].push_back(c.box.hi[z]);
    }
    for (auto* rows : {&low_[0], &low_[1], &high_[0], &high_[1]}) rows->resize(order.size() + kWidth<Float8>);
    size_t steps = 0;
    for (size_t i = 0; i < chunks_.size(); ++i) steps += end_of(i) - i;
    const size_t n = chunks_.size();
    if (steps > kMostWork + 512 * n) most_steps_ = kMostWork / n + 512;
  }
  const Chunk& sorted(size_t i) const { return chunks_[order_[i]]; }
  /// Of the chunks that begin before chunk i ends.
  size_t end_of(size_t i) const {
    const auto end =
        std::upper_bound(start_.begin() + static_cast<ptrdiff_t>(i), start_.end(), sorted(i).box.hi[axis_]);
    return static_cast<size_t>(end - start_.begin());
  }

  /// Part of the search.
  class Block {
   public:
    Block(const Search& search, size_t more_pairs, std::vector<FacePair>* pairs)
        : s_(search), pairs_(*pairs), more_left_(more_pairs) {}

    void run(size_t begin, size_t end) {
      for (size_t i = begin; i < end; ++i) {
        const Chunk& a = s_.sorted(i);
        const size_t last = std::min(s_.end_of(i), i + 1 + s_.most_steps_);
        left_ = kMostWork / s_.chunks_.size() + kMostTests;
        pairs_left_ = kPairsOfOne * a.count;
        for (size_t j = i + 1; j < last && may_go_on(); j += kWidth<Float8>) {
          const auto from = [&](int k) { return load<Float8>(&s_.low_[k][j]) <= s_.high_[k][i]; };
          const auto to = [&](int k) { return load<Float8>(&s_.high_[k][j]) >= s_.low_[k][i]; };
          unsigned met = mask_bits(from(0) & to(0) & from(1) & to(1));
          if (last - j < kWidth<Float8>) met &= (1u << (last - j)) - 1;
          for (; met; met &= met - 1) {
            const Chunk& b = s_.sorted(j + static_cast<size_t>(std::countr_zero(met)));
            if (a.piece != b.piece) compare(a, b);
          }
        }
      }
    }

   private:
    bool may_go_on() const { return left_ > 0 && pairs_left_ + more_left_ > 0; }
    /// Triangles of `c` that reach into `into`; returns the box around them.
    Box reach(const Chunk& c, const Box& into, std::vector<Candidate>* out) const {
      out->clear();
      Box around;
      const auto meets = c.parts_in(into);
      for (uint32_t part = 0; part < kParts; ++part) {
        if (!meets[part]) continue;
        for (uint32_t k = part * kPart; k < std::min(c.count, (part + 1) * kPart); ++k) {
          const Box box = face_box(s_.meshes_[c.mesh], s_.positions_, c.first + k);
          if (!box.meets(into)) continue;
          around.add(box);
          out->push_back({c.first + k, box});
        }
      }
      return around;
    }

    void compare(const Chunk& a, const Chunk& b) {
      const float room = a.room + b.room;
      const Box around = reach(a, b.box.grown(a.room), &first_);
      if (first_.empty()) return;
      const double rounding = s_.meshes_[a.mesh].rounding + s_.meshes_[b.mesh].rounding;
      reach(b, around.grown(room), &second_);
      for (Candidate& f : first_) {
        const Box into = f.box.grown(room);
        for (Candidate& g : second_) {
          if (left_ == 0) return;
          --left_;
          if (!g.box.meets(into) || !on_each_other(face(a, &f), face(b, &g), rounding)) continue;
          if (pairs_left_ > 0) {
            --pairs_left_;
          } else if (more_left_ > 0) {
            --more_left_;
          } else {
            return;
          }
          FacePair pair{{a.mesh, f.triangle}, {b.mesh, g.triangle}};
          if (pair.b < pair.a) std::swap(pair.a, pair.b);
          pairs_.push_back(pair);
        }
      }
    }
    const Face& face(const Chunk& of, Candidate* c) const {
      if (!c->face) {
        const FaceCorners p = face_corners(s_.meshes_[of.mesh], s_.positions_, c->triangle);
        c->face = {p, FacePlane(p)};
      }
      return *c->face;
    }

    const Search& s_;
    std::vector<FacePair>& pairs_;
    std::vector<Candidate> first_, second_;
    size_t left_ = 0;                        // comparisons of triangles
    size_t pairs_left_ = 0, more_left_ = 0;  // to be found
  };

  const std::vector<PlacedMesh>& meshes_;
  const float* positions_;
  std::vector<Chunk> chunks_;
  std::vector<uint32_t> order_;  // in which they begin
  int axis_ = 0;
  std::vector<float> start_, low_[2], high_[2];  // along it, and along the other two
  size_t most_steps_ = std::numeric_limits<size_t>::max() / 2;
};

}  // namespace

std::vector<FacePair> overlapping_faces(const std::vector<PlacedMesh>& meshes, const float* positions,
                                        int threads) {
  return Search(meshes, positions).run(threads);
}

}  // namespace lightmill
