// lightmill logs: what happened to a job's tiles.
#include <CLI/CLI.hpp>
#include <cmath>
#include <cstdio>
#include <ctime>
#include <memory>
#include <nlohmann/json.hpp>

#include "client/cli.h"
#include "client/connection/farm_client.h"
#include "client/json_output.h"
#include "client/options.h"

namespace lightmill::client {
namespace {

struct LogsOptions {
  CommonOptions common;
  ConnectionOptions connection;
  std::string job;
  std::optional<int64_t> tile;
  int64_t lines = 1000;
};

/// Seconds since 1970 as local time of day.
std::string time_text(double time) {
  const auto seconds = static_cast<std::time_t>(std::floor(time));
  std::tm parts{};
  localtime_r(&seconds, &parts);
  char text[32], whole[48];
  std::strftime(text, sizeof text, "%Y-%m-%d %H:%M:%S", &parts);
  std::snprintf(whole, sizeof whole, "%s.%03d", text,
                static_cast<int>((time - static_cast<double>(seconds)) * 1000));
  return whole;
}

nlohmann::json line_to_json(const TileLogLine& line) {
  nlohmann::json j = {{"time", line.time}, {"text", line.text}};
  j["tile"] = line.tile >= 0 ? nlohmann::json(line.tile) : nlohmann::json();
  j["attempt"] = line.attempt > 0 ? nlohmann::json(line.attempt) : nlohmann::json();
  j["worker"] = line.worker.empty() ? nlohmann::json() : nlohmann::json(line.worker);
  return j;
}

int logs(const LogsOptions& options) {
  const std::vector<TileLogLine> lines =
      FarmClient(options.connection).logs(JobId{options.job}, options.tile, options.lines);
  if (options.common.json) {
    nlohmann::json array = nlohmann::json::array();
    for (const TileLogLine& line : lines) array.push_back(line_to_json(line));
    std::printf("%s\n", dump(array).c_str());
    return 0;
  }
  for (const TileLogLine& line : lines) {
    std::string about;
    if (line.tile >= 0) about += " tile " + std::to_string(line.tile);
    if (line.attempt > 0) about += " attempt " + std::to_string(line.attempt);
    if (!line.worker.empty()) about += " " + line.worker;
    std::printf("%s%s: %s\n", time_text(line.time).c_str(), about.c_str(), line.text.c_str());
  }
  return 0;
}

}  // namespace

void add_logs(CLI::App& app, Action& action) {
  auto options = std::make_shared<LogsOptions>();
  CLI::App* verb =
      add_verb(app, "logs", "What happened to a job's tiles: leases, commits, failures", &options->common);
  add_json(verb, &options->common);
  add_connection(verb, &options->connection);
  verb->add_option("JOB", options->job, "The job's id")->required();
  verb->add_option("--tile", options->tile, "Of this tile alone; its number, as in tiles")
      ->check(CLI::NonNegativeNumber);
  verb->add_option("--lines", options->lines, "The newest so many, of those that the coordinator still has")
      ->check(CLI::Range(1, 20000).description("1 to 20000"))
      ->capture_default_str();
  verb->callback([&action, options] { action = [options] { return logs(*options); }; });
}

}  // namespace lightmill::client
