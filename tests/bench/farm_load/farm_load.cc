// Many workers that render nothing: real gRPC clients, a connection each, with canned partials. Few threads
// drive them by completion queues, as those of a farm have machines of their own. See ./run.
//   farm_load COORDINATOR WORKERS JOBS SECONDS PID
// PID is the coordinator's: its processor time is read from /proc around the load, without what connecting
// costs.
#include <grpcpp/completion_queue.h>
#include <grpcpp/create_channel.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <sstream>
#include <thread>

#include "common/base/digest.h"
#include "common/build_id/build_id.h"
#include "common/rpc/channel.h"
#include "common/rpc/convert.h"
#include "lightmill/v1/client.grpc.pb.h"
#include "lightmill/v1/worker.grpc.pb.h"
#include "tests/bench/farm/grey_partial.h"

namespace lightmill {
namespace {

using Clock = std::chrono::steady_clock;
constexpr size_t kThreads = 2, kTurnsOfThread = 8;  // so many calls are under way at once

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

void require(const grpc::Status& status, const char* what) {
  if (status.ok()) return;
  std::fprintf(stderr, "farm_load: %s: %s\n", what, status.error_message().c_str());
  std::exit(1);
}

std::shared_ptr<grpc::Channel> connection(const std::string& address) {
  grpc::ChannelArguments arguments;
  arguments.SetInt(GRPC_ARG_USE_LOCAL_SUBCHANNEL_POOL, 1);  // not shared with other workers
  arguments.SetMaxReceiveMessageSize(kMaxMessageBytes);
  return grpc::CreateCustomChannel(address, grpc::InsecureChannelCredentials(), arguments);
}

/// As by a worker as slow as real ones: tiles stay small, one cell each.
constexpr double kTileSeconds = 1;

/// Of one thread.
struct Totals {
  int64_t cycles = 0, empty = 0, refused = 0;
  int64_t raw_bytes = 0;
  std::vector<double> lease_seconds, commit_seconds;
  void add(const Totals& other) {
    cycles += other.cycles, empty += other.empty, refused += other.refused, raw_bytes += other.raw_bytes;
    lease_seconds.insert(lease_seconds.end(), other.lease_seconds.begin(), other.lease_seconds.end());
    commit_seconds.insert(commit_seconds.end(), other.commit_seconds.begin(), other.commit_seconds.end());
  }
};

class LoadWorker {
 public:
  explicit LoadWorker(const std::string& address) : stub_(v1::WorkerService::NewStub(connection(address))) {
    v1::RegisterRequest request;
    *request.mutable_registration() =
        to_proto(WorkerRegistration{"load", 1, build_id(), kPartialSchema, "load", ""});
    v1::RegisterResponse response;
    grpc::ClientContext context;
    set_deadline(context, 60);
    require(stub_->Register(&context, request, &response), "register");
    id_ = response.worker_id();
  }
  v1::WorkerService::Stub& stub() const { return *stub_; }
  const std::string& id() const { return id_; }

 private:
  std::unique_ptr<v1::WorkerService::Stub> stub_;
  std::string id_;
};
using LoadWorkers = std::vector<std::unique_ptr<LoadWorker>>;

/// One call after the other: every kStep-th worker leases a tile and commits it, as long as there is time.
class Turn {
 public:
  static constexpr size_t kStep = kThreads * kTurnsOfThread;

  Turn(const LoadWorkers& workers, size_t first, Clock::time_point end, grpc::CompletionQueue& queue,
       Totals& totals)
      : workers_(workers), next_(first), end_(end), queue_(queue), totals_(totals) {
    lease();
  }
  bool ended() const { return !cycle_; }
  /// What was begun last is done.
  void go_on(bool ok) {
    if (!cycle_->writer) return leased();
    if (++cycle_->done == 1) return finish(ok);  // the header is on its way
    if (cycle_->done == 3) committed();          // after the last chunk and the answer
  }

 private:
  struct Cycle {
    const LoadWorker* worker = nullptr;
    grpc::Status status;
    grpc::ClientContext leasing, committing;
    std::unique_ptr<grpc::ClientAsyncResponseReader<v1::LeaseResponse>> reader;
    v1::LeaseResponse leased;
    std::unique_ptr<grpc::ClientAsyncWriter<v1::CommitRequest>> writer;
    v1::CommitRequest chunk;
    v1::CommitResponse answer;
    int64_t raw_bytes = 0;
    int done = 0;  // operations of the commit
    Clock::time_point start;
  };

