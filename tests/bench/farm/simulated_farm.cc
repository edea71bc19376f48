#include "tests/bench/farm/simulated_farm.h"

#include <algorithm>
#include <cmath>
#include <ctime>
#include <memory>
#include <optional>
#include <random>
#include <string>
#include <utility>
#include <vector>

#include "coordinator/core/farm.h"
#include "coordinator/farm/sharing/film_bytes.h"
#include "coordinator/store/memory_job_store.h"
#include "tests/bench/farm/simulated_partial.h"

namespace lightmill {
namespace {

constexpr double kLeaseLatency = 0.005, kCommitLatency = 0.02;
constexpr double kSpeedSpread = 0.4, kTileNoise = 0.1;  // standard deviations of logarithms
constexpr double kLateShare = 0.2, kLateWithin = 0.1;   // so many join within so much of the job's time
constexpr double kMeanLife = 1800, kAway = 30;          // seconds between deaths, and until the return
constexpr double kAskAgain = 0.25, kTick = 0.25;
constexpr int kWaiting = 200;  // idle workers that a coordinator lets wait; they ask at once
constexpr double kFirstPause = 0.1,
                 kLastPause = 5;           // of others, twice as long each time (worker/agent/backoff.h)
constexpr int kLargeFarm = 10000;          // workers; from there on the image is larger
constexpr int64_t kPacketsPerWorker = 64;  // at least: with fewer, packets are what is shared out badly
constexpr int kTimedRenewals =
    16;  // one in so many is measured, as reading the processor's clock costs as much

enum class Kind : uint8_t { kAsk, kFinish, kCommit, kRenew, kDie, kTick };

/// A tile on its way from lease to commit.
struct Flight {
  LeaseKey key;
  TileSpec tile;
  double lease_seconds = 0, rendering = 0;
  std::string bytes = {};  // once it is rendered
};

/// Of a large farm there are hundreds of thousands at once, which are moved again and again.
struct Event {
  double at = 0;
  uint64_t order = 0;
  uint32_t worker = 0, life = 0;  // events of a worker's earlier lives are void
  Kind kind = Kind::kTick;
  std::shared_ptr<Flight> flight = {};
};
bool later(const Event& a, const Event& b) { return a.at != b.at ? a.at > b.at : a.order > b.order; }

double processor_seconds() {
  timespec now{};
  clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
  return static_cast<double>(now.tv_sec) + static_cast<double>(now.tv_nsec) * 1e-9;
}

RenderSettings settings_of(const SimulationOptions& options) {
  const int scale = options.workers >= kLargeFarm ? 2 : 1;
  const int width = options.width > 0 ? options.width : 960 * scale,
            height = options.height > 0 ? options.height : 540 * scale;
  RenderSettings settings;
  settings.integrator = options.integrator;
  settings.grid = {width, height, {0, 0, width, height}};
  settings.spp = options.spp;
  while (settings.grid.cells().count() * settings.spp / kSuperblockSamples <
         kPacketsPerWorker * options.workers)
    settings.spp *= 2;
  return settings;
}

class Simulation {
 public:
  explicit Simulation(const SimulationOptions& options)
      : options_(options),
        random_(options.seed),
        farm_(make_farm()),
        settings_(settings_of(options)),
        partial_(settings_) {
    JobRequest request;
    request.name = "simulated";
    request.bundle.main = "scene.pbrt";
    request.bundle.entries = {{"scene.pbrt", std::string(64, '0'), 1}};
    request.settings = settings_;
    job_ = farm_->submit(request);
    std::lognormal_distribution<double> speed(0, kSpeedSpread);
    double total = 0;
    workers_.resize(static_cast<size_t>(options.workers));
    for (Worker& worker : workers_) total += worker.speed = options.trouble ? speed(random_) : 1;
    const double samples =
        static_cast<double>(settings_.grid.crop.area()) * static_cast<double>(settings_.spp);
    for (Worker& worker : workers_) worker.speed *= samples / (total * options.seconds);
  }

