#include "coordinator/http/metrics.h"

#include <prometheus/text_serializer.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <set>

namespace lightmill {
namespace {

using prometheus::ClientMetric;
using prometheus::Histogram;
using prometheus::MetricFamily;
using prometheus::MetricType;

/// Seconds, from what a quiet coordinator needs to what means trouble.
const Histogram::BucketBoundaries kSeconds = {0.001, 0.003, 0.01, 0.03, 0.1, 0.3, 1, 3, 10, 30};

/// Families that are read off the farm's state rather than counted along.
class Families {
 public:
  void begin(const char* name, MetricType type, const char* help) {
    MetricFamily family;
    family.name = name;
    family.help = help;
    family.type = type;
    all_.push_back(std::move(family));
  }
  template <class Number>
  void sample(Number value, const char* label = nullptr, const std::string& label_value = "") {
    ClientMetric metric;
    if (label) metric.label.push_back({label, label_value});
    const auto number = static_cast<double>(value);
    all_.back().type == MetricType::Counter ? metric.counter.value = number : metric.gauge.value = number;
    all_.back().metric.push_back(std::move(metric));
  }
  template <class Number>
  void sample(Number value, std::vector<ClientMetric::Label> labels) {
    sample(value);
    all_.back().metric.back().label = std::move(labels);
  }
  template <class Number>
  void counter(const char* name, const char* help, Number value) {
    begin(name, MetricType::Counter, help);
    sample(value);
  }
  template <class Number>
  void gauge(const char* name, const char* help, Number value) {
    begin(name, MetricType::Gauge, help);
    sample(value);
  }
  std::vector<MetricFamily> take() { return std::move(all_); }