  void lease() {
    cycle_.reset();
    if (Clock::now() >= end_) return;
    cycle_ = std::make_unique<Cycle>();
    cycle_->worker = workers_[next_ % workers_.size()].get();
    next_ += kStep;
    v1::LeaseRequest request;
    request.set_worker_id(cycle_->worker->id());
    set_deadline(cycle_->leasing, 60);
    cycle_->start = Clock::now();
    cycle_->reader = cycle_->worker->stub().AsyncLease(&cycle_->leasing, request, &queue_);
    cycle_->reader->Finish(&cycle_->leased, &cycle_->status, this);
  }
  void leased() {
    require(cycle_->status, "lease");
    totals_.lease_seconds.push_back(seconds_since(cycle_->start));
    if (!cycle_->leased.has_grant()) {
      ++totals_.empty;
      return lease();
    }
    const LeaseGrant grant = from_proto(cycle_->leased.grant());
    cycle_->raw_bytes = grant.settings.grid.pixels(grant.tile.cells).area() * 48;
    cycle_->chunk.set_chunk(grey_partial(grant, kTileSeconds));
    const std::string& bytes = cycle_->chunk.chunk();
    if (bytes.size() > kChunkBytes) {
      std::fprintf(stderr, "farm_load: partials of several chunks are not made for\n");
      std::exit(1);
    }
    v1::CommitRequest header;
    header.mutable_header()->set_worker_id(cycle_->worker->id());
    *header.mutable_header()->mutable_key() = to_proto(LeaseKey{grant.job, grant.tile_id, grant.attempt});
    header.mutable_header()->set_size(bytes.size());
    header.mutable_header()->set_digest(sha256_hex(bytes));
    set_deadline(cycle_->committing, 60);
    cycle_->committing.set_initial_metadata_corked(true);  // as commit_partial(): all in one packet
    cycle_->start = Clock::now();
    cycle_->writer = cycle_->worker->stub().PrepareAsyncCommit(&cycle_->committing, &cycle_->answer, &queue_);
    cycle_->writer->StartCall(nullptr);  // corked: nothing comes of it
    cycle_->writer->Write(header, grpc::WriteOptions().set_buffer_hint(), this);
  }
  void finish(bool ok) {
    if (ok) {
      cycle_->writer->WriteLast(cycle_->chunk, grpc::WriteOptions(), this);
    } else {
      ++cycle_->done;
    }
    cycle_->writer->Finish(&cycle_->status, this);
  }
  void committed() {
    require(cycle_->status, "commit");
    totals_.commit_seconds.push_back(seconds_since(cycle_->start));
    if (cycle_->answer.outcome() == v1::COMMIT_OUTCOME_ACCEPTED) {
      ++totals_.cycles;
      totals_.raw_bytes += cycle_->raw_bytes;
    } else {
      ++totals_.refused;
    }
    lease();
  }

