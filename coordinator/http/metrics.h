#pragma once
// What Prometheus asks for: the farm's state of the moment, and what was measured of calls since the start.
//
//   Metrics metrics(farm, {});
//   metrics.count_refusals("connection", [&listener] { return listener.refused(); });
//   metrics.lease_granted(0.02);
//   metrics.text();        // format 0.0.4
//
// Series are bounded: jobs are labels only while they run, and at most kMostJobs of them.
#include <prometheus/histogram.h>
#include <prometheus/registry.h>

#include <cstdint>
#include <functional>
#include <map>
#include <mutex>
#include <string>

#include "coordinator/core/farm.h"

namespace lightmill {

/// Content type of what follows.
inline constexpr const char* kMetricsType = "text/plain; version=0.0.4";

struct MetricsOptions {
  double finish_within_seconds = 600;  // what lightmill_workers_wanted aims at
};

/// Thread-safe.
class Metrics {
 public:
  static constexpr size_t kMostJobs = 50;

  /// `farm` must outlive this object.
  explicit Metrics(const Farm& farm, const MetricsOptions& options = {});
  /// A worker got a lease so long after it had asked; waiting for work counts.
  void lease_granted(double seconds) { lease_wait_.Observe(seconds); }
  /// A partial was folded and durable so long after all of it had arrived.
  void committed(double seconds) { fold_lag_.Observe(seconds); }
  /// `count`, as long as this object lives, says how often something was refused for `reason`.
  void count_refusals(const std::string& reason, std::function<uint64_t()> count);
  /// `count`, as long as this object lives, says how many blobs were found damaged.
  void count_damaged_blobs(std::function<uint64_t()> count);
  std::string text() const;

 private:
  const Farm& farm_;
  const MetricsOptions options_;
  prometheus::Registry registry_;
  prometheus::Histogram &lease_wait_, &fold_lag_;
  mutable std::mutex mutex_;
  std::map<std::string, std::function<uint64_t()>> refusals_;  // guarded by mutex_
  std::function<uint64_t()> damaged_blobs_;                    // guarded by mutex_
};

/// What a coordinator that stands by answers in place of Metrics::text(): that it does not lead.
std::string standby_metrics();

/// Workers like those at hand that would finish all open jobs in the time that is wanted: for autoscalers. At
/// least 1 while a job could be rendered, 0 else; for a job never more than it has packets or allows
/// workers. A job without a known rate, none of it being done yet, counts as 1; one that is paused, or waits
/// for others, as 0.
int64_t workers_wanted(const std::vector<JobStatus>& jobs, const std::vector<WorkerStatus>& workers,
                       double finish_within_seconds);

}  // namespace lightmill
