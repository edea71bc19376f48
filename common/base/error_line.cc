#include "common/base/error_line.h"

#include <new>
#include <system_error>

namespace lightmill {

std::string error_line(const std::exception& error) {
  if (dynamic_cast<const std::bad_alloc*>(&error) != nullptr) {
    return "out of memory; lower the resolution, free some memory, or raise its limit (ulimit -v and -d, or "
           "the "
           "container's)";
  }
  const auto* system = dynamic_cast<const std::system_error*>(&error);
  if (system != nullptr && system->code() == std::errc::resource_unavailable_try_again) {
    return "the system has no more threads for this program, or no memory for them; lower --threads, or "
           "raise the "
           "limits (ulimit -u and -v, or the container's)";
  }
  return error.what();
}

}  // namespace lightmill