  SimulationResult run() {
    for (uint32_t i = 0; i < workers_.size(); ++i) {
      const bool late = options_.trouble && draw() < kLateShare;
      push({late ? draw() * kLateWithin * options_.seconds : 0, 0, i, 0, Kind::kAsk});
    }
    push({kTick, 0, 0, 0, Kind::kTick});
    double last_commit = 0;  // the job was done by then
    for (JobState state = JobState::kQueued; state != JobState::kDone;) {
      Event event = pop();
      clock_.advance(event.at - now_);
      now_ = event.at;
      const Kind kind = event.kind;
      handle(std::move(event));
      if (kind == Kind::kTick) state = farm_->job(job_).state;
      if (kind == Kind::kCommit) last_commit = now_;
      if (state == JobState::kFailed) throw Error(ErrorKind::kFailed, farm_->job(job_).message);
    }
    return result(last_commit);
  }

 private:
  struct Worker {
    double speed = 1;  // samples a second
    WorkerId id = {};
    uint32_t life = 0;
    bool idle = false;
    double alive_since = -1;
    double pause = kFirstPause;  // before it asks again
    double handing_in = 0;       // seconds that this takes of its processor, beside the next tile
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
    events_.push_back(std::move(event));
    std::push_heap(events_.begin(), events_.end(), later);
  }
  Event pop() {
    std::pop_heap(events_.begin(), events_.end(), later);
    Event event = std::move(events_.back());
    events_.pop_back();
    return event;
  }
  template <class Call>
  auto timed(double* total, Call call) {
    const double start = processor_seconds();
    auto result = call();
    *total += processor_seconds() - start;
    return result;
  }

  void handle(Event event) {
    if (event.kind == Kind::kTick) {
      farm_->tick();
      push({now_ + kTick, 0, 0, 0, Kind::kTick});
      return;
    }
    Worker& worker = workers_[event.worker];
    if (event.life != worker.life) {
      if (event.kind == Kind::kFinish) result_.lost_seconds += event.flight->rendering;
      return;
    }
    switch (event.kind) {
      case Kind::kAsk:
        ask(event.worker);
        break;
      case Kind::kFinish:
        finish(event);
        push({now_, 0, event.worker, worker.life, Kind::kAsk});
        break;
      case Kind::kCommit:
        commit(worker, *event.flight);
        break;
      case Kind::kRenew:
        if (renew(worker, event.flight->key)) {
          event.at = now_ + event.flight->lease_seconds / 3;
          push(std::move(event));
        }
        break;
      case Kind::kDie:
        die(event.worker);
        break;
      case Kind::kTick:
        break;
    }
  }

  void finish(Event& event) {
    event.flight->bytes = partial_.encode(event.flight->tile, event.flight->rendering);
    const auto size = static_cast<double>(event.flight->bytes.size());
    result_.commit_bytes += size;
    const double handing_in = size * options_.seconds_per_byte;
    workers_[event.worker].handing_in = handing_in;
    event.at = now_ + kCommitLatency + size / options_.line_bytes_per_second + handing_in;
    push({event.at, 0, event.worker, event.life, Kind::kCommit, std::move(event.flight)});
  }

  void commit(const Worker& worker, const Flight& flight) {
    const CommitResult answer = timed(&result_.commit_core_seconds,
                                      [&] { return farm_->commit(worker.id, flight.key, flight.bytes); });
    ++result_.commits;
    (answer == CommitResult::kAccepted ? result_.useful_seconds : result_.lost_seconds) += flight.rendering;
  }

  /// Whether it still has the lease.
  bool renew(const Worker& worker, const LeaseKey& key) {
    const auto call = [&] {
      try {
        return farm_->renew(worker.id, {key}).empty();
      } catch (const UnknownWorker&) {  // it registers when it asks again
        return false;
      }
    };
    if (result_.renewals++ % kTimedRenewals) return call();
    double seconds = 0;
    const bool held = timed(&seconds, call);
    result_.renewal_core_seconds += kTimedRenewals * seconds;
    return held;
  }

