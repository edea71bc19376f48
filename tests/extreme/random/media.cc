// Media with closed answers: what slabs absorb and emit, and furnaces.
#include <cmath>

#include "tests/extreme/random/families.h"

namespace lightmill::test {
namespace {

int add_medium(TestScene* s, double sigma_a, double sigma_s, double emission, double g = 0) {
  const auto grey_of = [](double x) {
    const auto v = static_cast<float>(x);
    return Rgb{v, v, v};
  };
  s->scene.media.push_back(
      {"", grey_of(sigma_a), grey_of(sigma_s), grey_of(emission), static_cast<float>(g), {}});
  return static_cast<int>(s->scene.media.size()) - 1;
}

/// A box as one mesh whose faces are cut along either diagonal, the boundary of a medium.
void add_boundary(Draw& d, TestScene* s, const Vec3d& lo, const Vec3d& hi, MediumInterface media) {
  s->triangle({0, 0, 0}, {1, 0, 0}, {0, 1, 0}, s->diffuse(0));
  TriangleMesh mesh;
  for (int i = 0; i < 8; ++i) {
    mesh.positions.push_back({static_cast<float>(i & 1 ? hi.x : lo.x),
                              static_cast<float>(i & 2 ? hi.y : lo.y),
                              static_cast<float>(i & 4 ? hi.z : lo.z)});
  }
  constexpr std::array<std::array<uint32_t, 4>, 6> kFaces{
      {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 4, 6, 2}, {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}}};
  for (const auto& f : kFaces) {
    const size_t k = d.coin() ? 0 : 1;
    mesh.triangles.push_back({f[k], f[k + 1], f[k + 2]});
    mesh.triangles.push_back({f[k], f[k + 2], f[(k + 3) % 4]});
  }
  ShapeDescription& shape = s->scene.shapes.back();
  shape.kind = MeshShape{std::make_shared<TriangleMesh>(std::move(mesh))};
  shape.media = media;
  shape.boundary = true;
}

/// Light along a way: what is left of it, and what was added.
struct Way {
  double left = 1, light = 0;
  void through(double sigma, double emission, double length) {
    const double tau = sigma * length;
    light += left * emission * -std::expm1(-tau);
    left *= std::exp(-tau);
  }
};

/// What a medium absorbs and emits, in float as the scene has it.
struct Absorber {
  double sigma = 0, emission = 0;
  static Absorber draw(Draw& d) {
    const auto sigma = static_cast<float>(d.decades(-4, 0.5));
    const auto emission = static_cast<float>(d.coin() ? 0 : d.decades(-1, 1));
    return {double{sigma}, double{emission}};
  }
  int add_to(TestScene* s) const { return add_medium(s, sigma, 0, emission); }
};

/// Looks up +z from z = -3, at light of 1 behind everything.
void look_through(const Way& way, RandomScene* s) {
  s->test.environment({1, 1, 1});
  s->test.camera({0.1, 0.2, -3}, {0.1, 0.2, 0}, 0.01).film(8, 8);
  s->max_depth = 0;
  s->exact = grey(way.left + way.light);
  s->sight = only_hits(0);
}

}  // namespace

RandomScene slabs(Draw& d) {
  RandomScene s;
  Way way;
  const int count = 1 + d.below(4);
  double z = 0;
  int touching = 0;
  for (int i = 0; i < count; ++i) {
    const Absorber a = Absorber::draw(d);
    const double thick = d.uniform(0.1, 1), wide = d.coin() ? 2 : d.uniform(1, 3);
    const auto from = static_cast<float>(z), to = static_cast<float>(z + thick);
    add_boundary(d, &s.test, {-wide, -wide, from}, {wide, wide, to}, {a.add_to(&s.test), -1});
    way.through(a.sigma, a.emission, double{to} - double{from});
    const bool touches = d.coin();
    touching += touches && i + 1 < count;
    z = touches ? double{to} : double{to} + 0.3;
  }
  look_through(way, &s);
  s.family = "slabs of media";
  s.said = std::to_string(count) + ", " + std::to_string(touching) + " faces shared";
  return s;
}

RandomScene nested_boxes(Draw& d) {
  RandomScene s;
  const Absorber outer = Absorber::draw(d), inner = Absorber::draw(d);
  const int around = outer.add_to(&s.test), within = inner.add_to(&s.test);
  const bool low = d.coin(), high = d.coin();
  const double a = low ? 0 : d.uniform(0.1, 0.4), b = high ? 1 : d.uniform(0.6, 0.9);
  const auto from = static_cast<float>(a), to = static_cast<float>(b);
  const auto add_outer = [&] { add_boundary(d, &s.test, {-2, -2, 0}, {2, 2, 1}, {around, -1}); };
  const auto add_inner = [&] { add_boundary(d, &s.test, {-1, -1, from}, {1, 1, to}, {within, around}); };
  if (d.coin()) {
    add_outer(), add_inner();
  } else {
    add_inner(), add_outer();
  }
  Way way;
  way.through(outer.sigma, outer.emission, double{from});
  way.through(inner.sigma, inner.emission, double{to} - double{from});
  way.through(outer.sigma, outer.emission, 1 - double{to});
  look_through(way, &s);
  s.family = "nested media";
  s.said = std::to_string(int{low} + int{high}) + " faces shared";
  return s;
}

RandomScene furnace_of_media(Draw& d) {
  RandomScene s;
  const int balls = 1 + d.below(2);
  double x = 0;
  for (int i = 0; i < balls; ++i) {
    const double radius = d.uniform(0.3, 0.6);
    s.test.sphere({x, 0, 0}, radius, s.test.diffuse(0));
    ShapeDescription& shape = s.test.scene.shapes.back();
    shape.media = {add_medium(&s.test, 0, d.decades(-2, 0.5), 0, d.uniform(-0.9, 0.9)), -1};
    shape.boundary = true;
    x += 1.3;
  }
  s.test.environment({1, 2, 0.5f}).camera({0.4, 0.9, -3}, {0, 0, 0}, 22).film(16, 16);
  s.max_depth = kUnlimitedDepth;
  s.exact = {1, 2, 0.5};
  s.sight = without_lens(far_light_sight(0, kUnlimitedDepth));
  s.family = "furnace of media";
  s.said = std::to_string(balls) + " balls";
  return s;
}

}  // namespace lightmill::test
