#include "common/base/error.h"

namespace lightmill {

int Error::exit_code() const {
  switch (kind_) {
    case ErrorKind::kFailed:
      return 1;
    case ErrorKind::kUsage:
    case ErrorKind::kBadScene:
      return 2;
    case ErrorKind::kUnreachable:
      return 3;
  }
  return 1;
}

}  // namespace lightmill
