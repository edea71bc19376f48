#include "common/rpc/tls_diagnosis.h"

#include <arpa/inet.h>
#include <netdb.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <openssl/x509v3.h>
#include <sys/socket.h>
#include <unistd.h>

#include <array>
#include <memory>

#include "common/rpc/certificate_text.h"
#include "common/rpc/channel.h"

namespace lightmill {
namespace {

constexpr timeval kPatience{3, 0};

class Socket {
 public:
  /// Connects to the first address that answers; fd() is -1 if none does.
  explicit Socket(const HostPort& peer) {
    addrinfo hints{};
    hints.ai_socktype = SOCK_STREAM;
    addrinfo* list = nullptr;
    if (getaddrinfo(peer.host.c_str(), std::to_string(peer.port).c_str(), &hints, &list) != 0) return;
    for (const addrinfo* a = list; a && fd_ < 0; a = a->ai_next) try_one(*a);
    freeaddrinfo(list);
  }
  ~Socket() {
    if (fd_ >= 0) close(fd_);
  }
  Socket(const Socket&) = delete;
  Socket& operator=(const Socket&) = delete;
  int fd() const { return fd_; }

 private:
  void try_one(const addrinfo& a) {
    fd_ = socket(a.ai_family, a.ai_socktype | SOCK_CLOEXEC, a.ai_protocol);
    if (fd_ < 0) return;
    setsockopt(fd_, SOL_SOCKET, SO_SNDTIMEO, &kPatience, sizeof kPatience);  // connect obeys it, too
    setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &kPatience, sizeof kPatience);
    if (connect(fd_, a.ai_addr, a.ai_addrlen) == 0) return;
    close(fd_);
    fd_ = -1;
  }
  int fd_ = -1;
};

bool is_ip(const std::string& host) {
  std::array<unsigned char, 16> bytes{};
  return inet_pton(AF_INET, host.c_str(), bytes.data()) == 1 ||
         inet_pton(AF_INET6, host.c_str(), bytes.data()) == 1;
}

TlsDiagnosis of_their_certificate(long result, const Certificate& certificate, const std::string& host,
                                  const SecurityFiles& files) {
  switch (result) {
    case X509_V_OK:
      return {};
    case X509_V_ERR_CERT_HAS_EXPIRED:
      return {"its certificate " + expired_text(certificate), true};
    case X509_V_ERR_CERT_NOT_YET_VALID:
      return {"its certificate " + not_yet_valid_text(certificate), false};
    case X509_V_ERR_HOSTNAME_MISMATCH:
    case X509_V_ERR_IP_ADDRESS_MISMATCH:
      return {"its certificate is for " + names_of(certificate) + ", not for " + host +
                  "; use one of these names, or make one for it: lightmill-coordinator init --renew --san " +
                  host,
              true};
    case X509_V_ERR_UNABLE_TO_GET_ISSUER_CERT_LOCALLY:
    case X509_V_ERR_UNABLE_TO_VERIFY_LEAF_SIGNATURE:
    case X509_V_ERR_DEPTH_ZERO_SELF_SIGNED_CERT:
    case X509_V_ERR_SELF_SIGNED_CERT_IN_CHAIN:
    case X509_V_ERR_CERT_SIGNATURE_FAILURE:
      return {"its certificate was not signed by the CA in " + files.ca +
                  "; take ca.crt from the coordinator's own credentials",
              true};
    default:
      return {std::string("its certificate is not accepted: ") + X509_verify_cert_error_string(result), true};
  }
}

/// Whether our certificate is of the CA that signed theirs.
bool is_ours_of_their_authority(const SSL_CTX* context) {
  X509* const ours = SSL_CTX_get0_certificate(context);
  const std::unique_ptr<X509_STORE_CTX, void (*)(X509_STORE_CTX*)> check(X509_STORE_CTX_new(),
                                                                         X509_STORE_CTX_free);
  if (!ours || !check ||
      X509_STORE_CTX_init(check.get(), SSL_CTX_get_cert_store(context), ours, nullptr) != 1) {
    return true;  // unknown: nothing is said of it
  }
  const int result = X509_verify_cert(check.get()) == 1 ? X509_V_OK : X509_STORE_CTX_get_error(check.get());
  return result == X509_V_OK || result == X509_V_ERR_CERT_HAS_EXPIRED ||
         result == X509_V_ERR_CERT_NOT_YET_VALID;
}

/// Why the other side refused our certificate: by its alert, or, as gRPC does, by hanging up.
TlsDiagnosis of_our_certificate(unsigned long error, const SSL_CTX* context, const SecurityFiles& files) {
  const std::string ours = "it does not accept our certificate " + files.cert;
  if (!is_ours_of_their_authority(context)) {
    return {ours + ", which was not signed by the CA in " + files.ca +
                "; make one there: lightmill-coordinator grant NAME",
            true};
  }
  switch (ERR_GET_REASON(error)) {
    case SSL_R_TLSV1_ALERT_UNKNOWN_CA:
    case SSL_R_TLSV1_ALERT_DECRYPT_ERROR:  // its CA has our CA's name, but another key
    case SSL_R_SSLV3_ALERT_BAD_CERTIFICATE:
      return {ours + ", which was not signed by its CA; make one there: lightmill-coordinator grant NAME",
              true};
    case SSL_R_SSLV3_ALERT_CERTIFICATE_EXPIRED:
      return {ours + ", which has expired by its clock; make a new one: lightmill-coordinator init --renew",
              true};
    case SSL_R_TLSV13_ALERT_CERTIFICATE_REQUIRED:
    case SSL_R_SSLV3_ALERT_HANDSHAKE_FAILURE:
      return {"it requires a certificate of ours; give --credentials DIR, or --tls-cert and --tls-key", true};
    case SSL_R_WRONG_VERSION_NUMBER:
      return {"it does not speak TLS; give no TLS options, or start the coordinator with its --credentials",
              true};
    case SSL_R_UNEXPECTED_EOF_WHILE_READING:
      return {"it hangs up when it sees our certificate " + files.cert +
                  "; is its clock right, and does it trust the CA that signed this?",
              false};
    default:
      return {};
  }
}

}  // namespace

