#pragma once
// A digest that travels beside a worker's registration. Without TLS a line may change bits, and a
// registration that says another arithmetic class can't be told from a true one: its jobs would wait for
// workers that do not exist.
#include <string>

#include "lightmill/v1/worker.pb.h"

namespace lightmill {

/// Metadata of Register; optional, as for clients that do not know of it.
inline constexpr char kRegistrationDigestKey[] = "lightmill-registration-sha256";

/// SHA-256, in hex, of the message as it is on the wire.
std::string registration_digest(const v1::WorkerRegistration& registration);

}  // namespace lightmill
