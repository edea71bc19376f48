#include "common/scene/mesh/curve_mesh.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "common/scene/mesh/mesh_check.h"
#include "common/scene/mesh/vec3d_math.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

constexpr double kPi = std::numbers::pi;
constexpr double kMaxTurn = kPi / 12;  // of one chord, along the curve or of a ribbon's normal
constexpr int kMaxChords = 128;        // of one Bezier piece

double dot(const Vec3d& a, const Vec3d& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec3d lerp(const Vec3d& a, const Vec3d& b, double t) { return a + t * (b - a); }
double angle_between(const Vec3d& a, const Vec3d& b) { return std::atan2(length(cross(a, b)), dot(a, b)); }

/// Of unit length, or 0 if there is no direction.
Vec3d unit(const Vec3d& v) {
  const double size = length(v);
  return size > 0 && std::isfinite(size) ? 1 / size * v : Vec3d{};
}
Vec3d any_perpendicular(const Vec3d& t) {
  return unit(std::abs(t.x) > 0.5 ? cross(t, {0, 1, 0}) : cross(t, {1, 0, 0}));
}

struct Sample {
  Vec3d p, tangent;  // tangent: unit
  double u = 0;
  Vec3d normal;  // of a ribbon
};

/// One piece, with de Casteljau's algorithm.
struct Piece {
  const Vec3d* b;
  int degree;

  Sample at(double t) const {
    Vec3d p[4];
    std::copy(b, b + degree + 1, p);
    for (int n = degree; n > 1; --n) {
      for (int i = 0; i < n; ++i) p[i] = lerp(p[i], p[i + 1], t);
    }
    return {lerp(p[0], p[1], t), unit(p[1] - p[0]), 0, {}};
  }
  double polygon_length() const {
    double sum = 0;
    for (int i = 0; i < degree; ++i) sum += length(b[i + 1] - b[i]);
    return sum;
  }
  /// Chords so that each is within `tolerance` of the curve (Wang 1984) and turns little.
  int chords(double tolerance) const {
    double bend = 0, turn = 0;
    for (int i = 0; i + 2 <= degree; ++i) bend = std::max(bend, length(b[i] - 2.0 * b[i + 1] + b[i + 2]));
    constexpr int kProbes = 8;
    Vec3d before = at(0).tangent;
    for (int i = 1; i <= kProbes; ++i) {
      const Vec3d tangent = at(static_cast<double>(i) / kProbes).tangent;
      turn += angle_between(before, tangent);
      before = tangent;
    }
    const double wang = std::sqrt(degree * (degree - 1) / 8.0 * bend / tolerance);
    return static_cast<int>(std::clamp(std::ceil(std::max(wang, turn / kMaxTurn)), 1.0, double{kMaxChords}));
  }
};

Vec3d on_great_circle(const Vec3d& a, const Vec3d& b, double t) {
  const double angle = angle_between(a, b), s = std::sin(angle);
  if (s < 1e-6) return unit(lerp(a, b, t));
  return 1 / s * (std::sin((1 - t) * angle) * a + std::sin(t * angle) * b);
}

/// Where a tangent vanishes (end points that coincide, cusps) the chords' directions stand in.
void mend_tangents(std::vector<Sample>* samples) {
  std::vector<Sample>& s = *samples;
  for (size_t i = 0; i < s.size(); ++i) {
    if (length(s[i].tangent) > 0.5) continue;
    const Vec3d behind = i > 0 ? unit(s[i].p - s[i - 1].p) : Vec3d{};
    const Vec3d ahead = i + 1 < s.size() ? unit(s[i + 1].p - s[i].p) : Vec3d{};
    s[i].tangent = unit(behind + ahead);
    if (length(s[i].tangent) < 0.5) s[i].tangent = length(behind) > 0.5 ? behind : ahead;
    if (length(s[i].tangent) < 0.5) s[i].tangent = i > 0 ? s[i - 1].tangent : Vec3d{0, 0, 1};
  }
}

std::vector<Sample> sample(const BezierChain& chain, double total_length) {
  const double tolerance = std::max(std::max(chain.width0, chain.width1) / 8, total_length / 1000);
  std::vector<Sample> samples;
  const size_t pieces = chain.pieces();
  for (size_t k = 0; k < pieces; ++k) {
    const Piece piece{&chain.points[k * static_cast<size_t>(chain.degree)], chain.degree};
    int n = piece.chords(tolerance);
    if (!chain.normals.empty()) {
      const double turn = angle_between(chain.normals[k], chain.normals[k + 1]);
      n = std::max(n, static_cast<int>(std::ceil(turn / kMaxTurn)));
    }
    for (int i = 0; i <= n; ++i) {
      const double t = static_cast<double>(i) / n;
      Sample at = piece.at(t);
      at.u = (static_cast<double>(k) + t) / static_cast<double>(pieces);
      if (!chain.normals.empty()) at.normal = on_great_circle(chain.normals[k], chain.normals[k + 1], t);
      if (i == 0 && k > 0) {  // a kink between pieces is mitred
        const Vec3d mean = unit(samples.back().tangent + at.tangent);
        if (length(mean) > 0.5) samples.back().tangent = mean;
      } else {
        samples.push_back(at);
      }
    }
  }
  mend_tangents(&samples);
  return samples;
}

void add_vertex(TriangleMesh* mesh, const Vec3d& p, const Vec3d& n, double u, double v) {
  mesh->positions.push_back(to_float(p));
  mesh->normals.push_back(to_float(n));
  mesh->uvs.push_back({static_cast<float>(u), static_cast<float>(v)});
}

/// The rows of `across` + 1 vertices, joined.
void join_rows(TriangleMesh* mesh, uint32_t rows, uint32_t across) {
  for (uint32_t i = 0; i + 1 < rows; ++i) {
    for (uint32_t j = 0; j < across; ++j) {
      const uint32_t a = i * (across + 1) + j, b = a + across + 1;
      mesh->triangles.push_back({a, b, b + 1});
      mesh->triangles.push_back({a, b + 1, a + 1});
    }
  }
  drop_zero_area_triangles(mesh);  // at a tip of width 0
}

TriangleMesh ribbon(const BezierChain& chain, const std::vector<Sample>& samples) {
  TriangleMesh mesh;
  Vec3d side;
  for (const Sample& s : samples) {
    const Vec3d across = unit(cross(s.normal, s.tangent));
    if (length(across) > 0.5) side = across;  // else the normal runs along the curve: as before
    if (length(side) < 0.5) side = any_perpendicular(s.tangent);
    const Vec3d half = (chain.width0 + (chain.width1 - chain.width0) * s.u) / 2 * side;
    const Vec3d n = unit(cross(s.tangent, side));
    add_vertex(&mesh, s.p - half, n, s.u, 0);
    add_vertex(&mesh, s.p + half, n, s.u, 1);
  }
  join_rows(&mesh, static_cast<uint32_t>(samples.size()), 1);
  return mesh;
}

TriangleMesh tube(const BezierChain& chain, const std::vector<Sample>& samples, double total_length) {
  const double slenderness = total_length / std::max(chain.width0, chain.width1);
  const int sides = slenderness > 100 ? 5 : slenderness > 20 ? 9 : 17;
  const double widen = kPi / sides / std::sin(kPi / sides);
  const double slope = (chain.width1 - chain.width0) / 2 / total_length;
  TriangleMesh mesh;
  mesh.tube = true;
  Vec3d r = any_perpendicular(samples.front().tangent);
  for (size_t i = 0; i < samples.size(); ++i) {
    const Sample& s = samples[i];
    if (i > 0) {
      // A frame that does not spin, by two reflections (Wang, Juttler, Zheng & Liu 2008).
      const Sample& last = samples[i - 1];
      const auto reflect = [](const Vec3d& v, const Vec3d& n) {
        const double n2 = dot(n, n);
        return n2 > 0 ? v - 2 * dot(n, v) / n2 * n : v;
      };
      const Vec3d step = s.p - last.p;
      r = reflect(reflect(r, step), s.tangent - reflect(last.tangent, step));
      r = unit(r - dot(r, s.tangent) * s.tangent);
      if (length(r) < 0.5) r = any_perpendicular(s.tangent);
    }
    const Vec3d b = cross(s.tangent, r);
    const double radius = widen * (chain.width0 + (chain.width1 - chain.width0) * s.u) / 2;
    for (int j = 0; j <= sides; ++j) {
      const double angle = j == sides ? 0 : 2 * kPi * j / sides;
      const Vec3d out = std::cos(angle) * r - std::sin(angle) * b;
      add_vertex(&mesh, s.p + radius * out, unit(out - slope * s.tangent), s.u,
                 static_cast<double>(j) / sides);
    }
  }
  join_rows(&mesh, static_cast<uint32_t>(samples.size()), static_cast<uint32_t>(sides));
  return mesh;
}

}  // namespace

