#include "common/rpc/registration_digest.h"

#include "common/base/digest.h"

namespace lightmill {

std::string registration_digest(const v1::WorkerRegistration& registration) {
  return sha256_hex(registration.SerializeAsString());
}

}  // namespace lightmill