 private:
  std::vector<MetricFamily> all_;
};

bool is_open(const JobStatus& job) {
  return job.state == JobState::kQueued || job.state == JobState::kRunning;
}

int64_t packets_left(const JobStatus& job) {
  return std::max<int64_t>(job.packets_total - job.packets_done, 1);  // a target may ask for more
}

/// CPU seconds of workers that the rest takes; negative if unknown.
double seconds_left(const JobStatus& job) {
  if (job.packets_done <= 0) return -1;
  return job.cpu_seconds / static_cast<double>(job.packets_done) * static_cast<double>(packets_left(job));
}

bool is_there(const WorkerStatus& worker) { return worker.state == "idle" || worker.state == "rendering"; }

void add_running(const std::vector<JobStatus>& jobs, Families& out) {
  std::vector<const JobStatus*> running;
  for (const JobStatus& job : jobs) {
    if (job.state == JobState::kRunning && running.size() < Metrics::kMostJobs) running.push_back(&job);
  }
  const auto family = [&](const char* name, const char* help, auto value) {
    out.begin(name, MetricType::Gauge, help);
    for (const JobStatus* job : running) {
      if (const std::optional<double> number = value(*job)) out.sample(*number, "job", job->id.value);
    }
  };
  using Value = std::optional<double>;
  family("lightmill_job_relmse", "Estimated relMSE of a running job.",
         [](const JobStatus& job) { return job.relmse; });
  family("lightmill_job_relmse_high", "Upper end of its 95 % interval.",
         [](const JobStatus& job) { return job.relmse_high; });
  out.begin(
      "lightmill_job_relmse_boxes", MetricType::Gauge,
      "Estimated relMSE of means over boxes of pixels, times a box's pixels, by side, of a running job.");
  for (const JobStatus* job : running) {
    for (size_t i = 0; i < kBoxSides.size(); ++i) {
      const std::optional<double>& relmse = job->boxes[i].relmse;
      if (relmse) out.sample(*relmse, {{"job", job->id.value}, {"side", std::to_string(kBoxSides[i])}});
    }
  }
  family("lightmill_job_samples_per_pixel", "Mean samples per pixel of a running job.",
         [](const JobStatus& job) { return Value(job.spp); });
  family("lightmill_job_samples_per_second", "Recent pixel samples per second of a running job.",
         [](const JobStatus& job) { return Value(job.samples_per_second); });
  family("lightmill_job_progress", "Packets done of those asked for, 0 to 1, of a running job.",
         [](const JobStatus& job) {
           return job.packets_total > 0
                      ? Value(static_cast<double>(job.packets_done) / static_cast<double>(job.packets_total))
                      : Value();
         });
}

void add_jobs(const std::vector<JobStatus>& jobs, Families& out) {
  std::map<std::string, int> states;
  for (const char* state : {"queued", "running", "paused", "done", "failed", "cancelled"}) states[state] = 0;
  int64_t leased = 0, pending = 0, committed = 0;
  uint64_t nonfinite = 0;
  std::array<uint64_t, kDropKinds> dropped{};
  double rate = 0, left = 0;
  for (const JobStatus& job : jobs) {
    ++states[job_state_name(job.state)];
    nonfinite += job.counters.nonfinite;
    for (size_t i = 0; i < kDropKinds; ++i) dropped[i] += job.dropped[i].count;
    if (is_final(job.state)) continue;
    leased += job.tiles_leased;
    pending += job.tiles_pending;
    committed += job.tiles_committed;
    rate += job.samples_per_second;
    if (is_open(job)) left += std::max(0.0, seconds_left(job));
  }
  out.begin("lightmill_jobs", MetricType::Gauge, "Jobs by state (of the newest 1000).");
  for (const auto& [state, count] : states) out.sample(count, "state", state);
  out.begin("lightmill_tiles", MetricType::Gauge,
            "Tiles of the jobs that have not ended, by state; pending are those of the round at hand.");
  out.sample(pending, "state", "pending");
  out.sample(leased, "state", "leased");
  out.sample(committed, "state", "committed");
  out.gauge("lightmill_samples_per_second", "Recent pixel samples per second over all jobs.", rate);
  out.gauge("lightmill_work_left_seconds",
            "CPU seconds of workers that the open jobs still take, as far as known.", left);
  out.gauge("lightmill_nonfinite_contributions",
            "Contributions dropped as not finite, negative or out of range, over all jobs.", nonfinite);
  out.begin("lightmill_dropped_contributions", MetricType::Gauge,
            "Contributions that were dropped, scaled down or rounded to 0, by kind, over all jobs.");
  for (size_t i = 0; i < kDropKinds; ++i)
    out.sample(dropped[i], "kind", drop_kind_name(static_cast<DropKind>(i)));
  add_running(jobs, out);
}

void add_workers(const std::vector<WorkerStatus>& workers, Families& out) {
  std::map<std::string, int> states;
  for (const char* state : {"idle", "rendering", "draining", "lost", "refused", "benched"}) states[state] = 0;
  int threads = 0;
  for (const WorkerStatus& worker : workers) {
    ++states[worker.state];
    if (is_there(worker)) threads += worker.registration.threads;
  }
  out.begin("lightmill_workers", MetricType::Gauge, "Workers by state.");
  for (const auto& [state, count] : states) out.sample(count, "state", state);
  out.gauge("lightmill_worker_threads", "Render threads of the workers that are idle or rendering.", threads);
}

void add_leading(bool leads, Families& out) {
  out.gauge("lightmill_coordinator_leading",
            "1 of the coordinator that leads the farm, 0 of those that stand by.", leads ? 1 : 0);
}

void add_stats(const FarmStats& stats, Families& out) {
  out.gauge("lightmill_storage_fault", "1 while jobs pause because the coordinator's disk fails.",
            stats.storage_fault ? 1 : 0);
  out.gauge("lightmill_film_bytes", "Memory of the merged layers that are loaded.", stats.film_bytes);
  out.counter("lightmill_film_loads_total", "Merged layers that were read from the store.", stats.film_loads);
  out.counter("lightmill_leases_total", "Leases granted.", stats.leases);
  out.counter("lightmill_leases_expired_total", "Leases that ran out.", stats.leases_expired);
  out.begin("lightmill_commits_total", MetricType::Counter, "Partials handed in, by outcome.");
  out.sample(stats.commits, "outcome", "accepted");
  out.sample(stats.commits_repeated, "outcome", "repeated");
  out.sample(stats.commits_stale, "outcome", "stale");
  out.sample(stats.commits_corrupt, "outcome", "corrupt");
  out.counter("lightmill_commit_bytes_total", "Bytes of accepted partials.", stats.commit_bytes);
  out.counter("lightmill_packets_total", "Packets completed.", stats.packets);
  out.counter("lightmill_samples_total", "Pixel samples of accepted partials.", stats.pixel_samples);
  out.begin("lightmill_rays_total", MetricType::Counter, "Rays cast for accepted partials, by kind.");
  out.sample(stats.counters.closest_hit_rays, "kind", "closest_hit");
  out.sample(stats.counters.shadow_rays, "kind", "shadow");
  out.counter("lightmill_tiles_split_total", "Tiles cut so that more workers could share them.",
              stats.tiles_split);
  out.counter("lightmill_races_total", "Tiles given to a second worker while the first still had them.",
              stats.races);
  out.counter("lightmill_checks_total", "Tiles rendered again by another worker to compare.", stats.checks);
  out.counter("lightmill_liars_total", "Workers whose pixels were wrong.", stats.liars);
  out.counter("lightmill_tiles_taken_back_total", "Committed tiles of such workers that are rendered again.",
              stats.tiles_taken_back);
  out.counter("lightmill_tile_failures_total", "Tiles that workers reported as failed.", stats.failures);
}

}  // namespace

int64_t workers_wanted(const std::vector<JobStatus>& jobs, const std::vector<WorkerStatus>& workers,
                       double finish_within_seconds) {
  double threads = 0, there = 0;
  for (const WorkerStatus& worker : workers) {
    if (!is_there(worker)) continue;
    ++there;
    threads += worker.registration.threads;
  }
  const double threads_each = there > 0 ? threads / there : 1;
  std::set<JobId> not_done;
  for (const JobStatus& job : jobs) {
    if (job.state != JobState::kDone) not_done.insert(job.id);
  }
  const auto waits = [&](const JobStatus& job) {
    return std::any_of(job.after.begin(), job.after.end(),
                       [&](const JobId& id) { return not_done.count(id) > 0; });
  };
  double wanted = 0;
  for (const JobStatus& job : jobs) {
    if (!is_open(job) || waits(job)) continue;
    const double left = seconds_left(job);
    double of_job = left < 0 ? 1 : left / finish_within_seconds / threads_each;
    of_job = std::min(of_job, static_cast<double>(packets_left(job)));
    if (job.max_workers > 0) of_job = std::min(of_job, static_cast<double>(job.max_workers));
    wanted += of_job;
  }
  return static_cast<int64_t>(std::ceil(wanted));
}

Metrics::Metrics(const Farm& farm, const MetricsOptions& options)
    : farm_(farm),
      options_(options),
      lease_wait_(prometheus::BuildHistogram()
                      .Name("lightmill_lease_wait_seconds")
                      .Help("From a worker's question to its lease; waiting for work counts.")
                      .Register(registry_)
                      .Add({}, kSeconds)),
      fold_lag_(prometheus::BuildHistogram()
                    .Name("lightmill_fold_lag_seconds")
                    .Help("From a partial's arrival until it is folded and durable.")
                    .Register(registry_)
                    .Add({}, kSeconds)) {}

void Metrics::count_refusals(const std::string& reason, std::function<uint64_t()> count) {
  const std::lock_guard lock(mutex_);
  refusals_[reason] = std::move(count);
}

void Metrics::count_damaged_blobs(std::function<uint64_t()> count) {
  const std::lock_guard lock(mutex_);
  damaged_blobs_ = std::move(count);
}

std::string standby_metrics() {
  Families out;
  add_leading(false, out);
  return prometheus::TextSerializer().Serialize(out.take());
}

std::string Metrics::text() const {
  const std::vector<JobStatus> jobs = farm_.jobs();
  const std::vector<WorkerStatus> workers = farm_.workers();
  const FarmStats stats = farm_.stats();
  Families out;
  add_leading(true, out);
  add_jobs(jobs, out);
  add_workers(workers, out);
  out.gauge(
      "lightmill_workers_wanted",
      "Workers like those at hand that would finish the open jobs within the coordinator's --finish-within.",
      workers_wanted(jobs, workers, options_.finish_within_seconds));
  add_stats(stats, out);
  out.begin("lightmill_refusals_total", MetricType::Counter, "What was turned away, by reason.");
  for (const char* reason :
       {"worker_build", "worker_schema", "worker_limit", "job_limit", "commit_unknown_job", "spot_check"}) {
    const auto found = stats.refusals.find(reason);
    out.sample(found == stats.refusals.end() ? 0 : found->second, "reason", reason);
  }
  {
    const std::lock_guard lock(mutex_);
    for (const auto& [reason, count] : refusals_) out.sample(count(), "reason", reason);
    out.counter("lightmill_blobs_damaged_total", "Scene files that were found damaged on the disk.",
                damaged_blobs_ ? damaged_blobs_() : 0);
  }
  std::vector<MetricFamily> families = out.take();
  for (MetricFamily& family : registry_.Collect()) families.push_back(std::move(family));
  return prometheus::TextSerializer().Serialize(families);
}

}  // namespace lightmill
