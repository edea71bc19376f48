// lightmill submit: hands a scene to the farm and prints the job's id.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <filesystem>
#include <memory>

#include "client/cli.h"
#include "client/farm_client.h"
#include "client/follow.h"
#include "client/options.h"
#include "client/output.h"
#include "client/progress.h"
#include "common/error.h"

namespace lightmill::client {
namespace {

struct SubmitOptions {
  CommonOptions common;
  ConnectionOptions connection;
  SceneOptions scene;
  OutputOptions output;
  std::string name, pool, reference;
  int priority = 0;
  bool wait = false;
};

int submit(SubmitOptions& options) {
  finish_scene_options(&options.scene);
  const bool quiet = options.common.quiet;
  if (!options.output.path.empty()) {
    if (!options.wait)
      throw Error(ErrorKind::kUsage, "-o: only with --wait; fetch the image later by lightmill fetch");
    check_output(options.output);
  }
  const SceneDescription scene = load_scene_for(options.scene, quiet);
  JobRequest request;
  request.settings = resolve_settings(scene, options.scene.render);
  if (!options.output.path.empty()) check_output(options.output, request.settings.aovs);
  request.reference = load_reference(options.reference, request.settings.grid);
  request.name =
      options.name.empty() ? std::filesystem::path(options.scene.scene).stem().string() : options.name;
  request.priority = options.priority;
  request.pool = options.pool;
  std::map<std::string, std::string> paths;
  request.bundle = make_bundle(scene, &paths);

  FarmClient farm(options.connection);
  const JobId id = farm.submit(request, paths, [&](size_t blobs, uint64_t bytes) {
    if (quiet) return;
    std::fprintf(stderr, "uploading %zu file(s), %sB\n", blobs,
                 short_number(static_cast<double>(bytes)).c_str());
  });
  std::printf("%s\n", id.value.c_str());
  std::fflush(stdout);
  if (!options.wait) return 0;
  follow(farm, id, quiet);
  if (!options.output.path.empty()) fetch_to_file(farm, id, options.output, quiet);
  return 0;
}

}  // namespace

void add_submit(CLI::App& app, Action& action) {
  auto options = std::make_shared<SubmitOptions>();
  CLI::App* verb =
      add_verb(app, "submit", "Queue a scene on the farm; prints the job's id", &options->common);
  add_connection(verb, &options->connection);
  add_scene(verb, &options->scene);
  add_render_options(verb, &options->scene);
  add_output(verb, &options->output);
  verb->add_option("--name", options->name, "What listings call the job (default: the scene file's name)");
  verb->add_option("--priority", options->priority, "Higher first")->capture_default_str();
  verb->add_option("--pool", options->pool, "Only workers of this pool");
  verb->add_option("--reference", options->reference, "An image to measure true errors against");
  verb->add_flag("--wait", options->wait, "Follow the job until it ends");
  verb->callback([&action, options] { action = [options] { return submit(*options); }; });
}

}  // namespace lightmill::client
