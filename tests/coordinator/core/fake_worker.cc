#include "tests/coordinator/core/fake_worker.h"

#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <map>
#include <stdexcept>

#include "common/base/digest.h"

namespace lightmill::testing {
namespace {

uint64_t hash(uint64_t a, uint64_t b) {
  uint64_t x = a * 0x9e3779b97f4a7c15u ^ (b + 0x7f4a7c15u) * 0xbf58476d1ce4e5b9u;
  x ^= x >> 31;
  x *= 0x94d049bb133111ebu;
  return x ^ (x >> 29);
}

/// One sample's value in units of the quantum: positive, up to about 1.
Units sample_units(uint32_t pixel, int64_t sample, int channel) {
  return static_cast<Units>(
      hash(pixel * 3u + static_cast<uint32_t>(channel), static_cast<uint64_t>(sample)) >> 25);
}

}  // namespace

Partial fake_partial(const TileSpec& tile, const RenderSettings& settings, double cpu_seconds) {
  Partial p;
  p.tile = tile;
  p.grid = settings.grid;
  p.quantum_exponent = kFakeQuantum;
  p.cpu_seconds = cpu_seconds;
  const PixelRect r = p.grid.pixels(tile.cells);
  const bool camera = has_camera_layer(settings);
  const bool light = has_splat_layer(settings);
  std::map<uint32_t, ExactRgb> splats;
  for (int y = r.y0; y < r.y1; ++y) {
    for (int x = r.x0; x < r.x1; ++x) {
      const auto pixel = static_cast<uint32_t>(y * p.grid.width + x);
      ExactRgb sum;
      for (int64_t s = tile.sample_begin; s < tile.sample_end; ++s) {
        for (int c = 0; c < 3; ++c) sum.c[c] += sample_units(pixel, s, c);
        if (!light || hash(pixel, static_cast<uint64_t>(s)) % 7 != 0) continue;
        // Light paths land anywhere in the crop window.
        const PixelRect& crop = p.grid.crop;
        const uint64_t where =
            hash(pixel + 17u, static_cast<uint64_t>(s)) % static_cast<uint64_t>(crop.area());
        const int sy = crop.y0 + static_cast<int>(where / static_cast<uint64_t>(crop.width()));
        const int sx = crop.x0 + static_cast<int>(where % static_cast<uint64_t>(crop.width()));
        ExactRgb& splat = splats[static_cast<uint32_t>(sy * p.grid.width + sx)];
        for (int c = 0; c < 3; ++c) splat.c[c] += sample_units(pixel, s, c) + 1;
      }
      if (camera) p.camera.push_back(sum);
    }
  }
  // What is seen is black, faces nowhere and is at no distance.
  p.aovs.spec.set = settings.aovs;
  for (int layer = 0; layer < kAovLayers; ++layer) {
    if (has_layer(p.aovs.spec, layer))
      p.aovs.layers[static_cast<size_t>(layer)].resize(static_cast<size_t>(r.area()));
  }
  const auto samples = static_cast<uint64_t>(r.area()) * static_cast<uint64_t>(tile.samples());
  for (const auto& [pixel, sum] : splats) p.splats.push_back({pixel, sum});
  if (light) p.light_paths = samples;
  p.counters.light_paths = p.light_paths;
  p.counters.camera_paths = camera ? samples : 0;
  return p;
}

std::string fake_bytes(const LeaseGrant& grant, double cpu_seconds) {
  if (is_pilot(grant.tile)) return encode_pilot({fake_pilot(), cpu_seconds});
  return encode_partial(fake_partial(grant.tile, grant.settings, cpu_seconds));
}

PilotReport fake_pilot() {
  const SamplingPlan chosen{kEmissionHits | kNextEvent, 1, 1};
  PilotReport report{chosen, {{chosen, 0.5, 2}, {SamplingPlan(), 0.25, 20}}, 1000, {}};
  report.features = {{"lights", true, "one <lamp>", ""}, {"textures", false, "there are none", "look-ups"}};
  return report;
}

RenderSettings after_pilot(RenderSettings settings) {
  if (needs_pilot(settings)) settings.plan = fake_pilot().chosen;
  return settings;
}

Image fake_image(const RenderSettings& requested) {
  const RenderSettings settings = after_pilot(requested);
  Film film(settings.grid);
  film.fold(fake_partial({settings.grid.cells(), 0, settings.spp}, settings));
  return film.resolve();
}

RenderSettings small_settings(int width, int height, int64_t spp, Integrator integrator) {
  RenderSettings settings;
  settings.integrator = integrator;
  settings.grid = {width, height, {0, 0, width, height}};
  settings.spp = spp;
  return settings;
}

Bundle fake_bundle() {
  Bundle bundle;
  bundle.main = "scene.pbrt";
  bundle.entries = {{"scene.pbrt", sha256_hex("scene"), 5}};
  return bundle;
}

JobRequest small_job(int width, int height, int64_t spp, Integrator integrator) {
  JobRequest request;
  request.name = "small";
  request.bundle = fake_bundle();
  request.settings = small_settings(width, height, spp, integrator);
  return request;
}

WorkerRegistration registration(const std::string& arithmetic_class, const std::string& pool) {
  return {"host", 2, "build-1", 1, arithmetic_class, pool};
}

FarmOptions fake_options() {
  FarmOptions options;
  options.build = "build-1";
  options.schema = 1;
  return options;
}

int work(Farm& farm, const WorkerId& worker, int limit) {
  int tiles = 0;
  while (tiles < limit) {
    const auto grant = farm.lease(worker);
    if (!grant) break;
    if (farm.commit(worker, {grant->job, grant->tile_id, grant->attempt}, fake_bytes(*grant)) !=
        CommitResult::kAccepted) {
      throw std::logic_error("a good partial was refused");
    }
    ++tiles;
  }
  return tiles;
}

bool same_pixels(const Image& a, const Image& b) {
  return a.width == b.width && a.height == b.height && a.data.size() == b.data.size() &&
         std::memcmp(a.data.data(), b.data.data(), a.data.size() * sizeof(float)) == 0;
}

TemporaryFolder::TemporaryFolder() {
  path_ = (std::filesystem::temp_directory_path() / "lightmill-test-XXXXXX").string();
  if (!mkdtemp(path_.data())) throw std::runtime_error("mkdtemp failed");
}
TemporaryFolder::~TemporaryFolder() {
  std::error_code error;
  std::filesystem::remove_all(path_, error);
}

}  // namespace lightmill::testing
