// What the pilot predicts of sampling plans against what renders of them show: variance of a pixel sample
// (relMSE) and CPU time of one, so that it is seen which of the two a wrong choice stems from.
//
//   plan_check SCENE [--resolution WxH] [--batches 8] [--top 6] [--plan
//   LIGHT_PATHS:CONNECTIONS[:STRATEGIES]]... [--pilots N] [--keep FILE]
//
// Rendered are path tracing, bdpt, the `--top` plans by prediction and those that are given. Each has
// `--batches` independent images of 16 samples per pixel, plans in turn, with the same seeds; the mean of all
// of them is the reference. Prints a line per plan: predicted and measured relMSE of one sample with its
// standard error, predicted and measured CPU microseconds of one sample, and both products, relative to the
// plan that the pilot chose.
//
// With --pilots, pilots of so many seeds are asked then: a line for each has the plan that it chose, how many
// times the best product measured that plan has, and predicted over measured relMSE: mean over the plans and
// spread between them (both of logarithms), which is what a choice suffers from. --keep writes to FILE what
// was measured, or reads it instead of rendering: to see what a change of the pilot does.
#include <CLI/CLI.hpp>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "common/base/error.h"
#include "common/film/film.h"
#include "common/job/plan_text.h"
#include "common/scene/load.h"
#include "tests/bench/render/bench_scene.h"
#include "worker/render/plan/pilot.h"

