// lightmill fetch: the current or final image of a job.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>
#include <optional>

#include "client/cli.h"
#include "client/connection/farm_client.h"
#include "client/json_output.h"
#include "client/options.h"
#include "client/output.h"
#include "client/terminal/sequence_progress.h"
#include "client/terminal/terminal.h"
#include "client/verbs/follow.h"
#include "client/verbs/sequences.h"
#include "common/base/error.h"

namespace lightmill::client {
namespace {

constexpr int kPreviewSide = 512;

struct FetchOptions {
  CommonOptions common;
  ConnectionOptions connection;
  OutputOptions output;
  std::string job, frames;
  bool preview = false;
};

int fetch_sequence(const FetchOptions& options) {
  if (options.preview) {
    throw Error(ErrorKind::kUsage, "--preview is of one picture; name a frame, as " + options.job + ".1");
  }
  const FrameFetch fetch{options.output, options.frames};
  check_frame_output(fetch, 0);
  FarmClient farm(options.connection);
  SequenceClient sequences(options.connection);
  const SequenceId id{options.job};
  FrameFetcher fetcher(farm, sequences, id, fetch, options.common.quiet);
  fetcher.fetch_new();
  const SequenceStatus status = sequences.sequence(id);
  if (options.common.json) {
    nlohmann::json document = sequence_to_json(status);
    document["written"] = fetcher.written();
    document["left"] = fetcher.left();
    std::printf("%s\n", dump(document).c_str());
  } else if (!options.common.quiet) {
    std::fprintf(stderr, "%d written, %d there already; sequence %s: %s\n", fetcher.written(), fetcher.left(),
                 id.value.c_str(), sequence_line(status).c_str());
  }
  return 0;
}

int fetch(FetchOptions& options) {
  finish_output_options(&options.output);
  const bool to_terminal = options.output.path.empty();
  if (!to_terminal && is_sequence_id(options.job)) return fetch_sequence(options);
  if (!options.frames.empty())
    throw Error(ErrorKind::kUsage, "--frames: " + options.job + " is no sequence; leave it out");
  if (to_terminal && !options.preview)
    throw Error(ErrorKind::kUsage, "-o is required; see lightmill fetch --help");
  if (to_terminal && !is_terminal(stdout)) {
    throw Error(ErrorKind::kUsage,
                "--preview without -o draws on a terminal, which the output is not; name a file");
  }
  if (options.preview && options.output.denoise)
    throw Error(ErrorKind::kUsage, "--denoise: not with --preview, which has no layers");
  const int max_side = options.preview ? kPreviewSide : 0;
  if (!to_terminal) check_output(options.output);
  FarmClient farm(options.connection);
  const JobId id{options.job};
  FetchedImage fetched;
  std::optional<DenoiseFigures> denoised;
  if (to_terminal) {
    fetched = farm.fetch(id, false, terminal_columns(stdout));
    std::fputs(terminal_picture(fetched.image, options.output.transform).c_str(), stdout);
  } else {
    fetched = fetch_to_file(farm, id, options.output, options.common.quiet, max_side, &denoised);
  }
  if (!options.common.json) return 0;
  nlohmann::json document = {{"output", options.output.path},
                             {"width", fetched.image.width},
                             {"height", fetched.image.height},
                             {"aov_channels", fetched.aovs.channels},
                             {"metadata", fetched.metadata}};
  if (denoised) document["denoised"] = denoise_to_json(*denoised);
  std::printf("%s\n", dump(document).c_str());
  return 0;
}

}  // namespace

void add_fetch(CLI::App& app, Action& action) {
  auto options = std::make_shared<FetchOptions>();
  CLI::App* verb =
      add_verb(app, "fetch", "Write the current or final image of a job, or the images of a sequence",
               &options->common);
  add_json(verb, &options->common);
  add_connection(verb, &options->connection);
  add_output(verb, &options->output);
  add_denoise_flag(verb, &options->output);
  verb->add_flag("--preview", options->preview,
                 "A small image, at most 512 pixels a side; without -o it is drawn on the terminal");
  verb->add_option("--frames", options->frames, "Of a sequence only these: A-B[xSTEP][,...]");
  verb->add_option("JOB", options->job,
                   "The id of a job, or of a sequence, whose frames that are done are fetched")
      ->required();
  verb->callback([&action, options] { action = [options] { return fetch(*options); }; });
}

}  // namespace lightmill::client
