// A farm of any size in simulated time: the real scheduler, lease table and merger under workers of drawn
// speeds that come late, die and return, over a network that costs time. What takes real time here are the
// coordinator's own decisions, decoding and folding, which is measured.
//   farm_sim WORKERS SECONDS [SEED] [--rpc-ms MS] [--renew-ms MS] [--lease-seconds S] [--commit-rate N]
// SECONDS is what the job would take if nothing was ever lost; --rpc-ms is the processor time of one lease
// and one commit outside of the farm's core (gRPC, the disk), as tests/bench/farm_load measures it (its
// figure less what is printed here for the core), --renew-ms that of a renewal.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <ctime>
#include <memory>
#include <optional>
#include <queue>
#include <random>
#include <string>
#include <vector>

#include "common/image/partial.h"
#include "coordinator/farm.h"
#include "coordinator/film_bytes.h"
#include "coordinator/memory_job_store.h"

namespace lightmill {
namespace {

constexpr double kLeaseLatency = 0.005, kCommitLatency = 0.02,
                 kBytesPerSecond = 12.5e6;              // of a worker's line
constexpr double kSpeedSpread = 0.4, kTileNoise = 0.1;  // standard deviations of logarithms
constexpr double kLateShare = 0.2, kLateWithin = 0.1;   // so many join within so much of the job's time
constexpr double kMeanLife = 1800, kAway = 30;          // seconds between deaths, and until the return
constexpr double kAskAgain = 0.25, kTick = 0.25;
constexpr int kWaiting = 200;  // idle workers that a coordinator lets wait; they ask at once
constexpr double kFirstPause = 0.1,
                 kLastPause = 5;           // of others, twice as long each time (worker/agent/backoff.h)
constexpr int kLargeFarm = 10000;          // workers; from there on the image is larger
constexpr int64_t kPacketsPerWorker = 64;  // at least: with fewer, packets are what is shared out badly
constexpr double kFullLoad = 0.7;          // of a core, beyond which calls begin to wait for each other

struct Options {
  int workers = 100;
  double seconds = 60;
  uint64_t seed = 1;
  double rpc_seconds = 0.4e-3, renew_seconds = 0.1e-3;
  double lease_seconds = 10, commits_per_second = 1000;
};

enum class Kind { kAsk, kFinish, kCommit, kRenew, kDie, kTick };
struct Event {
  double at;
  uint64_t order;
  Kind kind;
  size_t worker = 0;
  uint64_t life = 0;
  LeaseGrant grant = {};
  double rendering = 0;
  std::shared_ptr<const std::string> bytes = {};
  bool operator<(const Event& o) const { return at != o.at ? at > o.at : order > o.order; }
};

double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

std::string canned_partial(const LeaseGrant& grant, double cpu_seconds) {
  Partial partial;
  partial.tile = grant.tile;
  partial.grid = grant.settings.grid;
  partial.quantum_exponent = -40;
  const auto area = static_cast<size_t>(partial.grid.pixels(grant.tile.cells).area());
  partial.camera.resize(area);
  for (size_t i = 0; i < area; ++i) {
    // Low bits as random as those of a real image, so that compression has as much to do.
    for (int c = 0; c < 3; ++c) {
      partial.camera[i].c[c] = (static_cast<Units>(grant.tile.samples()) << 38) +
                               ((i * 3 + static_cast<size_t>(c) + 1) * 0x9e3779b97f4a7c15u >> 28);
    }
  }
  partial.counters.camera_paths = area * static_cast<uint64_t>(grant.tile.samples());
  partial.cpu_seconds = cpu_seconds;
  return encode_partial(partial);
}

class Simulation {
 public:
  explicit Simulation(const Options& options) : options_(options), random_(options.seed), farm_(make_farm()) {
    RenderSettings settings;
    settings.integrator = Integrator::kPt;
    const int scale = options.workers >= kLargeFarm ? 2 : 1;
    settings.grid = {960 * scale, 540 * scale, {0, 0, 960 * scale, 540 * scale}};
    settings.spp = 4096;
    while (settings.grid.cells().count() * settings.spp / kSuperblockSamples <
           kPacketsPerWorker * options.workers)
      settings.spp *= 2;
    JobRequest request;
    request.name = "simulated";
    request.bundle.main = "scene.pbrt";
    request.bundle.entries = {{"scene.pbrt", std::string(64, '0'), 1}};
    request.settings = settings_ = settings;
    job_ = farm_->submit(request);
    std::lognormal_distribution<double> speed(0, kSpeedSpread);
    double total = 0;
    for (int i = 0; i < options.workers; ++i) {
      workers_.push_back({speed(random_)});
      total += workers_.back().speed;
    }
    const double samples = static_cast<double>(settings.grid.crop.area()) * static_cast<double>(settings.spp);
    for (Worker& worker : workers_) worker.speed *= samples / (total * options.seconds);
  }

