#include "common/job/strategies.h"

#include <algorithm>

#include "common/base/error.h"

namespace lightmill {
namespace {

constexpr const char* kStrategyNames[] = {"hit", "next-event", "light-tracing", "vertex-connection"};
/// What they were called in earlier versions.
constexpr const char* kOlderNames[] = {"hit", "next-event", "lens", "connect"};

}  // namespace

std::string strategy_names(Strategies set) {
  std::string names;
  for (unsigned i = 0; i < 4; ++i) {
    if (!(set >> i & 1)) continue;
    if (!names.empty()) names += ',';
    names += kStrategyNames[i];
  }
  return names;
}

Strategies strategies_named(const std::string& names) {
  Strategies set = 0;
  for (size_t begin = 0; begin <= names.size();) {
    const size_t end = std::min(names.find(',', begin), names.size());
    const std::string name = names.substr(begin, end - begin);
    unsigned i = 0;
    while (i < 4 && name != kStrategyNames[i] && name != kOlderNames[i]) ++i;
    if (i == 4) {
      throw Error(ErrorKind::kUsage,
                  "unknown strategy \"" + name + "\" in \"" + names +
                      "\"; list some of hit, next-event, light-tracing, vertex-connection");
    }
    set |= 1u << i;
    begin = end + 1;
  }
  return set;
}

}  // namespace lightmill
