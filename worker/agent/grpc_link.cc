#include "worker/agent/grpc_link.h"

#include <grpcpp/grpcpp.h>

#include <algorithm>
#include <atomic>
#include <filesystem>
#include <fstream>
#include <mutex>
#include <set>
#include <utility>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "common/farm/pilot_result.h"
#include "common/rpc/channel.h"
#include "common/rpc/commit_stream.h"
#include "common/rpc/convert.h"
#include "common/rpc/coordinators.h"
#include "common/rpc/pictures.h"
#include "common/rpc/registration_digest.h"
#include "common/rpc/status.h"
#include "common/rpc/tls_diagnosis.h"
#include "lightmill/v1/worker.grpc.pb.h"

namespace lightmill::agent {
namespace {

constexpr double kTransferSeconds = 600;  // a partial, or a blob of many gigabytes
constexpr size_t kMostBlobsAtOnce = 1000;

}  // namespace

struct GrpcLink::Impl {
  Coordinators coordinators;
  SecurityFiles security;
  std::vector<std::unique_ptr<v1::WorkerService::Stub>> stubs;  // one to a coordinator
  std::mutex mutex;
  std::string worker_id;                  // guarded by mutex
  std::vector<std::string> wanted;        // guarded by mutex: what the newest answer named
  std::set<grpc::ClientContext*> active;  // guarded by mutex: what cancel() ends
  bool cancelled = false;                 // guarded by mutex
  std::atomic<bool> met{false};           // the coordinator has answered

  explicit Impl(const std::string& addresses) : coordinators(addresses) {}
  void check(size_t coordinator, const grpc::Status& status, bool names_worker);
  std::string worker() {
    const std::lock_guard lock(mutex);
    return worker_id;
  }
  template <class Response>
  void note_wanted(const Response& response) {
    const std::lock_guard lock(mutex);
    wanted.assign(response.wanted_blobs().begin(), response.wanted_blobs().end());
  }
};

namespace {

/// One RPC: its deadline, and its place among those that cancel() ends.
template <class Impl>
class Call {
 public:
  Call(Impl& impl, double seconds) : impl_(impl), coordinator_(impl.coordinators.current()) {
    set_deadline(context_, seconds);
    const std::lock_guard lock(impl_.mutex);
    if (impl_.cancelled) throw LinkDown("stopping");
    impl_.active.insert(&context_);
  }
  ~Call() {
    const std::lock_guard lock(impl_.mutex);
    impl_.active.erase(&context_);
  }
  Call(const Call&) = delete;
  Call& operator=(const Call&) = delete;
  grpc::ClientContext* context() { return &context_; }
  v1::WorkerService::Stub* stub() { return impl_.stubs[coordinator_].get(); }
  void check(const grpc::Status& status, bool names_worker) {
    impl_.check(coordinator_, status, names_worker);
  }

