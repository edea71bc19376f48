#include "client/connection/farm_client.h"

#include <chrono>
#include <thread>

#include "client/connection/farm_connection.h"
#include "common/base/error.h"
#include "common/rpc/convert.h"
#include "common/rpc/tls_diagnosis.h"

namespace lightmill::client {
namespace {

constexpr double kWatchSeconds = 86400;   // a stream; it is opened again when it ends by this
constexpr double kConnectSeconds = 6;     // patience of a first connection: a coordinator may be starting
constexpr double kReconnectSeconds = 60;  // a coordinator that restarts is back by then

constexpr int kJobsPerPage = 500, kWorkersPerPage = 1000;
constexpr size_t kMostListed = 1000000;  // ten times the jobs that a coordinator takes

bool is_loss(grpc::StatusCode code) {
  return code == grpc::StatusCode::UNAVAILABLE || code == grpc::StatusCode::DEADLINE_EXCEEDED ||
         code == grpc::StatusCode::CANCELLED || code == grpc::StatusCode::UNKNOWN ||
         code == grpc::StatusCode::INTERNAL;
}

/// Calls that name a job and answer with its status.
template <class Request, class Response>
JobStatus change(FarmConnection& farm,
                 grpc::Status (FarmConnection::Stub::*method)(grpc::ClientContext*, const Request&,
                                                              Response*),
                 const JobId& id) {
  Request request;
  request.set_job_id(id.value);
  return from_proto(farm.call(method, request).job());
}

/// Asks for page after page. `take` returns how much there is by now, 0 for an empty page. A coordinator that
/// repeats itself, or goes on for ever, does not hold us.
template <class Request, class Response, class Take>
void turn_pages(FarmConnection& farm,
                grpc::Status (FarmConnection::Stub::*method)(grpc::ClientContext*, const Request&, Response*),
                Request request, Take&& take) {
  for (;;) {
    const Response page = farm.call(method, request);
    const size_t taken = take(page);
    if (taken == 0 || taken >= kMostListed || page.next_page_token().empty() ||
        page.next_page_token() == request.page_token()) {
      return;
    }
    request.set_page_token(page.next_page_token());
  }
}

}  // namespace

FarmClient::FarmClient(const ConnectionOptions& connection)
    : farm_(std::make_unique<FarmConnection>(connection)) {}
FarmClient::~FarmClient() = default;

JobStatus FarmClient::job(const JobId& id) { return change(*farm_, &v1::ClientService::Stub::GetJob, id); }
JobStatus FarmClient::pause(const JobId& id) {
  return change(*farm_, &v1::ClientService::Stub::PauseJob, id);
}
JobStatus FarmClient::resume(const JobId& id) {
  return change(*farm_, &v1::ClientService::Stub::ResumeJob, id);
}
JobStatus FarmClient::cancel(const JobId& id) {
  return change(*farm_, &v1::ClientService::Stub::CancelJob, id);
}
JobStatus FarmClient::retry(const JobId& id) {
  return change(*farm_, &v1::ClientService::Stub::RetryJob, id);
}

JobStatus FarmClient::extend(const JobId& id, std::optional<int64_t> spp, std::optional<double> time_s,
                             std::optional<double> target_error) {
  v1::ExtendJobRequest request;
  request.set_job_id(id.value);
  if (spp) request.set_spp(*spp);
  if (time_s) request.set_time_seconds(*time_s);
  if (target_error) request.set_target_error(*target_error);
  return from_proto(farm_->call(&v1::ClientService::Stub::ExtendJob, request).job());
}

std::optional<PilotReport> FarmClient::pilot(const JobId& id) {
  v1::GetJobRequest request;
  request.set_job_id(id.value);
  const auto response = farm_->call(&v1::ClientService::Stub::GetJob, request);
  if (!response.has_pilot_json()) return std::nullopt;
  return pilot_from_json(response.pilot_json());
}

std::vector<JobStatus> FarmClient::jobs() {
  std::vector<JobStatus> list;
  v1::ListJobsRequest request;
  request.set_page_size(kJobsPerPage);
  turn_pages(*farm_, &v1::ClientService::Stub::ListJobs, request, [&](const v1::ListJobsResponse& page) {
    for (const v1::JobStatus& job : page.jobs()) list.push_back(from_proto(job));
    return page.jobs().empty() ? 0 : list.size();
  });
  return list;
}

std::vector<WorkerStatus> FarmClient::workers() {
  std::vector<WorkerStatus> list;
  v1::ListWorkersRequest request;
  request.set_page_size(kWorkersPerPage);
  turn_pages(*farm_, &v1::ClientService::Stub::ListWorkers, request,
             [&](const v1::ListWorkersResponse& page) {
               for (const v1::WorkerStatus& worker : page.workers()) list.push_back(from_proto(worker));
               return page.workers().empty() ? 0 : list.size();
             });
  return list;
}

std::vector<TileStatus> FarmClient::tiles(const JobId& id) {
  grpc::ClientContext context;
  set_deadline(context, kTransferSeconds);
  v1::ListTilesRequest request;
  request.set_job_id(id.value);
  const auto reader = farm_->stub()->ListTiles(&context, request);
  std::vector<TileStatus> list;
  v1::ListTilesResponse message;
  while (reader->Read(&message)) {
    for (const v1::TileStatus& tile : message.tiles()) list.push_back(from_proto(tile));
  }
  farm_->require_ok(reader->Finish());
  return list;
}

std::vector<TileLogLine> FarmClient::logs(const JobId& id, const std::optional<int64_t>& tile, int64_t most) {
  grpc::ClientContext context;
  set_deadline(context, kTransferSeconds);
  v1::GetLogsRequest request;
  request.set_job_id(id.value);
  if (tile) request.set_tile_id(*tile);
  request.set_max_lines(most);
  const auto reader = farm_->stub()->GetLogs(&context, request);
  std::vector<TileLogLine> list;
  v1::GetLogsResponse message;
  while (reader->Read(&message)) {
    for (const v1::LogLine& line : message.lines())
      list.push_back({line.time(), line.tile_id(), line.attempt(), line.worker_id(), line.text()});
  }
  farm_->require_ok(reader->Finish());
  return list;
}

JobStatus FarmClient::watch(const JobId& id, const std::function<void(const JobStatus&)>& observe,
                            const std::function<void(const std::string&)>& lost) {
  using Steady = std::chrono::steady_clock;
  JobStatus last;
  bool connected = false, complained = false;
  bool is_lost = false;
  Steady::time_point lost_at{};
  for (;;) {
    grpc::ClientContext context;
    set_deadline(context, kWatchSeconds);
    v1::WatchJobRequest request;
    request.set_job_id(id.value);
    const auto reader = farm_->stub()->WatchJob(&context, request);
    v1::WatchJobResponse message;
    while (reader->Read(&message)) {
      last = from_proto(message.job());
      connected = true;
      complained = false;
      is_lost = false;
      observe(last);
    }
    const grpc::Status status = reader->Finish();
    if (status.ok() && is_final(last.state)) return last;
    if (!status.ok() && !is_loss(status.error_code())) farm_->require_ok(status);
    if (!is_lost) lost_at = Steady::now();
    is_lost = true;
    const double seconds = std::chrono::duration<double>(Steady::now() - lost_at).count();
    if (!connected && diagnose_tls(farm_->address(), farm_->security()).definite) farm_->require_ok(status);
    if (!connected && seconds > kConnectSeconds) farm_->require_ok(status);
    if (seconds > kReconnectSeconds) {
      throw Error(ErrorKind::kUnreachable,
                  "coordinator " + farm_->address() +
                      " did not come back; the job goes on once it does: lightmill watch " + id.value);
    }
    if (connected && !complained && !status.ok()) {
      lost("lost the coordinator at " + farm_->address() + "; trying again");
      complained = true;
    }
    std::this_thread::sleep_for(std::chrono::milliseconds(300));
    farm_->connect_anew();
  }
}

ErrorCurve FarmClient::curve(const JobId& id) {
  v1::GetCurveRequest request;
  request.set_job_id(id.value);
  return from_proto(farm_->call(&v1::ClientService::Stub::GetCurve, request).curve());
}

}  // namespace lightmill::client
