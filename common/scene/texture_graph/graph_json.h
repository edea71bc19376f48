#pragma once
// Strict access to the nodes of a texture graph's JSON. Whatever is wrong is an Error(kBadScene) that names
// the node. What a node has and nobody asks for is refused, too.
#include <functional>
#include <map>
#include <nlohmann/json_fwd.hpp>
#include <set>
#include <string>
#include <string_view>
#include <vector>

#include "common/scene/texture_graph/graph_builder.h"

namespace lightmill {

/// What a graph may have of each.
inline constexpr size_t kMostGraphBytes = 4u << 20, kMostGraphNodes = 1024, kMostGraphOperations = 20000,
                        kMostGraphImages = 64, kMostTableValues = 4096, kMostGraphText = 256;

/// What flows between nodes. Where a number is wanted, a colour gives its luminance and a vector its mean.
struct GraphSocket {
  enum class Kind { kNumber, kVector, kColor } kind = Kind::kNumber;
  GraphVector value;  // all three alike of a number
};

/// What all nodes of a graph share.
struct GraphContext {
  GraphBuilder builder;
  std::map<std::string, int32_t> spaces;  // by name
  Transform world;                        // the space of that name
  Transform to_world, to_object_normals;  // of the scene's normals
  std::vector<GraphImage> images;
  std::map<std::string, std::map<std::string, GraphSocket>> outputs;  // of nodes so far
  std::map<std::string, std::map<std::string, const char*>> refused;  // outputs that can't be had, and why
  std::set<std::string> later;                                        // names of nodes that are still to come
};

class GraphNode {
 public:
  GraphNode(GraphContext& graph, const nlohmann::json& json, std::string name)
      : graph_(graph), json_(json), name_(std::move(name)) {}

  [[noreturn]] void fail(const std::string& what) const;
  GraphContext& graph() const { return graph_; }
  GraphBuilder& builder() const { return graph_.builder; }

  // Inputs, by the identifiers of Blender's sockets.
  bool has_input(const char* socket) const;
  GraphNumber number(const char* socket, float fallback);
  GraphVector vector(const char* socket, float x, float y, float z);
  GraphVector color(const char* socket, float grey) { return vector(socket, grey, grey, grey); }

  // Parameters, by the names of Blender's properties.
  std::string choice(const char* name, const std::vector<std::string_view>& known, const char* fallback);
  size_t choice_index(const char* name, const std::vector<std::string_view>& known, const char* fallback);
  bool flag(const char* name, bool fallback);
  double parameter(const char* name, double fallback, double low, double high);
  std::string text(const char* name);
  std::vector<double> numbers(const nlohmann::json& list, const std::string& what, size_t least, size_t most);
  /// A member of any kind; null if it is not there.
  const nlohmann::json* member(const char* name);

  // Outputs.
  void out(const char* socket, const GraphNumber& value);
  void out_vector(const char* socket, const GraphVector& value);
  void out_color(const char* socket, const GraphVector& value);
  /// Says why one that Blender has is not there; an error only if it is read.
  void no_output(const char* socket, const char* why) const { graph_.refused[name_][socket] = why; }
  /// Refuses what was not asked for.
  void finish() const;

 private:
  GraphSocket socket(const nlohmann::json& json, const std::string& what);
  const nlohmann::json* input(const char* socket);

  GraphContext& graph_;
  const nlohmann::json& json_;
  std::string name_;
  std::set<std::string, std::less<>> asked_inputs_, asked_;
};

/// What a reference ["node", "Output"] names.
const GraphSocket& referred_socket(const GraphContext& graph, const nlohmann::json& reference,
                                   const std::string& who);
GraphNumber number_of(const GraphSocket& socket);

/// Makes operations of one type of node.
using GraphNodeReader = void (*)(GraphNode&);
/// By Blender's name of the type; a null reader is one that is known and can't be read, `why`.
struct GraphNodeType {
  const char* type;
  GraphNodeReader read;
  const char* why = "";
};

/// What takes the scene's normals to where `t` takes its points.
Transform for_normals(const Transform& t);
/// The shading normal in the object's space.
GraphVector object_normal(GraphContext& graph);
/// The vector input of a texture: generated coordinates where nothing is given.
GraphVector texture_vector(GraphNode& node);
// Of image_nodes.cc.
void read_image_node(GraphNode& node);
void read_environment_node(GraphNode& node);
std::vector<GraphNodeType> input_node_types();
std::vector<GraphNodeType> texture_node_types();
std::vector<GraphNodeType> color_node_types();
std::vector<GraphNodeType> vector_node_types();
std::vector<GraphNodeType> converter_node_types();
std::vector<GraphNodeType> spectrum_node_types();

}  // namespace lightmill
