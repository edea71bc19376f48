#include "tests/support/render.h"

#include <algorithm>
#include <atomic>
#include <numeric>
#include <stdexcept>
#include <thread>

#include "common/film/film.h"
#include "common/scene/resolve_settings.h"
#include "worker/render/pipeline/context.h"

namespace lightmill::test {
namespace {

Partial render_tile(const Renderer& r, const TileSpec& tile, int64_t spp, int threads, PacketOrder order) {
  const FilmGrid& grid = r.settings().grid;
  std::vector<Packet> packets;
  for (int64_t b = block_of_sample(tile.sample_begin); block_begin(b) < tile.sample_end; ++b) {
    const int64_t begin = std::max(block_begin(b), tile.sample_begin),
                  end = std::min({block_end(b), tile.sample_end, spp});
    for (int y = tile.cells.y0; y < tile.cells.y1; ++y) {
      for (int x = tile.cells.x0; x < tile.cells.x1; ++x) packets.push_back({x, y, begin, end});
    }
  }
  if (order == PacketOrder::kReverse) std::reverse(packets.begin(), packets.end());
  if (order == PacketOrder::kScattered) {
    Random random(99);
    for (size_t i = packets.size(); i > 1; --i) std::swap(packets[i - 1], packets[random.bits() % i]);
  }
  PartialBuilder builder(grid, tile, r.quantum_exponent(), r.has_camera_layer(), r.has_splat_layer(),
                         r.aovs());
  std::atomic<size_t> next{0};
  auto work = [&] {
    const auto workspace = r.make_workspace();
    for (size_t i = next++; i < packets.size(); i = next++) r.render_packet(packets[i], *workspace, builder);
  };
  std::vector<std::thread> pool;
  for (int t = 1; t < threads; ++t) pool.emplace_back(work);
  work();
  for (std::thread& t : pool) t.join();
  return builder.take();
}

}  // namespace

RenderSettings settings_for(const SceneDescription& scene, Integrator integrator, int64_t spp, int max_depth,
                            uint64_t seed) {
  RenderOptions options;
  options.integrator = integrator_name(integrator);
  options.spp = spp;
  options.max_depth = max_depth;
  options.seed = seed;
  return resolve_settings(scene, options);
}

Partial render_partial(const SceneDescription& scene, const RenderSettings& settings, int threads,
                       PacketOrder order) {
  return render_partial(Renderer(scene, settings, threads), threads, order);
}

Vec3<float> placed(const Renderer& renderer, const Vec3d& p) {
  const Vec3d q = renderer.context().scene.normalised_point(p);
  return {static_cast<float>(q.x), static_cast<float>(q.y), static_cast<float>(q.z)};
}

Partial render_partial(const Renderer& renderer, int threads, PacketOrder order) {
  const RenderSettings& settings = renderer.settings();
  return render_tile(renderer, {settings.grid.cells(), 0, settings.spp}, settings.spp, threads, order);
}

Partial render_samples(const Renderer& renderer, int64_t begin, int64_t end) {
  return render_tile(renderer, {renderer.settings().grid.cells(), begin, end}, renderer.settings().spp, 1,
                     PacketOrder::kForward);
}

Partial render_cells(const Renderer& renderer, const CellRect& cells) {
  const int64_t spp = renderer.settings().spp;
  return render_tile(renderer, {cells, 0, spp}, spp, 1, PacketOrder::kForward);
}

Estimate mean_over_seeds(const Renderer& world, RenderSettings settings) {
  std::vector<double> means;
  for (settings.seed = 1; settings.seed <= 16; ++settings.seed) {
    Film film(settings.grid);
    film.fold(render_partial(Renderer(world, settings)));
    const Image image = film.resolve();
    means.push_back(std::accumulate(image.data.begin(), image.data.end(), 0.0) /
                    static_cast<double>(image.data.size()));
  }
  return estimate(means);
}

Batches render_batches(const SceneDescription& scene, const RenderSettings& settings, int batches,
                       int threads) {
  if (settings.spp % (int64_t{kSuperblockSamples} * batches) != 0) {
    throw std::logic_error("batches must be whole superblocks");
  }
  RenderSettings of_batch = settings;
  of_batch.spp = settings.spp / batches;
  const Renderer world(scene, settings, threads);
  Batches result;
  for (int b = 0; b < batches; ++b) {
    of_batch.seed = settings.seed + 1000003 * static_cast<uint64_t>(b);
    const Partial p = render_partial(Renderer(world, of_batch), threads);
    Film film(settings.grid);
    film.fold(p);
    result.images.push_back(film.resolve());
    result.counters += p.counters;
  }
  return result;
}

Estimate Batches::of(const std::function<double(const Image&)>& value) const {
  std::vector<double> values;
  for (const Image& image : images) values.push_back(value(image));
  return estimate(values);
}

Estimate Batches::mean(const PixelRect& rect, int c) const {
  return of([&](const Image& image) {
    double sum = 0;
    for (int y = rect.y0; y < rect.y1; ++y) {
      for (int x = rect.x0; x < rect.x1; ++x) {
        const float* p = image.pixel(x, y);
        sum += c < 0 ? (double{p[0]} + p[1] + p[2]) / 3 : p[c];
      }
    }
    return sum / static_cast<double>(rect.area());
  });
}

Estimate Batches::mean(int c) const { return mean({0, 0, images[0].width, images[0].height}, c); }

}  // namespace lightmill::test
