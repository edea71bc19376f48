#pragma once
// The command line: verbs, exit codes, one-line errors.
//
//   int main(int argc, char** argv) { return lightmill::client::run_cli(argc, argv); }
#include <functional>
#include <string>

namespace CLI {
class App;
}

namespace lightmill::client {

/// What a verb's parser leaves behind: the work to do once the whole command line was understood. Returns
/// the process exit code; throws lightmill::Error.
using Action = std::function<int()>;

/// Parses and runs one command. Never throws; errors are one line on stderr. Returns the exit code of the
/// contract: 0 done, 1 failed, 2 wrong usage or bad scene, 3 coordinator unreachable or refused.
int run_cli(int argc, const char* const* argv);

// Each adds its verbs to `app` and, when one of them is chosen, sets `action`.
void add_render(CLI::App& app, Action& action);
void add_submit(CLI::App& app, Action& action);
void add_watch(CLI::App& app, Action& action);
void add_listings(CLI::App& app, Action& action);  // jobs, job, sequences, frames, workers, tiles
void add_logs(CLI::App& app, Action& action);
void add_control(CLI::App& app, Action& action);  // pause, resume, cancel, retry, priority, extend
void add_fetch(CLI::App& app, Action& action);
void add_explain(CLI::App& app, Action& action);
void add_check(CLI::App& app, Action& action);
void add_compare(CLI::App& app, Action& action);
void add_denoise(CLI::App& app, Action& action);
void add_mix(CLI::App& app, Action& action);
void add_report(CLI::App& app, Action& action);
void add_completion(CLI::App& app, Action& action);
void add_manual(CLI::App& app, Action& action);

}  // namespace lightmill::client
