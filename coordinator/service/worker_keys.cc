#include "coordinator/service/worker_keys.h"

#include <openssl/crypto.h>
#include <openssl/rand.h>

#include "common/base/digest.h"
#include "common/base/error.h"
#include "coordinator/farm/farm_errors.h"

namespace lightmill {
namespace {

constexpr size_t kSecretBytes = 32, kKeyDigits = 32;

std::string random_secret() {
  std::string bytes(kSecretBytes, '\0');
  if (RAND_bytes(reinterpret_cast<unsigned char*>(bytes.data()), static_cast<int>(bytes.size())) != 1)
    throw Error(ErrorKind::kFailed, "the system gives no random numbers");
  return bytes;
}

}  // namespace

WorkerKeys::WorkerKeys() : secret_(random_secret()) {}

std::string WorkerKeys::key_of(const WorkerId& worker) const {
  // Digest of a digest: from one key nobody can go on to that of a longer name.
  return sha256_hex(secret_ + sha256_hex(secret_ + worker.value)).substr(0, kKeyDigits);
}

std::string WorkerKeys::name_of(const WorkerId& worker) const { return worker.value + "." + key_of(worker); }

WorkerId WorkerKeys::shown(const std::string& name) { return WorkerId{name.substr(0, name.find('.'))}; }

WorkerId WorkerKeys::worker_of(const std::string& name) const {
  const WorkerId worker = shown(name);
  const std::string right = name_of(worker);
  if (name.size() != right.size() || CRYPTO_memcmp(name.data(), right.data(), right.size()) != 0)
    throw UnknownWorker(worker);
  return worker;
}

}  // namespace lightmill
