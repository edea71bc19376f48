#include "tests/extreme/solids.h"

#include <cmath>
#include <numbers>

namespace lightmill::test {
namespace {

/// Height and radius of the rings of a solid of revolution about z, from top to bottom. Rings of radius 0 are
/// points.
struct Ring {
  double z, radius;
};

/// A mesh through the rings, its outside outwards.
void add_turned(TestScene* s, const std::vector<Ring>& rings, int sides, int material, const Emits& emits) {
  TriangleMesh mesh;
  std::vector<uint32_t> first;
  for (const Ring& ring : rings) {
    first.push_back(static_cast<uint32_t>(mesh.positions.size()));
    for (int j = 0; j < (ring.radius > 0 ? sides : 1); ++j) {
      const double phi = 2 * std::numbers::pi * j / sides;
      mesh.positions.push_back({static_cast<float>(ring.radius * std::cos(phi)),
                                static_cast<float>(ring.radius * std::sin(phi)), static_cast<float>(ring.z)});
    }
  }
  for (size_t i = 0; i + 1 < rings.size(); ++i) {
    const auto at = [&](size_t ring, int side) {
      return rings[ring].radius > 0 ? first[ring] + static_cast<uint32_t>(side % sides) : first[ring];
    };
    for (int j = 0; j < sides; ++j) {
      if (rings[i + 1].radius > 0) mesh.triangles.push_back({at(i, j), at(i + 1, j), at(i + 1, j + 1)});
      if (rings[i].radius > 0) mesh.triangles.push_back({at(i, j), at(i + 1, j + 1), at(i, j + 1)});
    }
  }
  // A triangle of the scene brings the shape and its emission; the mesh takes its place.
  s->triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, material, emits);
  s->scene.shapes.back().kind = MeshShape{std::make_shared<TriangleMesh>(std::move(mesh))};
}

std::vector<Ring> sphere_rings(double top, int rings) {
  std::vector<Ring> all;
  const double from = std::acos(top);
  for (int i = 0; i <= rings; ++i) {
    const double theta = from + (std::numbers::pi - from) * i / rings;
    all.push_back({std::cos(theta), i == rings || theta == 0 ? 0 : std::sin(theta)});
  }
  return all;
}

}  // namespace

const char* solid_name(Solid solid) {
  switch (solid) {
    case Solid::kSphere:
      return "sphere";
    case Solid::kBox:
      return "box";
    case Solid::kBipyramid:
      return "bipyramid";
    case Solid::kBall:
      return "ball of facets";
    case Solid::kCylinder:
      return "cylinder";
    case Solid::kCone:
      break;
  }
  return "cone";
}

double add_solid(TestScene* s, Solid solid, int rings, int material, const Emits& emits) {
  switch (solid) {
    case Solid::kSphere:
      s->sphere({0, 0, 0}, 1, material, emits);
      return 0.9;
    case Solid::kBox:
      s->box({-1, -0.5, -0.25}, {1, 0.5, 0.25}, material, emits);
      return 0.2;
    case Solid::kBipyramid:
      add_turned(s, {{1, 0}, {0, 1}, {-1, 0}}, 3 + rings % 4, material, emits);
      return 0.2;
    case Solid::kBall:
      add_turned(s, sphere_rings(1, rings), 2 * rings, material, emits);
      return 0.5;
    case Solid::kCylinder:
      add_turned(s, {{0.5, 0}, {0.5, 1}, {-0.5, 1}, {-0.5, 0}}, 2 * rings, material, emits);
      return 0.4;
    case Solid::kCone:
      break;
  }
  add_turned(s, {{1, 0}, {-0.5, 1}, {-0.5, 0}}, 2 * rings, material, emits);
  return 0.25;
}

void add_bowl(TestScene* s, double top, int rings, int material, const Emits& emits) {
  add_turned(s, sphere_rings(top, rings), 2 * rings, material, emits);
}

}  // namespace lightmill::test
