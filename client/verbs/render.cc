// lightmill render: a scene to an image on this machine, through an embedded farm.
#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "client/cli.h"
#include "client/connection/local_render.h"
#include "client/json_output.h"
#include "client/options.h"
#include "client/output.h"
#include "client/terminal/live_view.h"
#include "client/terminal/progress.h"
#include "client/verbs/diagnose.h"
#include "common/base/error.h"
#include "common/error/report/report.h"
#include "common/image/image_library.h"
#include "worker/agent/float_mode.h"
#include "worker/agent/host.h"
#include "worker/agent/memory_size.h"

namespace lightmill::client {
namespace {

volatile std::sig_atomic_t interrupted = 0;

/// The first Ctrl-C (or SIGTERM) asks for an orderly end; the second one ends the program.
void handle_interrupt(int signal) {
  interrupted = 1;
  std::signal(signal, SIG_DFL);
}

struct LocalOptions {
  CommonOptions common;
  SceneOptions scene;
  OutputOptions output;
  int threads = 0;
  std::string texture_memory = "auto";
  std::string reference, report, diagnose, display;
};

int render(LocalOptions& options) {
  finish_scene_options(&options.scene);
  if (!options.display.empty()) check_display(options.display);
  const bool quiet = options.common.quiet;
  const uint64_t texture_bytes = agent::parse_memory(options.texture_memory, "--texture-memory");
  std::optional<Phase> phase;
  phase.emplace(quiet, "reading " + options.scene.scene + " ...");
  SceneDescription scene = load_scene_for(options.scene, quiet);
  JobRequest request;
  forget_film_layers(options.output, &options.scene.render);
  request.settings = resolve_settings(scene, options.scene.render);
  const std::string path = output_path(options.output, scene, request.settings.aovs);
  // What writes their pictures is found missing now, not after the render.
  if (!options.report.empty() || !options.diagnose.empty()) image_library();
  request.reference = load_reference(options.reference, request.settings.grid);
  request.name = std::filesystem::path(options.scene.scene).stem().string();
  request.bundle = make_bundle(scene, nullptr);

  const int threads = options.threads > 0 ? options.threads : agent::usable_threads();
  agent::set_float_mode();
  phase.emplace(quiet, "building the scene ...");
  const BuildOptions build(threads, texture_bytes);
  const auto warn = [quiet](const std::string& line) {
    if (!quiet) print_warning(line);
  };
  SceneDescription to_diagnose;
  if (!options.diagnose.empty()) to_diagnose = scene;
  auto renderer = agent::make_packet_renderer(std::move(scene), request.settings, build, warn);

  phase.reset();
  std::signal(SIGINT, handle_interrupt);
  std::signal(SIGTERM, handle_interrupt);
  Progress progress(quiet);
  // The scene goes with the last tile: an image is finished in the memory that it had.
  const LocalResult result = render_local(
      request, std::move(renderer), threads,
      [&](const JobStatus& status) {
        progress.update(status);
        return interrupted == 0;
      },
      options.display);
  progress.finish(result.status);

  write_image(result.image, path,
              {options.output.half, image_metadata(result.status), &result.aovs, view_of(options.output)});
  if (!options.report.empty()) {
    write_report(options.report, report_info(result.status, result.pilot), result.curve, result.image);
  }
  if (!options.diagnose.empty() && !result.interrupted) {
    RenderSettings settings = result.status.settings;
    settings.spp = std::max<int64_t>(1, static_cast<int64_t>(result.status.spp));
    write_diagnosis(options.diagnose, to_diagnose, settings, threads, [] { return interrupted == 0; });
    if (!quiet) std::fprintf(stderr, "wrote %s/index.html\n", options.diagnose.c_str());
  }
  if (options.common.json) {
    nlohmann::json document = job_to_json(result.status);
    document["output"] = path;
    document["pilot"] = pilot_document(result.pilot);
    std::printf("%s\n", dump(document).c_str());
  } else if (!quiet) {
    std::fprintf(stderr, "wrote %s\n", path.c_str());
  }
  print_dropped(result.status, quiet);
  if (result.interrupted) {
    char spp[32];
    std::snprintf(spp, sizeof spp, "%.4g", result.status.spp);
    throw Error(ErrorKind::kFailed, std::string("interrupted at ") + spp + " of " +
                                        std::to_string(request.settings.spp) + " spp; " + path +
                                        " holds what was there");
  }
  return 0;
}

}  // namespace

void add_render(CLI::App& app, Action& action) {
  auto options = std::make_shared<LocalOptions>();
  CLI::App* verb = add_verb(app, "render", "Render a scene on this machine", &options->common);
  add_json(verb, &options->common);
  add_scene(verb, &options->scene);
  add_render_options(verb, &options->scene);
  add_output(verb, &options->output);
  verb->add_option("--threads", options->threads, "Render threads; 0: all processors")
      ->check(CLI::Range(0, 4096).description("0 to 4096"))
      ->capture_default_str();
  verb->add_option("--texture-memory", options->texture_memory,
                   "Memory for textures, e.g. 500M; auto: half of what there is; none: no bound")
      ->capture_default_str();
  verb->add_option("--reference", options->reference, "An image to measure true errors against");
  verb->add_option("--report", options->report, "Folder for error.csv, error.svg and report.html");
  add_display(verb, &options->display);
  verb->add_option("--diagnose", options->diagnose,
                   "Folder for every strategy's image, noise, time and brightest paths (renders once more)");
  verb->callback([&action, options] { action = [options] { return render(*options); }; });
}

}  // namespace lightmill::client
