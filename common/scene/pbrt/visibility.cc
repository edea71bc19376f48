// "hidden": the kinds of rays that do not see a shape, a light or an instance. Ours; pbrt has no such thing.
#include <array>

#include "common/scene/pbrt/scene.h"
#include "common/scene/pbrt/syntax/params.h"

namespace lightmill {

RayKinds hidden_from(ParameterList& params) {
  static constexpr std::array<std::pair<std::string_view, RayKinds>, 6> kKinds{
      {{"camera", kCameraRays},
       {"diffuse", kDiffuseRays},
       {"glossy", kGlossyRays},
       {"transmission", kTransmissionRays},
       {"volume_scatter", kVolumeRays},
       {"shadow", kShadowRays}}};
  const Parameter* given = params.find("hidden", {ParamType::kString});
  if (given == nullptr) return 0;
  RayKinds hidden = 0;
  for (const std::string& word : given->strings) {
    const auto* const kind =
        std::find_if(kKinds.begin(), kKinds.end(), [&](const auto& k) { return k.first == word; });
    if (kind != kKinds.end()) {
      hidden |= kind->second;
      continue;
    }
    params.odd_value("hidden",
                     "knows \"camera\", \"diffuse\", \"glossy\", \"transmission\", "
                     "\"volume_scatter\" and \"shadow\", not " +
                         in_quotes(word) + ", which is left out");
  }
  return hidden;
}

}  // namespace lightmill
