#include "tests/support/test_scene.h"

#include <cmath>

namespace lightmill::test {

Vec3d operator+(const Vec3d& a, const Vec3d& b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Vec3d operator-(const Vec3d& a, const Vec3d& b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Vec3d operator*(const Vec3d& a, double s) { return {a.x * s, a.y * s, a.z * s}; }
double dot(const Vec3d& a, const Vec3d& b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Vec3d normalized(const Vec3d& a) { return a * (1 / length(a)); }

namespace {

Vec3f to_float3(const Vec3d& p) {
  return {static_cast<float>(p.x), static_cast<float>(p.y), static_cast<float>(p.z)};
}

Roughness alpha_roughness(float alpha) {
  Roughness r;
  r.u.value = r.v.value = alpha;
  r.remap = false;
  return r;
}

int add(SceneDescription* scene, MaterialKind kind) {
  MaterialDescription m;
  m.kind = std::move(kind);
  scene->materials.push_back(std::move(m));
  return static_cast<int>(scene->materials.size()) - 1;
}

}  // namespace

TestScene::TestScene() {
  scene.sampling.spp = 16;
  film(8, 8);
}

int TestScene::diffuse(const Rgb& reflectance) { return add(&scene, DiffuseMaterial{{reflectance, -1}}); }

int TestScene::conductor(float r, float alpha) {
  ConductorMaterial m;
  m.reflectance = SpectrumInput{{r, r, r}, -1};
  m.roughness = alpha_roughness(alpha);
  return add(&scene, m);
}

int TestScene::dielectric(float eta, float alpha) {
  return add(&scene, DielectricMaterial{eta, alpha_roughness(alpha)});
}

int TestScene::thin_dielectric(float eta) { return add(&scene, ThinDielectricMaterial{eta}); }

int TestScene::diffuse_transmission(const Rgb& reflectance, const Rgb& transmittance) {
  return add(&scene, DiffuseTransmissionMaterial{{reflectance, -1}, {transmittance, -1}});
}

int TestScene::coated(const Rgb& reflectance, float eta, float alpha) {
  CoatedDiffuseMaterial m;
  m.reflectance = {reflectance, -1};
  m.eta = eta;
  m.roughness = alpha_roughness(alpha);
  return add(&scene, m);
}

int TestScene::mix(int first, int second, float amount) {
  return add(&scene, MixMaterial{{first, second}, {amount, -1}});
}

int TestScene::coated_conductor(const Rgb& reflectance, float eta, float coat_alpha, float metal_alpha) {
  CoatedConductorMaterial m;
  m.conductor.reflectance = SpectrumInput{reflectance, -1};
  m.conductor.roughness = alpha_roughness(metal_alpha);
  m.eta = eta;
  m.coat_roughness = alpha_roughness(coat_alpha);
  return add(&scene, m);
}

ShapeDescription& TestScene::shape(int material, const Emits& emits) {
  ShapeDescription& s = scene.shapes.emplace_back();
  s.material = material;
  s.reverse_orientation = emits.inward;
  if (emits.radiance.r > 0 || emits.radiance.g > 0 || emits.radiance.b > 0) {
    s.area_light = static_cast<int>(scene.area_lights.size());
    AreaLightDescription light;
    light.radiance = emits.radiance;
    light.two_sided = emits.two_sided;
    scene.area_lights.push_back(light);
  }
  return s;
}

TestScene& TestScene::quad(const Vec3d& p, const Vec3d& u, const Vec3d& v, int material, const Emits& emits) {
  TriangleMesh mesh;
  mesh.positions = {to_float3(p), to_float3(p + u), to_float3(p + u + v), to_float3(p + v)};
  mesh.triangles = {{0, 1, 2}, {0, 2, 3}};
  shape(material, emits).kind = MeshShape{std::make_shared<TriangleMesh>(std::move(mesh))};
  return *this;
}

TestScene& TestScene::triangle(const Vec3d& a, const Vec3d& b, const Vec3d& c, int material,
                               const Emits& emits) {
  TriangleMesh mesh;
  mesh.positions = {to_float3(a), to_float3(b), to_float3(c)};
  mesh.triangles = {{0, 1, 2}};
  shape(material, emits).kind = MeshShape{std::make_shared<TriangleMesh>(std::move(mesh))};
  return *this;
}

TestScene& TestScene::box(const Vec3d& lo, const Vec3d& hi, int material, const Emits& emits) {
  const Vec3d d = hi - lo, x{d.x, 0, 0}, y{0, d.y, 0}, z{0, 0, d.z};
  quad(lo, y, x, material, emits).quad(lo + z, x, y, material, emits);
  quad(lo, z, y, material, emits).quad(lo + x, y, z, material, emits);
  return quad(lo, x, z, material, emits).quad(lo + y, z, x, material, emits);
}

TestScene& TestScene::sphere(const Vec3d& center, double radius, int material, const Emits& emits) {
  ShapeDescription& s = shape(material, emits);
  s.kind = SphereShape{static_cast<float>(radius)};
  s.object_to_world.m[0][3] = center.x;
  s.object_to_world.m[1][3] = center.y;
  s.object_to_world.m[2][3] = center.z;
  return *this;
}

TestScene& TestScene::point_light(const Vec3d& position, const Rgb& intensity) {
  scene.lights.push_back({PointLight{intensity, position}, {}});
  return *this;
}

TestScene& TestScene::environment(const Rgb& radiance) {
  scene.lights.push_back({InfiniteLight{radiance}, {}});
  return *this;
}

TestScene& TestScene::camera(const Vec3d& eye, const Vec3d& target, double fov) {
  const Vec3d forward = normalized(target - eye);
  const Vec3d up0 = std::fabs(forward.y) > 0.99 ? Vec3d{0, 0, 1} : Vec3d{0, 1, 0};
  const Vec3d right = normalized(cross(up0, forward)), up = cross(forward, right);
  auto& m = scene.camera.camera_to_world.m;
  const Vec3d columns[4] = {right, up, forward, eye};
  for (size_t j = 0; j < 4; ++j) {
    m[0][j] = columns[j].x;
    m[1][j] = columns[j].y;
    m[2][j] = columns[j].z;
  }
  scene.camera.fov_degrees = fov;
  return *this;
}

TestScene& TestScene::film(int width, int height) {
  scene.film.width = width;
  scene.film.height = height;
  scene.filter = {FilterKind::kBox, 0.5, 0.5, 0.5};
  return *this;
}

TestScene cornell_room() {
  TestScene s;
  const int white = s.diffuse(0.7f), red = s.diffuse(Rgb{0.6f, 0.05f, 0.05f}),
            green = s.diffuse(Rgb{0.1f, 0.5f, 0.1f});
  s.quad({-1, -1, -1}, {0, 0, 2}, {2, 0, 0}, white);  // floor
  s.quad({-1, 1, -1}, {2, 0, 0}, {0, 0, 2}, white);   // ceiling
  s.quad({-1, -1, 1}, {0, 2, 0}, {2, 0, 0}, white).quad({-1, -1, -1}, {2, 0, 0}, {0, 2, 0}, white);
  s.quad({-1, -1, -1}, {0, 2, 0}, {0, 0, 2}, red).quad({1, -1, -1}, {0, 0, 2}, {0, 2, 0}, green);
  s.quad({-0.3, 0.98, 0.0}, {0.6, 0, 0}, {0, 0, 0.6}, s.diffuse(0.0f), {.radiance = {8, 7, 6}});
  s.box({0.1, -1, 0.3}, {0.6, -0.4, 0.8}, white);
  s.camera({0, 0, -0.9}, {0, 0, 1}, 75).film(32, 32);
  return s;
}

Vec3d camera_direction(const SceneDescription& scene, double x, double y) {
  const double w = scene.film.width, h = scene.film.height, frame = w / h;
  const double t = std::tan(scene.camera.fov_degrees * M_PI / 360);
  const double sx = frame > 1 ? frame : 1, sy = frame > 1 ? 1 : 1 / frame;
  const double px = (2 * x / w - 1) * sx * t, py = (1 - 2 * y / h) * sy * t;
  const auto& m = scene.camera.camera_to_world.m;
  return normalized({m[0][0] * px + m[0][1] * py + m[0][2], m[1][0] * px + m[1][1] * py + m[1][2],
                     m[2][0] * px + m[2][1] * py + m[2][2]});
}

Vec3d camera_position(const SceneDescription& scene) {
  const auto& m = scene.camera.camera_to_world.m;
  return {m[0][3], m[1][3], m[2][3]};
}

}  // namespace lightmill::test
