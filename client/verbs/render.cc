// lightmill render: a scene to an image on this machine, through an embedded farm.
#include <CLI/CLI.hpp>
#include <csignal>
#include <cstdio>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "client/cli.h"
#include "client/connection/local_render.h"
#include "client/frames.h"
#include "client/json_output.h"
#include "client/options.h"
#include "client/output.h"
#include "client/terminal/live_view.h"
#include "client/terminal/progress.h"
#include "client/verbs/diagnose.h"
#include "client/verbs/sequences.h"
#include "client/write_picture.h"
#include "common/base/error.h"
#include "common/error/report/report.h"
#include "common/image/enlarge.h"
#include "common/image/image_library.h"
#include "worker/agent/float_mode.h"
#include "worker/agent/host.h"
#include "worker/agent/memory_size.h"
#include "worker/render/plan/first_look.h"

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
  FrameOptions frames;
  OutputOptions output;
  int threads = 0;
  std::string texture_memory = "auto";
  std::string reference, report, diagnose, display;
};

/// What came of one picture.
struct Rendered {
  nlohmann::json document;
  bool interrupted = false;
  std::string why;  // it was interrupted
};

/// Something to see while the scene is learnt. Nothing depends on it: what fails is left out.
void show_first_look(const Renderer& built, const RenderSettings& settings, int threads, LiveView* view) {
  try {
    const Image look = first_look(built, threads, [] { return interrupted == 0; });
    if (look.data.empty()) return;
    const PixelRect& crop = settings.grid.crop;
    view->show([image = enlarged(look, crop.width(), crop.height())] { return image; });
  } catch (const Error&) {
    // Interrupted, or the render itself will say what is wrong.
  }
}

/// Renders one picture. `output` may have no path: then the scene's film names the file.
Rendered render_picture(const LocalOptions& options, const SceneOptions& scene_options,
                        const OutputOptions& output) {
  const bool quiet = options.common.quiet;
  const uint64_t texture_bytes = agent::parse_memory(options.texture_memory, "--texture-memory");
  std::optional<Phase> phase;
  phase.emplace(quiet, "reading " + scene_options.scene + " ...");
  SceneDescription scene = load_scene_for(scene_options, quiet);
  JobRequest request;
  RenderOptions render_options = scene_options.render;
  render_options.denoise = output.denoise;
  forget_film_layers(output, &render_options);
  request.settings = resolve_settings(scene, render_options);
  const std::string path = output_path(output, scene, request.settings.aovs);
  // What writes their pictures is found missing now, not after the render.
  if (!options.report.empty() || !options.diagnose.empty()) image_library();
  request.reference = load_reference(options.reference, request.settings.grid);
  request.name = std::filesystem::path(scene_options.scene).stem().string();
  request.bundle = make_bundle(scene, nullptr);

  const int threads = options.threads > 0 ? options.threads : agent::usable_threads();
  agent::set_float_mode();
  phase.emplace(quiet, "building the scene ...");
  BuildOptions build(threads, texture_bytes);
  const auto warn = [quiet](const std::string& line) {
    if (!quiet) print_warning(line);
  };
  SceneDescription to_diagnose;
  if (!options.diagnose.empty()) to_diagnose = scene;
  std::optional<LiveView> view;
  if (!options.display.empty()) {
    view.emplace(options.display, request.name, nullptr, print_warning);
    build.when_built = [&](const Renderer& built) {
      show_first_look(built, request.settings, threads, &*view);
    };
  }
  auto renderer = agent::make_packet_renderer(std::move(scene), request.settings, build, warn);

  phase.reset();
  Progress progress(quiet);
  // The scene goes with the last tile: an image is finished in the memory that it had.
  const LocalResult result = render_local(
      request, std::move(renderer), threads,
      [&](const JobStatus& status) {
        progress.update(status);
        return interrupted == 0;
      },
      view ? &*view : nullptr);
  progress.finish(result.status);

  OutputOptions named = output;
  named.path = path;
  const std::optional<DenoiseFigures> denoised = write_picture(
      named, result.image, result.aovs, image_metadata(result.status), request.name, threads, quiet);
  if (!options.report.empty()) {
    write_report(options.report, report_info(result.status, result.pilot), result.curve, result.image);
  }
  if (!options.diagnose.empty() && !result.interrupted) {
    RenderSettings settings = result.status.settings;
    settings.spp = std::max<int64_t>(1, static_cast<int64_t>(result.status.spp));
    write_diagnosis(options.diagnose, to_diagnose, settings, threads, [] { return interrupted == 0; });
    if (!quiet) std::fprintf(stderr, "wrote %s/index.html\n", options.diagnose.c_str());
  }
  Rendered rendered{job_to_json(result.status), result.interrupted, ""};
  rendered.document["output"] = path;
  if (denoised) rendered.document["denoised"] = denoise_to_json(*denoised);
  rendered.document["pilot"] = pilot_document(result.pilot);
  if (!options.common.json && !quiet) {
    if (denoised) std::fprintf(stderr, "denoised: %s\n", denoise_line(*denoised).c_str());
    std::fprintf(stderr, "wrote %s\n", path.c_str());
  }
  print_dropped(result.status, quiet);
  if (result.interrupted) {
    char spp[32];
    std::snprintf(spp, sizeof spp, "%.4g", result.status.spp);
    rendered.why = std::string("interrupted at ") + spp + " of " + std::to_string(request.settings.spp) +
                   " spp; " + path + " holds what was there";
  }
  return rendered;
}

