#include "client/connection/farm_client.h"

#include "client/connection/answers.h"
#include "client/connection/farm_connection.h"
#include "common/rpc/convert.h"

namespace lightmill::client {
namespace {

constexpr int kJobsPerPage = 500, kWorkersPerPage = 1000;

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

JobStatus FarmClient::set_priority(const JobId& id, int priority) {
  v1::SetJobPriorityRequest request;
  request.set_job_id(id.value);
  request.set_priority(priority);
  return from_proto(farm_->call(&v1::ClientService::Stub::SetJobPriority, request).job());
}

std::optional<PilotReport> FarmClient::pilot(const JobId& id) {
  v1::GetJobRequest request;
  request.set_job_id(id.value);
  const auto response = farm_->call(&v1::ClientService::Stub::GetJob, request);
  if (!response.has_pilot_json()) return std::nullopt;
  return pilot_from_json(response.pilot_json());
}

std::vector<JobStatus> FarmClient::jobs(bool frames) {
  std::vector<JobStatus> list;
  v1::ListJobsRequest request;
  request.set_page_size(kJobsPerPage);
  request.set_without_frames(!frames);
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
  v1::WatchJobRequest request;
  request.set_job_id(id.value);
  return watch_stream<JobStatus, v1::WatchJobResponse>(
      *farm_, "job", id.value,
      [&](grpc::ClientContext* context) { return farm_->stub()->WatchJob(context, request); },
      [](const v1::WatchJobResponse& message) { return from_proto(message.job()); }, observe, lost);
}

ErrorCurve FarmClient::curve(const JobId& id) {
  v1::GetCurveRequest request;
  request.set_job_id(id.value);
  return from_proto(farm_->call(&v1::ClientService::Stub::GetCurve, request).curve());
}

}  // namespace lightmill::client
