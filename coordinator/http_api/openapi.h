#pragma once
// The OpenAPI 3.0 text of the routes, with the comments of the .proto files as descriptions.
#include <string>

#include "coordinator/http_api/api_routes.h"

namespace lightmill {

/// A JSON document. The roles of access.h stand with each operation.
std::string openapi_text(const ApiRoutes& routes);

}  // namespace lightmill
