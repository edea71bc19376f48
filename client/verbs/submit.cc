// lightmill submit: hands a scene to the farm and prints the job's id.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <filesystem>
#include <iostream>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "client/cli.h"
#include "client/connection/farm_client.h"
#include "client/connection/sequence_client.h"
#include "client/deadline.h"
#include "client/frames.h"
#include "client/json_output.h"
#include "client/options.h"
#include "client/output.h"
#include "client/terminal/progress.h"
#include "client/terminal/terminal.h"
#include "client/verbs/follow.h"
#include "client/verbs/sequences.h"
#include "common/base/error.h"

namespace lightmill::client {
namespace {

struct SubmitOptions {
  CommonOptions common;
  ConnectionOptions connection;
  SceneOptions scene;
  FrameOptions frames;
  OutputOptions output;
  std::string name, pool, reference;
  std::string submitter;
  std::vector<std::string> after;
  int priority = 0, max_workers = 0;
  double deadline = 0;
  bool wait = false;
};

std::string user_name() {
  const char* name = std::getenv("USER");
  return name ? name : "";
}

UploadProgress show_uploads(std::optional<Phase>* phase, bool quiet) {
  return [phase, quiet](size_t blobs, uint64_t sent, uint64_t bytes) {
    const std::string text =
        "uploading " + std::to_string(blobs) + " file(s), " + short_number(static_cast<double>(bytes)) + "B";
    if (!*phase && !quiet && !is_terminal(stderr)) std::fprintf(stderr, "%s\n", text.c_str());
    if (!*phase) phase->emplace(quiet, text);
    (*phase)->advance(text, static_cast<double>(sent) / static_cast<double>(std::max<uint64_t>(bytes, 1)));
  };
}

int submit_sequence(const SubmitOptions& options) {
  const bool quiet = options.common.quiet;
  if (!options.reference.empty())
    throw Error(ErrorKind::kUsage, "--reference is one image; leave it out with --frames");
  if (!options.frames.quality.empty() && !options.scene.render.target_error)
    throw Error(ErrorKind::kUsage, "--quality equal: say which, by --target-error");
  const std::vector<SceneFrame> wanted = scene_frames(options.scene, options.frames, std::cin);
  SceneOptions scene = options.scene;
  if (options.frames.budget_seconds > 0 && !scene.render.spp) scene.render.spp = kMaxSpp;
  const FrameFetch fetch{options.output, {}};
  if (!options.output.path.empty()) {
    check_frame_output(fetch, 0);
    forget_film_layers(options.output, &scene.render);
  }
  LoadedFrames loaded = load_frames(scene, wanted, quiet);
  if (!options.output.path.empty()) check_frame_output(fetch, loaded.frames.front().settings.aovs);
  SequenceRequest request;
  request.name =
      options.name.empty() ? std::filesystem::path(wanted.front().file).stem().string() : options.name;
  request.priority = options.priority;
  request.pool = options.pool;
  request.submitter = options.submitter.empty() ? user_name() : options.submitter;
  request.max_workers = options.max_workers;
  request.deadline = options.deadline;
  for (const std::string& id : options.after) request.after.push_back(JobId{id});
  request.order = *frame_order_from_name(options.frames.order);
  request.fps = options.scene.fps;
  request.budget_seconds = options.frames.budget_seconds;

  SequenceClient sequences(options.connection);
  std::optional<Phase> phase;
  const SequenceId id = sequences.submit(request, loaded.frames, loaded.paths, show_uploads(&phase, quiet));
  phase.reset();
  loaded = {};
  const bool json = options.common.json;
  if (!json) std::printf("%s\n", id.value.c_str());
  if (json && !options.wait) std::printf("%s\n", dump({{"id", id.value}}).c_str());
  std::fflush(stdout);
  if (!options.wait) return 0;
  FarmClient farm(options.connection);
  std::optional<FrameFetcher> fetcher;
  if (!options.output.path.empty()) fetcher.emplace(farm, sequences, id, fetch, quiet);
  const SequenceStatus last = follow_sequence(sequences, id, quiet, fetcher ? &*fetcher : nullptr);
  if (json) std::printf("%s\n", dump(sequence_to_json(last)).c_str());
  return 0;
}

int submit(SubmitOptions& options) {
  finish_scene_options(&options.scene);
  finish_output_options(&options.output);
  options.scene.render.denoise = options.output.denoise;
  const bool quiet = options.common.quiet;
  if (!options.output.path.empty()) {
    if (!options.wait)
      throw Error(ErrorKind::kUsage, "-o: only with --wait; fetch the image later by lightmill fetch");
    if (!wants_frames(options.scene, options.frames)) check_output(options.output);
  }
  if (wants_frames(options.scene, options.frames)) return submit_sequence(options);
  const SceneDescription scene = load_scene_for(options.scene, quiet);
  JobRequest request;
  forget_film_layers(options.output, &options.scene.render);
  request.settings = resolve_settings(scene, options.scene.render);
  if (!options.output.path.empty()) check_output(options.output, request.settings.aovs);
  request.reference = load_reference(options.reference, request.settings.grid);
  request.name =
      options.name.empty() ? std::filesystem::path(options.scene.scene).stem().string() : options.name;
  request.priority = options.priority;
  request.pool = options.pool;
  request.submitter = options.submitter.empty() ? user_name() : options.submitter;
  request.max_workers = options.max_workers;
  request.deadline = options.deadline;
  for (const std::string& id : options.after) request.after.push_back(JobId{id});
  std::map<std::string, std::string> paths;
  request.bundle = make_bundle(scene, &paths);

  FarmClient farm(options.connection);
  std::optional<Phase> phase;
  const JobId id = farm.submit(request, paths, show_uploads(&phase, quiet));
  phase.reset();
  const bool json = options.common.json;
  if (!json) std::printf("%s\n", id.value.c_str());
  if (json && !options.wait) std::printf("%s\n", dump({{"id", id.value}}).c_str());
  std::fflush(stdout);
  if (!options.wait) return 0;
  const JobStatus last = follow(farm, id, quiet);
  if (!options.output.path.empty()) fetch_to_file(farm, id, options.output, quiet);
  if (json) std::printf("%s\n", dump(job_to_json(last)).c_str());
  return 0;
}

}  // namespace

void add_submit(CLI::App& app, Action& action) {
  auto options = std::make_shared<SubmitOptions>();
  CLI::App* verb =
      add_verb(app, "submit", "Queue a scene, or its frames, on the farm; prints the id", &options->common);
  add_json(verb, &options->common);
  add_connection(verb, &options->connection);
  add_scene(verb, &options->scene);
  add_render_options(verb, &options->scene);
  add_frames(verb, &options->frames);
  add_output(verb, &options->output);
  add_denoise_flag(verb, &options->output);
  verb->add_option("--name", options->name, "What listings call the job (default: the scene file's name)");
  verb->add_option("--priority", options->priority, "Higher first; equal ones share the workers")
      ->capture_default_str();
  verb->add_option("--pool", options->pool, "Only workers of this pool");
  verb->add_option("--max-workers", options->max_workers, "At most so many workers at a time; 0: any number")
      ->check(CLI::Range(0, 100000).description("0 to 100000"))
      ->capture_default_str();
  verb->add_option_function<std::string>(
      "--by",
      [options](const std::string& text) {
        options->deadline = parse_deadline(text, static_cast<double>(std::time(nullptr)));
      },
      "When it is to be done: +90m, 18:30 or 2026-12-24T18:30. If it would be late it comes before your "
      "other jobs");
  verb->add_option("--after", options->after,
                   "Jobs and sequences (ID[,ID...]) that must be done before this one starts")
      ->delimiter(',');
  verb->add_option("--submitter", options->submitter,
                   "Who shares the farm with others (default: you); where tokens are used, the token's name")
      ->envname("LIGHTMILL_SUBMITTER");
  verb->add_option("--reference", options->reference, "An image to measure true errors against");
  verb->add_flag("--wait", options->wait, "Follow the job until it ends");
  verb->callback([&action, options] { action = [options] { return submit(*options); }; });
}

}  // namespace lightmill::client
