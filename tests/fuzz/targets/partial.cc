// What workers commit: partials and pilots' results. What is accepted encodes to the same content again.
#include "common/film/partial.h"

#include <cstdlib>

#include "common/base/error.h"
#include "common/farm/pilot_result.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using namespace lightmill;
  const std::string bytes(reinterpret_cast<const char*>(data), size);
  try {
    const Partial partial = decode_partial(bytes);
    if (partial_digest(decode_partial(encode_partial(partial))) != partial_digest(partial)) abort();
  } catch (const Error&) {
  }
  try {
    encode_pilot(decode_pilot(bytes));
  } catch (const Error&) {
  }
  return 0;
}