  void run() {
    for (size_t i = 0; i < workers_.size(); ++i) {
      const bool late = draw() < kLateShare;
      push({late ? draw() * kLateWithin * options_.seconds : 0, 0, Kind::kAsk, i});
    }
    push({kTick, 0, Kind::kTick});
    for (bool done = false; !done;) {
      const Event event = events_.top();
      events_.pop();
      clock_.advance(event.at - now_);
      now_ = event.at;
      handle(event);
      if (event.kind == Kind::kTick) done = farm_->job(job_).state == JobState::kDone;
      if (event.kind == Kind::kCommit) last_commit_ = now_;
    }
    now_ = last_commit_;  // the job was done by then
    report();
  }

 private:
  struct Worker {
    double speed = 1;  // samples a second
    WorkerId id = {};
    uint64_t life = 0;  // events of earlier ones are void
    double alive_since = -1;
    double pause = kFirstPause;  // before it asks again
    bool idle = false;
  };

  std::unique_ptr<Farm> make_farm() {
    FarmOptions farm_options;
    farm_options.build = "simulation";
    farm_options.checkpoint_bytes = options_.workers >= kLargeFarm ? 1e9 : 64e6;
    farm_options.lease_seconds = options_.lease_seconds;
    farm_options.commits_per_second = options_.commits_per_second;
    farm_options.max_workers =
        2 * static_cast<size_t>(options_.workers);  // the dead count until they are lost
    return std::make_unique<Farm>(std::make_unique<MemoryJobStore>(), clock_, farm_options);
  }
  double draw() { return std::uniform_real_distribution<double>(0, 1)(random_); }
  void push(Event event) {
    event.order = ++order_;
    events_.push(std::move(event));
  }
  template <class Call>
  auto timed(double* total, Call call) {
    const double start = processor_seconds();
    auto result = call();
    *total += processor_seconds() - start;
    return result;
  }

  void handle(const Event& event) {
    if (event.kind == Kind::kTick) {
      farm_->tick();
      push({now_ + kTick, 0, Kind::kTick});
      return;
    }
    Worker& worker = workers_[event.worker];
    if (event.life != worker.life) {
      if (event.kind == Kind::kFinish) lost_ += event.rendering;
      return;
    }
    switch (event.kind) {
      case Kind::kAsk:
        ask(event.worker);
        break;
      case Kind::kFinish: {
        Event commit = event;
        commit.bytes = std::make_shared<const std::string>(canned_partial(event.grant, event.rendering));
        const auto size = static_cast<double>(commit.bytes->size());
        bytes_ += size;
        commit.at = now_ + kCommitLatency + size / kBytesPerSecond;
        commit.kind = Kind::kCommit;
        push(commit);
        push({now_, 0, Kind::kAsk, event.worker, worker.life});
        break;
      }
      case Kind::kCommit: {
        const LeaseKey key{event.grant.job, event.grant.tile_id, event.grant.attempt};
        const CommitResult result =
            timed(&commit_seconds_, [&] { return farm_->commit(worker.id, key, *event.bytes); });
        ++commits_;
        (result == CommitResult::kAccepted ? useful_ : lost_) += event.rendering;
        break;
      }
      case Kind::kRenew: {
        const LeaseKey key{event.grant.job, event.grant.tile_id, event.grant.attempt};
        ++renewals_;
        bool held = false;
        try {
          held = timed(&renewal_seconds_, [&] { return farm_->renew(worker.id, {key}).empty(); });
        } catch (const UnknownWorker&) {  // it registers when it asks again
        }
        if (held) {
          Event next = event;
          next.at = now_ + event.grant.lease_seconds / 3;
          push(next);
        }
        break;
      }
      case Kind::kDie:
        ++deaths_;
        ++worker.life;
        alive_ += now_ - worker.alive_since;
        worker.alive_since = -1;
        worker.id = {};
        if (worker.idle) --idle_;
        worker.idle = false;
        push({now_ + kAway, 0, Kind::kAsk, event.worker, worker.life});
        break;
      case Kind::kTick:
        break;
    }
  }

