// lightmill pause, resume, cancel, retry, extend: what changes a job.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "client/cli.h"
#include "client/connection/farm_client.h"
#include "client/json_output.h"
#include "client/options.h"
#include "common/base/error.h"

namespace lightmill::client {
namespace {

struct ControlOptions {
  CommonOptions common;
  ConnectionOptions connection;
  std::string job;
  SceneOptions totals;  // extend only: --spp, --time, --target-error
};

int report(const ControlOptions& options, const JobStatus& status) {
  if (options.common.json) {
    std::printf("%s\n", dump(job_to_json(status)).c_str());
  } else if (!options.common.quiet) {
    std::fprintf(stderr, "job %s is %s\n", status.id.value.c_str(), job_state_name(status.state));
  }
  return 0;
}

std::shared_ptr<ControlOptions> add_control_verb(CLI::App& app, const std::string& name,
                                                 const std::string& description) {
  auto options = std::make_shared<ControlOptions>();
  CLI::App* verb = add_verb(app, name, description, &options->common);
  add_json(verb, &options->common);
  add_connection(verb, &options->connection);
  verb->add_option("JOB", options->job, "The job's id")->required();
  return options;
}

int extend(const ControlOptions& options) {
  const RenderOptions& totals = options.totals.render;
  if (!totals.spp && !totals.time_s && !totals.target_error) {
    throw Error(ErrorKind::kUsage, "extend: give a new total by --spp, --time or --target-error");
  }
  FarmClient farm(options.connection);
  return report(options, farm.extend(JobId{options.job}, totals.spp, totals.time_s, totals.target_error));
}

}  // namespace

void add_control(CLI::App& app, Action& action) {
  using Method = JobStatus (FarmClient::*)(const JobId&);
  struct Verb {
    const char* name;
    const char* description;
    Method method;
  };
  for (const Verb& v :
       {Verb{"pause", "Stop handing out a job's tiles", &FarmClient::pause},
        Verb{"resume", "Go on with a paused job", &FarmClient::resume},
        Verb{"cancel", "End a job; what was rendered stays", &FarmClient::cancel},
        Verb{"retry", "Go on with a failed or cancelled job, or render again what the disk has damaged",
             &FarmClient::retry}}) {
    const auto options = add_control_verb(app, v.name, v.description);
    app.get_subcommand(v.name)->callback([&action, options, method = v.method] {
      action = [options, method] {
        FarmClient farm(options->connection);
        return report(*options, (farm.*method)(JobId{options->job}));
      };
    });
  }
  const auto options = add_control_verb(app, "extend", "Set new totals and go on; finished jobs reopen");
  CLI::App* verb = app.get_subcommand("extend");
  add_stop_rule(verb, &options->totals);
  verb->callback([&action, options] { action = [options] { return extend(*options); }; });
}

}  // namespace lightmill::client