namespace {

using namespace lightmill;

struct Options {
  std::string scene, resolution = "96x96", keep;
  int batches = 8, top = 6, pilots = 0;
  std::vector<std::string> plans;
};

/// What renders show of a plan, per pixel sample.
struct Seen {
  double relmse = 0, error = 0, microseconds = 0, camera = 0;  // `camera`: relmse of that layer
};

struct Measured {
  PlanEstimate predicted;
  std::unique_ptr<Renderer> renderer;
  std::vector<Image> images, camera;
  double cpu_seconds = 0;
  Seen seen;
};

SamplingPlan parse_plan(const std::string& text) {
  std::istringstream in(text);
  SamplingPlan plan;
  std::string light_paths, connections, strategies;
  std::getline(in, light_paths, ':'), std::getline(in, connections, ':'), std::getline(in, strategies);
  try {
    plan.light_paths = std::stod(light_paths);
    plan.connections = std::stod(connections);
  } catch (const std::exception&) {
    throw Error(ErrorKind::kUsage, "--plan " + text + ": expected LIGHT_PATHS:CONNECTIONS[:STRATEGIES]");
  }
  if (!strategies.empty()) plan.strategies = strategies_named(strategies);
  check_plan(plan);
  return plan;
}

/// Light paths go by the emission guide if the pilot's do.
void add(const PilotReport& pilot, const SamplingPlan& plan, std::vector<Measured>* to) {
  const auto is_plan = [&](SamplingPlan other) {
    other.guided_emission = plan.guided_emission;
    return other == plan;
  };
  for (const Measured& m : *to) {
    if (is_plan(m.predicted.plan)) return;
  }
  for (const PlanEstimate& e : pilot.estimates) {
    if (is_plan(e.plan)) {
      to->push_back({e, nullptr, {}, {}, 0, {}});
      return;
    }
  }
}

/// One batch of one plan.
void render(const RenderSettings& settings, int batch, Measured* m) {
  const CellRect cells = settings.grid.cells();
  const TileSpec tile{cells, int64_t{kSuperblockSamples} * batch, int64_t{kSuperblockSamples} * (batch + 1)};
  const Renderer& r = *m->renderer;
  PartialBuilder builder(settings.grid, tile, r.quantum_exponent(), r.has_camera_layer(),
                         r.has_splat_layer());
  const auto workspace = r.make_workspace();
  for (int64_t b = block_of_sample(tile.sample_begin); block_begin(b) < tile.sample_end; ++b) {
    for (int y = cells.y0; y < cells.y1; ++y) {
      for (int x = cells.x0; x < cells.x1; ++x)
        r.render_packet({x, y, block_begin(b), std::min(block_end(b), tile.sample_end)}, *workspace, builder);
    }
  }
  Partial p = builder.take();
  m->cpu_seconds += p.cpu_seconds;
  Film film(settings.grid);
  film.fold(p);
  m->images.push_back(film.resolve());
  p.splats.clear();
  Film camera(settings.grid);
  camera.fold(p);
  m->camera.push_back(camera.resolve());
}

struct Spread {
  double mean = 0, error = 0;
};

/// relMSE of one sample: of batches less their mean, over the reference.
Spread variance(const std::vector<Image>& images, const Image& reference) {
  const size_t values = reference.data.size(), n = images.size();
  std::vector<double> mean(values);
  for (const Image& image : images) {
    for (size_t k = 0; k < values; ++k)
      mean[k] += static_cast<double>(image.data[k]) / static_cast<double>(n);
  }
  std::vector<double> each;
  Spread s;
  for (const Image& image : images) {
    double sum = 0;
    for (size_t k = 0; k < values; ++k) {
      const double d = static_cast<double>(image.data[k]) - mean[k],
                   r = static_cast<double>(reference.data[k]);
      sum += d * d / (r * r + 0.01);
    }
    each.push_back(sum / static_cast<double>(values) * kSuperblockSamples * static_cast<double>(n) /
                   static_cast<double>(n - 1));
    s.mean += each.back() / static_cast<double>(n);
  }
  for (const double e : each) s.error += (e - s.mean) * (e - s.mean);
  s.error = std::sqrt(s.error / static_cast<double>(n * (n - 1)));
  return s;
}

/// Renders all plans, in turn.
void measure(const Options& options, const bench::Scene& built, std::vector<Measured>* plans) {
  for (Measured& m : *plans) {
    RenderSettings settings = built.settings;
    settings.plan = m.predicted.plan;
    m.renderer = std::make_unique<Renderer>(*built.renderer, settings);
  }
  for (int batch = 0; batch < options.batches; ++batch) {
    for (Measured& m : *plans) render(m.renderer->settings(), batch, &m);
  }
  Image reference = plans->front().images[0];
  for (size_t k = 0; k < reference.data.size(); ++k) {
    double sum = 0;
    for (const Measured& m : *plans) {
      for (const Image& image : m.images) sum += static_cast<double>(image.data[k]);
    }
    reference.data[k] =
        static_cast<float>(sum / static_cast<double>(plans->size() * plans->front().images.size()));
  }
  for (Measured& m : *plans) {
    const Spread v = variance(m.images, reference), camera = variance(m.camera, reference);
    m.seen = {v.mean, v.error, 1e6 * m.cpu_seconds / built.samples(), camera.mean};
  }
}

/// What an earlier run has kept, of the plans that this pilot considers.
void read(const std::string& path, const PilotReport& pilot, std::vector<Measured>* plans) {
  std::ifstream in(path);
  for (const auto& kept : nlohmann::json::parse(in)) {
    const size_t before = plans->size();
    add(pilot, plan_from_json(kept.at("plan").dump()), plans);
    if (plans->size() == before) continue;
    plans->back().seen = {kept.at("relmse"), kept.at("error"), kept.at("microseconds"), kept.at("camera")};
  }
}

void write(const std::string& path, const std::vector<Measured>& plans) {
  auto kept = nlohmann::json::array();
  for (const Measured& m : plans)
    kept.push_back({{"plan", nlohmann::json::parse(plan_to_json(m.predicted.plan))},
                    {"relmse", m.seen.relmse},
                    {"error", m.seen.error},
                    {"microseconds", m.seen.microseconds},
                    {"camera", m.seen.camera}});
  std::ofstream(path) << kept.dump(1) << "\n";
}

void print_table(const Options& options, const std::vector<Measured>& plans) {
  std::printf("%s %s\n%-34s %28s %8s %22s %17s\n", options.scene.c_str(), options.resolution.c_str(), "plan",
              "relMSE predicted, measured", "ratio", "us predicted, measured", "product");
  double first[2] = {0, 0};
  for (const Measured& m : plans) {
    const Seen& v = m.seen;
    const double product[2] = {m.predicted.relative_variance * m.predicted.cost, v.relmse * v.microseconds};
    if (first[0] == 0) std::copy(product, product + 2, first);
    std::printf("%-34s %9.4g %9.4g +- %5.2g %8.2f %9.3g %8.3g %5.2f %8.3f %8.3f  camera %.4g splats %.4g\n",
                plan_text(m.predicted.plan).c_str(), m.predicted.relative_variance, v.relmse, v.error,
                m.predicted.relative_variance / v.relmse, m.predicted.cost, v.microseconds,
                m.predicted.cost / v.microseconds, product[0] / first[0], product[1] / first[1], v.camera,
                v.relmse - v.camera);
  }
}

/// A line of what the pilot of seed `seed` makes of the scene, against what was measured of `plans`. Returns
/// how many times the best product the chosen plan has; 0 if that was not measured.
double print_pilot(const bench::Scene& built, uint64_t seed, const std::vector<Measured>& plans) {
  RenderSettings settings = built.settings;
  settings.seed = seed;
  const Renderer renderer(*built.renderer, settings);
  const PilotReport pilot = run_pilot(renderer, 1, [] { return true; });
  SamplingPlan chosen = pilot.chosen;
  chosen.allocation = {};
  double best = 0, own = 0, sum = 0, squares = 0, n = 0;
  for (const Measured& m : plans) {
    const double product = m.seen.relmse * m.seen.microseconds;
    if (best == 0 || product < best) best = product;
    for (const PlanEstimate& e : pilot.estimates) {
      if (!(e.plan == m.predicted.plan)) continue;
      if (e.plan == chosen) own = product;
      const double ratio = std::log(e.relative_variance / m.seen.relmse);
      sum += ratio, squares += ratio * ratio, ++n;
    }
  }
  std::printf(
      "pilot %3llu %-34s %8.3f of the best, predicted %.2f of measured, spread %.3f, allocation %.2f\n",
      static_cast<unsigned long long>(seed), plan_text(chosen).c_str(), own / best, std::exp(sum / n),
      std::sqrt(std::max(squares / n - sum * sum / (n * n), 0.0)), pilot.adaptive_gain);
  return own / best;
}

void run(const Options& options) {
  bench::Options scene;
  scene.scene = options.scene;
  scene.resolution = options.resolution;
  scene.render.integrator = "bdpt";
  scene.spp = int64_t{kSuperblockSamples} * options.batches;
  scene.threads = 1;
  const bench::Scene built = bench::build(scene);
  const PilotReport pilot = run_pilot(*built.renderer, 1, [] { return true; });
  std::vector<Measured> plans;
  if (!options.keep.empty() && std::filesystem::exists(options.keep)) {
    read(options.keep, pilot, &plans);
  } else {
    SamplingPlan chosen = pilot.chosen;
    chosen.allocation = {};
    add(pilot, chosen, &plans);
    for (const PlanEstimate& e : ranked_estimates(pilot)) {
      if (static_cast<int>(plans.size()) >= options.top) break;
      add(pilot, e.plan, &plans);
    }
    add(pilot, path_tracing_plan(), &plans);
    add(pilot, SamplingPlan(), &plans);
    for (const std::string& text : options.plans) add(pilot, parse_plan(text), &plans);
    measure(options, built, &plans);
    if (!options.keep.empty()) write(options.keep, plans);
  }
  print_table(options, plans);
  double sum = 0, known = 0;
  for (int seed = 1; seed <= options.pilots; ++seed) {
    const double times = print_pilot(built, static_cast<uint64_t>(seed), plans);
    if (times > 0) sum += std::log(times), ++known;
  }
  if (known > 0) std::printf("chosen plans have %.3f of the best product\n", std::exp(sum / known));
}

}  // namespace

int main(int argc, char** argv) {
  CLI::App app("Predictions of the pilot against renders", "plan_check");
  Options options;
  app.add_option("scene", options.scene)->required();
  app.add_option("--resolution", options.resolution, "WxH");
  app.add_option("--batches", options.batches)->check(CLI::Range(2, 1000));
  app.add_option("--top", options.top)->check(CLI::Range(1, 72));
  app.add_option("--plan", options.plans, "LIGHT_PATHS:CONNECTIONS[:STRATEGIES]; again for more");
  app.add_option("--pilots", options.pilots, "seeds to ask pilots of")->check(CLI::Range(0, 1000));
  app.add_option("--keep", options.keep, "file of what was measured");
  return bench::run_main(app, argc, argv, [&] { run(options); });
}
