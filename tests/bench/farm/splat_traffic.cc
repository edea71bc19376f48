// What the workers of a large farm hand in for one bidirectional image, whose partials bring splats over the
// whole window: the real scheduler, ledger and merger on a simulated clock, and a line into the coordinator
// of a given rate that commits pass one after the other.
//   splat_traffic WORKERS SECONDS [SAMPLES_PER_SECOND [MEGABYTES_PER_SECOND]]
// SECONDS is what the image would take if nothing was ever lost, SAMPLES_PER_SECOND what a worker renders,
// the rate that of the line and --ingest-limit at once. The image has 1920x1080 pixels. It is simulated at an
// eighth of that, bytes, speeds and rates divided by the same 64, so that a partial of 40 MB need not be
// encoded thousands of times: times and counts of tiles depend on ratios only. How many pixels a tile's
// splats reach, and how many bits they have, are as measured on scenes/cornell-spheres.pbrt.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <map>
#include <memory>
#include <queue>
#include <random>
#include <string>
#include <vector>

#include "common/film/partial.h"
#include "coordinator/core/farm.h"
#include "coordinator/store/memory_job_store.h"

namespace lightmill {
namespace {

constexpr int kScale = 8;
constexpr double kArea = kScale * kScale;  // pixels that one simulated pixel stands for
constexpr int kWidth = 1920 / kScale, kHeight = 1080 / kScale;
constexpr double kSpeedSpread = 0.2;  // standard deviation of the logarithm
constexpr double kReached = 0.86;     // of the window's pixels that splats can reach
constexpr double kReachRate = 1.6;    // and how fast they do: 1 - exp(-kReachRate samples per pixel)
constexpr int kSplatBits = 30, kCameraBits = 33;
constexpr double kAskAgain = 0.25, kWindow = 10;
constexpr int kMostHeld = 3;  // tiles that wait to be handed in before a worker stops rendering

struct Options {
  int workers = 1000;
  double seconds = 600, speed = 2e5, megabytes = 100;
};

struct Worker {
  WorkerId id;
  double speed = 1;
  int waiting = 0;  // to be handed in
  bool stopped = false;
};

struct Event {
  double at;
  uint64_t order;
  size_t worker;
  enum class Kind { kAsk, kFinish, kCommit } kind;
  std::shared_ptr<const LeaseGrant> grant;
  std::shared_ptr<const std::string> bytes;
  bool operator<(const Event& o) const { return at != o.at ? at > o.at : order > o.order; }
};

class Traffic {
 public:
  explicit Traffic(const Options& options) : options_(options), farm_(make_farm()) {
    settings_.integrator = Integrator::kBdpt;
    settings_.grid = {kWidth, kHeight, {0, 0, kWidth, kHeight}};
    const double window = static_cast<double>(settings_.grid.crop.area());
    const double rate = options.workers * options.speed / kArea;
    settings_.spp = std::max<int64_t>(1, std::llround(rate * options.seconds / window));
    std::lognormal_distribution<double> spread(0, kSpeedSpread);
    double total = 0;
    for (int i = 0; i < options.workers; ++i) {
      workers_.push_back(
          {farm_->register_worker({"simulated", 1, "simulation", 0, "class", ""}), spread(random_)});
      total += workers_.back().speed;
    }
    for (Worker& worker : workers_) worker.speed *= rate / total;
    show_speeds();
    job_ = farm_->submit(request_of(settings_));
  }

  void run() {
    for (size_t i = 0; i < workers_.size(); ++i) push({0, 0, i, Event::Kind::kAsk, {}, {}});
    while (farm_->job(job_).state != JobState::kDone) {
      const Event event = events_.top();
      events_.pop();
      clock_.advance(event.at - now_);
      now_ = event.at;
      handle(event);
    }
    report();
  }

 private:
  std::unique_ptr<Farm> make_farm() {
    FarmOptions farm_options;
    farm_options.build = "simulation";
    farm_options.lease_seconds = 1e6;
    farm_options.ingest_bytes_per_second = options_.megabytes * 1e6 / kArea;
    return std::make_unique<Farm>(std::make_unique<MemoryJobStore>(false), clock_, farm_options);
  }
  static JobRequest request_of(const RenderSettings& settings) {
    JobRequest request;
    request.name = "simulated";
    request.bundle.main = "scene.pbrt";
    request.bundle.entries = {{"scene.pbrt", std::string(64, '0'), 1}};
    request.settings = settings;
    return request;
  }
  /// The farm is not new: every worker has handed in something before. (What is assumed of new ones is not to
  /// scale.)
  void show_speeds() {
    RenderSettings settings = settings_;
    settings.integrator = Integrator::kPt;
    settings.spp = 1 << 20;
    const JobId earlier = farm_->submit(request_of(settings));
    for (const Worker& worker : workers_) {
      const auto grant = farm_->lease(worker.id);
      Partial p;
      p.tile = grant->tile;
      p.grid = settings.grid;
      p.quantum_exponent = -52;
      p.camera.resize(static_cast<size_t>(p.grid.pixels(p.tile.cells).area()));
      p.counters.camera_paths = p.camera.size() * static_cast<uint64_t>(p.tile.samples());
      p.cpu_seconds = static_cast<double>(p.counters.camera_paths) / worker.speed;
      farm_->commit(worker.id, {earlier, grant->tile_id, grant->attempt}, encode_partial(p));
    }
    farm_->cancel(earlier);
  }
  void push(Event event) {
    event.order = ++order_;
    events_.push(std::move(event));
  }
  Units bits(int count) { return random_() >> (64 - count); }

