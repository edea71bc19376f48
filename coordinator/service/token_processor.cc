#include "coordinator/service/token_processor.h"

#include <ctime>

namespace lightmill {
namespace {

std::string_view view(const grpc::string_ref& text) { return {text.data(), text.size()}; }

}  // namespace

grpc::Status TokenProcessor::Process(const InputMetadata& metadata, grpc::AuthContext*,
                                     OutputMetadata* consumed, OutputMetadata*) {
  std::string_view path, authorization;
  if (const auto found = metadata.find(":path"); found != metadata.end()) path = view(found->second);
  const bool submits = is_submission(path), registers = path.ends_with("/Register");
  if (const auto found = metadata.find("authorization"); found != metadata.end()) {
    authorization = view(found->second);
    // Jobs, workers and files in pieces bear the name of the token that they came with: these handlers ask
    // once more.
    const bool asks = submits || registers || path.ends_with("/PutBlob");
    if (!asks) consumed->emplace("authorization", authorization);
  }
  const Verdict verdict = authenticator_->judge(path, authorization, std::time(nullptr));
  if (verdict.kind != Verdict::Kind::kAllowed && registers) turned_away_(verdict.message);
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
