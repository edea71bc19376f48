#include "coordinator/http/http_base.h"

#include <httplib.h>
#include <openssl/err.h>
#include <openssl/ssl.h>
#include <sys/socket.h>

#include "common/base/error.h"
#include "common/rpc/channel.h"

namespace lightmill {
namespace {

/// Gives a connection the certificate of the moment. An SSL_CTX has it once and for all.
int use_certificate(SSL* tls, void* argument) {
  const auto& files = *static_cast<const SecurityFiles*>(argument);
  const bool used = SSL_use_certificate_chain_file(tls, files.cert.c_str()) == 1 &&
                    SSL_use_PrivateKey_file(tls, files.key.c_str(), SSL_FILETYPE_PEM) == 1;
  ERR_clear_error();
  return used ? 1 : 0;
}

}  // namespace

std::unique_ptr<httplib::Server> make_http_server(const SecurityFiles& files) {
  if (!files.tls()) return std::make_unique<httplib::Server>();
  return std::make_unique<httplib::SSLServer>([&files](SSL_CTX& context) {
    SSL_CTX_set_min_proto_version(&context, TLS1_2_VERSION);
    SSL_CTX_set_cert_cb(&context, use_certificate, const_cast<SecurityFiles*>(&files));
    return true;
  });
}

int bind_http(httplib::Server& server, const std::string& address) {
  const HostPort at = parse_address(address);
  // The library's default lets a second process share the port; here that is an error.
  server.set_socket_options([](int socket) {
    const int yes = 1;
    setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof yes);
  });
  int port = 0;
  if (at.port == 0) {
    port = server.bind_to_any_port(at.host.c_str());
  } else if (server.bind_to_port(at.host.c_str(), at.port)) {
    port = at.port;
  }
  if (port <= 0) {
    throw Error(ErrorKind::kFailed, "--http " + address + ": can't listen there; is the port in use?");
  }
  return port;
}

}  // namespace lightmill
