#include "common/farm/pilot_result.h"

#include <nlohmann/json.hpp>

#include "common/base/error.h"
#include "common/base/json/json_depth.h"

namespace lightmill {
namespace {

constexpr int kMaxDepth = 16;
constexpr double kMaxCpuSeconds = 1e7;

}  // namespace

std::string encode_pilot(const PilotResult& result) {
  return nlohmann::json{{"cpu_seconds", result.cpu_seconds},
                        {"report", nlohmann::json::parse(pilot_to_json(result.report))}}
      .dump();
}

PilotResult decode_pilot(const std::string& bytes) {
  if (bytes.size() > kMaxPilotResultBytes) throw Error(ErrorKind::kUsage, "pilot result: larger than 1 MiB");
  check_json_depth(bytes, kMaxDepth);
  try {
    const auto j = nlohmann::json::parse(bytes);
    PilotResult result;
    result.report = pilot_from_json(j.at("report").dump());
    result.cpu_seconds = j.at("cpu_seconds").get<double>();
    if (!(result.cpu_seconds >= 0 && result.cpu_seconds <= kMaxCpuSeconds))
      throw Error(ErrorKind::kUsage, "pilot result: its CPU time is out of range");
    return result;
  } catch (const nlohmann::json::exception& e) {
    throw Error(ErrorKind::kUsage, std::string("the pilot result is malformed: ") + e.what());
  }
}

}  // namespace lightmill
