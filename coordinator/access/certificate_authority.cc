#include "coordinator/access/certificate_authority.h"

#include <arpa/inet.h>
#include <openssl/bio.h>
#include <openssl/bn.h>
#include <openssl/err.h>
#include <openssl/evp.h>
#include <openssl/pem.h>
#include <openssl/rand.h>
#include <openssl/x509v3.h>

#include <algorithm>
#include <array>
#include <cctype>
#include <cstring>

#include "common/base/error.h"

namespace lightmill {
namespace {

using Key = std::unique_ptr<EVP_PKEY, void (*)(EVP_PKEY*)>;
using Certificate = std::unique_ptr<X509, void (*)(X509*)>;
using Memory = std::unique_ptr<BIO, int (*)(BIO*)>;

constexpr int kSerialBits = 127;

[[noreturn]] void fail(const std::string& what) {
  std::array<char, 256> reason{};
  ERR_error_string_n(ERR_get_error(), reason.data(), reason.size());
  throw Error(ErrorKind::kFailed, "OpenSSL can't " + what + ": " + reason.data());
}

void require(bool done, const char* what) {
  if (!done) fail(what);
}

Key make_key() {
  Key key(EVP_EC_gen("P-256"), EVP_PKEY_free);
  require(key != nullptr, "make a key");
  return key;
}

std::string text_of(const Memory& memory) {
  char* data = nullptr;
  const long size = BIO_get_mem_data(memory.get(), &data);
  return {data, static_cast<size_t>(size)};
}

std::string pem_of(X509* certificate) {
  const Memory memory(BIO_new(BIO_s_mem()), BIO_free);
  require(memory && PEM_write_bio_X509(memory.get(), certificate) == 1, "write a certificate");
  return text_of(memory);
}

std::string pem_of(EVP_PKEY* key) {
  const Memory memory(BIO_new(BIO_s_mem()), BIO_free);
  require(
      memory && PEM_write_bio_PKCS8PrivateKey(memory.get(), key, nullptr, nullptr, 0, nullptr, nullptr) == 1,
      "write a key");
  return text_of(memory);
}

void set_serial(X509* certificate) {
  const std::unique_ptr<BIGNUM, void (*)(BIGNUM*)> number(BN_new(), BN_free);
  require(number && BN_rand(number.get(), kSerialBits, BN_RAND_TOP_ANY, BN_RAND_BOTTOM_ANY) == 1 &&
              BN_to_ASN1_INTEGER(number.get(), X509_get_serialNumber(certificate)),
          "draw a serial number");
}

void add_extension(X509* certificate, X509* issuer, int nid, const std::string& value) {
  X509V3_CTX context;
  X509V3_set_ctx_nodb(&context);
  X509V3_set_ctx(&context, issuer, certificate, nullptr, nullptr, 0);
  X509_EXTENSION* const extension = X509V3_EXT_conf_nid(nullptr, &context, nid, value.c_str());
  require(extension != nullptr, "make an extension");
  const int added = X509_add_ext(certificate, extension, -1);
  X509_EXTENSION_free(extension);
  require(added == 1, "add an extension");
}

Certificate make_certificate(const std::string& name, const Validity& validity, EVP_PKEY* key) {
  Certificate certificate(X509_new(), X509_free);
  require(certificate && X509_set_version(certificate.get(), X509_VERSION_3) == 1, "make a certificate");
  set_serial(certificate.get());
  X509_NAME* const subject = X509_get_subject_name(certificate.get());
  const auto* text = reinterpret_cast<const unsigned char*>(name.c_str());
  require(X509_NAME_add_entry_by_txt(subject, "O", MBSTRING_UTF8,
                                     reinterpret_cast<const unsigned char*>("Lightmill"), -1, -1, 0) == 1 &&
              X509_NAME_add_entry_by_txt(subject, "CN", MBSTRING_UTF8, text, -1, -1, 0) == 1 &&
              ASN1_TIME_set(X509_getm_notBefore(certificate.get()), validity.from) &&
              ASN1_TIME_set(X509_getm_notAfter(certificate.get()), validity.until) &&
              X509_set_pubkey(certificate.get(), key) == 1,
          "fill in a certificate");
  return certificate;
}

/// "DNS:name" or "IP:address". The text goes into OpenSSL's little language, so its characters are checked.
std::string alternative_name(const std::string& host) {
  std::array<unsigned char, 16> bytes{};
  if (inet_pton(AF_INET, host.c_str(), bytes.data()) == 1 ||
      inet_pton(AF_INET6, host.c_str(), bytes.data()) == 1) {
    return "IP:" + host;
  }
  const bool name = !host.empty() && host.size() <= 253 && std::all_of(host.begin(), host.end(), [](char c) {
    return std::isalnum(static_cast<unsigned char>(c)) || std::strchr(".-_*", c);
  });
  if (!name) throw Error(ErrorKind::kUsage, "--san " + host + ": is neither a host name nor an IP address");
  return "DNS:" + host;
}

}  // namespace

struct CertificateAuthority::Impl {
  Certificate certificate{nullptr, X509_free};
  Key key{nullptr, EVP_PKEY_free};
  PemPair pem;
};

CertificateAuthority CertificateAuthority::create(const std::string& name, const Validity& validity) {
  const Key key = make_key();
  const Certificate certificate = make_certificate(name, validity, key.get());
  X509* const self = certificate.get();
  require(X509_set_issuer_name(self, X509_get_subject_name(self)) == 1, "name the issuer");
  add_extension(self, self, NID_basic_constraints, "critical,CA:TRUE,pathlen:0");
  add_extension(self, self, NID_key_usage, "critical,keyCertSign,cRLSign");
  add_extension(self, self, NID_subject_key_identifier, "hash");
  require(X509_sign(self, key.get(), EVP_sha256()) > 0, "sign a certificate");
  return CertificateAuthority({pem_of(self), pem_of(key.get())});
}

CertificateAuthority::CertificateAuthority(const PemPair& pem) : impl_(std::make_unique<Impl>()) {
  impl_->pem = pem;
  const Memory certificate(BIO_new_mem_buf(pem.certificate.data(), static_cast<int>(pem.certificate.size())),
                           BIO_free);
  const Memory key(BIO_new_mem_buf(pem.key.data(), static_cast<int>(pem.key.size())), BIO_free);
  impl_->certificate.reset(PEM_read_bio_X509(certificate.get(), nullptr, nullptr, nullptr));
  impl_->key.reset(PEM_read_bio_PrivateKey(
      key.get(), nullptr, [](char*, int, int, void*) { return -1; }, nullptr));
  const bool fits = impl_->certificate && impl_->key &&
                    X509_check_private_key(impl_->certificate.get(), impl_->key.get()) == 1;
  ERR_clear_error();
  if (!fits) throw Error(ErrorKind::kFailed, "the CA's files are damaged: no certificate and its key (PEM)");
}

CertificateAuthority::~CertificateAuthority() = default;
CertificateAuthority::CertificateAuthority(CertificateAuthority&&) noexcept = default;
CertificateAuthority& CertificateAuthority::operator=(CertificateAuthority&&) noexcept = default;

const PemPair& CertificateAuthority::pem() const { return impl_->pem; }

PemPair CertificateAuthority::issue(const std::string& name, const std::vector<std::string>& hosts,
                                    const Validity& validity) const {
  std::string alternatives;
  for (const std::string& host : hosts) {
    if (!alternatives.empty()) alternatives += ',';
    alternatives += alternative_name(host);
  }
  const Key key = make_key();
  const Certificate certificate = make_certificate(name, validity, key.get());
  X509* const self = certificate.get();
  X509* const issuer = impl_->certificate.get();
  require(X509_set_issuer_name(self, X509_get_subject_name(issuer)) == 1, "name the issuer");
  add_extension(self, issuer, NID_basic_constraints, "critical,CA:FALSE");
  add_extension(self, issuer, NID_key_usage, "critical,digitalSignature");
  add_extension(self, issuer, NID_ext_key_usage, hosts.empty() ? "clientAuth" : "serverAuth");
  add_extension(self, issuer, NID_subject_key_identifier, "hash");
  add_extension(self, issuer, NID_authority_key_identifier, "keyid:always");
  if (!hosts.empty()) add_extension(self, issuer, NID_subject_alt_name, alternatives);
  require(X509_sign(self, impl_->key.get(), EVP_sha256()) > 0, "sign a certificate");
  return {pem_of(self), pem_of(key.get())};
}

}  // namespace lightmill