TlsDiagnosis diagnose_tls(const std::string& address, const SecurityFiles& files) {
  const HostPort peer = parse_address(address);
  const Socket socket(peer);
  if (socket.fd() < 0) return {};
  const std::unique_ptr<SSL_CTX, void (*)(SSL_CTX*)> context(SSL_CTX_new(TLS_client_method()), SSL_CTX_free);
  if (!context) return {};
  SSL_CTX_set_verify(context.get(), SSL_VERIFY_NONE, nullptr);  // goes on; the result is looked at below
  if (files.tls()) {
    SSL_CTX_load_verify_locations(context.get(), files.ca.c_str(), nullptr);
    SSL_CTX_use_certificate_chain_file(context.get(), files.cert.c_str());
    SSL_CTX_use_PrivateKey_file(context.get(), files.key.c_str(), SSL_FILETYPE_PEM);
  }
  static constexpr unsigned char kHttp2[] = "\x02h2";
  SSL_CTX_set_alpn_protos(context.get(), kHttp2, 3);
  const std::unique_ptr<SSL, void (*)(SSL*)> tls(SSL_new(context.get()), SSL_free);
  if (!tls) return {};
  if (is_ip(peer.host)) {
    X509_VERIFY_PARAM_set1_ip_asc(SSL_get0_param(tls.get()), peer.host.c_str());
  } else {
    SSL_set1_host(tls.get(), peer.host.c_str());
    SSL_set_tlsext_host_name(tls.get(), peer.host.c_str());
  }
  SSL_set_fd(tls.get(), socket.fd());
  ERR_clear_error();
  bool works = SSL_connect(tls.get()) == 1;
  const Certificate theirs(SSL_get1_peer_certificate(tls.get()), X509_free);
  if (!files.tls()) {
    if (!theirs) return {};
    return {"it speaks TLS; give --credentials DIR, or --tls-ca, --tls-cert, --tls-key and --token-file",
            true};
  }
  if (theirs) {
    TlsDiagnosis found = of_their_certificate(SSL_get_verify_result(tls.get()), theirs, peer.host, files);
    if (!found.problem.empty()) return found;
  }
  if (works) {  // with TLS 1.3 the other side judges our certificate after the handshake; then it greets
    char byte = 0;
    works = SSL_peek(tls.get(), &byte, 1) == 1;
  }
  TlsDiagnosis found = works ? TlsDiagnosis{} : of_our_certificate(ERR_peek_error(), context.get(), files);
  ERR_clear_error();
  return found;
}

}  // namespace lightmill
