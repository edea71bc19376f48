#include "coordinator/web/guard.h"

#include <algorithm>
#include <array>
#include <string_view>

namespace lightmill {
namespace {

std::string_view without_port(std::string_view host) {
  if (host.starts_with('[')) return host.substr(0, host.find(']') + 1);
  return host.substr(0, host.find(':'));
}

}  // namespace

httplib::Headers security_headers() {
  return {{"Content-Security-Policy",
           "default-src 'none'; script-src 'self'; style-src 'self'; img-src 'self' data: blob:; connect-src "
           "'self'; "
           "base-uri 'none'; form-action 'none'; frame-ancestors 'none'"},
          {"X-Content-Type-Options", "nosniff"},
          {"X-Frame-Options", "DENY"},
          {"Referrer-Policy", "no-referrer"},
          {"Cross-Origin-Opener-Policy", "same-origin"},
          {"Cross-Origin-Resource-Policy", "same-origin"}};
}

std::string forgery(const httplib::Request& request) {
  if (request.get_header_value("X-Lightmill") != "1") {
    return "a request that changes something needs the header \"X-Lightmill: 1\"";
  }
  return foreign_page(request);
}

std::string foreign_page(const httplib::Request& request) {
  if (request.has_header("Origin")) {
    const std::string origin = request.get_header_value("Origin"), host = request.get_header_value("Host");
    if (origin != "http://" + host && origin != "https://" + host) {
      return "the page that asks is of " + origin.substr(0, 200) + ", this is " + host.substr(0, 200);
    }
  }
  const std::string site = request.get_header_value("Sec-Fetch-Site");
  if (!site.empty() && site != "same-origin" && site != "none") return "the page that asks is another site's";
  return {};
}

std::string foreign_host(const httplib::Request& request) {
  constexpr std::array<std::string_view, 3> kNames = {"localhost", "127.0.0.1", "[::1]"};
  const std::string host = request.get_header_value("Host");
  if (std::find(kNames.begin(), kNames.end(), without_port(host)) != kNames.end()) return {};
  return "this coordinator answers to loopback's names only, not to \"" + host.substr(0, 200) +
         "\"; open it as http://localhost:PORT/";
}

}  // namespace lightmill
