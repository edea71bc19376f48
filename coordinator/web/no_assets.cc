// In place of the dashboard where it was left out of the build.
#include "coordinator/web/assets.h"

namespace lightmill {

std::span<const Asset> dashboard_assets() {
  static constexpr Asset kAssets[] = {
      {"/", "text/html; charset=utf-8",
       "<!doctype html><html lang=\"en\"><meta charset=\"utf-8\"><title>Lightmill</title><p>This coordinator "
       "was "
       "built without the dashboard (-DLIGHTMILL_DASHBOARD=OFF). Use the command line, <a "
       "href=\"/metrics\">/metrics</a> or <a href=\"/api/v1/jobs\">/api/v1/jobs</a>.</p></html>\n",
       "no-dashboard"}};
  return kAssets;
}

}  // namespace lightmill
