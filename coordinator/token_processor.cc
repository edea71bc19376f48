#include "coordinator/token_processor.h"

#include <ctime>

namespace lightmill {
namespace {

std::string_view view(const grpc::string_ref& text) { return {text.data(), text.size()}; }

}  // namespace

grpc::Status TokenProcessor::Process(const InputMetadata& metadata, grpc::AuthContext*,
                                     OutputMetadata* consumed, OutputMetadata*) {
  std::string_view path, authorization;
  if (const auto found = metadata.find(":path"); found != metadata.end()) path = view(found->second);
  const bool submits = path.ends_with("/SubmitJob");
  if (const auto found = metadata.find("authorization"); found != metadata.end()) {
    authorization = view(found->second);
    // A job bears the name of its submitter's token: that handler asks once more.
    if (!submits) consumed->emplace("authorization", authorization);
  }
  const Verdict verdict = authenticator_->judge(path, authorization, std::time(nullptr));
  if (verdict.kind != Verdict::Kind::kAllowed && path.ends_with("/Register")) turned_away_(verdict.message);
  switch (verdict.kind) {
    case Verdict::Kind::kAllowed: {
      if (!submits) return grpc::Status::OK;
      const std::string refusal = submissions_->refusal(verdict.name);
      if (refusal.empty()) return grpc::Status::OK;
      return {grpc::StatusCode::RESOURCE_EXHAUSTED, refusal};
    }
    case Verdict::Kind::kUnauthenticated:
      return {grpc::StatusCode::UNAUTHENTICATED, verdict.message};
    case Verdict::Kind::kForbidden:
      break;
  }
  return {grpc::StatusCode::PERMISSION_DENIED, verdict.message};
}

}  // namespace lightmill
