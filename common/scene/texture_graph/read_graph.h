#pragma once
// Reads a texture graph's JSON (docs/texture-graph.md).
#include <string>
#include <vector>

#include "common/scene/texture_graph/texture_graph.h"

namespace lightmill {

/// A graph, and the images that its kImage operations show, by their numbers.
struct GraphFile {
  TextureGraph graph;
  std::vector<GraphImage> images;
};

/// Reads a graph whose spaces are those that the text gives; without, object coordinates are those that
/// `to_texture` leads to from the scene's space. Its nodes are as many as kMostGraphNodes; whatever else
/// strangers could make costly has a bound, too. Throws Error(kBadScene), with the name of the node that is
/// wrong. With `as_number` the output is made a number, as where one is wanted of a colour or vector.
GraphFile read_texture_graph(const std::string& json_text, const Transform& to_texture,
                             bool as_number = false);
/// The same of a file.
GraphFile read_texture_graph_file(const std::string& path, const Transform& to_texture, bool as_number);

}  // namespace lightmill
