#include "common/rpc/certificate_text.h"

#include <arpa/inet.h>
#include <openssl/asn1.h>
#include <openssl/x509v3.h>

#include <array>
#include <ctime>

namespace lightmill {
namespace {

std::string time_text(const std::tm& time) {
  std::array<char, 40> text{};
  const size_t size = std::strftime(text.data(), text.size(), "%Y-%m-%d %H:%M:%S UTC", &time);
  return {text.data(), size};
}

std::string time_text(const ASN1_TIME* time) {
  std::tm parts{};
  return ASN1_TIME_to_tm(time, &parts) == 1 ? time_text(parts) : "an unreadable time";
}

std::string now_text() {
  const std::time_t now = std::time(nullptr);
  std::tm parts{};
  return gmtime_r(&now, &parts) ? time_text(parts) : "?";
}

std::string name_text(const GENERAL_NAME& name) {
  if (name.type == GEN_DNS) {
    const ASN1_STRING* text = name.d.dNSName;
    return {reinterpret_cast<const char*>(ASN1_STRING_get0_data(text)),
            static_cast<size_t>(ASN1_STRING_length(text))};
  }
  if (name.type != GEN_IPADD) return "";
  const ASN1_OCTET_STRING* address = name.d.iPAddress;
  const int length = ASN1_STRING_length(address);
  std::array<char, INET6_ADDRSTRLEN> text{};
  if (length != 4 && length != 16) return "";
  inet_ntop(length == 4 ? AF_INET : AF_INET6, ASN1_STRING_get0_data(address), text.data(), text.size());
  return text.data();
}

}  // namespace

std::string expired_text(const Certificate& certificate) {
  return "expired on " + time_text(X509_get0_notAfter(certificate.get())) + " (this machine's clock says " +
         now_text() + "); make a new one: lightmill-coordinator init --renew";
}

std::string not_yet_valid_text(const Certificate& certificate) {
  return "is valid only from " + time_text(X509_get0_notBefore(certificate.get())) +
         ", but this machine's clock says " + now_text() + "; set the clocks of both machines";
}

std::string names_of(const Certificate& certificate) {
  auto* names = static_cast<GENERAL_NAMES*>(
      X509_get_ext_d2i(certificate.get(), NID_subject_alt_name, nullptr, nullptr));
  std::string list;
  for (int i = 0; i < sk_GENERAL_NAME_num(names); ++i) {
    const std::string name = name_text(*sk_GENERAL_NAME_value(names, i));
    if (!name.empty()) list += (list.empty() ? "" : ", ") + name;
  }
  GENERAL_NAMES_free(names);
  return list.empty() ? "no host at all" : list;
}

}  // namespace lightmill