void refuse_single_options(const LocalOptions& options) {
  for (const auto& [value, name] : {std::pair{&options.reference, "--reference"},
                                    {&options.report, "--report"},
                                    {&options.diagnose, "--diagnose"}}) {
    if (!value->empty())
      throw Error(ErrorKind::kUsage, std::string(name) + " is about one picture; leave it out with --frames");
  }
  if (options.frames.budget_seconds > 0)
    throw Error(ErrorKind::kUsage,
                "--budget needs a farm, which can go back to a frame; see lightmill submit");
  if (!options.frames.quality.empty() && !options.scene.render.target_error)
    throw Error(ErrorKind::kUsage, "--quality equal: say which, by --target-error");
}

/// Frames in the order in which a farm would begin them.
std::vector<SceneFrame> in_order(std::vector<SceneFrame> frames, FrameOrder order) {
  std::vector<SceneFrame> ordered;
  for (const int pass : {0, 1}) {
    for (size_t i = 0; i < frames.size(); ++i) {
      if (frame_pass(order, i) == pass) ordered.push_back(frames[i]);
    }
  }
  return ordered;
}

/// Renders frame after frame. One that fails is reported, and the others go on.
int render_frames(const LocalOptions& options) {
  refuse_single_options(options);
  const std::vector<SceneFrame> frames = in_order(scene_frames(options.scene, options.frames, std::cin),
                                                  *frame_order_from_name(options.frames.order));
  check_frame_output({options.output, ""}, 0);
  const FramePattern pattern = FramePattern::require(options.output.path, "-o");
  nlohmann::json documents = nlohmann::json::array();
  size_t failed = 0;
  std::string first_failure;
  for (size_t i = 0; i < frames.size(); ++i) {
    const SceneFrame& frame = frames[i];
    if (!options.common.quiet) {
      std::fprintf(stderr, "frame %d (%zu of %zu)\n", frame.number, i + 1, frames.size());
    }
    SceneOptions scene = options.scene;
    scene.scene = frame.file;
    scene.pose.time = frame.time;
    OutputOptions output = options.output;
    output.path = pattern.name_of(frame.number);
    try {
      Rendered rendered = render_picture(options, scene, output);
      rendered.document["frame"] = frame.number;
      documents.push_back(std::move(rendered.document));
      if (rendered.interrupted)
        throw Error(ErrorKind::kFailed, "frame " + std::to_string(frame.number) + ": " + rendered.why);
    } catch (const Error& e) {
      if (interrupted != 0) throw;
      const std::string text = "frame " + std::to_string(frame.number) + ": " + e.what();
      if (failed++ == 0) first_failure = text;
      print_warning(text);
    }
  }
  if (options.common.json) std::printf("%s\n", dump(documents).c_str());
  if (failed > 0) {
    throw Error(ErrorKind::kFailed, std::to_string(failed) + " of " + std::to_string(frames.size()) +
                                        " frames failed; the first was " + first_failure);
  }
  return 0;
}

int render(LocalOptions& options) {
  finish_scene_options(&options.scene);
  finish_output_options(&options.output);
  if (!options.display.empty()) check_display(options.display);
  std::signal(SIGINT, handle_interrupt);
  std::signal(SIGTERM, handle_interrupt);
  if (wants_frames(options.scene, options.frames)) return render_frames(options);
  const Rendered rendered = render_picture(options, options.scene, options.output);
  if (options.common.json) std::printf("%s\n", dump(rendered.document).c_str());
  if (rendered.interrupted) throw Error(ErrorKind::kFailed, rendered.why);
  return 0;
}

}  // namespace

void add_render(CLI::App& app, Action& action) {
  auto options = std::make_shared<LocalOptions>();
  CLI::App* verb =
      add_verb(app, "render", "Render a scene, or its frames, on this machine", &options->common);
  add_json(verb, &options->common);
  add_scene(verb, &options->scene);
  add_render_options(verb, &options->scene);
  add_frames(verb, &options->frames);
  add_output(verb, &options->output);
  add_denoise_flag(verb, &options->output);
  verb->add_option("--threads", options->threads, "Render threads; 0: all processors")
      ->check(CLI::Range(0, 4096).description("0 to 4096"))
      ->capture_default_str();
  verb->add_option("--texture-memory", options->texture_memory,
                   "Memory for textures and grids, e.g. 500M; auto: half of what there is; none: no bound")
      ->capture_default_str();
  verb->add_option("--reference", options->reference, "An image to measure true errors against");
  verb->add_option("--report", options->report, "Folder for error.csv, error.svg and report.html");
  add_display(verb, &options->display);
  verb->add_option("--diagnose", options->diagnose,
                   "Folder for every strategy's image, noise, time and brightest paths (renders once more)");
  verb->callback([&action, options] { action = [options] { return render(*options); }; });
}

}  // namespace lightmill::client
