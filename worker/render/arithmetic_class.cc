#include "worker/render/arithmetic_class.h"

#include <array>

#include "common/base/digest.h"
#include "common/film/partial.h"
#include "common/scene/measured/measured_table.h"
#include "common/scene/possible_strategies.h"
#include "worker/render/camera/lens_stack.h"
#include "worker/render/guiding/photon_guide.h"
#include "worker/render/light/light_sampling.h"
#include "worker/render/renderer.h"
#include "worker/render/scene/geometry/instancing.h"
#include "worker/render/scene/textures/graph/every_operation.h"

namespace lightmill {
namespace {

ShapeDescription quad(Vec3f a, Vec3f b, Vec3f c, Vec3f d, int material, int light = -1) {
  auto mesh = std::make_shared<TriangleMesh>();
  mesh->positions = {a, b, c, d};
  mesh->normals = {{0.1f, 0.2f, 1}, {-0.1f, 0.3f, 1}, {0.2f, -0.1f, 1}, {0, 0, 1}};
  mesh->uvs = {{0, 0}, {1, 0}, {1, 1}, {0, 1}};
  mesh->triangles = {{0, 1, 2}, {0, 2, 3}};
  if (light >= 0) mesh->normals.clear();
  ShapeDescription s;
  s.kind = MeshShape{mesh};
  s.material = material;
  s.area_light = light;
  return s;
}

ShapeDescription sphere(double x, double y, double z, float radius, int material, int light = -1) {
  ShapeDescription s;
  s.kind = SphereShape{radius};
  s.object_to_world.m[0][3] = x;
  s.object_to_world.m[1][3] = y;
  s.object_to_world.m[2][3] = z;
  s.material = material;
  s.area_light = light;
  return s;
}

/// A wavy ribbon and a ball on it, large enough that instances share them.
ObjectDescription ribbon_with_ball() {
  constexpr uint32_t kQuads = kSmallObject / 2 + 1;
  auto mesh = std::make_shared<TriangleMesh>();
  for (uint32_t i = 0; i <= kQuads; ++i) {
    const float x = static_cast<float>(i) / kQuads, z = static_cast<float>(i * i % 17) / 100;
    for (const float y : {0.0f, 0.3f}) {
      mesh->positions.push_back({x, y, z});
      mesh->normals.push_back({z, y, 1});
      mesh->uvs.push_back({x, y});
    }
    if (i < kQuads) {
      mesh->triangles.push_back({2 * i, 2 * i + 2, 2 * i + 3});
      mesh->triangles.push_back({2 * i, 2 * i + 3, 2 * i + 1});
    }
  }
  ShapeDescription ribbon;
  ribbon.kind = MeshShape{mesh};
  ribbon.material = 0;
  ribbon.alpha.texture = 0;
  return {"ribbon", {ribbon, sphere(0.5, 0.5, 0.1, 0.2f, 4)}};
}

/// Tables of a measured BRDF, from one azimuth or around: of no matter, but every value counts.
MeasuredMaterial measured(const std::vector<float>& phi) {
  const auto grid = [](int slices, int nodes, int channels) {
    MeasuredGrid g{nodes, nodes, channels, {}};
    for (int i = 0; i < slices * nodes * nodes * channels; ++i)
      g.values.push_back(0.2f + 0.05f * static_cast<float>(i * 7 % 11));
    return g;
  };
  const int views = static_cast<int>(phi.size()) * 3;
  auto table = std::make_shared<MeasuredTable>();
  table->phi = phi;
  table->theta = {0, 0.5f, 1.4f};
  table->ndf = grid(1, 3, 1);
  table->sigma = grid(1, 3, 1);
  table->visible = grid(views, 5, 1);
  table->luminance = grid(views, 4, 1);
  table->rgb = grid(views, 4, 3);
  return {table};
}

/// A guide of two cells, of which one sees little of the sky in `lights`' first image.
void add_guide(LightTable* lights) {
  BinnedDensity& bins = lights->environments[0].bins = BinnedDensity(lights->environments[0].weights());
  std::vector<LightMoments> tables(2);
  for (size_t k = 0; k < tables.size(); ++k) {
    for (int i = 0; i < lights->count(); ++i) tables[k].light.push_back(i % 3);
    tables[k].sky.emplace_back();
    for (int b = 0; b < bins.count(); ++b) tables[k].sky[0].push_back(b % (k == 0 ? 2 : 7) == 1);
  }
  LightGrid grid;
  grid.origin = {-0.9f, 0, 0};
  grid.per_unit = {1, 1, 1};
  grid.cells = {2, 1, 1};
  guide_lights(grid, {0, 1}, tables, {0}, lights);
}

void hash_lanes(const Float8& x, Sha256* all) {
  float out[8];
  store(out, x);
  all->update(std::string(reinterpret_cast<const char*>(out), sizeof out));
}

/// Samples, in both directions, of lights that shine by images and of a lamp with an emission guide: in
/// memory, as a worker has no files of its own.
void hash_imaged_lights(Sha256* all) {
  LightImage image{"", 4, 4, {}};
  for (int i = 0; i < 48; ++i) image.rgb.push_back(static_cast<float>(i * 7 % 11));
  LightTable lights;
  lights.environments.emplace_back(image, Rgb{1, 2, 3}, Transform{});
  lights.goniometers.emplace_back(image, Rgb{3, 1, 2}, Transform{});
  lights.projectors.emplace_back(image, Rgb{2, 2, 1}, Transform{}, 50);
  for (const LightType type : {kInfiniteLight, kGoniometricLight, kProjectionLight}) {
    std::array<float, kLightFloats> record{};
    record[2] = -0.5f;
    record[3] = 1;
    record[kLightArea] = 1;
    lights.add(type, record, 1);
  }
  // The same sky behind a portal, too.
  const float center[3] = {0, 0, -0.5f};
  lights.portals.push_back(make_portal({{{-1, -1, 1}, {-1, 1, 1}, {1, 1, 1.5}, {1, -1, 1.5}}}, center, 1));
  std::array<float, kLightFloats> behind{};
  behind[2] = -0.5f;
  behind[3] = behind[6] = behind[kLightArea] = 1;
  lights.add(kInfiniteLight, behind, 1);
  // A lamp with an emission guide.
  std::array<float, kLightFloats> lamp{};
  lamp[kLightE1] = lamp[kLightE2 + 1] = lamp[kLightN + 2] = 1;
  lamp[kLightRadiance] = lamp[kLightRadiance + 1] = lamp[kLightRadiance + 2] = 2;
  lamp[kLightArea] = 0.5f;
  lights.add(kTriangleLight, lamp, 1);
  lights.finish();
  lights.emission_guide = BinnedDensity(std::vector<double>(16, 1), 4);
  lights.emission_guide.add_table({1, 2, 3, 1, 2, 5, 1, 3, 1, 2, 8, 1, 1, 4, 1, 2});
  lights.emission_guide_of = {-1, -1, -1, -1, 0};
  for (int i = 0; i < 128; ++i) {
    // The second half by a guide.
    if (i == 64) add_guide(&lights);
    const auto u = [&](int k) {
      return to_float((lane_index<Float8>() * 641 + i * 97 + k * 193) & 1023) * 0x1p-10f;
    };
    const auto e = sample_emission<Float8>(lights, u(0), u(1), u(2), u(3), u(4), u(5));
    const Vec3<Float8> at{u(6) - 0.5f, u(7) - 0.5f, u(8)};
    const auto d = sample_direct<Float8>(lights, at, u(0), u(1), u(2), u(3));
    for (const Float8& x :
         {e.direction.x, e.direction.y, e.power.x, e.pdf, d.wi.z, d.radiance.x, d.pdf, d.pdf_emission})
      hash_lanes(x, all);
  }
}

/// Directions that a photon guide draws, and their densities.
void hash_photon_guide(Sha256* all) {
  std::vector<Photon> photons;
  for (int i = 0; i < 1024; ++i) {
    const auto at = [&](int k) { return static_cast<float>((i * k) % 127) * 0x1p-7f; };
    const Vec3<float> w = normalize(Vec3<float>{at(7) - 0.5f, 0.3f * at(11) - 0.2f, 0.5f});
    photons.push_back({{at(3), at(5), 0},
                       {w.x, w.y, w.z},
                       {at(2), at(9), 0, -at(17), at(4), 0, 0, 0, 0},
                       0.1f + at(13),
                       -1,
                       {}});
  }
  const PhotonGuide guide = make_photon_guide(photons);
  for (int i = 0; i < 64; ++i) {
    const auto u = [&](int k) {
      return to_float((lane_index<Float8>() * 641 + i * 97 + k * 193) & 1023) * 0x1p-10f;
    };
    const PhotonGuideTables<Float8> tables(guide, splat_mask<Float8>(true), splat_int<Float8>(kDiffuse),
                                           {u(0), u(1), Float8{}});
    if (!any(tables.mask)) continue;
    const Vec3<Float8> w = tables.draw(u(2), u(3));
    for (const Float8& x : {w.x, w.y, w.z, tables.density(w)})
      hash_lanes(select(tables.mask, x, Float8{}), all);
  }
}

/// Rays through lenses: files that would describe them are not at hand.
void hash_lenses(Sha256* all) {
  LensSystem lens;
  lens.elements = {{50, 6, 1.6, 30}, {-50, 4, 1, 30}, {0, 4, 0, 20}, {-90, 2, 1.7, 24}, {90, 3, 1, 24}};
  lens.aperture_diameter = 15;
  const LensStack stack = build_lenses(lens);
  for (int i = 0; i < 16; ++i) {
    const auto at = [&](int k) {
      return to_float((lane_index<Float8>() * 37 + i * 11 + k * 53) & 63) * 2e-4f;
    };
    Vec3<Float8> o{at(0), at(1), Float8{}}, d{at(2), at(3), splat<Float8>(0.05f)};
    const Float8 weight = trace_lenses<Float8>(stack, &o, &d, splat_mask<Float8>(true));
    for (const Float8& x : {weight, o.x, d.x, d.y, d.z})
      hash_lanes(select(Int8(weight > 0.0f), x, Float8{}), all);
  }
}

/// A small scene with every BSDF kind, every light type, textures, alpha, bumps, smooth normals, spheres and
/// instances.
SceneDescription every_kernel() {
  SceneDescription scene;
  scene.camera.fov_degrees = 70;
  scene.filter = {FilterKind::kGaussian, 1.5, 1.5, 0.5};
  CheckerboardTexture board{{{0.8f, 0.3f, 0.2f}, -1}, {{0.2f, 0.4f, 0.7f}, -1}, {4, 4, 0, 0}};
  scene.textures.push_back({"board", true, board, {}});
  auto add = [&](MaterialKind kind) { scene.materials.push_back({"", std::move(kind), {}}); };
  const auto rough = [](float r) { return Roughness{{r, -1}, {r, -1}, false}; };
  add(DiffuseMaterial{{{0.5f, 0.5f, 0.5f}, 0}});
  add(ConductorMaterial{{{0.2f, 0.92f, 1.1f}, -1}, {{3.9f, 2.45f, 2.14f}, -1}, {}, rough(0.2f)});
  add(ConductorMaterial{{{0.2f, 0.92f, 1.1f}, -1}, {{3.9f, 2.45f, 2.14f}, -1}, {}, rough(0)});
  add(DielectricMaterial{1.5f, rough(0)});
  add(DielectricMaterial{1.3f, rough(0.3f)});
  add(CoatedDiffuseMaterial{{{0.7f, 0.4f, 0.1f}, -1}, 1.5f, rough(0)});
  add(CoatedDiffuseMaterial{{{0.1f, 0.4f, 0.7f}, -1}, 1.5f, rough(0.2f)});
  add(ThinDielectricMaterial{1.5f});
  add(DiffuseTransmissionMaterial{{{0.5f, 0.3f, 0.2f}, -1}, {{0.2f, 0.5f, 0.6f}, -1}});
  scene.materials[0].normal_map = 0;
  scene.materials[1].displacement = 0;
  const ConductorMaterial metal{{{0.2f, 0.92f, 1.1f}, -1}, {{3.9f, 2.45f, 2.14f}, -1}, {}, rough(0.2f)};
  ConductorMaterial polished = metal;
  polished.roughness = rough(0);
  add(CoatedConductorMaterial{polished, 1.5f, rough(0)});
  // Those over a rough metal are alike in what their tables are made for, which takes most of the time here.
  add(CoatedConductorMaterial{metal, 1.5f, rough(0), 0.5f});
  add(CoatedConductorMaterial{metal, 1.4f, rough(0.3f), 0.5f});
  const CoatMediumDescription milky{{0.9f, 0.6f, 0.3f}, 0.4f};
  add(CoatedDiffuseMaterial{{{0.7f, 0.4f, 0.1f}, -1}, 1.5f, rough(0), 0.5f, 10, milky});
  add(CoatedDiffuseMaterial{{{0.7f, 0.4f, 0.1f}, -1}, 1.5f, rough(0.2f), 0.5f, 10, milky});
  add(CoatedConductorMaterial{metal, 1.5f, rough(0), 0.5f, 10, milky});
  add(CoatedConductorMaterial{metal, 1.4f, rough(0.3f), 0.5f, 10, milky});
  CoatedConductorMaterial lying{metal, 1.4f, rough(0.3f), 0.5f};
  lying.conductor.roughness = {{0.4f, -1}, {0.1f, -1}, false};  // of mean 0.2
  add(lying);
  lying.eta = 1.5f;
  lying.coat_roughness = rough(0);
  add(lying);
  add(CoatedDiffuseMaterial{{{0.7f, 0.4f, 0.1f}, -1}, 1.5f, lying.conductor.roughness});
  add(MixMaterial{{1, 6}, {0.4f, -1}});
  ConductorMaterial brushed = metal;
  brushed.roughness = {{0.3f, -1}, {0.05f, -1}, false};
  add(brushed);
  add(DielectricMaterial{1.5f, brushed.roughness});
  MetallicRoughnessMaterial metallic;
  metallic.base_color = {{0.8f, 0.6f, 0.3f}, -1};
  metallic.metallic.value = 0.4f;
  metallic.roughness.value = 0.5f;
  add(metallic);
  metallic.clearcoat = {0.7f, -1};
  metallic.base_color.texture = 0;
  add(metallic);
  metallic.sheen_color = {{0.5f, 0.4f, 0.3f}, -1};
  metallic.sheen_roughness = {0.4f, -1};
  add(metallic);
  metallic.iridescence.value = 0.8f;
  add(metallic);
  metallic.iridescence.value = 0;
  metallic.sheen_color.value = {};
  metallic.translucence.value = 0.6f;
  add(metallic);
  metallic.translucence.value = 0;
  metallic.anisotropy = 0.6f;
  metallic.anisotropy_rotation = 0.2f;
  add(metallic);
  for (const bool thin : {true, false}) {
    add(TransmissionMaterial{{{0.5f, 0.9f, 0.6f}, -1}, {0, -1}, 1.5f, thin});
    add(TransmissionMaterial{{{0.5f, 0.9f, 0.6f}, -1}, {0.6f, -1}, 1.5f, thin});
  }
  add(measured({0}));
  add(measured({-3.1415927f, 0, 3.1415927f}));
  const int blenders = static_cast<int>(scene.materials.size());
  PrincipledMaterial principled;
  principled.base_color = {{0.8f, 0.6f, 0.3f}, 0};
  principled.metallic.value = 0.3f;
  principled.sheen.value = principled.clearcoat.value = 0.5f;
  add(principled);
  principled.anisotropic.value = 0.6f;
  add(principled);
  principled.part = PrincipledMaterial::Part::kGlass;
  add(principled);
  for (const auto closure : {ClosureKind::kDiffuse, ClosureKind::kGlossy, ClosureKind::kGlass,
                             ClosureKind::kRefraction, ClosureKind::kVelvet, ClosureKind::kToon}) {
    ClosureMaterial m;
    m.closure = closure;
    m.roughness.value = 0.5f;
    for (const FacetShape facets :
         {FacetShape::kAshikhminShirley, FacetShape::kBeckmann, FacetShape::kSharp}) {
      const bool glass = closure == ClosureKind::kGlass || closure == ClosureKind::kRefraction;
      if (facets != FacetShape::kBeckmann && closure != ClosureKind::kGlossy && !glass) continue;
      if (glass && facets == FacetShape::kAshikhminShirley) continue;
      m.facets = facets;
      add(m);
    }
  }
  MixMaterial sum;
  sum.materials = {blenders, blenders + 2};
  sum.rule = MixRule::kAddShader;
  add(sum);
  scene.area_lights.push_back({{9, 8, 7}, false, {}});
  scene.area_lights.push_back({{20, 30, 40}, true, {}});
  scene.area_lights.push_back({{4, 3, 2}, false, {}, 0});
  scene.shapes.push_back(quad({-3, -2, 6}, {3, -2, 6}, {3, 2, 6}, {-3, 2, 6}, 0));
  scene.shapes.push_back(quad({-3, -2, 0}, {3, -2, 0}, {3, -2, 6}, {-3, -2, 6}, 6));
  scene.shapes.push_back(quad({-1, 2, 3}, {1, 2, 3}, {1, 2, 5}, {-1, 2, 5}, 0, 0));
  scene.shapes.push_back(sphere(2.4, 1.2, 4, 0.2f, 0, 1));
  scene.shapes.push_back(sphere(-2.4, 1.2, 4, 0.2f, 0, 2));
  scene.shapes.push_back(quad({-2, 2, 3}, {-1.2f, 2, 3}, {-1.2f, 2, 4}, {-2, 2, 4}, 0, 2));
  scene.shapes.back().alpha.texture = 0;
  scene.shapes.push_back(sphere(0, 1.5, 1, 0.2f, 0, 1));
  scene.shapes.back().alpha.value = 0;
  const int materials = static_cast<int>(scene.materials.size());
  for (int i = 1; i < blenders; ++i)
    scene.shapes.push_back(sphere(-3.0 + i * 0.5, -0.8 + 0.15 * i, 4.0, 0.3f, i));
  for (int i = blenders; i < materials; ++i)
    scene.shapes.push_back(sphere(-2.0 + (i - blenders) * 0.25, -1.4, 3.5, 0.12f, i));
  ShapeDescription veil =
      quad({-0.5f, -1, 2.5f}, {1.5f, -1, 2.5f}, {1.5f, 0.5f, 2.5f}, {-0.5f, 0.5f, 2.5f}, 0);
  veil.alpha.texture = 0;
  scene.shapes.push_back(veil);
  scene.objects.push_back(ribbon_with_ball());
  for (int i = 0; i < 3; ++i) {
    // A turn by an angle of rational sine and cosine; the second is mirrored.
    InstanceDescription& instance = scene.instances.emplace_back();
    instance.object = 0;
    const double mirror = i == 1 ? -1 : 1;
    instance.object_to_world.m = {{{0.6, -0.8 * mirror, 0, -1.5 + i},
                                   {0.8, 0.6 * mirror, 0, -0.5},
                                   {0, 0, 1, 2 + 0.3 * i},
                                   {0, 0, 0, 1}}};
  }
  scene.lights.push_back({PointLight{{3, 3, 3}, {-2, 1, 2}}, {}});
  scene.lights.push_back({InfiniteLight{{0.1f, 0.2f, 0.3f}}, {}});
  scene.lights.push_back({DistantLight{{0.4f, 0.3f, 0.2f}, {0, -0.6, 0.8}}, {}});
  scene.lights.push_back({SpotLight{{5, 6, 7}, {1, 1.5, 1}, {0, -0.6, 0.8}, 20, 35}, {}});
  scene.lights.push_back({DistantLight{{0.2f, 0.3f, 0.4f}, {0.6, -0.8, 0}, 4}, {}});
  // Enough lights for a light tree.
  for (int i = 0; i < 24; ++i)
    scene.lights.push_back({PointLight{{0.2f, 0.1f, 0.1f}, {-2 + 0.17 * i, 1.6, 2.0 + (i * 7) % 5}}, {}});
  return scene;
}

/// Nothing but diffuse surfaces, for which there are kernels of their own.
SceneDescription diffuse_balls() {
  SceneDescription scene;
  scene.camera.fov_degrees = 70;
  scene.materials.push_back({"", DiffuseMaterial{{{0.7f, 0.5f, 0.3f}, -1}}, {}});
  scene.area_lights.push_back({{9, 8, 7}, false, {}});
  scene.shapes = {sphere(0, -52, 4, 50, 0), sphere(0.5, -1, 4, 1, 0), sphere(-1.5, -1, 3, 0.7f, 0),
                  quad({-1, 2, 3}, {1, 2, 3}, {1, 2, 5}, {-1, 2, 5}, 0, 0)};
  return scene;
}

/// A density over a lattice of a few bricks, of which one is dense.
std::shared_ptr<const MediumGrid> uneven_grid() {
  auto density = std::make_shared<VolumeField>();
  density->nx = 9, density->ny = 3, density->nz = 5;
  density->lo = {-0.2, -0.5, 1.6}, density->hi = {1, 0.7, 2.8};
  for (int i = 0; i < 9 * 3 * 5; ++i) density->values.push_back(static_cast<float>(i % 7) * 0.25f);
  density->values.back() = 100;
  auto grid = std::make_shared<MediumGrid>();
  grid->lo = density->lo, grid->hi = density->hi;
  grid->density = std::move(density);
  return grid;
}

/// Everything in a coloured fog, and a cloud that glows behind a boundary.
void fill_with_media(SceneDescription* scene) {
  scene->media = {{"", {0.02f, 0.05f, 0.1f}, {0.1f, 0.05f, 0.02f}, {}, 0.6f, {}},
                  {"", {0.5f, 0.2f, 0.1f}, {2, 3, 1}, {0.1f, 0.1f, 0.2f}, -0.3f, {}, uneven_grid()}};
  for (ShapeDescription& shape : scene->shapes) shape.media = {0, 0};
  for (LightDescription& light : scene->lights) light.medium = 0;
  scene->camera.medium = 0;
  ShapeDescription cloud = sphere(0.4, 0.1, 2.2, 0.5f, 0);
  cloud.media = {1, 0};
  cloud.boundary = true;
  scene->shapes.push_back(cloud);
}

/// The mesh, bent in two steps.
MeshShape bending(const TriangleMesh& mesh) {
  TriangleMesh out = mesh;
  for (const float by : {0.1f, 0.15f}) {
    MeshStep& step = out.later.emplace_back(MeshStep{mesh.positions, mesh.normals});
    for (size_t i = 0; i < step.positions.size(); i += 2) step.positions[i].y += by;
  }
  return {std::make_shared<const TriangleMesh>(std::move(out))};
}

/// An instance that turns, a veil that passes and bends, and a camera that moves and turns.
void set_moving(SceneDescription* scene) {
  Transform turn;  // by an angle of rational sine and cosine
  turn.m = {{{0.8, 0, 0.6, 0.3}, {0, 1, 0, -0.1}, {-0.6, 0, 0.8, 1}, {0, 0, 0, 1}}};
  scene->later = {turn, scene->shapes.back().object_to_world, scene->camera.camera_to_world};
  scene->instances.front().moves_to = 0;
  scene->later[1].m[0][3] -= 0.7;
  scene->shapes.back().moves_to = 1;
  scene->shapes.back().kind = bending(*std::get<MeshShape>(scene->shapes.back().kind).mesh);
  scene->later[2].m = {{{0.96, 0, 0.28, 0.1}, {0, 1, 0, 0}, {-0.28, 0, 0.96, 0}, {0, 0, 0, 1}}};
  scene->camera.moves_to = 2;
}

/// Layered materials are plain ones: their tables, which take longer to make than all else here, are only
/// made for what is to render them.
SceneDescription without_layers(SceneDescription scene) {
  for (MaterialDescription& material : scene.materials) {
    if (std::holds_alternative<CoatedDiffuseMaterial>(material.kind) ||
        std::holds_alternative<CoatedConductorMaterial>(material.kind)) {
      material.kind = DiffuseMaterial{{{0.5f, 0.5f, 0.5f}, -1}};
    }
  }
  return scene;
}

}  // namespace

std::string arithmetic_class() {
  static const std::string digest = [] {
    RenderSettings settings;
    settings.grid = {64, 32, {0, 0, 64, 32}};
    settings.spp = 2;
    settings.max_depth = 12;
    settings.energy_compensation = true;
    settings.seed = 1;
    const TileSpec tile{{0, 0, 2, 1}, 0, 2};
    SceneDescription scene = every_kernel();
    CameraDescription thin_lens = scene.camera, orthographic = scene.camera, spherical = scene.camera;
    thin_lens.lens_radius = 0.1;
    thin_lens.focal_distance = 4;
    orthographic.kind = CameraKind::kOrthographic;
    CameraDescription parallel_lens = thin_lens;
    parallel_lens.kind = CameraKind::kOrthographic;
    spherical.kind = CameraKind::kSpherical;
    Sha256 all;
    const auto hash_render = [&](const SceneDescription& description) {
      settings.plan = SamplingPlan{.strategies = possible_strategies(description).set};
      const Renderer renderer(description, settings, 1);
      PartialBuilder builder(settings.grid, tile, renderer.quantum_exponent(), true, true);
      const auto workspace = renderer.make_workspace();
      for (int x = 0; x < 2; ++x) {
        for (int64_t s = 0; s < 2; ++s) renderer.render_packet({x, 0, s, s + 1}, *workspace, builder);
      }
      all.update(partial_digest(builder.take()));
    };
    hash_render(scene);
    SceneDescription plain = without_layers(scene);
    for (const CameraDescription& camera : {thin_lens, orthographic, parallel_lens, spherical}) {
      plain.camera = camera;
      hash_render(plain);
    }
    // Hair, which leaves light paths out.
    SceneDescription fur = plain;
    fur.materials.back().kind = HairMaterial{};
    hash_render(fur);
    // Bodies that light walks through, in fog and without.
    SceneDescription wax = plain;
    SubsurfaceMaterial smooth, rough;
    smooth.sigma_a = {0.2f, 0.5f, 1};
    smooth.sigma_s = {3, 2, 1};
    rough.reflectance = SpectrumInput{{0.6f, 0.4f, 0.2f}, -1};
    rough.g = 0.5f;
    rough.roughness = {{0.2f, -1}, {0.2f, -1}, false};
    wax.materials.front().kind = smooth;
    wax.materials.back().kind = rough;
    hash_render(wax);
    fill_with_media(&wax);
    hash_render(wax);
    SceneDescription moving = plain;
    set_moving(&moving);
    hash_render(moving);
    // Opaque and without instances: rays are traced without the library.
    plain.objects.clear();
    plain.instances.clear();
    for (ShapeDescription& shape : plain.shapes) shape.alpha = {1, -1};
    hash_render(plain);
    scene.objects.clear();
    scene.instances.clear();
    fill_with_media(&scene);
    hash_render(scene);
    hash_render(diffuse_balls());
    hash_imaged_lights(&all);
    hash_photon_guide(&all);
    hash_lenses(&all);
    const std::vector<float> graphs = every_graph_operation();
    all.update(std::string(reinterpret_cast<const char*>(graphs.data()), graphs.size() * sizeof(float)));
    return all.hex();
  }();
  return digest;
}

}  // namespace lightmill
