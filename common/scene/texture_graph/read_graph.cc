#include "common/scene/texture_graph/read_graph.h"

#include <algorithm>
#include <cmath>
#include <fstream>
#include <nlohmann/json.hpp>
#include <unordered_map>

#include "common/base/error.h"
#include "common/scene/problem_list.h"
#include "common/scene/texture_graph/graph_json.h"

namespace lightmill {
namespace {

using nlohmann::json;

constexpr int kMostDepth = 8;
constexpr int64_t kMostGraphWork = 100'000;

using GraphNodeTypes = std::unordered_map<std::string_view, GraphNodeType>;

const GraphNodeTypes& graph_node_types() {
  static const GraphNodeTypes all = [] {
    GraphNodeTypes types;
    for (const auto& list : {input_node_types(), texture_node_types(), color_node_types(),
                             vector_node_types(), converter_node_types(), spectrum_node_types()}) {
      for (const GraphNodeType& t : list) types.emplace(t.type, t);
    }
    return types;
  }();
  return all;
}

/// About how many lattice points or cells an operation looks at; 1 for one that looks at none.
int64_t work_of(const GraphOperation& o) {
  const auto power = [&](int64_t base) {
    int64_t n = 1;
    for (int i = 0; i < o.p; ++i) n *= base;
    return n;
  };
  constexpr int64_t kMostOctaves = 17;
  switch (o.op) {
    case GraphOp::kPerlin:
      return power(2);
    case GraphOp::kFractal:
    case GraphOp::kMusgrave:
      return kMostOctaves * power(2);
    case GraphOp::kVoronoi:
      return o.q == static_cast<int32_t>(VoronoiFeature::kSmoothF1) ? power(5) : 2 * power(3);
    default:
      return 1;
  }
}

json parse_graph(const std::string& text) {
  if (text.size() > kMostGraphBytes)
    fail_scene("it has more than " + std::to_string(kMostGraphBytes >> 20) + " MiB");
  const auto shallow = [](int depth, json::parse_event_t, json&) {
    if (depth > kMostDepth) fail_scene("it is nested more than " + std::to_string(kMostDepth) + " deep");
    return true;
  };
  try {
    return json::parse(text, shallow);
  } catch (const json::exception& e) {
    fail_scene("it is not JSON: " + std::string(e.what()));
  }
}

Transform transform_of(const json& list, const std::string& name) {
  const auto good = [](const json& x) { return x.is_number() && std::fabs(x.get<double>()) <= 1e30; };
  if (!list.is_array() || list.size() != 16 || !std::all_of(list.begin(), list.end(), good))
    fail_scene("the space " + in_quotes(name) + " needs 16 numbers, a matrix row by row");
  Transform t;
  for (size_t i = 0; i < 16; ++i) t.m[i / 4][i % 4] = list[i].get<double>();
  return t;
}

void read_spaces(const json& root, const Transform& to_texture, GraphContext* graph) {
  std::map<std::string, Transform> spaces = {
      {"world", {}}, {"object", to_texture}, {"generated", to_texture}};
  if (const auto given = root.find("spaces"); given != root.end()) {
    if (!given->is_object()) fail_scene("\"spaces\" must be an object");
    for (const auto& [name, matrix] : given->items()) {
      static const std::vector<std::string_view> known = {"world", "object", "generated", "camera"};
      if (std::find(known.begin(), known.end(), name) == known.end())
        fail_scene("the space " + in_quotes(name) + " is unknown" + nearest_hint(name, known));
      spaces[name] = transform_of(matrix, name);
      if (name == "object" && !given->contains("generated")) spaces["generated"] = spaces[name];
    }
  }
  for (const auto& [name, t] : spaces) graph->spaces[name] = graph->builder.space(t);
  graph->world = spaces["world"];
  graph->to_world = for_normals(spaces["world"]);
  graph->to_object_normals = for_normals(spaces["object"]);
}

std::string text_of(const json& node, const char* key, size_t number) {
  const auto found = node.is_object() ? node.find(key) : node.end();
  if (!node.is_object() || found == node.end() || !found->is_string() ||
      found->get_ref<const std::string&>().empty() ||
      found->get_ref<const std::string&>().size() > kMostGraphText)
    fail_scene("node " + std::to_string(number) + " needs a " + in_quotes(key) + ", a text of 1 to " +
               std::to_string(kMostGraphText) + " bytes");
  return found->get<std::string>();
}

void read_node(const json& json_node, const std::string& name, const std::string& type, GraphContext* graph) {
  GraphNode node(*graph, json_node, name);
  const auto found = graph_node_types().find(type);
  if (found == graph_node_types().end()) {
    std::vector<std::string_view> known;
    for (const auto& [other, reader] : graph_node_types()) {
      if (reader.read) known.push_back(other);
    }
    std::sort(known.begin(), known.end());
    node.fail("is of the unknown type " + in_quotes(type) + nearest_hint(type, known));
  }
  if (!found->second.read) node.fail("(" + type + ") is not supported: " + found->second.why);
  found->second.read(node);
  graph->outputs[name];  // it is there even if it has none
  node.finish();
  if (graph->builder.operations() > kMostGraphOperations)
    node.fail("makes the graph larger than " + std::to_string(kMostGraphOperations) + " operations");
}

}  // namespace

GraphFile read_texture_graph(const std::string& json_text, const Transform& to_texture, bool as_number) {
  const json root = parse_graph(json_text);
  if (!root.is_object()) fail_scene("a texture graph is a JSON object");
  for (const auto& [key, value] : root.items()) {
    static const std::vector<std::string_view> known = {"texture_graph", "spaces", "nodes", "output"};
    if (std::find(known.begin(), known.end(), key) == known.end())
      fail_scene(in_quotes(key) + " is unknown" + nearest_hint(key, known));
  }
  if (root.value("texture_graph", json()) != 1) fail_scene("\"texture_graph\": 1, the version, is missing");
  const auto nodes = root.find("nodes");
  if (nodes == root.end() || !nodes->is_array() || nodes->size() > kMostGraphNodes)
    fail_scene("\"nodes\" must be an array of at most " + std::to_string(kMostGraphNodes) + " nodes");
  if (!root.contains("output")) fail_scene("\"output\" is missing");
  GraphContext graph;
  read_spaces(root, to_texture, &graph);
  std::vector<std::string> names;
  for (const json& node : *nodes) {
    names.push_back(text_of(node, "name", names.size()));
    if (!graph.later.insert(names.back()).second)
      fail_scene("two nodes are named " + in_quotes(names.back()));
  }
  for (size_t i = 0; i < names.size(); ++i) {
    read_node((*nodes)[i], names[i], text_of((*nodes)[i], "type", i), &graph);
    graph.later.erase(names[i]);
  }
  const GraphSocket& socket = referred_socket(graph, root["output"], "\"output\"");
  GraphVector output = socket.value;
  if (as_number) output.x = output.y = output.z = number_of(socket);
  GraphFile out;
  out.graph = graph.builder.finish(output);
  out.graph.to_world = graph.world;
  int64_t work = 0;
  for (const GraphOperation& o : out.graph.operations) work += work_of(o);
  if (work > kMostGraphWork)
    fail_scene("it looks at " + std::to_string(work) + " cells of noise for every point; at most " +
               std::to_string(kMostGraphWork) + " are");
  // Of the images only those that are shown.
  std::vector<int> number(graph.images.size(), -1);
  for (GraphOperation& o : out.graph.operations) {
    if (o.op != GraphOp::kImage) continue;
    int& n = number[static_cast<size_t>(o.p)];
    if (n < 0) {
      n = static_cast<int>(out.images.size());
      out.images.push_back(graph.images[static_cast<size_t>(o.p)]);
    }
    o.p = n;
  }
  return out;
}

GraphFile read_texture_graph_file(const std::string& path, const Transform& to_texture, bool as_number) {
  std::ifstream file(path, std::ios::binary);
  std::string text(kMostGraphBytes + 1, '\0');
  file.read(text.data(), static_cast<std::streamsize>(text.size()));
  if (file.bad() || (!file && !file.eof())) fail_scene("can't be read");
  text.resize(static_cast<size_t>(file.gcount()));
  return read_texture_graph(text, to_texture, as_number);
}

}  // namespace lightmill
