// lightmill watch: live progress of a job or a sequence. Exits 0 when it is done, 1 when it failed or was
// cancelled.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "client/cli.h"
#include "client/connection/farm_client.h"
#include "client/json_output.h"
#include "client/options.h"
#include "client/terminal/live_view.h"
#include "client/verbs/follow.h"
#include "client/verbs/sequences.h"
#include "common/base/error.h"

namespace lightmill::client {
namespace {

struct WatchOptions {
  CommonOptions common;
  ConnectionOptions connection;
  std::string job, display;
};

int watch(const WatchOptions& options) {
  if (!options.display.empty()) check_display(options.display);
  if (is_sequence_id(options.job)) {
    if (!options.display.empty())
      throw Error(ErrorKind::kUsage, "--display shows one picture; name a frame, as " + options.job + ".1");
    SequenceClient sequences(options.connection);
    const SequenceStatus last = follow_sequence(sequences, SequenceId{options.job}, options.common.quiet);
    if (options.common.json) std::printf("%s\n", dump(sequence_to_json(last)).c_str());
    return 0;
  }
  FarmClient farm(options.connection);
  const JobStatus last = follow(farm, JobId{options.job}, options.common.quiet, options.display, true);
  if (options.common.json) std::printf("%s\n", dump(job_to_json(last)).c_str());
  return 0;
}

}  // namespace

void add_watch(CLI::App& app, Action& action) {
  auto options = std::make_shared<WatchOptions>();
  CLI::App* verb = add_verb(app, "watch", "Follow a job or a sequence until it ends", &options->common);
  add_json(verb, &options->common);
  add_connection(verb, &options->connection);
  add_display(verb, &options->display);
  verb->add_option("JOB", options->job, "The id of a job, or of a sequence")->required();
  verb->callback([&action, options] { action = [options] { return watch(*options); }; });
}

}  // namespace lightmill::client
