#include "worker/render/scene/textures/graph/constant_graphs.h"

#include "common/scene/fold_constants.h"
#include "worker/render/scene/textures/graph/graph_program.h"

namespace lightmill {

std::optional<SceneDescription> with_constant_graphs(const SceneDescription& scene) {
  std::optional<SceneDescription> out;
  for (size_t i = 0; i < scene.textures.size(); ++i) {
    const auto* graph = std::get_if<GraphTexture>(&scene.textures[i].kind);
    if (!graph) continue;
    const auto value = GraphProgram(*graph->graph, graph->images).constant();
    if (!value) continue;
    if (!out) out = scene;
    out->textures[i].kind = ConstantTexture{*value};
  }
  if (out) fold_constants(&*out);
  return out;
}

}  // namespace lightmill
