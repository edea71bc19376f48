#pragma once
// The authenticator at gRPC's door: judges every call before its handler, or even its message, is looked at.
#include <grpcpp/security/auth_metadata_processor.h>

#include "coordinator/authenticator.h"

namespace lightmill {

class TokenProcessor final : public grpc::AuthMetadataProcessor {
 public:
  explicit TokenProcessor(std::shared_ptr<Authenticator> authenticator)
      : authenticator_(std::move(authenticator)) {}
  bool IsBlocking() const override { return false; }
  /// UNAUTHENTICATED or PERMISSION_DENIED with the verdict's message; the token goes no further.
  grpc::Status Process(const InputMetadata& metadata, grpc::AuthContext* context, OutputMetadata* consumed,
                       OutputMetadata* response) override;

 private:
  const std::shared_ptr<Authenticator> authenticator_;
};

}  // namespace lightmill
