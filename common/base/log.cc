#include "common/base/log.h"

#include <spdlog/formatter.h>
#include <spdlog/sinks/stdout_sinks.h>
#include <spdlog/spdlog.h>

#include <chrono>
#include <cstdio>
#include <ctime>
#include <nlohmann/json.hpp>

#include "common/base/error.h"

namespace lightmill {
namespace {

thread_local LogContext current;

/// "2026-11-21T16:43:13.325Z"
std::string utc_text(spdlog::log_clock::time_point time) {
  using std::chrono::milliseconds;
  const auto since = std::chrono::duration_cast<milliseconds>(time.time_since_epoch()).count();
  const std::time_t seconds = since / 1000;
  std::tm parts{};
  gmtime_r(&seconds, &parts);
  char text[64];
  const size_t length = std::strftime(text, sizeof text, "%Y-%m-%dT%H:%M:%S", &parts);
  std::snprintf(text + length, sizeof text - length, ".%03dZ", static_cast<int>(since % 1000));
  return text;
}

std::string text_of(const spdlog::string_view_t& view) { return {view.data(), view.size()}; }

/// An object to a line. Bytes that are not UTF-8 are replaced.
class JsonFormatter : public spdlog::formatter {
 public:
  void format(const spdlog::details::log_msg& message, spdlog::memory_buf_t& out) override {
    nlohmann::ordered_json line = {{"time", utc_text(message.time)},
                                   {"level", text_of(spdlog::level::to_string_view(message.level))},
                                   {"program", text_of(message.logger_name)},
                                   {"message", text_of(message.payload)}};
    if (!current.job.empty()) line["job"] = current.job;
    if (current.tile >= 0) line["tile"] = current.tile;
    if (current.attempt > 0) line["attempt"] = current.attempt;
    if (!current.worker.empty()) line["worker"] = current.worker;
    const std::string text =
        line.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace) + "\n";
    out.append(text.data(), text.data() + text.size());
  }
  std::unique_ptr<spdlog::formatter> clone() const override { return std::make_unique<JsonFormatter>(); }
};

}  // namespace

LogScope::LogScope(LogContext context) : outer_(current) {
  if (!context.job.empty()) current.job = std::move(context.job);
  if (context.tile >= 0) current.tile = context.tile;
  if (context.attempt > 0) current.attempt = context.attempt;
  if (!context.worker.empty()) current.worker = std::move(context.worker);
}

LogScope::~LogScope() { current = std::move(outer_); }

const LogContext& log_context() { return current; }

void start_log(const std::string& program, const std::string& level, const std::string& format) {
  if (format != "text" && format != "json")
    throw Error(ErrorKind::kUsage, "--log-format " + format + ": expected text or json");
  const auto logger =
      std::make_shared<spdlog::logger>(program, std::make_shared<spdlog::sinks::stderr_sink_mt>());
  if (format == "json") logger->set_formatter(std::make_unique<JsonFormatter>());
  logger->set_level(spdlog::level::from_str(level));
  spdlog::set_default_logger(logger);
}

}  // namespace lightmill
