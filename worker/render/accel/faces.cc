#include "worker/render/accel/faces.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>
#include <map>
#include <optional>

namespace lightmill {
namespace {

using Point = std::array<float, 3>;
using Direction = std::array<double, 3>;

Direction minus(const Point& a, const Point& b) {
  return {double{a[0]} - b[0], double{a[1]} - b[1], double{a[2]} - b[2]};
}
Direction cross(const Direction& a, const Direction& b) {
  return {a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]};
}
double dot(const Direction& a, const Direction& b) { return a[0] * b[0] + a[1] * b[1] + a[2] * b[2]; }
Direction direction(const Point& p) { return {p[0], p[1], p[2]}; }

/// The power of two next to the largest entry, as an exponent.
int exponent_of(const Direction& v) {
  const double most = std::max({std::fabs(v[0]), std::fabs(v[1]), std::fabs(v[2])});
  return most > 0 ? std::ilogb(most) : 0;
}
void round_to(float* out, const Direction& v, int exponent) {
  for (size_t i = 0; i < 3; ++i) out[i] = static_cast<float>(std::ldexp(v[i], -exponent));
}

struct Corners {
  std::array<Point, 4> p;
  size_t count = 3;
  int32_t first = 0, second = 0;  // triangles: p[0] p[1] p[2] and p[0] p[2] p[3]
};

/// The quadrangle of triangles `a` and `b`, if they make a convex one in one plane.
std::optional<Corners> quadrangle(const Corners& a, const Corners& b) {
  for (size_t i = 0; i < 3; ++i) {
    for (size_t j = 0; j < 3; ++j) {
      // The edge from p[i] to the next is walked the other way by b, whose opposite corner follows.
      const Point &from = a.p[i], &to = a.p[(i + 1) % 3], &opposite = a.p[(i + 2) % 3];
      if (b.p[j] != to || b.p[(j + 1) % 3] != from) continue;
      const Point& corner = b.p[(j + 2) % 3];
      Corners q{{to, opposite, from, corner}, 4, a.first, b.first};
      Direction side[4];
      for (size_t k = 0; k < 4; ++k) side[k] = minus(q.p[(k + 1) % 4], q.p[k]);
      const Direction normal = cross(side[0], side[1]), other = cross(side[2], side[3]);
      const auto length = [](const Direction& v) { return std::sqrt(dot(v, v)); };
      // To double precision: then both triangles have the same plane in float.
      if (std::fabs(dot(normal, side[2])) > 0x1p-40 * length(normal) * length(side[2])) continue;
      if (!(dot(normal, other) > 0 && dot(normal, cross(side[1], side[2])) > 0 &&
            dot(normal, cross(side[3], side[0])) > 0))
        continue;
      return q;
    }
  }
  return std::nullopt;
}

}  // namespace

FaceTable::FaceTable(const RenderScene& scene) {
  std::vector<Corners> triangles;
  for (int32_t t = 0; t < scene.triangle_count(); ++t) {
    Corners& c = triangles.emplace_back();
    for (size_t k = 0; k < 3; ++k) {
      const float* p =
          &scene.positions[static_cast<size_t>(scene.indices[static_cast<size_t>(t) * 3 + k]) * 3];
      c.p[k] = {p[0], p[1], p[2]};
    }
    c.first = c.second = t;
  }
  std::map<Point, int32_t> numbers;
  const auto corner_number = [&](const Point& p) {
    const auto [known, is_new] = numbers.emplace(p, static_cast<int32_t>(corners.size()));
    if (is_new) corners.push_back({{p[0], p[1], p[2]}});
    return known->second;
  };
  std::vector<bool> taken(triangles.size());
  for (size_t t = 0; t < triangles.size(); ++t) {
    if (taken[t]) continue;
    Corners c = triangles[t];
    for (size_t other = t + 1; other < triangles.size() && c.count == 3; ++other) {
      if (taken[other]) continue;
      if (const auto q = quadrangle(c, triangles[other])) c = *q, taken[other] = true;
    }
    Face& face = faces.emplace_back();
    for (size_t k = 0; k < 4; ++k) face.corner[k] = corner_number(c.p[std::min(k, c.count - 1)]);
    // Distances from the plane are rounded in proportion to the distance from this corner. That is at most
    // twice what the bounds of the ray offsets are in proportion to: the mean of the corners' distances from
    // the origin, weighted by the barycentrics.
    const auto nearest = std::min_element(
        c.p.begin(), c.p.begin() + static_cast<std::ptrdiff_t>(c.count), [](const Point& a, const Point& b) {
          return dot(direction(a), direction(a)) < dot(direction(b), direction(b));
        });
    std::copy(nearest->begin(), nearest->end(), face.at);
    const Direction diagonal = minus(c.p[2], c.p[0]);
    const Direction normal = cross(minus(c.p[1], c.p[0]), diagonal);
    round_to(face.normal, normal, exponent_of(normal));
    // The diagonal's side, towards p[3].
    const Direction across = cross(normal, diagonal);
    const int exponent = exponent_of(across);
    Halves& h = halves.emplace_back();
    round_to(h.across, across, exponent);
    h.offset = c.count == 4 ? static_cast<float>(std::ldexp(dot(across, direction(c.p[0])), -exponent))
                            : std::numeric_limits<float>::infinity();
    h.first = c.first, h.second = c.second;
  }
  // The camera is the origin.
  float reach = 0;
  for (const Corner& c : corners) {
    for (const float x : c.p) reach = std::max(reach, std::abs(x));
  }
  for (Face& face : faces) {
    float extent = 0;
    for (const int32_t k : face.corner) {
      for (int axis = 0; axis < 3; ++axis) {
        const float from = corners[static_cast<size_t>(face.corner[0])].p[axis];
        extent = std::max(extent, std::abs(corners[static_cast<size_t>(k)].p[axis] - from));
      }
    }
    face.tiny = extent < 0x1p-14f * reach;
  }
}

}  // namespace lightmill
