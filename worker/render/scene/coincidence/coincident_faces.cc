#include "worker/render/scene/coincidence/coincident_faces.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <optional>
#include <set>
#include <tuple>

#include "worker/render/scene/coincidence/corner_moves.h"
#include "worker/render/scene/coincidence/crossing_order.h"
#include "worker/render/scene/coincidence/mesh_bodies.h"

namespace lightmill {
namespace {

class Separation {
 public:
  Separation(const std::vector<PlacedMesh>& meshes, const std::vector<SurfaceTraits>& traits,
             const float* normals, const CoincidenceSpace& space, float* positions)
      : meshes_(meshes), traits_(traits), normals_(normals), space_(space), positions_(positions) {}

  CoincidentFaces run() {
    pairs_ = overlapping_faces(meshes_, positions_, space_.threads);
    if (pairs_.empty()) return {};
    std::map<uint32_t, bool> touch;  // meshes, and whether they do themselves
    for (const FacePair& p : pairs_) {
      for (const uint32_t m : {p.a.mesh, p.b.mesh}) touch[m] |= p.a.mesh == p.b.mesh;
    }
    bodies_.resize(meshes_.size());
    for (const auto& [m, itself] : touch) bodies_[m].emplace(meshes_[m], positions_, itself);
    std::erase_if(pairs_, [&](const FacePair& p) { return may_stay(p); });
    leave_out_copies();
    collect_faces();
    Groups stacks = stacks_of_faces();
    std::map<size_t, std::vector<size_t>> members, pairs_in;
    for (size_t i = 0; i < faces_.size(); ++i) members[stacks.of(i)].push_back(i);
    for (size_t i = 0; i < pairs_.size(); ++i) pairs_in[stacks.of(index_of(pairs_[i].a))].push_back(i);
    for (const auto& [stack, faces] : members) spread(faces, pairs_in[stack]);
    found_.moved = move_corners(std::move(wishes_), meshes_, bodies_, positions_);
    report();
    return std::move(found_);
  }

 private:
  struct Face {
    FaceId id;
    FaceCorners p;
    FacePlane plane;
    int facing;  // of the winding: 1 if its side is where the face faces
  };
  const Body& body(const FaceId& f) const {
    const MeshBodies& b = *bodies_[f.mesh];
    return b.body(b.body_of(f.triangle));
  }
  FaceCorners corners(const FaceId& f) const { return face_corners(meshes_[f.mesh], positions_, f.triangle); }

  /// As rays see it: 1 if the surface's outside is that of the winding (surface.h).
  int surface_facing(const FaceId& f, const Vec3d& winding) const {
    double sum = 0;
    if (normals_) {
      for (const uint32_t v : meshes_[f.mesh].mesh->triangles[f.triangle]) {
        const float* n = normals_ + 3 * (meshes_[f.mesh].first_vertex + v);
        sum += n[0] * winding.x + n[1] * winding.y + n[2] * winding.z;
      }
    }
    if (sum != 0) return sum < 0 ? -1 : 1;
    return traits_[f.mesh].flipped ? -1 : 1;
  }
  /// Opaque faces are seen from both sides, so what counts is from where they can be seen.
  int facing(const FaceId& f) const {
    const FaceCorners p = corners(f);
    const FacePlane plane(p);
    const SurfaceTraits& t = traits_[f.mesh];
    const Body& b = body(f);
    if (t.passes || t.one_sided) return surface_facing(f, plane.normal);
    if (b.winding_outwards != 0) {
      bool around = space_.has_viewer;
      for (int i = 0; i < 3; ++i) around = around && b.lo[i] < 0 && b.hi[i] > 0;
      return around ? -b.winding_outwards : b.winding_outwards;
    }
    const double viewer = space_.has_viewer ? -along(p[0], plane.normal) : 0;
    if (std::fabs(viewer) > 2 * kSetApart * plane.coordinate) return viewer > 0 ? 1 : -1;
    return surface_facing(f, plane.normal);
  }

