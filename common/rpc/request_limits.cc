#include "common/rpc/request_limits.h"

#include <google/protobuf/io/coded_stream.h>
#include <google/protobuf/wire_format_lite.h>

#include <map>
#include <string>

namespace lightmill {
namespace {

// Ids and numbers; names and lines for people; lists of leases or of digests of 64 digits; chunks, of 1 MiB
// from our own programs; a bundle's manifest, and up to 1000 jobs to wait for; of up to 1000 frames; a
// scene's files, and as many jobs; a piece of a file.
constexpr RequestLimit kPlain{4096, 16}, kLines{65536, 32}, kLeases{1 << 20, 10016},
    kDigests{7 << 20, 100016}, kChunk{(4 << 20) + 4096, 16}, kSubmission{16 << 20, 1100},
    kFrames{16 << 20, 2100}, kScene{16 << 20, 51100}, kPiece{(1 << 20) + 4096, 16};

const std::map<std::string_view, RequestLimit>& limits() {
  static const std::map<std::string_view, RequestLimit> all{{"SubmitJobRequest", kSubmission},
                                                            {"GetJobRequest", kPlain},
                                                            {"ListJobsRequest", kPlain},
                                                            {"ListTilesRequest", kPlain},
                                                            {"ListWorkersRequest", kPlain},
                                                            {"WatchJobRequest", kPlain},
                                                            {"PauseJobRequest", kPlain},
                                                            {"ResumeJobRequest", kPlain},
                                                            {"CancelJobRequest", kPlain},
                                                            {"RetryJobRequest", kPlain},
                                                            {"ExtendJobRequest", kPlain},
                                                            {"SetJobPriorityRequest", kPlain},
                                                            {"FetchImageRequest", kPlain},
                                                            {"GetLogsRequest", kPlain},
                                                            {"GetCurveRequest", kPlain},
                                                            {"FindMissingBlobsRequest", kDigests},
                                                            {"UploadBlobsRequest", kChunk},
                                                            {"SubmitSequenceRequest", kFrames},
                                                            {"AddFramesRequest", kFrames},
                                                            {"GetSequenceRequest", kPlain},
                                                            {"ListSequencesRequest", kPlain},
                                                            {"ListFramesRequest", kPlain},
                                                            {"WatchSequenceRequest", kPlain},
                                                            {"PauseSequenceRequest", kPlain},
                                                            {"ResumeSequenceRequest", kPlain},
                                                            {"CancelSequenceRequest", kPlain},
                                                            {"RetrySequenceRequest", kPlain},
                                                            {"ExtendSequenceRequest", kPlain},
                                                            {"SetSequencePriorityRequest", kPlain},
                                                            {"PutBlobRequest", kPiece},
                                                            {"SceneRequest", kScene},
                                                            {"GetPictureRequest", kPlain},
                                                            {"RegisterRequest", kLines},
                                                            {"LeaseRequest", kPlain},
                                                            {"RenewRequest", kLeases},
                                                            {"CommitRequest", kChunk},
                                                            {"FailRequest", kLines},
                                                            {"WarnRequest", kLines},
                                                            {"ShowPictureRequest", kPiece},
                                                            {"DrainRequest", kPlain},
                                                            {"GetBundleRequest", kPlain},
                                                            {"FetchBlobsRequest", kLeases},
                                                            {"HandInBlobRequest", kChunk}};
  return all;
}

/// False also for what is no message.
bool has_at_most(int most, grpc::ByteBuffer* buffer) {
  grpc::ProtoBufferReader reader(buffer);
  if (!reader.status().ok()) return false;
  google::protobuf::io::CodedInputStream in(&reader);
  for (int fields = 0;; ++fields) {
    const uint32_t tag = in.ReadTag();
    if (tag == 0) return in.ConsumedEntireMessage();
    if (fields == most || !google::protobuf::internal::WireFormatLite::SkipField(&in, tag)) return false;
  }
}

grpc::Status refused(grpc::ByteBuffer* buffer, const std::string& why) {
  buffer->Clear();
  return {grpc::StatusCode::RESOURCE_EXHAUSTED, why};
}

}  // namespace

std::optional<RequestLimit> request_limit(std::string_view message) {
  constexpr std::string_view kPackage = "lightmill.v1.";
  if (!message.starts_with(kPackage)) return std::nullopt;
  const auto found = limits().find(message.substr(kPackage.size()));
  return found == limits().end() ? std::nullopt : std::optional(found->second);
}

grpc::Status read_message(grpc::ByteBuffer* buffer, google::protobuf::MessageLite* message) {
  const std::optional<RequestLimit> limit = request_limit(message->GetTypeName());
  if (!limit || !buffer || !buffer->Valid())
    return grpc::GenericDeserialize<grpc::ProtoBufferReader, google::protobuf::MessageLite>(buffer, message);
  if (buffer->Length() > limit->bytes) {
    return refused(buffer, "the request has " + std::to_string(buffer->Length()) + " bytes; it may have " +
                               std::to_string(limit->bytes));
  }
  if (!has_at_most(limit->fields, buffer)) {
    return refused(buffer,
                   "the request has more than " + std::to_string(limit->fields) + " fields, or is damaged");
  }
  const grpc::Status status =
      grpc::GenericDeserialize<grpc::ProtoBufferReader, google::protobuf::MessageLite>(buffer, message);
  if (!status.ok()) {
    return {grpc::StatusCode::INVALID_ARGUMENT,
            "the request is no message of this method, or a text in it is not UTF-8"};
  }
  static_cast<google::protobuf::Message*>(message)->DiscardUnknownFields();
  return grpc::Status::OK;
}

}  // namespace lightmill
