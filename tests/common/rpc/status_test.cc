#include "common/rpc/status.h"

#include <gtest/gtest.h>

namespace lightmill {
namespace {

TEST(Status, ErrorsKeepKindAndMessageAcrossTheWire) {
  for (const auto& [kind, exit_code] : {std::pair{ErrorKind::kFailed, 1},
                                        {ErrorKind::kUsage, 2},
                                        {ErrorKind::kBadScene, 2},
                                        {ErrorKind::kUnreachable, 3}}) {
    const Error back = to_error(to_status(Error(kind, "what happened")), "host:1");
    EXPECT_EQ(back.exit_code(), exit_code);
    EXPECT_NE(std::string(back.what()).find("what happened"), std::string::npos);
  }
}

TEST(Status, ExitCodesOfTransportFailures) {
  for (auto code : {grpc::StatusCode::UNAVAILABLE, grpc::StatusCode::DEADLINE_EXCEEDED,
                    grpc::StatusCode::RESOURCE_EXHAUSTED, grpc::StatusCode::UNIMPLEMENTED}) {
    const Error error = to_error(grpc::Status(code, "x"), "host:1");
    EXPECT_EQ(error.exit_code(), 3);
    EXPECT_NE(std::string(error.what()).find("host:1"), std::string::npos);
  }
  EXPECT_EQ(to_error(grpc::Status(grpc::StatusCode::NOT_FOUND, "no job"), "h:1").exit_code(), 1);
  EXPECT_EQ(to_error(grpc::Status(grpc::StatusCode::INTERNAL, ""), "h:1").exit_code(), 1);
  EXPECT_NO_THROW(throw_if_failed(grpc::Status::OK, "h:1"));
  EXPECT_THROW(throw_if_failed(grpc::Status::CANCELLED, "h:1"), Error);
}

TEST(Status, MessagesAreOneBoundedLine) {
  EXPECT_EQ(one_line("first\nsecond"), "first");
  EXPECT_EQ(one_line("a\tb\x1b[31m"), "a b [31m");
  EXPECT_EQ(one_line(std::string(5000, 'x')).size(), 1000u);
}

}  // namespace
}  // namespace lightmill
