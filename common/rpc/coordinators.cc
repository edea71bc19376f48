#include "common/rpc/coordinators.h"

#include <algorithm>

#include "common/base/error.h"
#include "common/rpc/channel.h"

namespace lightmill {

Coordinators::Coordinators(const std::string& list) {
  constexpr size_t kMost = 16;
  for (size_t begin = 0; begin <= list.size();) {
    const size_t comma = std::min(list.find(',', begin), list.size());
    addresses_.push_back(list.substr(begin, comma - begin));
    parse_address(addresses_.back());
    if (addresses_.size() > kMost) {
      throw Error(ErrorKind::kUsage, "--coordinator: more than 16 addresses; name those that may lead");
    }
    begin = comma + 1;
  }
}

void Coordinators::move_on(size_t tried) { current_.compare_exchange_strong(tried, (tried + 1) % size()); }

}  // namespace lightmill
