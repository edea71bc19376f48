// lightmill explain: the scene plan. What is needed, what is left out, and why; how it is sampled.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "client/cli.h"
#include "client/json_output.h"
#include "client/options.h"
#include "common/job/plan_text.h"
#include "worker/agent/float_mode.h"
#include "worker/agent/host.h"
#include "worker/render/plan/analysis/savings.h"
#include "worker/render/plan/pilot.h"
#include "worker/render/renderer.h"

namespace lightmill::client {
namespace {

struct ExplainOptions {
  CommonOptions common;
  SceneOptions scene;
  bool no_pilot = false;
  bool measure = false;
};

nlohmann::json items_document(const ScenePlan& plan) {
  nlohmann::json items = nlohmann::json::array();
  for (const PlanItem& item : plan.items) {
    items.push_back({{"feature", item.feature},
                     {"needed", item.needed},
                     {"option", feature_names(item.feature_bit)},
                     {"reason", item.reason},
                     {"saving", item.saving}});
  }
  return items;
}

/// Shares of the image's light; how many camera paths hit a light that is seldom hit, per path; and the noise
/// that these emitter hits make (MissingShare).
nlohmann::json missing_document(const MissingShare& missing) {
  return {{"never", missing.never},
          {"seldom", missing.seldom},
          {"meetings", missing.emitter_hits},
          {"noise", missing.noise}};
}

void print_items(const ScenePlan& plan) {
  for (const PlanItem& item : plan.items) {
    std::printf("%-9s %-30s %-20s %s%s%s\n", item.needed ? "needed" : "left out", item.feature.c_str(),
                feature_names(item.feature_bit).c_str(), item.reason.c_str(),
                item.saving.empty() ? "" : "; saves ", item.saving.c_str());
  }
}

/// Adds what was measured to the savings of everything that can be switched.
void measure_savings(const SceneDescription& scene, const RenderSettings& settings, ScenePlan* plan) {
  constexpr double kSeconds = 0.3;
  for (PlanItem& item : plan->items) {
    if (item.needed || !item.feature_bit) continue;
    const double percent = 100 * measured_saving(scene, settings, item.feature_bit, kSeconds);
    char text[64];
    std::snprintf(text, sizeof text, " (measured: %.1f %% of the time a sample)", percent);
    item.saving += text;
  }
}

void print_gain(const PilotReport& pilot, const char* name, const SamplingPlan& plan) {
  if (const auto gain = predicted_gain(pilot, plan)) {
    std::printf("predicted efficiency: %.3g times that of %s\n", *gain, name);
  }
}

void print_pilot(const PilotReport& pilot) {
  std::printf("\nsampling: %s, chosen by a pilot of %lld camera paths\n", plan_text(pilot.chosen).c_str(),
              static_cast<long long>(pilot.samples));
  print_gain(pilot, "path tracing", path_tracing_plan());
  print_gain(pilot, "bdpt", SamplingPlan());
  if (pilot.emission_guide_gain != 1) {
    std::printf("guided emission: predicted efficiency %.3g times that without, which is %s\n",
                pilot.emission_guide_gain,
                pilot.chosen.guided_emission.value_or(false) ? "used" : "not worth it");
  }
  if (!pilot.chosen.allocation.uniform()) {
    std::printf(
        "adaptive sampling, a quarter to four samples: predicted efficiency %.3g times that of uniform\n",
        pilot.adaptive_gain);
  }
  std::printf("%12s %12s %12s  %s\n", "variance", "us a sample", "product", "plan");
  for (const PlanEstimate& e : ranked_estimates(pilot)) {
    std::printf("%12.4g %12.4g %12.4g  %s\n", e.relative_variance, e.cost, e.relative_variance * e.cost,
                plan_text(e.plan).c_str());
  }
}

int explain(ExplainOptions& options) {
  finish_scene_options(&options.scene);
  const SceneDescription scene = load_scene_for(options.scene, options.common.quiet);
  RenderSettings settings = resolve_settings(scene, options.scene.render);
  agent::set_float_mode();
  const int threads = agent::usable_threads();
  const Renderer analysed(scene, settings, threads);
  if (!options.common.quiet) {
    for (const std::string& line : analysed.warnings()) print_warning(line);
  }
  std::optional<PilotReport> pilot;
  if (needs_pilot(settings) && !options.no_pilot) {
    pilot = run_pilot(analysed, threads, [] { return true; });
    settings.plan = pilot->chosen;
  }
  const Renderer renderer(analysed, settings);
  ScenePlan plan = renderer.plan();
  if (options.measure) {
    // Without a pilot the full plan stands in for the one that it would choose.
    RenderSettings sampled = settings;
    if (needs_pilot(sampled)) sampled.plan = plan_of(sampled);
    measure_savings(scene, sampled, &plan);
  }
  if (options.common.json) {
    const nlohmann::json document = {{"integrator", integrator_name(settings.integrator)},
                                     {"quantum_exponent", plan.quantum_exponent},
                                     {"items", items_document(plan)},
                                     {"lost_light", plan.lost_light},
                                     {"missing_light_shares", missing_document(plan.missing)},
                                     {"pilot", pilot_document(pilot)}};
    std::printf("%s\n", dump(document).c_str());
    return 0;
  }
  print_items(plan);
  if (pilot) print_pilot(*pilot);
  return 0;
}

}  // namespace

void add_explain(CLI::App& app, Action& action) {
  auto options = std::make_shared<ExplainOptions>();
  CLI::App* verb = add_verb(app, "explain", "Print the scene plan: what is needed, what is left out, why",
                            &options->common);
  add_json(verb, &options->common);
  add_scene(verb, &options->scene);
  add_render_options(verb, &options->scene);
  verb->add_flag("--no-pilot", options->no_pilot, "Do not run the pilot of --integrator auto");
  verb->add_flag(
      "--measure", options->measure,
      "Time a few packets with each feature that is left out and without: takes about a second each");
  verb->callback([&action, options] { action = [options] { return explain(*options); }; });
}

}  // namespace lightmill::client
