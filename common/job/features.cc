#include "common/job/features.h"

#include <algorithm>
#include <iterator>

#include "common/base/error.h"

namespace lightmill {
namespace {

constexpr const char* kFeatureNames[] = {"hit",
                                         "next-event",
                                         "light-tracing",
                                         "vertex-connection",
                                         "textures",
                                         "texture-coordinates",
                                         "shading-normals",
                                         "bumps",
                                         "anisotropic-lobes",
                                         "mixes",
                                         "alpha-masks",
                                         "material-sort",
                                         "delta-lights",
                                         "general-kernels"};
static_assert((1u << std::size(kFeatureNames)) - 1 == kAllFeatures);

/// Today's name of a feature that had another one in earlier versions.
std::string today(const std::string& name) {
  return name == "lens" ? "light-tracing" : name == "connect" ? "vertex-connection" : name;
}

}  // namespace

std::string feature_names(Features set) {
  std::string names;
  for (unsigned i = 0; i < std::size(kFeatureNames); ++i) {
    if (!(set >> i & 1)) continue;
    if (!names.empty()) names += ',';
    names += kFeatureNames[i];
  }
  return names;
}

Features features_named(const std::string& names) {
  Features set = 0;
  for (size_t begin = 0; begin < names.size();) {
    const size_t end = std::min(names.find(',', begin), names.size());
    const std::string name = today(names.substr(begin, end - begin));
    const auto* found = std::find(std::begin(kFeatureNames), std::end(kFeatureNames), name);
    if (found == std::end(kFeatureNames)) {
      std::string list = feature_names(kAllFeatures);
      for (size_t at = 0; (at = list.find(',', at)) != std::string::npos; at += 2) list.replace(at, 1, ", ");
      throw Error(ErrorKind::kUsage,
                  "no feature \"" + name + "\" to switch on in \"" + names + "\"; there are " + list);
    }
    set |= 1u << (found - std::begin(kFeatureNames));
    begin = end + 1;
  }
  return set;
}

}  // namespace lightmill