  static std::array<std::tuple<double, double, double>, 3> sorted(const FaceCorners& p) {
    std::array<std::tuple<double, double, double>, 3> s;
    for (size_t k = 0; k < 3; ++k) s[k] = {p[k].x, p[k].y, p[k].z};
    std::sort(s.begin(), s.end());
    return s;
  }
  /// Whether the two are opaque bodies that hide each other's faces where these face apart, or such a body
  /// and a thin one, which it hides where it is seen from.
  bool stands_on(const FaceId& f, const FaceId& g) const {
    const auto thin = [&](const FaceId& x) { return body(x).winding_outwards == 0; };
    const auto sets_in = [&](const FaceId& x) {
      const SurfaceTraits& t = traits_[x.mesh];
      return !t.passes && !(thin(x) && t.one_sided);
    };
    return sets_in(f) && sets_in(g) && !(thin(f) && thin(g));
  }
  /// Whether no ray can tell: opaque bodies that touch, or copies of an emitter, of which one is left out
  /// (emitter_copies.h). Notes copies of others.
  bool may_stay(const FacePair& pair) {
    const SurfaceTraits &a = traits_[pair.a.mesh], &b = traits_[pair.b.mesh];
    const FaceCorners p = corners(pair.a), q = corners(pair.b);
    const FacePlane plane(p), other(q);
    const double alike = along(plane.normal, other.normal);
    if (stands_on(pair.a, pair.b) && alike * facing(pair.a) * facing(pair.b) < 0) return true;
    const bool same =
        alike * surface_facing(pair.a, plane.normal) * surface_facing(pair.b, other.normal) > 0 &&
        sorted(p) == sorted(q);
    if (!same) return false;
    if (a.emits || b.emits) return a.emits && b.emits;
    if (a.same_surface(b)) found_.left_out.push_back(pair.b);
    return false;
  }
  void leave_out_copies() {
    std::vector<FaceId>& out = found_.left_out;
    std::sort(out.begin(), out.end());
    out.erase(std::unique(out.begin(), out.end()), out.end());
    for (const FacePair& p : pairs_) note(p);
    const auto gone = [&](const FaceId& f) { return std::binary_search(out.begin(), out.end(), f); };
    std::erase_if(pairs_, [&](const FacePair& p) { return gone(p.a) || gone(p.b); });
  }
  void note(const FacePair& p) {
    touched_.push_back(p.a);
    touched_.push_back(p.b);
  }

  void collect_faces() {
    std::vector<FaceId> ids;
    for (const FacePair& p : pairs_) ids.push_back(p.a), ids.push_back(p.b);
    std::sort(ids.begin(), ids.end());
    ids.erase(std::unique(ids.begin(), ids.end()), ids.end());
    for (const FaceId& id : ids) {
      const FaceCorners p = corners(id);
      faces_.push_back({id, p, FacePlane(p), facing(id)});
    }
  }
  size_t index_of(const FaceId& id) const {
    return static_cast<size_t>(std::lower_bound(faces_.begin(), faces_.end(), id,
                                                [](const Face& f, const FaceId& i) { return f.id < i; }) -
                               faces_.begin());
  }
  /// Faces on each other, and faces of a body that share a corner and a plane, belong together.
  Groups stacks_of_faces() {
    Groups stacks(faces_.size());
    for (const FacePair& p : pairs_) stacks.join(index_of(p.a), index_of(p.b));
    std::vector<std::tuple<uint32_t, uint32_t, size_t>> at;  // mesh, corner, face
    for (size_t i = 0; i < faces_.size(); ++i) {
      const FaceId& f = faces_[i].id;
      for (const uint32_t v : meshes_[f.mesh].mesh->triangles[f.triangle])
        at.emplace_back(f.mesh, bodies_[f.mesh]->corner(v), i);
    }
    std::sort(at.begin(), at.end());
    constexpr size_t kLookBack = 8;
    for (size_t i = 0; i < at.size(); ++i) {
      const auto& [mesh, corner, face] = at[i];
      for (size_t j = i - std::min(i, kLookBack); j < i; ++j) {
        const auto& [other_mesh, other_corner, other] = at[j];
        if (mesh == other_mesh && corner == other_corner &&
            std::fabs(along(faces_[face].plane.normal, faces_[other].plane.normal)) > 1 - 1e-6)
          stacks.join(face, other);
      }
    }
    return stacks;
  }