  void die(uint32_t index) {
    Worker& worker = workers_[index];
    ++result_.deaths;
    ++worker.life;
    result_.alive_seconds += now_ - worker.alive_since;
    worker.alive_since = -1;
    worker.id = {};
    set_idle(worker, false);
    push({now_ + kAway, 0, index, worker.life, Kind::kAsk});
  }

  void set_idle(Worker& worker, bool idle) {
    idle_ += idle - worker.idle;
    worker.idle = idle;
  }

  void ask(uint32_t index) {
    Worker& worker = workers_[index];
    if (worker.id.empty()) {
      worker.id = farm_->register_worker({"simulated", 1, "simulation", 0, "class", ""});
    }
    if (worker.alive_since < 0) {
      worker.alive_since = now_;
      const double life = std::exponential_distribution<double>(1 / kMeanLife)(random_);
      if (options_.trouble) push({now_ + life, 0, index, worker.life, Kind::kDie});
    }
    std::optional<LeaseGrant> grant;
    try {
      grant = timed(&result_.lease_core_seconds, [&] { return farm_->lease(worker.id); });
    } catch (const UnknownWorker&) {  // it said nothing for too long, as its tile was lost to another one
      worker.id = {};
      push({now_ + kFirstPause, 0, index, worker.life, Kind::kAsk});
      return;
    }
    ++result_.leases;
    if (!grant) {
      if (first_idle_ < 0) first_idle_ = now_;
      set_idle(worker, true);
      double pause = kAskAgain;
      if (idle_ > kWaiting) {
        pause = worker.pause * (0.5 + draw() / 2);
        worker.pause = std::min(kLastPause, 2 * worker.pause);
      }
      push({now_ + pause, 0, index, worker.life, Kind::kAsk});
      return;
    }
    first_idle_ = -1;  // there was something after all
    set_idle(worker, false);
    worker.pause = kFirstPause;
    const auto samples =
        static_cast<double>(settings_.grid.pixels(grant->tile.cells).area() * grant->tile.samples());
    const double noise = std::exp(std::normal_distribution<double>(0, kTileNoise)(random_));
    const double rendering = samples / worker.speed * noise;
    const auto flight = std::make_shared<Flight>(Flight{LeaseKey{grant->job, grant->tile_id, grant->attempt},
                                                        grant->tile, grant->lease_seconds, rendering});
    const double busy = std::exchange(worker.handing_in, 0) + rendering;
    push({now_ + kLeaseLatency + busy, 0, index, worker.life, Kind::kFinish, flight});
    if (busy > flight->lease_seconds / 3)
      push({now_ + flight->lease_seconds / 3, 0, index, worker.life, Kind::kRenew, flight});
  }

  SimulationResult result(double end) {
    for (const Worker& worker : workers_) {
      if (worker.alive_since >= 0) result_.alive_seconds += end - worker.alive_since;
    }
    const FarmStats stats = farm_->stats();
    result_.seconds = end;
    result_.tail_seconds = first_idle_ < 0 ? 0 : end - first_idle_;
    result_.tiles_split = stats.tiles_split;
    result_.races = stats.races;
    result_.film_bytes = film_bytes(settings_);
    return result_;
  }

  const SimulationOptions options_;
  std::mt19937_64 random_;
  FakeClock clock_;
  std::unique_ptr<Farm> farm_;
  const RenderSettings settings_;
  SimulatedPartial partial_;
  JobId job_;
  std::vector<Worker> workers_;
  std::vector<Event> events_;  // a heap
  uint64_t order_ = 0;
  double now_ = 0, first_idle_ = -1;
  int idle_ = 0;  // workers that have nothing to do
  SimulationResult result_;
};

}  // namespace

double SimulationResult::tile_load(const SimulationOptions& options) const {
  const double rpcs = static_cast<double>(commits) * options.rpc_seconds;
  return (lease_core_seconds + commit_core_seconds + rpcs) / seconds;
}

double SimulationResult::renewal_load(const SimulationOptions& options) const {
  return (renewal_core_seconds + static_cast<double>(renewals) * options.renew_seconds) / seconds;
}

SimulationResult simulate(const SimulationOptions& options) { return Simulation(options).run(); }

}  // namespace lightmill
