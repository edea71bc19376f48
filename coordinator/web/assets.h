#pragma once
// The dashboard's files, inside the program: built from coordinator/web/app, or one page that says that it
// was left out of the build (LIGHTMILL_DASHBOARD=OFF).
#include <span>
#include <string_view>

namespace lightmill {

struct Asset {
  std::string_view path;  // "/" or "/assets/NAME"
  std::string_view type;  // MIME
  std::string_view bytes;
  std::string_view digest;  // of the bytes: tells a browser whether it has them already
};
std::span<const Asset> dashboard_assets();

}  // namespace lightmill