  /// Says how far the faces of a stack are to be moved.
  void spread(const std::vector<size_t>& faces, const std::vector<size_t>& pairs) {
    const size_t base = *std::max_element(faces.begin(), faces.end(), [&](size_t a, size_t b) {
      return faces_[a].plane.area < faces_[b].plane.area;
    });
    const Vec3d up = faces_[base].plane.normal;
    std::vector<Sheet> sheets;
    std::map<std::tuple<uint32_t, uint32_t, int>, size_t> known;
    std::map<size_t, size_t> sheet_of;
    double coordinate = 0, uneven = 0;
    for (const size_t i : faces) {
      const Face& f = faces_[i];
      const uint32_t number = bodies_[f.id.mesh]->body_of(f.id.triangle);
      const int side = along(up, f.plane.normal) * f.facing < 0 ? -1 : 1;
      const auto [at, is_new] = known.try_emplace({f.id.mesh, number, side}, sheets.size());
      if (is_new) sheets.push_back(sheet(f.id, side, number));
      sheet_of[i] = at->second;
      coordinate = std::max(coordinate, f.plane.coordinate);
      const double rounding = meshes_[f.id.mesh].rounding;
      for (const Vec3d& p : f.p)
        uneven = std::max(uneven, std::min(std::fabs(along(minus(p, faces_[base].p[0]), up)),
                                           4 * same_within(f.plane.coordinate, 2 * rounding)));
    }
    std::vector<std::pair<size_t, size_t>> touching;
    for (const size_t i : pairs) {
      const size_t a = sheet_of[index_of(pairs_[i].a)], b = sheet_of[index_of(pairs_[i].b)];
      if (a != b) touching.emplace_back(std::min(a, b), std::max(a, b));
    }
    std::sort(touching.begin(), touching.end());
    touching.erase(std::unique(touching.begin(), touching.end()), touching.end());
    const std::vector<int> steps = steps_apart(sheets, touching);
    const double step = kSetApart * coordinate + space_.more + 2 * uneven;
    for (const size_t i : faces) {
      const FaceId& f = faces_[i].id;
      for (const uint32_t v : meshes_[f.mesh].mesh->triangles[f.triangle])
        wishes_.push_back({f.mesh, bodies_[f.mesh]->corner(v), base, up, steps[sheet_of[i]] * step});
    }
  }
  Sheet sheet(const FaceId& f, int side, uint32_t number) const {
    const SurfaceTraits& t = traits_[f.mesh];
    const Body& b = body(f);
    return {side, t.passes, b.flat, t.one_sided, t.media, b.size, uint64_t{f.mesh} << 32 | number};
  }

  void report() {
    std::sort(touched_.begin(), touched_.end());
    touched_.erase(std::unique(touched_.begin(), touched_.end()), touched_.end());
    found_.faces = touched_.size();
    for (size_t i = 0; i < touched_.size(); ++i) {
      if (i == 0 || touched_[i].mesh != touched_[i - 1].mesh)
        found_.shapes.push_back(traits_[touched_[i].mesh].location);
    }
  }

  const std::vector<PlacedMesh>& meshes_;
  const std::vector<SurfaceTraits>& traits_;
  const float* normals_;
  const CoincidenceSpace& space_;
  float* positions_;
  std::vector<FacePair> pairs_;
  std::vector<std::optional<MeshBodies>> bodies_;  // of those that have pairs
  std::vector<Face> faces_;
  std::vector<FaceId> touched_;
  std::vector<CornerWish> wishes_;
  CoincidentFaces found_;
};

}  // namespace

CoincidentFaces separate_faces(const std::vector<PlacedMesh>& meshes,
                               const std::vector<SurfaceTraits>& traits, const float* normals,
                               const CoincidenceSpace& space, float* positions) {
  return Separation(meshes, traits, normals, space, positions).run();
}

std::string describe_coincidence(size_t faces, size_t spheres, const std::vector<SourceLocation>& shapes) {
  std::set<std::pair<std::string, int>> lines;
  for (const SourceLocation& at : shapes) lines.emplace(at.file, at.line);
  std::string text = faces > 0 ? std::to_string(faces) + (faces == 1 ? " face" : " faces") : "";
  if (spheres > 0) text += (text.empty() ? "" : " and ") + std::to_string(spheres) + " spheres";
  text += " of " + std::to_string(shapes.size()) + " shapes coincide with others";
  constexpr size_t kMostNamed = 8;
  if (lines.size() > 1) {
    text += " (lines";
    size_t named = 0;
    for (const auto& [file, line] : lines) {
      if (named++ == kMostNamed) break;
      text += (named == 1 ? " " : ", ") + std::to_string(line);
    }
    text += lines.size() > kMostNamed ? ", ...)" : ")";
  }
  return text + "; they are set apart by a few roundoffs, so that they are crossed in one order";
}

}  // namespace lightmill
