#pragma once
// Judges every gRPC call by its token (authenticator.h), before its handler runs and before its message is
// read.
#include <grpcpp/security/auth_metadata_processor.h>

#include <functional>
#include <memory>
#include <string>

#include "coordinator/access/authenticator.h"
#include "coordinator/service/limits/submit_limit.h"

namespace lightmill {

class TokenProcessor final : public grpc::AuthMetadataProcessor {
 public:
  /// `submissions` bounds how often a token may submit. `turned_away` gets the reason why a worker may not
  /// register.
  TokenProcessor(std::shared_ptr<Authenticator> authenticator, std::shared_ptr<SubmitLimit> submissions,
                 std::function<void(const std::string&)> turned_away)
      : authenticator_(std::move(authenticator)),
        submissions_(std::move(submissions)),
        turned_away_(std::move(turned_away)) {}
  bool IsBlocking() const override { return false; }
  /// UNAUTHENTICATED or PERMISSION_DENIED with the verdict's message; RESOURCE_EXHAUSTED for too many
  /// submissions. The token goes no further.
  grpc::Status Process(const InputMetadata& metadata, grpc::AuthContext* context, OutputMetadata* consumed,
                       OutputMetadata* response) override;

 private:
  const std::shared_ptr<Authenticator> authenticator_;
  const std::shared_ptr<SubmitLimit> submissions_;
  const std::function<void(const std::string&)> turned_away_;
};

}  // namespace lightmill
