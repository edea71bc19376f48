#pragma once
// What protects the dashboard from other web sites that the same browser visits. Tokens and TLS are elsewhere
// (coordinator/access/authenticator.h): a browser sends those by itself, whoever wrote the page that asks.
#include <httplib.h>

#include <string>

namespace lightmill {

/// Headers of every answer: a content security policy without inline script, no framing, no sniffing.
httplib::Headers security_headers();

/// Why a request that changes something is refused, or nothing. It must say "X-Lightmill: 1", which makes
/// browsers ask first when the page is another site's, and which is never granted; and where the browser
/// tells whence it comes, that must be here.
std::string forgery(const httplib::Request& request);

/// The second half of that: why the page that a browser asks for is another site's, or nothing.
std::string foreign_page(const httplib::Request& request);

/// Why a request by this name of ours is refused, or nothing. In plain text on loopback, another site could
/// have its own name lead here (DNS rebinding) and would then be "the same origin": only loopback's names are
/// taken.
std::string foreign_host(const httplib::Request& request);

}  // namespace lightmill