  void ask(size_t index) {
    Worker& worker = workers_[index];
    if (worker.id.empty()) {
      worker.id = farm_->register_worker({"simulated", 1, "simulation", 0, "class", ""});
    }
    if (worker.alive_since < 0) {
      worker.alive_since = now_;
      push({now_ + std::exponential_distribution<double>(1 / kMeanLife)(random_), 0, Kind::kDie, index,
            worker.life});
    }
    std::optional<LeaseGrant> grant;
    try {
      grant = timed(&lease_seconds_, [&] { return farm_->lease(worker.id); });
    } catch (const UnknownWorker&) {  // it said nothing for too long, as its tile was lost to another one
      worker.id = {};
      push({now_ + kFirstPause, 0, Kind::kAsk, index, worker.life});
      return;
    }
    ++leases_;
    if (!grant) {
      if (first_idle_ < 0) first_idle_ = now_;
      if (!worker.idle) ++idle_;
      worker.idle = true;
      double pause = kAskAgain;
      if (idle_ > kWaiting) {
        pause = worker.pause * (0.5 + draw() / 2);
        worker.pause = std::min(kLastPause, 2 * worker.pause);
      }
      push({now_ + pause, 0, Kind::kAsk, index, worker.life});
      return;
    }
    first_idle_ = -1;  // there was something after all
    if (worker.idle) --idle_;
    worker.idle = false;
    worker.pause = kFirstPause;
    const auto samples =
        static_cast<double>(grant->settings.grid.pixels(grant->tile.cells).area() * grant->tile.samples());
    const double noise = std::exp(std::normal_distribution<double>(0, kTileNoise)(random_));
    const double rendering = samples / worker.speed * noise;
    push({now_ + kLeaseLatency + rendering, 0, Kind::kFinish, index, worker.life, *grant, rendering});
    if (rendering > grant->lease_seconds / 3)
      push({now_ + grant->lease_seconds / 3, 0, Kind::kRenew, index, worker.life, *grant});
  }

