// lightmill jobs, job, sequences, frames, workers, tiles: what the farm is doing.
#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>
#include <nlohmann/json.hpp>

#include "client/cli.h"
#include "client/connection/farm_client.h"
#include "client/connection/sequence_client.h"
#include "client/json_output.h"
#include "client/options.h"
#include "client/terminal/progress.h"
#include "client/terminal/sequence_progress.h"
#include "common/farm/pilot_result.h"
#include "common/film/dropped_text.h"

namespace lightmill::client {
namespace {

struct ListOptions {
  CommonOptions common;
  ConnectionOptions connection;
  std::string job;
  bool frames = false;  // jobs only: also those of sequences
};

template <class List, class ToJson, class PrintRow>
int print_list(bool json, const List& list, const char* header, ToJson to_json, PrintRow print_row) {
  if (json) {
    nlohmann::json array = nlohmann::json::array();
    for (const auto& item : list) array.push_back(to_json(item));
    std::printf("%s\n", dump(array).c_str());
    return 0;
  }
  std::printf("%s\n", header);
  for (const auto& item : list) print_row(item);
  return 0;
}

int jobs(const ListOptions& options) {
  const auto list = FarmClient(options.connection).jobs(options.frames);
  return print_list(options.common.json, list, "ID       STATE      PROGRESS  NAME", job_to_json,
                    [](const JobStatus& s) {
                      std::printf("%-8s %-10s %s  %s\n", s.id.value.c_str(), job_state_name(s.state),
                                  progress_line(s).substr(0, 5).c_str(), s.name.c_str());
                    });
}

int sequences(const ListOptions& options) {
  const auto list = SequenceClient(options.connection).sequences();
  return print_list(options.common.json, list, "ID       STATE      NAME, PROGRESS", sequence_to_json,
                    [](const SequenceStatus& s) {
                      std::printf("%-8s %-10s %s: %s\n", s.id.value.c_str(), job_state_name(s.state),
                                  s.request.name.c_str(), sequence_line(s).c_str());
                    });
}

int frames(const ListOptions& options) {
  const auto list = SequenceClient(options.connection).frames(SequenceId{options.job});
  return print_list(options.common.json, list, "FRAME    STATE      SPP       RELMSE    TIME      JOB",
                    frame_to_json, [](const FrameStatus& s) {
                      char error[32] = "-";
                      if (s.relmse) std::snprintf(error, sizeof error, "%.3g", *s.relmse);
                      std::printf("%-8d %-10s %-9.4g %-9s %-9s %s%s%s\n", s.number, job_state_name(s.state),
                                  s.spp, error, duration_text(s.wall_seconds).c_str(), s.job.value.c_str(),
                                  s.message.empty() ? "" : "  ", s.message.c_str());
                    });
}

int sequence(const ListOptions& options) {
  const SequenceStatus s = SequenceClient(options.connection).sequence(SequenceId{options.job});
  if (options.common.json) {
    std::printf("%s\n", dump(sequence_to_json(s)).c_str());
    return 0;
  }
  std::printf("sequence  %s  %s\n", s.id.value.c_str(), s.request.name.c_str());
  std::printf("state     %s%s%s\n", job_state_name(s.state), s.message.empty() ? "" : ": ",
              s.message.c_str());
  std::printf("progress  %s\n", sequence_line(s).c_str());
  std::printf("frames    %d to %d, at %.4g a second, %s\n", s.first_frame, s.last_frame, s.request.fps,
              frame_order_name(s.request.order));
  std::printf("time      %s wall over all frames, %s of processors\n", duration_text(s.wall_seconds).c_str(),
              duration_text(s.cpu_seconds).c_str());
  return 0;
}

int job(const ListOptions& options) {
  if (is_sequence_id(options.job)) return sequence(options);
  FarmClient farm(options.connection);
  const JobStatus s = farm.job(JobId{options.job});
  if (options.common.json) {
    nlohmann::json document = job_to_json(s);
    document["pilot"] = pilot_document(farm.pilot(s.id));
    std::printf("%s\n", dump(document).c_str());
    return 0;
  }
  const FilmGrid& grid = s.settings.grid;
  std::printf("job       %s  %s\n", s.id.value.c_str(), s.name.c_str());
  std::printf("state     %s%s%s\n", job_state_name(s.state), s.message.empty() ? "" : ": ",
              s.message.c_str());
  if (const std::string turn = turn_text(s); !turn.empty()) std::printf("turn      %s\n", turn.c_str());
  std::printf("progress  %s\n", progress_line(s).c_str());
  std::printf("packets   %lld of %lld, tiles committed %lld, leases reassigned %lld\n",
              static_cast<long long>(s.packets_done), static_cast<long long>(s.packets_total),
              static_cast<long long>(s.tiles_committed), static_cast<long long>(s.leases_reassigned));
  std::printf("image     %dx%d, %s\n", grid.crop.width(), grid.crop.height(),
              sampling_text(s.settings).c_str());
  std::printf("time      %s wall, %s of processors\n", duration_text(s.wall_seconds).c_str(),
              duration_text(s.cpu_seconds).c_str());
  std::printf("traffic   %.2f MB of partials\n", static_cast<double>(s.commit_bytes) / 1e6);
  if (s.relmse && s.relmse_low && s.relmse_high) {
    std::printf("relMSE    %.4g (95 %%: %.4g to %.4g)\n", *s.relmse, *s.relmse_low, *s.relmse_high);
  }
  if (s.denoised_relmse && s.denoised_relmse_low && s.denoised_relmse_high) {
    std::printf("denoised  %.4g (95 %%: %.4g to %.4g)\n", *s.denoised_relmse, *s.denoised_relmse_low,
                *s.denoised_relmse_high);
  }
  if (const std::string scales = scales_text(s); !scales.empty())
    std::printf("scales    %s\n", scales.c_str());
  for (const std::string& line : s.missing_light) std::printf("missing   %s\n", line.c_str());
  const std::vector<DroppedLine> dropped = dropped_lines(s.dropped, s.counters.nonfinite);
  if (dropped.empty()) std::printf("dropped   nothing\n");
  for (const DroppedLine& line : dropped)
    std::printf("dropped   %s%s\n", line.warning ? "warning: " : "", line.text.c_str());
  return 0;
}

int workers(const ListOptions& options) {
  const auto list = FarmClient(options.connection).workers();
  return print_list(options.common.json, list, "ID       STATE      THREADS  TILES    SEEN      HOST",
                    worker_to_json, [](const WorkerStatus& w) {
                      std::printf("%-8s %-10s %7d  %-7lld  %-8s  %s\n", w.id.value.c_str(), w.state.c_str(),
                                  w.registration.threads, static_cast<long long>(w.tiles_committed),
                                  (duration_text(w.seconds_since_seen) + " ago").c_str(),
                                  w.registration.host.c_str());
                    });
}

int tiles(const ListOptions& options) {
  const auto list = FarmClient(options.connection).tiles(JobId{options.job});
  return print_list(
      options.common.json, list, "TILE     STATE      ATTEMPT  WORKER   CELLS            SAMPLES",
      tile_to_json, [](const TileStatus& t) {
        const CellRect& c = t.tile.cells;
        char cells[64];
        std::snprintf(cells, sizeof cells, "%d,%d-%d,%d", c.x0, c.y0, c.x1, c.y1);
        if (is_pilot(t.tile)) std::snprintf(cells, sizeof cells, "pilot");
        std::printf("%-8lld %-10s %7lld  %-8s %-16s %lld-%lld\n", static_cast<long long>(t.id.value),
                    t.state.c_str(), static_cast<long long>(t.attempt), t.worker.value.c_str(), cells,
                    static_cast<long long>(t.tile.sample_begin), static_cast<long long>(t.tile.sample_end));
      });
}

}  // namespace

void add_listings(CLI::App& app, Action& action) {
  struct Verb {
    const char* name;
    const char* description;
    bool takes_job;
    int (*run)(const ListOptions&);
  };
  for (const Verb& v :
       {Verb{"jobs", "List all jobs", false, jobs}, Verb{"job", "Show one job or sequence", true, job},
        Verb{"sequences", "List all sequences", false, sequences},
        Verb{"frames", "List a sequence's frames", true, frames},
        Verb{"workers", "List the workers", false, workers},
        Verb{"tiles", "List a job's tiles: the ledger", true, tiles}}) {
    auto options = std::make_shared<ListOptions>();
    CLI::App* verb = add_verb(app, v.name, v.description, &options->common);
    add_json(verb, &options->common);
    add_connection(verb, &options->connection);
    if (v.takes_job)
      verb->add_option(v.run == frames ? "SEQUENCE" : "JOB", options->job, "Its id")->required();
    if (v.run == jobs) verb->add_flag("--frames", options->frames, "Also the frames of sequences");
    verb->callback([&action, options, run = v.run] { action = [options, run] { return run(*options); }; });
  }
}

}  // namespace lightmill::client
