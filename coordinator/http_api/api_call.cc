#include "coordinator/http_api/api_call.h"

#include <vector>

#include "common/rpc/channel.h"

namespace lightmill {

void ApiCalls::stop() {
  const std::lock_guard lock(mutex_);
  stopped_ = true;
  for (ApiCall* call : calls_) call->context_.TryCancel();
}

ApiCall::ApiCall(ApiCalls& calls, const std::string& rpc, const std::string& authorization,
                 double deadline_seconds, const std::string& request)
    : calls_(calls), stub_(calls.channel_) {
  set_deadline(context_, deadline_seconds);
  if (!authorization.empty()) context_.AddMetadata("authorization", authorization);
  stream_ = stub_.PrepareCall(&context_, rpc, &queue_);
  {
    const std::lock_guard lock(calls_.mutex_);
    calls_.calls_.insert(this);
    if (calls_.stopped_) context_.TryCancel();
  }
  stream_->StartCall(this);
  done();
  const grpc::Slice slice(request);
  stream_->WriteLast(grpc::ByteBuffer(&slice, 1), grpc::WriteOptions(), this);
  done();  // where it did not go through, the status says why
}

ApiCall::~ApiCall() {
  if (!status_) {
    context_.TryCancel();
    finish();
  }
  {
    const std::lock_guard lock(calls_.mutex_);
    calls_.calls_.erase(this);
  }
  queue_.Shutdown();
  void* tag = nullptr;
  bool ok = false;
  while (queue_.Next(&tag, &ok)) {
  }
}

bool ApiCall::done() {
  void* tag = nullptr;
  bool ok = false;
  return queue_.Next(&tag, &ok) && ok;
}

bool ApiCall::read(std::string* message) {
  grpc::ByteBuffer buffer;
  stream_->Read(&buffer, this);
  if (!done()) return false;
  std::vector<grpc::Slice> slices;
  if (!buffer.Dump(&slices).ok()) return false;
  message->clear();
  for (const grpc::Slice& slice : slices)
    message->append(reinterpret_cast<const char*>(slice.begin()), slice.size());
  return true;
}

grpc::Status ApiCall::finish() {
  if (!status_) {
    grpc::Status status;
    stream_->Finish(&status, this);
    done();
    status_ = status;
  }
  return *status_;
}

}  // namespace lightmill