 private:
  Impl& impl_;
  const size_t coordinator_;
  grpc::ClientContext context_;
};

}  // namespace

/// Throws what a status means. `names_worker`: NOT_FOUND says that the coordinator has forgotten us; a token
/// that is not accepted any more is found out by registering again.
void GrpcLink::Impl::check(size_t coordinator, const grpc::Status& status, bool names_worker) {
  const std::string& address = coordinators.address(coordinator);
  if (status.error_code() != grpc::StatusCode::UNAVAILABLE) met = true;
  if (status.ok()) return;
  const std::string text = one_line(status.error_message());
  switch (status.error_code()) {
    case grpc::StatusCode::NOT_FOUND:
      if (names_worker) throw NotRegistered(text);
      throw Error(ErrorKind::kFailed, text);
    case grpc::StatusCode::UNAUTHENTICATED:
      if (names_worker) throw NotRegistered(text);
      [[fallthrough]];
    case grpc::StatusCode::PERMISSION_DENIED:
    case grpc::StatusCode::UNIMPLEMENTED:
      throw Error(ErrorKind::kUnreachable, address + ": refused: " + text);
    case grpc::StatusCode::INVALID_ARGUMENT:
    case grpc::StatusCode::FAILED_PRECONDITION:
    case grpc::StatusCode::OUT_OF_RANGE:
      throw Error(ErrorKind::kFailed, text);
    case grpc::StatusCode::DEADLINE_EXCEEDED:
      coordinators.move_on(coordinator);
      break;
    case grpc::StatusCode::UNAVAILABLE: {
      coordinators.move_on(coordinator);
      const TlsDiagnosis found = diagnose_tls(address, security);
      if (found.problem.empty()) break;
      // Later on certificates may be being renewed: that passes, and tiles are in our hands.
      if (found.definite && !met) throw Error(ErrorKind::kUnreachable, address + ": " + found.problem);
      throw LinkDown(address + ": " + found.problem);
    }
    default:
      break;
  }
  // Unreachable, shutting down, out of time, full: it may pass.
  throw LinkDown(address + ": " + (text.empty() ? "no answer" : text));
}

GrpcLink::GrpcLink(const std::string& addresses, bool insecure, const SecurityFiles& security)
    : impl_(std::make_unique<Impl>(addresses)) {
  impl_->security = security;
  for (size_t i = 0; i < impl_->coordinators.size(); ++i) {
    impl_->stubs.push_back(
        v1::WorkerService::NewStub(make_channel({impl_->coordinators.address(i), insecure, security})));
  }
}
GrpcLink::~GrpcLink() = default;

void GrpcLink::register_worker(const WorkerRegistration& registration) {
  Call call(*impl_, kCallSeconds);
  v1::RegisterRequest request;
  *request.mutable_registration() = to_proto(registration);
  call.context()->AddMetadata(kRegistrationDigestKey, registration_digest(request.registration()));
  v1::RegisterResponse response;
  call.check(call.stub()->Register(call.context(), request, &response), false);
  const std::lock_guard lock(impl_->mutex);
  impl_->worker_id = response.worker_id();
}

std::optional<LeaseGrant> GrpcLink::lease(double wait_seconds) {
  Call call(*impl_, wait_seconds + kCallSeconds);
  v1::LeaseRequest request;
  request.set_worker_id(impl_->worker());
  request.set_wait_seconds(wait_seconds);
  v1::LeaseResponse response;
  call.check(call.stub()->Lease(call.context(), request, &response), true);
  impl_->note_wanted(response);
  if (!response.has_grant()) return std::nullopt;
  if (response.grant().digest() != grant_digest(response.grant())) {
    throw Damaged("a lease arrived damaged: its digest does not fit");
  }
  LeaseGrant lease = from_proto(response.grant());
  const CellRect all = lease.settings.grid.cells(), cells = lease.tile.cells;
  if (is_pilot(lease.tile)) return lease;
  if (cells.x0 < all.x0 || cells.y0 < all.y0 || cells.x1 > all.x1 || cells.y1 > all.y1) {
    throw Error(ErrorKind::kFailed,
                "the coordinator sent a tile outside its image; is it of the same version?");
  }
  return lease;
}

std::vector<LeaseKey> GrpcLink::renew(const std::vector<LeaseKey>& held) {
  Call call(*impl_, kCallSeconds);
  v1::RenewRequest request;
  request.set_worker_id(impl_->worker());
  for (const LeaseKey& key : held) *request.add_held() = to_proto(key);
  v1::RenewResponse response;
  call.check(call.stub()->Renew(call.context(), request, &response), true);
  impl_->note_wanted(response);
  std::vector<LeaseKey> lost;
  for (const v1::LeaseKey& key : response.lost()) lost.push_back(from_proto(key));
  return lost;
}

CommitAnswer GrpcLink::commit(const LeaseKey& key, const std::string& partial_bytes) {
  Call call(*impl_, kTransferSeconds);
  v1::CommitResponse response;
  const grpc::Status status =
      commit_partial(*call.stub(), *call.context(), impl_->worker(), key, partial_bytes, &response);
  if (status.error_code() == grpc::StatusCode::INVALID_ARGUMENT)
    throw Damaged(one_line(status.error_message()));
  call.check(status, true);
  return {from_proto(response.outcome()), response.message()};
}

void GrpcLink::fail(const LeaseKey& key, const std::string& reason, FailureKind kind) {
  Call call(*impl_, kCallSeconds);
  v1::FailRequest request;
  request.set_worker_id(impl_->worker());
  *request.mutable_key() = to_proto(key);
  request.set_reason(one_line(reason));
  request.set_kind(to_proto(kind));
  v1::FailResponse response;
  call.check(call.stub()->Fail(call.context(), request, &response), true);
}

void GrpcLink::warn(const LeaseKey& key, const std::vector<std::string>& missing_light) {
  Call call(*impl_, kCallSeconds);
  v1::WarnRequest request;
  request.set_worker_id(impl_->worker());
  *request.mutable_key() = to_proto(key);
  for (const std::string& line : missing_light) request.add_missing_light(one_line(line));
  v1::WarnResponse response;
  call.check(call.stub()->Warn(call.context(), request, &response), true);
}

void GrpcLink::show(const LeaseKey& key, const Image& picture) {
  Call call(*impl_, kCallSeconds);
  v1::ShowPictureRequest request;
  request.set_worker_id(impl_->worker());
  *request.mutable_key() = to_proto(key);
  set_picture(picture, &request);
  v1::ShowPictureResponse response;
  call.check(call.stub()->ShowPicture(call.context(), request, &response), true);
}

void GrpcLink::hand_back(const LeaseKey& key, HandBack why) {
  Call call(*impl_, kCallSeconds);
  v1::FailRequest request;
  request.set_worker_id(impl_->worker());
  *request.mutable_key() = to_proto(key);
  request.set_handed_back(true);
  request.set_missing_blob(why == HandBack::kMissingBlob);
  v1::FailResponse response;
  call.check(call.stub()->Fail(call.context(), request, &response), true);
}

void GrpcLink::drain() {
  Call call(*impl_, kCallSeconds);
  v1::DrainRequest request;
  request.set_worker_id(impl_->worker());
  v1::DrainResponse response;
  call.check(call.stub()->Drain(call.context(), request, &response), true);
}

Bundle GrpcLink::bundle(const std::string& digest) {
  Call call(*impl_, kCallSeconds);
  v1::GetBundleRequest request;
  request.set_bundle_digest(digest);
  v1::GetBundleResponse response;
  call.check(call.stub()->GetBundle(call.context(), request, &response), false);
  return bundle_from_json(response.bundle_json());
}

void GrpcLink::fetch_blobs(const std::vector<std::string>& digests, BlobSink& sink) {
  for (size_t first = 0; first < digests.size(); first += kMostBlobsAtOnce) {
    Call call(*impl_, kTransferSeconds);
    v1::FetchBlobsRequest request;
    const size_t last = std::min(digests.size(), first + kMostBlobsAtOnce);
    for (size_t i = first; i < last; ++i) request.add_digests(digests[i]);
    const auto reader = call.stub()->FetchBlobs(call.context(), request);
    v1::FetchBlobsResponse message;
    bool begun = false;
    try {
      while (reader->Read(&message)) {
        if (message.has_header()) {
          if (begun) sink.end();
          sink.begin(message.header().digest(), message.header().size());
          begun = true;
        } else if (begun) {
          sink.write(message.chunk());
        }
      }
    } catch (...) {  // a full disk or a damaged blob: the stream must be ended before it is left
      call.context()->TryCancel();
      reader->Finish();
      throw;
    }
    const grpc::Status status = reader->Finish();
    if (status.error_code() == grpc::StatusCode::NOT_FOUND)
      throw MissingBlob(one_line(status.error_message()));
    call.check(status, false);
    if (begun) sink.end();
  }
}

std::vector<std::string> GrpcLink::take_wanted_blobs() {
  const std::lock_guard lock(impl_->mutex);
  return std::exchange(impl_->wanted, {});
}

bool GrpcLink::hand_in_blob(const std::string& digest, const std::string& path) {
  std::error_code error;
  const uint64_t size = std::filesystem::file_size(path, error);
  std::ifstream in(path, std::ios::binary);
  if (error || !in) throw Error(ErrorKind::kFailed, path + ": can't be read");
  Call call(*impl_, kTransferSeconds);
  v1::HandInBlobResponse response;
  const auto writer = call.stub()->HandInBlob(call.context(), &response);
  v1::HandInBlobRequest message;
  message.mutable_header()->set_worker_id(impl_->worker());
  message.mutable_header()->set_digest(digest);
  message.mutable_header()->set_size(size);
  bool open = writer->Write(message);
  std::string chunk(kChunkBytes, '\0');
  while (open && (in.read(chunk.data(), static_cast<std::streamsize>(chunk.size())) || in.gcount() > 0)) {
    message.set_chunk(chunk.data(), static_cast<size_t>(in.gcount()));
    open = writer->Write(message);
  }
  writer->WritesDone();
  const grpc::Status status = writer->Finish();
  if (status.error_code() == grpc::StatusCode::ABORTED) return false;
  call.check(status, false);
  return true;
}

void GrpcLink::cancel() {
  const std::lock_guard lock(impl_->mutex);
  impl_->cancelled = true;
  for (grpc::ClientContext* context : impl_->active) context->TryCancel();
}

}  // namespace lightmill::agent