  void report() {
    for (const Worker& worker : workers_) {
      if (worker.alive_since >= 0) alive_ += now_ - worker.alive_since;
    }
    const FarmStats stats = farm_->stats();
    const double tail = first_idle_ < 0 ? 0 : now_ - first_idle_;
    const double cycles = static_cast<double>(commits_);
    const double busy = lease_seconds_ + commit_seconds_ + renewal_seconds_ + cycles * options_.rpc_seconds +
                        static_cast<double>(renewals_) * options_.renew_seconds;
    std::printf("%d workers, %.1f s (%.1f s if nothing was lost), %d deaths\n", options_.workers, now_,
                options_.seconds, deaths_);
    std::printf(
        "efficiency %.2f %% of the workers' time; lost to deaths and races %.2f %%; tail %.2f s = %.2f %%\n",
        100 * useful_ / alive_, 100 * lost_ / alive_, tail, 100 * tail / now_);
    std::printf("tiles %.0f (%.2f s each), cut %llu, raced %llu; %.1f MB committed, %.2f MB/s\n", cycles,
                useful_ / cycles, static_cast<unsigned long long>(stats.tiles_split),
                static_cast<unsigned long long>(stats.races), bytes_ / 1e6, bytes_ / 1e6 / now_);
    std::printf(
        "coordinator: %.3f ms a lease, %.3f ms a commit, %.3f ms assumed for RPCs; %.0f tiles and %.0f "
        "renewals a "
        "second: %.1f %% of one core\n",
        1e3 * lease_seconds_ / static_cast<double>(leases_), 1e3 * commit_seconds_ / cycles,
        1e3 * options_.rpc_seconds, cycles / now_, static_cast<double>(renewals_) / now_, 100 * busy / now_);
    const double load = busy / now_, bears = options_.workers / load;
    std::printf("at this tile time one core bears %.0f such workers, %.0f before calls wait (%.0f %% busy)\n",
                bears, bears * kFullLoad, 100 * kFullLoad);
    if (load <= kFullLoad) return;
    const double parts = std::ceil(load / kFullLoad);
    std::printf(
        "%d workers need %.0f coordinators: jobs shared out among them (each knows its own jobs and "
        "workers);\n"
        "one job alone: as many jobs of other seeds, their films added; or %.0f mergers of %.0f workers "
        "each,\n"
        "which hand in one film of %.0f MB at each checkpoint of 30 s: %.1f MB/s to the root\n",
        options_.workers, parts, parts, std::ceil(options_.workers / parts), film_bytes(settings_) / 1e6,
        parts * film_bytes(settings_) / 30e6);
  }

  const Options options_;
  std::mt19937_64 random_;
  FakeClock clock_;
  std::unique_ptr<Farm> farm_;
  JobId job_;
  std::vector<Worker> workers_;
  std::priority_queue<Event> events_;
  uint64_t order_ = 0;
  double now_ = 0, first_idle_ = -1, last_commit_ = 0;
  double alive_ = 0, useful_ = 0, lost_ = 0, bytes_ = 0;                 // worker seconds; bytes
  double lease_seconds_ = 0, commit_seconds_ = 0, renewal_seconds_ = 0;  // of this machine's processor
  int64_t leases_ = 0, commits_ = 0, renewals_ = 0;
  int idle_ = 0;  // workers that have nothing to do
  RenderSettings settings_;
  int deaths_ = 0;
};

}  // namespace
}  // namespace lightmill

int main(int argc, char** argv) {
  lightmill::Options options;
  std::vector<double> numbers;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    if (name == "--rpc-ms" && i + 1 < argc) {
      options.rpc_seconds = std::atof(argv[++i]) * 1e-3;
    } else if (name == "--renew-ms" && i + 1 < argc) {
      options.renew_seconds = std::atof(argv[++i]) * 1e-3;
    } else if (name == "--lease-seconds" && i + 1 < argc) {
      options.lease_seconds = std::atof(argv[++i]);
    } else if (name == "--commit-rate" && i + 1 < argc) {
      options.commits_per_second = std::atof(argv[++i]);
    } else {
      numbers.push_back(std::atof(argv[i]));
    }
  }
  if (numbers.size() < 2 || numbers.size() > 3 || !(numbers[0] >= 1) || !(numbers[0] <= 1e6) ||
      !(options.lease_seconds > 0) || !(numbers[1] > 0)) {
    std::fprintf(stderr,
                 "usage: farm_sim WORKERS SECONDS [SEED] [--rpc-ms MS] [--renew-ms MS] [--lease-seconds S] "
                 "[--commit-rate N]\n");
    return 2;
  }
  options.workers = static_cast<int>(numbers[0]);
  options.seconds = numbers[1];
  if (numbers.size() == 3) options.seed = static_cast<uint64_t>(numbers[2]);
  try {
    lightmill::Simulation(options).run();
  } catch (const lightmill::Error& error) {
    std::fprintf(stderr, "farm_sim: %s\n", error.what());
    return 1;
  }
  return 0;
}
