#include "client/connection/local_render.h"

#include <exception>
#include <thread>

#include "client/connection/in_process_link.h"
#include "client/terminal/live_view.h"
#include "common/base/clock.h"
#include "common/base/error.h"
#include "common/build_id/build_id.h"
#include "coordinator/store/memory_job_store.h"
#include "worker/agent/host.h"
#include "worker/agent/tile_runner.h"

namespace lightmill::client {
namespace {

/// Leases can't get lost inside one process; a machine that was suspended must not make them expire.
constexpr double kLeaseSeconds = 86400;
constexpr double kPollSeconds = 0.1;        // between looks at the interrupt flag
constexpr double kLeaseWaitSeconds = 0.05;  // so that the end of the job is the end of the program
constexpr double kFinishSeconds = 10;       // tiles in hand after an interrupt

/// The one scene: under the job's settings, and under those with the plan that its pilot chose.
class OneScene : public agent::RenderSource {
 public:
  explicit OneScene(std::shared_ptr<const agent::PacketRenderer> renderer) : renderer_(std::move(renderer)) {}
  std::shared_ptr<const agent::PacketRenderer> open(const std::string&, const RenderSettings& settings,
                                                    const agent::LookWanted*) override {
    if (settings.integrator != Integrator::kAuto || needs_pilot(settings)) return renderer_;
    if (!planned_) planned_ = renderer_->with_settings(settings);  // a job's plan does not change
    return planned_;
  }

 private:
  std::shared_ptr<const agent::PacketRenderer> renderer_, planned_;
};

/// Runs a TileRunner on its own thread; joins whatever happens.
class RunnerThread {
 public:
  RunnerThread(Farm& farm, std::shared_ptr<const agent::PacketRenderer> renderer, int threads)
      : link_(farm), source_(std::move(renderer)), runner_(link_, source_, options(threads)) {
    thread_ = std::thread([this] {
      try {
        runner_.run();
      } catch (...) {
        error_ = std::current_exception();
      }
      ended_ = true;
    });
  }
  ~RunnerThread() { join(); }
  void finish_tiles() {
    runner_.drain();
    if (thread_.joinable()) thread_.join();
  }
  /// Stops at once; rethrows what ended the runner.
  void stop() {
    join();
    if (error_) std::rethrow_exception(error_);
  }
  bool ended() const { return ended_; }

 private:
  static agent::RunnerOptions options(int threads) {
    agent::RunnerOptions options;
    options.threads = threads;
    options.registration = {agent::host_name(), threads, build_id(), kPartialSchema, "local", ""};
    options.lease_wait_seconds = kLeaseWaitSeconds;
    options.drain_timeout_seconds = kFinishSeconds;
    return options;
  }
  void join() {
    runner_.stop();
    if (thread_.joinable()) thread_.join();
  }
  InProcessLink link_;
  OneScene source_;
  agent::TileRunner runner_;
  std::atomic<bool> ended_{false};
  std::exception_ptr error_;
  std::thread thread_;
};

/// A view's last picture comes while there still is a farm, whatever happens.
struct ViewEnd {
  LiveView* view;
  ~ViewEnd() {
    if (view) view->finish();
  }
};

}  // namespace

LocalResult render_local(const JobRequest& request, std::shared_ptr<const agent::PacketRenderer> renderer,
                         int threads, const std::function<bool(const JobStatus&)>& observe, LiveView* view) {
  const SteadyClock clock;
  FarmOptions options;
  options.build = build_id();
  options.schema = kPartialSchema;
  options.lease_seconds = kLeaseSeconds;
  options.denoised_errors = false;    // it would take processors from the render; a target has it in any case
  options.denoise_threads = threads;  // which have nothing else to do then
  options.max_attempts = 1;           // there is one worker, and what it failed at it would fail at again
  Farm farm(std::make_unique<MemoryJobStore>(false), clock, options);
  const JobId job = farm.submit(request);
  LocalResult result;
  result.status = farm.job(job);
  if (view) view->show([&] { return farm.display_image(job); });
  const ViewEnd view_end{view};
  {
    RunnerThread runner(farm, std::move(renderer), threads);
    while (!is_final(result.status.state) && !runner.ended()) {
      if (!observe(result.status)) {
        result.interrupted = true;
        break;
      }
      const int64_t tiles = result.status.tiles_committed;
      result.status = farm.wait(job, result.status.version, kPollSeconds);
      if (view && (result.status.tiles_committed > tiles || tiles == 0)) view->changed();
    }
    if (result.interrupted) runner.finish_tiles();
    runner.stop();
  }
  if (view) view->finish();
  result.status = farm.job(job);
  if (result.status.state == JobState::kFailed) throw Error(ErrorKind::kFailed, result.status.message);
  if (is_final(result.status.state)) result.interrupted = false;
  result.aovs = farm.aovs(job, &result.image);
  result.curve = farm.curve(job);
  result.pilot = farm.pilot(job);
  return result;
}

}  // namespace lightmill::client
