// lightmill explain: the scene plan. What is needed, what is left out, and why.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "client/cli.h"
#include "client/options.h"
#include "worker/render/renderer.h"

namespace lightmill::client {
namespace {

struct ExplainOptions {
  CommonOptions common;
  SceneOptions scene;
};

int explain(ExplainOptions& options) {
  finish_scene_options(&options.scene);
  const SceneDescription scene = load_scene_for(options.scene, options.common.quiet);
  announce_auto(options.scene, options.common.quiet || options.common.json);
  const RenderSettings settings = resolve_settings(scene, options.scene.render);
  const Renderer renderer(scene, settings, 0);
  nlohmann::json items = nlohmann::json::array();
  for (const PlanItem& item : renderer.plan().items) {
    if (options.common.json) {
      items.push_back({{"feature", item.feature},
                       {"needed", item.needed},
                       {"reason", item.reason},
                       {"saving", item.saving}});
    } else {
      std::printf("%-9s %-28s %s%s%s\n", item.needed ? "needed" : "left out", item.feature.c_str(),
                  item.reason.c_str(), item.saving.empty() ? "" : "; saves ", item.saving.c_str());
    }
  }
  if (options.common.json) {
    const nlohmann::json document = {{"integrator", integrator_name(settings.integrator)},
                                     {"quantum_exponent", renderer.plan().quantum_exponent},
                                     {"items", items}};
    std::printf("%s\n", document.dump(2, ' ', false, nlohmann::json::error_handler_t::replace).c_str());
  }
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
  verb->callback([&action, options] { action = [options] { return explain(*options); }; });
}

}  // namespace lightmill::client
