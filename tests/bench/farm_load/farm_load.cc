// Many workers that render nothing: real gRPC clients, a connection each, with canned partials. See ./run.
//   farm_load COORDINATOR WORKERS JOBS SECONDS PID
// PID is the coordinator's: its processor time is read from /proc around the load, without what connecting
// costs.
#include <grpcpp/create_channel.h>
#include <unistd.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <mutex>
#include <sstream>
#include <thread>

#include "common/build_id/build_id.h"
#include "common/digest.h"
#include "common/rpc/channel.h"
#include "common/rpc/commit_stream.h"
#include "common/rpc/convert.h"
#include "lightmill/v1/client.grpc.pb.h"
#include "lightmill/v1/worker.grpc.pb.h"
#include "tests/bench/grey_partial.h"

namespace lightmill {
namespace {

using Clock = std::chrono::steady_clock;
constexpr int kThreads = 16;  // that drive the workers in turn: as many calls are under way at once

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

struct Totals {
  std::atomic<int64_t> cycles = 0, empty = 0, refused = 0;
  std::atomic<int64_t> raw_bytes = 0;
  std::mutex mutex;
  std::vector<double> lease_seconds, commit_seconds;
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
  void cycle(Totals& totals) {
    v1::LeaseRequest request;
    request.set_worker_id(id_);
    v1::LeaseResponse response;
    grpc::ClientContext context;
    set_deadline(context, 60);
    const auto start = Clock::now();
    require(stub_->Lease(&context, request, &response), "lease");
    const double leased = seconds_since(start);
    if (!response.has_grant()) {
      ++totals.empty;
      return;
    }
    const LeaseGrant grant = from_proto(response.grant());
    const std::string bytes = grey_partial(grant, kTileSeconds);
    v1::CommitResponse answer;
    grpc::ClientContext committing;
    set_deadline(committing, 60);
    const auto handing_in = Clock::now();
    const LeaseKey key{grant.job, grant.tile_id, grant.attempt};
    require(commit_partial(*stub_, committing, id_, key, bytes, &answer), "commit");
    const double committed = seconds_since(handing_in);
    if (answer.outcome() == v1::COMMIT_OUTCOME_ACCEPTED) {
      ++totals.cycles;
      totals.raw_bytes += grant.settings.grid.pixels(grant.tile.cells).area() * 48;
    } else {
      ++totals.refused;
    }
    const std::lock_guard lock(totals.mutex);
    totals.lease_seconds.push_back(leased);
    totals.commit_seconds.push_back(committed);
  }

 private:
  std::unique_ptr<v1::WorkerService::Stub> stub_;
  std::string id_;
};

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
  std::vector<std::unique_ptr<LoadWorker>> all;
  for (int i = 0; i < workers; ++i) all.push_back(std::make_unique<LoadWorker>(address));
  Totals totals;
  const ProcessorTime before = processor_time(pid), own_before = processor_time("self");
  const auto start = Clock::now();
  std::vector<std::thread> threads;
  for (int t = 0; t < kThreads; ++t) {
    threads.emplace_back([&, t] {
      for (size_t i = static_cast<size_t>(t); seconds_since(start) < seconds; i += kThreads) {
        all[i % all.size()]->cycle(totals);
      }
    });
  }
  for (std::thread& thread : threads) thread.join();
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
