#include "tests/statistical/error/error_scenes.h"

#include "tests/support/render.h"
#include "tests/support/test_scene.h"

namespace lightmill::test {
namespace {

constexpr int64_t kPlannedSpp = int64_t{1} << 30;  // superblocks of any index lie inside
constexpr int kDepth = 5;

/// A room without a lamp, seen from its open side.
TestScene empty_room(int white) {
  TestScene s;
  s.quad({-1, -1, -1}, {0, 0, 2}, {2, 0, 0}, white).quad({-1, 1, -1}, {2, 0, 0}, {0, 0, 2}, white);
  s.quad({-1, -1, 1}, {0, 2, 0}, {2, 0, 0}, white);
  s.quad({-1, -1, -1}, {0, 2, 0}, {0, 0, 2}, white).quad({1, -1, -1}, {0, 0, 2}, {0, 2, 0}, white);
  s.camera({0, 0, -3.2}, {0, 0, 1}, 50);
  return s;
}

TestScene glossy() {
  TestScene s;
  const int white = s.diffuse(0.6f);
  s = [&] {
    TestScene room = empty_room(0);
    room.scene.materials = s.scene.materials;
    return room;
  }();
  s.quad({-0.9, -0.9, -0.6}, {1.8, 0, 0}, {0, 0.3, 1.4}, s.conductor(0.8f, 0.1f));
  s.sphere({0.45, 0.1, 0.2}, 0.35, s.conductor(0.9f, 0.25f));
  s.sphere({-0.5, 0.6, 0.1}, 0.12, white, {.radiance = {12, 11, 9}});
  s.sphere({0.2, 0.75, 0.4}, 0.03, white, {.radiance = {120, 130, 150}});
  return s;
}

/// Light of a lamp of side 2 `half` through a ball of glass.
TestScene glass_ball(bool point, double half) {
  TestScene s;
  s.scene.materials.clear();
  const int white = s.diffuse(0.7f);
  TestScene room = empty_room(white);
  room.scene.materials = s.scene.materials;
  room.sphere({0.1, -0.35, 0.0}, 0.4, room.dielectric(1.5f, 0));
  if (point) {
    room.point_light({-0.4, 0.7, -0.2}, {1.5f, 1.4f, 1.2f});
  } else {
    const float l = static_cast<float>(0.8 / (half * half));
    room.quad({-0.3 - half, 0.95, -half}, {2 * half, 0, 0}, {0, 0, 2 * half}, white,
              {.radiance = {l, l, 0.8f * l}});
  }
  return room;
}

TestScene outdoors() {
  TestScene s;
  s.quad({-4, 0, -4}, {0, 0, 8}, {8, 0, 0}, s.diffuse(0.4f));
  s.box({-0.9, 0, -0.3}, {-0.3, 1, 0.4}, s.diffuse(Rgb{0.7f, 0.2f, 0.1f}));
  s.sphere({0.4, 0.5, 0}, 0.5, s.conductor(0.9f, 0.2f));
  s.environment({0.8f, 0.9f, 1.1f});
  s.camera({0, 1.1, -3}, {0, 0.4, 0}, 45);
  return s;
}

}  // namespace

std::vector<ErrorScene> error_scenes(int side, bool gaussian) {
  std::vector<ErrorScene> scenes;
  const auto add = [&](const char* name, TestScene scene, Integrator integrator) {
    scene.film(side, side);
    if (gaussian) scene.scene.filter = FilterDescription{};
    const RenderSettings settings = settings_for(scene.scene, integrator, kPlannedSpp, kDepth);
    scenes.push_back({name, std::move(scene.scene), settings});
  };
  add("diffuse", cornell_room(), Integrator::kPt);
  add("glossy", glossy(), Integrator::kBdpt);
  add("caustic", glass_ball(false, 0.08), Integrator::kPt);
  add("environment", outdoors(), Integrator::kPt);
  add("point-glass", glass_ball(true, 0), Integrator::kBdpt);
  add("splats", cornell_room(), Integrator::kLt);
  return scenes;
}

SuperblockRenderer::SuperblockRenderer(const ErrorScene& scene, uint64_t seed) : settings_(scene.settings) {
  settings_.seed = seed;
  renderer_ = std::make_unique<Renderer>(scene.scene, settings_, 1);
  workspace_ = renderer_->make_workspace();
}

Partial SuperblockRenderer::render(int64_t index) {
  const CellRect cells = settings_.grid.cells();
  const TileSpec tile{cells, kSuperblockSamples * index, kSuperblockSamples * (index + 1)};
  PartialBuilder builder(settings_.grid, tile, renderer_->quantum_exponent(), renderer_->has_camera_layer(),
                         renderer_->has_splat_layer());
  for (int64_t b = block_of_sample(tile.sample_begin); block_begin(b) < tile.sample_end; ++b) {
    for (int y = cells.y0; y < cells.y1; ++y) {
      for (int x = cells.x0; x < cells.x1; ++x) {
        renderer_->render_packet({x, y, block_begin(b), block_end(b)}, *workspace_, builder);
      }
    }
  }
  return builder.take();
}

}  // namespace lightmill::test