  std::string partial_of(const LeaseGrant& grant, double seconds) {
    Partial p;
    p.tile = grant.tile;
    p.grid = settings_.grid;
    p.quantum_exponent = -52;
    p.cpu_seconds = seconds;
    const auto pixels = static_cast<size_t>(p.grid.pixels(p.tile.cells).area());
    p.camera.resize(pixels);
    for (ExactRgb& sum : p.camera) {
      for (Units& u : sum.c) u = bits(kCameraBits);
    }
    const double samples = static_cast<double>(pixels) * static_cast<double>(p.tile.samples());
    const double spp = samples / static_cast<double>(p.grid.crop.area());
    const double reached = kReached * (1 - std::exp(-kReachRate * spp));
    for (uint32_t pixel = 0; pixel < static_cast<uint32_t>(p.grid.crop.area()); ++pixel) {
      if (std::uniform_real_distribution<double>(0, 1)(random_) >= reached) continue;
      p.splats.push_back({pixel, {{bits(kSplatBits) + 1, bits(kSplatBits), bits(kSplatBits)}}});
    }
    p.light_paths = p.counters.light_paths = p.counters.camera_paths = static_cast<uint64_t>(samples);
    return encode_partial(p);
  }

  void handle(const Event& event) {
    Worker& worker = workers_[event.worker];
    if (event.kind == Event::Kind::kAsk) return ask(event.worker);
    if (event.kind == Event::Kind::kFinish) {
      const double seconds = samples_of(*event.grant) / worker.speed;
      const auto bytes = std::make_shared<const std::string>(partial_of(*event.grant, seconds));
      const double size = static_cast<double>(bytes->size()) * kArea;
      bytes_ += size;
      handed_[static_cast<int64_t>(now_ / kWindow)] += size;
      line_free_ = std::max(line_free_, now_) + size / (options_.megabytes * 1e6);
      delay_ = std::max(delay_, line_free_ - now_);
      push({line_free_, 0, event.worker, Event::Kind::kCommit, event.grant, bytes});
      worker.stopped = ++worker.waiting >= kMostHeld;
      if (!worker.stopped) push({now_, 0, event.worker, Event::Kind::kAsk, {}, {}});
      return;
    }
    const LeaseKey key{job_, event.grant->tile_id, event.grant->attempt};
    if (farm_->commit(worker.id, key, *event.bytes) == CommitResult::kAccepted)
      useful_ += samples_of(*event.grant) / worker.speed;
    ++commits_;
    --worker.waiting;
    if (worker.stopped) push({now_, 0, event.worker, Event::Kind::kAsk, {}, {}});
    worker.stopped = false;
  }

  double samples_of(const LeaseGrant& grant) const {
    return static_cast<double>(settings_.grid.pixels(grant.tile.cells).area() * grant.tile.samples());
  }

  void ask(size_t index) {
    auto grant = farm_->lease(workers_[index].id);
    if (!grant) return push({now_ + kAskAgain, 0, index, Event::Kind::kAsk, {}, {}});
    const double seconds = samples_of(*grant) / workers_[index].speed;
    push({now_ + seconds,
          0,
          index,
          Event::Kind::kFinish,
          std::make_shared<const LeaseGrant>(std::move(*grant)),
          {}});
  }

  void report() const {
    double most = 0;
    for (const auto& [window, bytes] : handed_) most = std::max(most, bytes / kWindow);
    std::printf(
        "%d workers of %.0f samples/s, 1920x1080, %lld spp: %.0f s (%.0f s if nothing was lost), efficiency "
        "%.1f %%\n",
        options_.workers, options_.speed, static_cast<long long>(settings_.spp), now_, options_.seconds,
        100 * useful_ / (now_ * options_.workers));
    std::printf("%lld tiles, %.0f s of a worker and %.1f MB each\n", static_cast<long long>(commits_),
                useful_ / static_cast<double>(commits_), bytes_ / static_cast<double>(commits_) / 1e6);
    std::printf(
        "handed in: %.1f MB/s on average, %.1f MB/s in the busiest %.0f s; budget %.0f MB/s, waited for it "
        "up to %.1f s\n",
        bytes_ / now_ / 1e6, most / 1e6, kWindow, options_.megabytes, delay_);
  }

  const Options options_;
  std::mt19937_64 random_{1};
  FakeClock clock_;
  std::unique_ptr<Farm> farm_;
  RenderSettings settings_;
  JobId job_;
  std::vector<Worker> workers_;
  std::priority_queue<Event> events_;
  std::map<int64_t, double> handed_;  // bytes, by window of time
  uint64_t order_ = 0;
  double now_ = 0, line_free_ = 0, delay_ = 0, useful_ = 0, bytes_ = 0;
  int64_t commits_ = 0;
};

}  // namespace
}  // namespace lightmill

int main(int argc, char** argv) {
  lightmill::Options options;
  double* const numbers[] = {&options.seconds, &options.speed, &options.megabytes};
  if (argc < 3 || argc > 5) {
    std::fprintf(stderr,
                 "usage: splat_traffic WORKERS SECONDS [SAMPLES_PER_SECOND [MEGABYTES_PER_SECOND]]\n");
    return 2;
  }
  options.workers = std::atoi(argv[1]);
  for (int i = 2; i < argc; ++i) *numbers[i - 2] = std::atof(argv[i]);
  if (options.workers < 1 || !(options.seconds > 0) || !(options.speed > 0) || !(options.megabytes > 0)) {
    std::fprintf(stderr, "splat_traffic: every number must be above 0\n");
    return 2;
  }
  try {
    lightmill::Traffic(options).run();
  } catch (const lightmill::Error& error) {
    std::fprintf(stderr, "splat_traffic: %s\n", error.what());
    return 1;
  }
  return 0;
}
