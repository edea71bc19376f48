// lightmill pause, resume, cancel, retry, extend, priority: what changes a job or a sequence.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "client/cli.h"
#include "client/connection/farm_client.h"
#include "client/connection/sequence_client.h"
#include "client/json_output.h"
#include "client/options.h"
#include "client/terminal/sequence_progress.h"
#include "common/base/error.h"

namespace lightmill::client {
namespace {

struct ControlOptions {
  CommonOptions common;
  ConnectionOptions connection;
  std::string job;
  int priority = 0;     // priority only
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

int report(const ControlOptions& options, const SequenceStatus& status) {
  if (options.common.json) {
    std::printf("%s\n", dump(sequence_to_json(status)).c_str());
  } else if (!options.common.quiet) {
    std::fprintf(stderr, "sequence %s is %s: %s\n", status.id.value.c_str(), job_state_name(status.state),
                 sequence_line(status).c_str());
  }
  return 0;
}

std::shared_ptr<ControlOptions> add_control_verb(CLI::App& app, const std::string& name,
                                                 const std::string& description) {
  auto options = std::make_shared<ControlOptions>();
  CLI::App* verb = add_verb(app, name, description, &options->common);
  add_json(verb, &options->common);
  add_connection(verb, &options->connection);
  verb->add_option("JOB", options->job, "The id of a job, or of a sequence")->required();
  return options;
}

int extend(const ControlOptions& options) {
  const RenderOptions& totals = options.totals.render;
  if (!totals.spp && !totals.time_s && !totals.target_error) {
    throw Error(ErrorKind::kUsage, "extend: give a new total by --spp, --time or --target-error");
  }
  if (totals.target_denoised) {
    throw Error(ErrorKind::kUsage,
                "extend --target-error: give a number; it is of the image, raw or denoised, that the job was "
                "submitted with");
  }
  if (is_sequence_id(options.job)) {
    SequenceClient sequences(options.connection);
    return report(options,
                  sequences.extend(SequenceId{options.job}, totals.spp, totals.time_s, totals.target_error));
  }
  FarmClient farm(options.connection);
  return report(options, farm.extend(JobId{options.job}, totals.spp, totals.time_s, totals.target_error));
}

void add_priority(CLI::App& app, Action& action) {
  const auto options = add_control_verb(app, "priority", "Say which job or sequence comes first");
  CLI::App* verb = app.get_subcommand("priority");
  verb->add_option("PRIORITY", options->priority, "Higher first; equal ones share the workers")->required();
  verb->callback([&action, options] {
    action = [options] {
      if (is_sequence_id(options->job)) {
        SequenceClient sequences(options->connection);
        return report(*options, sequences.set_priority(SequenceId{options->job}, options->priority));
      }
      FarmClient farm(options->connection);
      return report(*options, farm.set_priority(JobId{options->job}, options->priority));
    };
  });
}

}  // namespace

void add_control(CLI::App& app, Action& action) {
  using Method = JobStatus (FarmClient::*)(const JobId&);
  using SequenceMethod = SequenceStatus (SequenceClient::*)(const SequenceId&);
  struct Verb {
    const char* name;
    const char* description;
    Method method;
    SequenceMethod of_sequence;
  };
  for (const Verb& v :
       {Verb{"pause", "Stop handing out a job's tiles", &FarmClient::pause, &SequenceClient::pause},
        Verb{"resume", "Go on with a paused job", &FarmClient::resume, &SequenceClient::resume},
        Verb{"cancel", "End a job; what was rendered stays", &FarmClient::cancel, &SequenceClient::cancel},
        Verb{"retry", "Go on with a failed or cancelled job, or render again what the disk has damaged",
             &FarmClient::retry, &SequenceClient::retry}}) {
    const auto options = add_control_verb(app, v.name, v.description);
    app.get_subcommand(v.name)->callback([&action, options, method = v.method, of_sequence = v.of_sequence] {
      action = [options, method, of_sequence] {
        if (is_sequence_id(options->job)) {
          SequenceClient sequences(options->connection);
          return report(*options, (sequences.*of_sequence)(SequenceId{options->job}));
        }
        FarmClient farm(options->connection);
        return report(*options, (farm.*method)(JobId{options->job}));
      };
    });
  }
  add_priority(app, action);
  const auto options = add_control_verb(app, "extend", "Set new totals and go on; finished jobs reopen");
  CLI::App* verb = app.get_subcommand("extend");
  add_stop_rule(verb, &options->totals);
  verb->callback([&action, options] { action = [options] { return extend(*options); }; });
}

}  // namespace lightmill::client
