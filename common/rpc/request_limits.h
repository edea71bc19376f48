#pragma once
// How large a request may be, in bytes and in fields, checked before it is unpacked. The generated headers of
// the services include this file (proto/CMakeLists.txt), so that gRPC reads messages by it.
//
// gRPC has one bound for all messages of a server, and unpacks what is below it: 16 MiB of empty strings take
// 5 GB. Fields that the protocol does not know are thrown away.
#include <grpcpp/impl/codegen/proto_utils.h>

#include <cstddef>
#include <optional>
#include <string_view>

#include "lightmill/v1/client.pb.h"
#include "lightmill/v1/sequence.pb.h"
#include "lightmill/v1/thin_client.pb.h"
#include "lightmill/v1/worker.pb.h"

namespace lightmill {

struct RequestLimit {
  size_t bytes;
  int fields;  // of the message itself: each element of a list is one
};

/// The limit of a message by its full name ("lightmill.v1.GetJobRequest"); none for answers.
std::optional<RequestLimit> request_limit(std::string_view message);

/// Unpacks `buffer`, which is empty afterwards, into `message`. RESOURCE_EXHAUSTED if it is over its limit.
grpc::Status read_message(grpc::ByteBuffer* buffer, google::protobuf::MessageLite* message);

/// In place of gRPC's own reading.
struct LimitedReading {
  static grpc::Status Serialize(const google::protobuf::MessageLite& message, grpc::ByteBuffer* buffer,
                                bool* own) {
    return grpc::GenericSerialize<grpc::ProtoBufferWriter, google::protobuf::MessageLite>(message, buffer,
                                                                                          own);
  }
  static grpc::Status Deserialize(grpc::ByteBuffer* buffer, google::protobuf::MessageLite* message) {
    return read_message(buffer, message);
  }
};

}  // namespace lightmill

namespace grpc {

// The handlers of unary calls read a MessageLite, those of streams and callbacks the type itself.
template <>
class SerializationTraits<protobuf::MessageLite, void> : public lightmill::LimitedReading {};
template <>
class SerializationTraits<lightmill::v1::ListTilesRequest, void> : public lightmill::LimitedReading {};
template <>
class SerializationTraits<lightmill::v1::WatchJobRequest, void> : public lightmill::LimitedReading {};
template <>
class SerializationTraits<lightmill::v1::WatchSequenceRequest, void> : public lightmill::LimitedReading {};
template <>
class SerializationTraits<lightmill::v1::FetchImageRequest, void> : public lightmill::LimitedReading {};
template <>
class SerializationTraits<lightmill::v1::GetPictureRequest, void> : public lightmill::LimitedReading {};
template <>
class SerializationTraits<lightmill::v1::GetLogsRequest, void> : public lightmill::LimitedReading {};
template <>
class SerializationTraits<lightmill::v1::FetchBlobsRequest, void> : public lightmill::LimitedReading {};
template <>
class SerializationTraits<lightmill::v1::LeaseRequest, void> : public lightmill::LimitedReading {};
template <>
class SerializationTraits<lightmill::v1::CommitRequest, void> : public lightmill::LimitedReading {};
template <>
class SerializationTraits<lightmill::v1::UploadBlobsRequest, void> : public lightmill::LimitedReading {};
template <>
class SerializationTraits<lightmill::v1::HandInBlobRequest, void> : public lightmill::LimitedReading {};

}  // namespace grpc
