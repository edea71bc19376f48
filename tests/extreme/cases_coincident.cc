// Surfaces in one place: media and glass that share faces, decals, shapes listed twice. What is crossed, and
// in which order, is what the bodies say, wherever they are, whatever their triangles, and at any scale.
#include <cmath>

#include "common/scene/transform.h"
#include "tests/extreme/case.h"

namespace lightmill::test {
namespace {

/// A closed box of one mesh. `diagonals`: which way its sides are cut into triangles.
ShapeDescription& mesh_box(TestScene* s, const Vec3d& lo, const Vec3d& hi, int material, int diagonals = 0) {
  TriangleMesh mesh;
  for (int corner = 0; corner < 8; ++corner) {
    const Vec3d p{corner & 1 ? hi.x : lo.x, corner & 2 ? hi.y : lo.y, corner & 4 ? hi.z : lo.z};
    mesh.positions.push_back({static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)});
  }
  const uint32_t sides[6][4] = {{0, 2, 3, 1}, {4, 5, 7, 6}, {0, 4, 6, 2},
                                {1, 3, 7, 5}, {0, 1, 5, 4}, {2, 6, 7, 3}};
  for (const auto& q : sides) {
    const size_t k = diagonals & 1 ? 1 : 0;
    mesh.triangles.push_back({q[k], q[k + 1], q[k + 2]});
    mesh.triangles.push_back({q[k], q[k + 2], q[(k + 3) % 4]});
  }
  ShapeDescription& shape = s->scene.shapes.emplace_back();
  shape.kind = MeshShape{std::make_shared<TriangleMesh>(std::move(mesh))};
  shape.material = material;
  return shape;
}

int absorbing(TestScene* s, float sigma) {
  s->scene.media.push_back({"", {sigma, sigma, sigma}, {0, 0, 0}, {}, 0, {}});
  return static_cast<int>(s->scene.media.size()) - 1;
}
void fill(ShapeDescription* shape, int inside, int outside) {
  shape->media = {inside, outside};
  shape->boundary = true;
}

using Add = std::function<void(TestScene&)>;

/// A parallel view along z, of which `depth` is absorbed on its way to a lamp at z = 6.
Case absorbed(std::string parameter, double depth, Add add) {
  Case c{"media in contact", std::move(parameter), "L exp(-sum of depths)", area_light_sight(0, 0),
         [depth, add = std::move(add)] {
           TestScene s;
           s.quad({-2, -2, 6}, {0, 4, 0}, {4, 0, 0}, s.diffuse(0), {.radiance = {1, 2, 3}});
           add(s);
           s.camera({0, 0, -1}, {0, 0, 1}, 90).film(16, 16);
           s.scene.camera.kind = CameraKind::kOrthographic;
           s.scene.camera.screen_window = std::array<double, 4>{-0.5, 0.5, -0.5, 0.5};
           const double t = std::exp(-depth);
           return Setup{s.scene, 0, {t, 2 * t, 3 * t}, 1e-4};
         }};
  return c;
}

void slabs(TestScene& s, int diagonals, double aside) {
  const int m = absorbing(&s, 0.5f), n = absorbing(&s, 1.5f);
  fill(&mesh_box(&s, {-3, -3, 1}, {3, 3, 2}, -1), m, -1);
  fill(&mesh_box(&s, {-3 + aside, -3 + aside, 2}, {3 + aside, 3 + aside, 3}, -1, diagonals), n, -1);
}
/// One inside another, which it touches from within at z = 1.
void nested(TestScene& s, bool inner_first, int diagonals) {
  const int m = absorbing(&s, 0.5f), n = absorbing(&s, 1.5f);
  const auto inner = [&] { fill(&mesh_box(&s, {-1, -1, 1}, {1, 1, 2}, -1, diagonals), n, m); };
  if (inner_first) inner();
  fill(&mesh_box(&s, {-3, -3, 1}, {3, 3, 3}, -1), m, -1);
  if (!inner_first) inner();
}
std::vector<Case> media() {
  std::vector<Case> cases;
  cases.push_back(absorbed("two slabs", 2, [](TestScene& s) { slabs(s, 0, 0); }));
  cases.push_back(absorbed("two slabs, other diagonals", 2, [](TestScene& s) { slabs(s, 1, 0); }));
  cases.push_back(absorbed("two slabs that overlap in part", 2, [](TestScene& s) { slabs(s, 1, 1.3); }));
  cases.push_back(absorbed("nested, a wall shared", 2, [](TestScene& s) { nested(s, false, 0); }));
  cases.push_back(absorbed("nested, inner first", 2, [](TestScene& s) { nested(s, true, 1); }));
  cases.push_back(absorbed("the slab twice", 0.5, [](TestScene& s) {
    const int m = absorbing(&s, 0.5f);
    for (int i = 0; i < 2; ++i) fill(&mesh_box(&s, {-3, -3, 1}, {3, 3, 2}, -1), m, -1);
  }));
  cases.push_back(absorbed("the slab twice, other diagonals", 0.5, [](TestScene& s) {
    const int m = absorbing(&s, 0.5f);
    for (int i = 0; i < 2; ++i) fill(&mesh_box(&s, {-3, -3, 1}, {3, 3, 2}, -1, i), m, -1);
  }));
  cases.push_back(absorbed("four slabs", 3, [](TestScene& s) {
    for (int i = 0; i < 4; ++i)
      fill(&mesh_box(&s, {-3, -3, 1.0 + i}, {3, 3, 2.0 + i}, -1, i), absorbing(&s, 0.75f), -1);
  }));
  cases.push_back(absorbed("two slabs in one mesh", 1, [](TestScene& s) {
    const int m = absorbing(&s, 0.5f);
    TriangleMesh both;
    for (int i = 0; i < 2; ++i) {
      const MeshShape one = std::get<MeshShape>(mesh_box(&s, {-3, -3, 1.0 + i}, {3, 3, 2.0 + i}, -1, i).kind);
      s.scene.shapes.pop_back();
      const auto base = static_cast<uint32_t>(both.positions.size());
      both.positions.insert(both.positions.end(), one.mesh->positions.begin(), one.mesh->positions.end());
      for (const auto& t : one.mesh->triangles)
        both.triangles.push_back({t[0] + base, t[1] + base, t[2] + base});
    }
    ShapeDescription& shape = s.scene.shapes.emplace_back();
    shape.kind = MeshShape{std::make_shared<TriangleMesh>(both)};
    fill(&shape, m, -1);
  }));
  cases.push_back(absorbed("two slabs of one object", 1, [](TestScene& s) {
    const int m = absorbing(&s, 0.5f);
    fill(&mesh_box(&s, {-3, -3, 1}, {3, 3, 2}, -1), m, -1);
    s.scene.objects.push_back({"o", {s.scene.shapes.back()}});
    s.scene.shapes.pop_back();
    for (const double z : {0.0, 1.0}) s.scene.instances.push_back({0, -1, translation({0, 0, z})});
  }));
  return cases;
}

/// After the camera has been set, the scene is moved as a whole.
Case elsewhere(Case c, const std::string& where, const Transform& by) {
  c.parameter += ", " + where;
  c.build = [build = c.build, by] {
    Setup setup = build();
    for (ShapeDescription& shape : setup.scene.shapes) shape.object_to_world = by * shape.object_to_world;
    setup.scene.camera.camera_to_world = by * setup.scene.camera.camera_to_world;
    return setup;
  };
  return c;
}
/// The same scene `size` times as large.
Case resized(Case c, double size) {
  c = elsewhere(std::move(c), "size " + text(size), scaling({size, size, size}));
  c.build = [build = c.build, size] {
    Setup setup = build();
    for (MediumDescription& m : setup.scene.media) {
      const auto sigma = static_cast<float>(double{m.sigma_a.r} / size);
      m.sigma_a = {sigma, sigma, sigma};
    }
    return setup;
  };
  return c;
}
/// The same by the vertices, which are rounded where they come to lie.
Case shifted(Case c, float by) {
  c.parameter += ", vertices moved by " + text(double{by});
  c.build = [build = c.build, by] {
    Setup setup = build();
    for (ShapeDescription& shape : setup.scene.shapes) {
      if (const auto* of = std::get_if<MeshShape>(&shape.kind)) {
        TriangleMesh mesh = *of->mesh;
        for (Vec3f& p : mesh.positions) p = {p.x + by, p.y + by, p.z + by};
        shape.kind = MeshShape{std::make_shared<TriangleMesh>(std::move(mesh))};
      }
    }
    const double d{by};
    setup.scene.camera.camera_to_world = translation({d, d, d}) * setup.scene.camera.camera_to_world;
    setup.oracle_error = 1e-3;
    return setup;
  };
  return c;
}

/// A ball of diameter 2 on the axis, of which a view of 2e-4 sees the middle.
void narrow_ball(TestScene& s, int inside, int outside) {
  s.sphere({0, 0, 2}, 1, -1);
  fill(&s.scene.shapes.back(), inside, outside);
}

std::vector<Case> spheres() {
  std::vector<Case> cases;
  cases.push_back(absorbed("a ball twice", 2, [](TestScene& s) {
    const int m = absorbing(&s, 1);
    for (int i = 0; i < 2; ++i) narrow_ball(s, m, -1);
  }));
  cases.push_back(absorbed("a ball that fills another", 3, [](TestScene& s) {
    const int m = absorbing(&s, 1), n = absorbing(&s, 1.5f);
    narrow_ball(s, m, -1), narrow_ball(s, n, m);
  }));
  cases.push_back(absorbed("a ball that fills another, listed first", 3, [](TestScene& s) {
    const int m = absorbing(&s, 1), n = absorbing(&s, 1.5f);
    narrow_ball(s, n, m), narrow_ball(s, m, -1);
  }));
  for (Case& c : cases) {
    c.build = [build = c.build] {
      Setup setup = build();
      setup.scene.camera.screen_window = std::array<double, 4>{-1e-4, 1e-4, -1e-4, 1e-4};
      return setup;
    };
    c.sight = without_lens(c.sight);
  }
  return cases;
}

/// Seen through a body of glass that absorbs nothing, in an even sky.
Case invisible(std::string parameter, Add add) {
  return {"glass in contact", std::move(parameter), "L0", specular_sight(), [add = std::move(add)] {
            TestScene s;
            add(s);
            s.environment({2, 1, 0.5}).camera({0.3, 0.7, -4}, {0, 0, 0}, 30).film(16, 16);
            return Setup{s.scene, kUnlimitedDepth, {2, 1, 0.5}, 1e-4};
          }};
}

std::vector<Case> glass() {
  std::vector<Case> cases;
  cases.push_back(invisible("two boxes", [](TestScene& s) {
    const int g = s.dielectric(1.5f, 0);
    mesh_box(&s, {-1, -1, -1}, {0, 1, 1}, g), mesh_box(&s, {0, -1, -1}, {1, 1, 1}, g, 1);
  }));
  cases.push_back(invisible("glass and water", [](TestScene& s) {
    mesh_box(&s, {-1, -1, -1}, {1, 0, 1}, s.dielectric(1.5f, 0));
    mesh_box(&s, {-0.7, 0, -0.7}, {0.7, 1, 0.7}, s.dielectric(1.33f, 0), 1);
  }));
  cases.push_back(invisible("one box twice", [](TestScene& s) {
    const int g = s.dielectric(1.5f, 0);
    mesh_box(&s, {-1, -1, -1}, {1, 1, 1}, g), mesh_box(&s, {-1, -1, -1}, {1, 1, 1}, g);
  }));
  cases.push_back(invisible("one ball twice", [](TestScene& s) {
    const int g = s.dielectric(1.5f, 0);
    s.sphere({0, 0, 0}, 1, g).sphere({0, 0, 0}, 1, g);
  }));
  return cases;
}

/// A wall under an even sky, seen from `side` of it: `rho` is what is in front.
Case in_front(std::string parameter, float rho, double side, Add add) {
  return {"faces in one plane", std::move(parameter), "rho L0", without_lens(far_light_sight(1, 1)),
          [rho, side, add = std::move(add)] {
            TestScene s;
            add(s);
            s.environment({1, 1, 1}).camera({0.1, 0.2, 3 * side}, {0, 0, 0}, 15).film(16, 16);
            return Setup{s.scene, 1, grey(double{rho}), 1e-4};
          }};
}
void wall(TestScene& s, double size, int material, bool turned = false, const Emits& emits = {}) {
  const Vec3d u{2 * size, 0, 0}, v{0, 2 * size, 0};
  s.quad({-size, -size, 0}, turned ? v : u, turned ? u : v, material, emits);
}

std::vector<Case> planes() {
  std::vector<Case> cases;
  for (const double side : {-1.0, 1.0}) {
    for (const bool turned : {false, true}) {
      const std::string from = (side > 0 ? ", from +z" : ", from -z") + std::string(turned ? ", turned" : "");
      cases.push_back(in_front("a decal" + from, 0.8f, side, [turned](TestScene& s) {
        wall(s, 2, s.diffuse(0.2f)), wall(s, 1, s.diffuse(0.8f), turned);
      }));
      cases.push_back(in_front("a decal listed first" + from, 0.8f, side, [turned](TestScene& s) {
        wall(s, 1, s.diffuse(0.8f), turned), wall(s, 2, s.diffuse(0.2f));
      }));
    }
    const std::string from = side > 0 ? ", from +z" : ", from -z";
    cases.push_back(in_front("a wall painted over" + from, 0.8f, side,
                             [](TestScene& s) { wall(s, 2, s.diffuse(0.2f)), wall(s, 2, s.diffuse(0.8f)); }));
    cases.push_back(in_front("a wall twice" + from, 0.8f, side, [](TestScene& s) {
      const int grey = s.diffuse(0.8f);
      wall(s, 2, grey), wall(s, 2, grey);
    }));
  }
  cases.push_back(in_front("a decal on a box", 0.8f, 1, [](TestScene& s) {
    mesh_box(&s, {-2, -2, -1}, {2, 2, 0}, s.diffuse(0.2f)), wall(s, 1, s.diffuse(0.8f));
  }));
  cases.push_back(in_front("a tile set into a box", 0.8f, 1, [](TestScene& s) {
    mesh_box(&s, {-1, -1, -0.1}, {1, 1, 0}, s.diffuse(0.8f), 1);
    mesh_box(&s, {-2, -2, -1}, {2, 2, 0}, s.diffuse(0.2f));
  }));
  return cases;
}

}  // namespace

std::vector<Case> coincident_cases() {
  std::vector<Case> cases;
  for (const auto& family : {media, spheres, glass, planes}) {
    for (Case& c : family()) cases.push_back(std::move(c));
  }
  const Case slabs = media()[2], walls = media()[4], decal = planes()[0];
  const Transform turn = rotation(37, {1, 2, 3}), away = translation({1000.1, -2000.3, 500.7});
  for (const Case& c : {slabs, walls, decal}) {
    cases.push_back(elsewhere(c, "turned", turn));
    cases.push_back(elsewhere(c, "far from the origin", away * turn));
    cases.push_back(shifted(c, 100.1f));
    for (const double size : {1e-6, 1e6}) cases.push_back(resized(c, size));
  }
  return cases;
}

}  // namespace lightmill::test