BezierChain from_bspline(int degree, const std::vector<Vec3d>& p) {
  BezierChain chain;
  chain.degree = degree;
  for (size_t i = 0; i + static_cast<size_t>(degree) < p.size(); ++i) {
    if (degree == 2) {
      if (i == 0) chain.points.push_back(lerp(p[0], p[1], 0.5));
      chain.points.insert(chain.points.end(), {p[i + 1], lerp(p[i + 1], p[i + 2], 0.5)});
    } else {
      const auto knot = [&](size_t k) { return 1.0 / 6 * (p[k] + 4.0 * p[k + 1] + p[k + 2]); };
      if (i == 0) chain.points.push_back(knot(0));
      chain.points.insert(chain.points.end(), {lerp(p[i + 1], p[i + 2], 1.0 / 3),
                                               lerp(p[i + 1], p[i + 2], 2.0 / 3), knot(i + 1)});
    }
  }
  return chain;
}

TriangleMesh curve_mesh(const BezierChain& chain) {
  double total_length = 0;  // of the control polygon: at least the curve's
  for (size_t k = 0; k < chain.pieces(); ++k)
    total_length +=
        Piece{&chain.points[k * static_cast<size_t>(chain.degree)], chain.degree}.polygon_length();
  if (!(total_length > 0) || !std::isfinite(total_length)) return {};
  const std::vector<Sample> samples = sample(chain, total_length);
  return chain.normals.empty() ? tube(chain, samples, total_length) : ribbon(chain, samples);
}

}  // namespace lightmill
