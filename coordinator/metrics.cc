#include "coordinator/metrics.h"

#include <map>
#include <sstream>

namespace lightmill {
namespace {

class Writer {
 public:
  void family(const char* name, const char* type, const char* help) {
    name_ = name;
    out_ << "# HELP " << name << ' ' << help << "\n# TYPE " << name << ' ' << type << '\n';
  }
  template <class Number>
  void sample(Number value, const std::string& labels = "") {
    out_ << name_ << (labels.empty() ? "" : "{" + labels + "}") << ' ' << value << '\n';
  }
  template <class Number>
  void counter(const char* name, const char* help, Number value) {
    family(name, "counter", help);
    sample(value);
  }
  std::string text() const { return out_.str(); }

 private:
  std::ostringstream out_;
  const char* name_ = "";
};

}  // namespace

std::string metrics_text(const Farm& farm) {
  Writer out;
  std::map<std::string, int> jobs, workers;
  for (const char* state : {"queued", "running", "paused", "done", "failed", "cancelled"}) jobs[state] = 0;
  for (const char* state : {"idle", "rendering", "draining", "lost", "refused", "benched"})
    workers[state] = 0;
  int64_t leased = 0;
  uint64_t nonfinite = 0;
  double rate = 0;
  for (const JobStatus& job : farm.jobs()) {
    ++jobs[job_state_name(job.state)];
    leased += job.tiles_leased;
    nonfinite += job.counters.nonfinite;
    rate += job.samples_per_second;
  }
  for (const WorkerStatus& worker : farm.workers()) ++workers[worker.state];
  const FarmStats stats = farm.stats();

  out.family("lightmill_jobs", "gauge", "Jobs by state (of the newest 1000).");
  for (const auto& [state, count] : jobs) out.sample(count, "state=\"" + state + "\"");
  out.family("lightmill_workers", "gauge", "Workers by state.");
  for (const auto& [state, count] : workers) out.sample(count, "state=\"" + state + "\"");
  out.family("lightmill_tiles_leased", "gauge", "Tiles that are leased now.");
  out.sample(leased);
  out.family("lightmill_samples_per_second", "gauge", "Pixel samples per second over all jobs.");
  out.sample(rate);
  out.family("lightmill_nonfinite_contributions", "gauge",
             "Contributions dropped as non-finite, over all jobs.");
  out.sample(nonfinite);
  out.family("lightmill_storage_fault", "gauge", "1 while jobs pause because the coordinator's disk fails.");
  out.sample(stats.storage_fault ? 1 : 0);
  out.counter("lightmill_leases_total", "Leases granted.", stats.leases);
  out.counter("lightmill_leases_expired_total", "Leases that ran out.", stats.leases_expired);
  out.family("lightmill_commits_total", "counter", "Partials handed in, by outcome.");
  out.sample(stats.commits, "outcome=\"accepted\"");
  out.sample(stats.commits_repeated, "outcome=\"repeated\"");
  out.sample(stats.commits_stale, "outcome=\"stale\"");
  out.sample(stats.commits_corrupt, "outcome=\"corrupt\"");
  out.counter("lightmill_commit_bytes_total", "Bytes of accepted partials.", stats.commit_bytes);
  out.counter("lightmill_packets_total", "Packets completed.", stats.packets);
  out.counter("lightmill_tile_failures_total", "Tiles that workers reported as failed.", stats.failures);
  out.counter("lightmill_workers_refused_total", "Registrations refused.", stats.workers_refused);
  return out.text();
}

}  // namespace lightmill
