#include "coordinator/hooks/end_message.h"

#include <google/protobuf/util/json_util.h>

#include <ctime>

#include "common/rpc/convert.h"
#include "common/rpc/sequence_messages.h"

namespace lightmill {
namespace {

std::string time_text(int64_t unix_seconds) {
  const std::time_t time = unix_seconds;
  std::tm parts{};
  gmtime_r(&time, &parts);
  char text[32];
  std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%SZ", &parts);
  return text;
}

std::string json_of(const google::protobuf::Message& message) {
  google::protobuf::util::JsonPrintOptions options;
  options.preserve_proto_field_names = true;
  options.always_print_primitive_fields = true;
  std::string text;
  if (!google::protobuf::util::MessageToJsonString(message, &text, options).ok())
    throw Error(ErrorKind::kFailed, "a state can't be written as JSON");
  return text;
}

}  // namespace

std::optional<HookMessage> end_message(const Farm& farm, const EndNote& note, int64_t unix_seconds) {
  HookMessage message;
  message.subject = note.id;
  std::string data;
  if (is_sequence_id(note.id)) {
    const SequenceStatus status = farm.sequence(SequenceId{note.id});
    if (!is_final(status.state)) return {};
    message.type = std::string("sequence.") + job_state_name(status.state);
    data = json_of(to_proto(status));
  } else {
    const JobStatus status = farm.job(JobId{note.id});
    if (!is_final(status.state)) return {};
    message.type = std::string("job.") + job_state_name(status.state);
    data = json_of(to_proto(status));
  }
  message.body = R"({"type":")" + message.type + R"(","timestamp":")" + time_text(unix_seconds) +
                 R"(","data":)" + data + "}";
  return message;
}

}  // namespace lightmill
