#pragma once
// What is said of a certificate in messages.
#include <openssl/x509.h>

#include <memory>
#include <string>

namespace lightmill {

using Certificate = std::unique_ptr<X509, void (*)(X509*)>;

/// "expired on 2027-01-31 12:00:00 UTC, and this machine's clock says ...; make a new one with ..."
std::string expired_text(const Certificate& certificate);
/// "is valid only from ..., and this machine's clock says ...; set the clock"
std::string not_yet_valid_text(const Certificate& certificate);
/// The DNS names and addresses that it is for: "localhost, 127.0.0.1".
std::string names_of(const Certificate& certificate);

}  // namespace lightmill