  const LoadWorkers& workers_;
  size_t next_;
  const Clock::time_point end_;
  grpc::CompletionQueue& queue_;
  Totals& totals_;
  std::unique_ptr<Cycle> cycle_;  // none: ended
};

void drive(const LoadWorkers& workers, size_t thread, Clock::time_point end, Totals& totals) {
  grpc::CompletionQueue queue;
  std::vector<std::unique_ptr<Turn>> turns;
  for (size_t i = 0; i < kTurnsOfThread; ++i) {
    turns.push_back(std::make_unique<Turn>(workers, thread * kTurnsOfThread + i, end, queue, totals));
  }
  size_t under_way = 0;
  for (const auto& turn : turns) under_way += !turn->ended();
  void* tag = nullptr;
  bool ok = false;
  while (under_way > 0 && queue.Next(&tag, &ok)) {
    Turn& turn = *static_cast<Turn*>(tag);
    turn.go_on(ok);
    under_way -= turn.ended();
  }
  queue.Shutdown();
  while (queue.Next(&tag, &ok)) {
  }
}

void submit(const std::string& address, int jobs) {
  const auto stub = v1::ClientService::NewStub(connection(address));
  const std::string scene = "scene";
  v1::UploadBlobsResponse uploaded;
  grpc::ClientContext uploading;
  const auto writer = stub->UploadBlobs(&uploading, &uploaded);
  v1::UploadBlobsRequest blob;
  blob.mutable_header()->set_digest(sha256_hex(scene));
  blob.mutable_header()->set_size(scene.size());
  writer->Write(blob);
  blob.set_chunk(scene);
  writer->Write(blob);
  writer->WritesDone();
  require(writer->Finish(), "upload");
  Bundle bundle;
  bundle.main = "scene.pbrt";
  bundle.entries = {{"scene.pbrt", sha256_hex(scene), scene.size()}};
  for (int i = 0; i < jobs; ++i) {
    RenderSettings settings;
    settings.integrator = Integrator::kPt;
    settings.grid = {256, 256, {0, 0, 256, 256}};
    settings.spp = kMaxSpp;
    v1::SubmitJobRequest request;
    request.set_bundle_json(bundle_to_json(bundle));
    request.set_settings_json(settings_to_json(settings));
    request.set_priority(i % 3);
    v1::SubmitJobResponse response;
    grpc::ClientContext context;
    require(stub->SubmitJob(&context, request, &response), "submit");
  }
}

/// User and system time of a process so far, seconds.
struct ProcessorTime {
  double user = 0, system = 0;
};

ProcessorTime processor_time(const std::string& pid) {
  std::ifstream file("/proc/" + pid + "/stat");
  std::string text;
  std::getline(file, text);
  std::istringstream fields(text.substr(std::min(text.size(), text.rfind(')') + 1)));
  std::string skipped;
  for (int field = 3; field < 14; ++field) fields >> skipped;  // proc(5): utime is the 14th
  ProcessorTime time;
  if (!(fields >> time.user >> time.system)) {
    std::fprintf(stderr, "farm_load: no processor time of process %s in /proc\n", pid.c_str());
    std::exit(1);
  }
  const auto ticks = static_cast<double>(sysconf(_SC_CLK_TCK));
  return {time.user / ticks, time.system / ticks};
}

double percentile(std::vector<double>& values, double p) {
  if (values.empty()) return 0;
  std::sort(values.begin(), values.end());
  return values[static_cast<size_t>(p * static_cast<double>(values.size() - 1))];
}

void run(const std::string& address, int workers, int jobs, double seconds, const std::string& pid) {
  submit(address, jobs);
  LoadWorkers all;
  for (int i = 0; i < workers; ++i) all.push_back(std::make_unique<LoadWorker>(address));
  const ProcessorTime before = processor_time(pid), own_before = processor_time("self");
  const auto start = Clock::now();
  const auto end =
      start + std::chrono::duration_cast<Clock::duration>(std::chrono::duration<double>(seconds));
  Totals of_thread[kThreads], totals;
  {
    std::vector<std::jthread> threads;
    for (size_t t = 0; t < kThreads; ++t) {
      threads.emplace_back([&, t] { drive(all, t, end, of_thread[t]); });
    }
  }
  for (const Totals& part : of_thread) totals.add(part);
  const double took = seconds_since(start);
  const ProcessorTime after = processor_time(pid), own_after = processor_time("self");
  const auto per_cycle = [&](double seconds_spent) {
    return 1e6 * seconds_spent / std::max(1.0, static_cast<double>(totals.cycles));
  };
  std::printf(
      "%d workers connected, %d jobs: %.0f lease+commit cycles/s over %.1f s, %lld without work, %lld "
      "refused\n",
      workers, jobs, static_cast<double>(totals.cycles) / took, took, static_cast<long long>(totals.empty),
      static_cast<long long>(totals.refused));
  std::printf("lease p50 %.1f ms, p99 %.1f ms; commit p50 %.1f ms, p99 %.1f ms; %.0f MB/s of sums merged\n",
              percentile(totals.lease_seconds, 0.5) * 1e3, percentile(totals.lease_seconds, 0.99) * 1e3,
              percentile(totals.commit_seconds, 0.5) * 1e3, percentile(totals.commit_seconds, 0.99) * 1e3,
              static_cast<double>(totals.raw_bytes) / took / 1e6);
  std::printf("processor time a cycle: coordinator %.0f us (user %.0f, system %.0f), clients %.0f us\n",
              per_cycle(after.user + after.system - before.user - before.system),
              per_cycle(after.user - before.user), per_cycle(after.system - before.system),
              per_cycle(own_after.user + own_after.system - own_before.user - own_before.system));
}

}  // namespace
}  // namespace lightmill

int main(int argc, char** argv) {
  if (argc != 6) {
    std::fprintf(stderr, "usage: farm_load COORDINATOR WORKERS JOBS SECONDS PID\n");
    return 2;
  }
  lightmill::prepare_grpc();
  lightmill::run(argv[1], std::atoi(argv[2]), std::atoi(argv[3]), std::atof(argv[4]), argv[5]);
  return 0;
}
