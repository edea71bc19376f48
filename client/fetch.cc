// lightmill fetch: the current or final image of a job.
#include <CLI/CLI.hpp>
#include <filesystem>
#include <memory>

#include "client/cli.h"
#include "client/farm_client.h"
#include "client/follow.h"
#include "client/options.h"
#include "client/output.h"

namespace lightmill::client {
namespace {

struct FetchOptions {
  CommonOptions common;
  ConnectionOptions connection;
  OutputOptions output;
  std::string job;
};

int fetch(const FetchOptions& options) {
  check_output(options.output);
  FarmClient farm(options.connection);
  fetch_to_file(farm, JobId{options.job}, options.output.path, options.output.half, options.common.quiet);
  return 0;
}

}  // namespace

void add_fetch(CLI::App& app, Action& action) {
  auto options = std::make_shared<FetchOptions>();
  CLI::App* verb = add_verb(app, "fetch", "Write the current or final image of a job", &options->common);
  add_connection(verb, &options->connection);
  add_output(verb, &options->output);
  verb->get_option("-o")->required();
  verb->add_option("JOB", options->job, "The job's id")->required();
  verb->callback([&action, options] { action = [options] { return fetch(*options); }; });
}

}  // namespace lightmill::client
