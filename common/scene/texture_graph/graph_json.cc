#include "common/scene/texture_graph/graph_json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "common/base/error.h"
#include "common/scene/problem_list.h"

namespace lightmill {
namespace {

using nlohmann::json;

constexpr double kLargestNumber = 1e30;

}  // namespace

GraphNumber number_of(const GraphSocket& socket) {
  const GraphVector& v = socket.value;
  if (socket.kind == GraphSocket::Kind::kColor) return luminance(v);
  if (socket.kind == GraphSocket::Kind::kVector) return (v.x + v.y + v.z) * (1.0f / 3.0f);
  return v.x;
}

const GraphSocket& referred_socket(const GraphContext& graph, const json& reference, const std::string& who) {
  const auto is_text = [&](size_t i) {
    return reference[i].is_string() && reference[i].get_ref<const std::string&>().size() <= kMostGraphText;
  };
  if (!reference.is_array() || reference.size() != 2 || !is_text(0) || !is_text(1))
    fail_scene(who + " needs [\"node\", \"Output\"]");
  const auto &node = reference[0].get_ref<const std::string&>(),
             &output = reference[1].get_ref<const std::string&>();
  const auto found = graph.outputs.find(node);
  if (found == graph.outputs.end()) {
    std::vector<std::string_view> names;
    for (const auto& [name, sockets] : graph.outputs) names.push_back(name);
    fail_scene(who + " reads the node " + in_quotes(node) +
               (graph.later.contains(node)
                    ? ", which is the node itself or comes later; nodes read earlier ones"
                    : ", which is not there" + nearest_hint(node, names)));
  }
  const auto socket = found->second.find(output);
  if (socket == found->second.end()) {
    if (const auto all = graph.refused.find(node); all != graph.refused.end()) {
      if (const auto why = all->second.find(output); why != all->second.end())
        fail_scene(who + " reads " + in_quotes(output) + " of the node " + in_quotes(node) +
                   ", which is not supported: " + why->second);
    }
    std::vector<std::string_view> names;
    for (const auto& [name, value] : found->second) names.push_back(name);
    fail_scene(who + " reads " + in_quotes(output) + " of the node " + in_quotes(node) +
               ", which has no such output" + nearest_hint(output, names));
  }
  return socket->second;
}

void GraphNode::fail(const std::string& what) const {
  fail_scene("the node " + in_quotes(name_) + " " + what);
}

const json* GraphNode::input(const char* socket) {
  asked_inputs_.insert(socket);
  const auto inputs = json_.find("inputs");
  if (inputs == json_.end() || !inputs->is_object()) return nullptr;
  const auto found = inputs->find(socket);
  return found == inputs->end() ? nullptr : &*found;
}

bool GraphNode::has_input(const char* socket) const {
  const auto inputs = json_.find("inputs");
  return inputs != json_.end() && inputs->is_object() && inputs->contains(socket);
}

std::vector<double> GraphNode::numbers(const json& list, const std::string& what, size_t least, size_t most) {
  const std::string count =
      least == most ? std::to_string(least) : std::to_string(least) + " to " + std::to_string(most);
  if (!list.is_array() || list.size() < least || list.size() > most)
    fail(what + " needs " + count + " numbers");
  std::vector<double> out;
  for (const json& x : list) {
    if (!x.is_number()) fail(what + " needs " + count + " numbers");
    const double value = x.get<double>();
    if (!(std::fabs(value) <= kLargestNumber)) fail(what + " has a number beyond 1e30");
    out.push_back(value);
  }
  return out;
}

GraphSocket GraphNode::socket(const json& value, const std::string& what) {
  GraphBuilder& g = builder();
  if (value.is_number()) {
    const double x = value.get<double>();
    if (!(std::fabs(x) <= kLargestNumber)) fail(what + " is beyond 1e30");
    const GraphNumber c = g.constant(static_cast<float>(x));
    return {GraphSocket::Kind::kNumber, {c, c, c}};
  }
  if (value.is_array() && value.size() == 2)
    return referred_socket(graph_, value, "the node " + in_quotes(name_) + ": " + what);
  if (!value.is_array()) fail(what + " needs a number, three numbers, or [\"node\", \"Output\"]");
  const std::vector<double> v =
      numbers(value, what, 3, 4);  // a fourth is an alpha, which colours don't have here
  const auto f = [&](size_t i) { return static_cast<float>(v[i]); };
  return {v.size() == 4 ? GraphSocket::Kind::kColor : GraphSocket::Kind::kVector,
          g.constant(f(0), f(1), f(2))};
}

GraphNumber GraphNode::number(const char* name, float fallback) {
  const json* value = input(name);
  return value ? number_of(socket(*value, "input " + in_quotes(name))) : builder().constant(fallback);
}

GraphVector GraphNode::vector(const char* name, float x, float y, float z) {
  const json* value = input(name);
  return value ? socket(*value, "input " + in_quotes(name)).value : builder().constant(x, y, z);
}

const json* GraphNode::member(const char* name) {
  asked_.insert(name);
  const auto found = json_.find(name);
  return found == json_.end() || found->is_null() ? nullptr : &*found;
}

std::string GraphNode::text(const char* name) {
  const json* value = member(name);
  if (!value) return "";
  if (!value->is_string() || value->get_ref<const std::string&>().size() > kMostGraphText)
    fail("needs a text of at most " + std::to_string(kMostGraphText) + " bytes as " + in_quotes(name));
  return value->get<std::string>();
}

size_t GraphNode::choice_index(const char* name, const std::vector<std::string_view>& known,
                               const char* fallback) {
  std::string given = text(name);
  if (given.empty()) given = fallback;
  for (size_t i = 0; i < known.size(); ++i) {
    if (known[i] == given) return i;
  }
  fail("has the " + in_quotes(name) + " " + in_quotes(given) + ", which is not supported" +
       nearest_hint(given, known));
}

std::string GraphNode::choice(const char* name, const std::vector<std::string_view>& known,
                              const char* fallback) {
  return std::string(known[choice_index(name, known, fallback)]);
}

bool GraphNode::flag(const char* name, bool fallback) {
  const json* value = member(name);
  if (!value) return fallback;
  if (!value->is_boolean()) fail("needs true or false as " + in_quotes(name));
  return value->get<bool>();
}

double GraphNode::parameter(const char* name, double fallback, double low, double high) {
  const json* value = member(name);
  if (!value) return fallback;
  const double x = value->is_number() ? value->get<double>() : std::nan("");
  if (!(x >= low && x <= high)) {
    char range[64];
    std::snprintf(range, sizeof range, "%g to %g", low, high);
    fail("needs a number from " + std::string(range) + " as " + in_quotes(name));
  }
  return x;
}

void GraphNode::out(const char* socket, const GraphNumber& x) {
  graph_.outputs[name_][socket] = {GraphSocket::Kind::kNumber, {x, x, x}};
}
void GraphNode::out_vector(const char* socket, const GraphVector& v) {
  graph_.outputs[name_][socket] = {GraphSocket::Kind::kVector, v};
}
void GraphNode::out_color(const char* socket, const GraphVector& v) {
  graph_.outputs[name_][socket] = {GraphSocket::Kind::kColor, v};
}

void GraphNode::finish() const {
  const auto refuse = [&](const std::string& key, const char* kind, const auto& asked) {
    fail(std::string("has ") + kind + " " + in_quotes(key) + ", which is unknown" +
         nearest_hint(key, {asked.begin(), asked.end()}));
  };
  for (const auto& [key, value] : json_.items()) {
    if (key != "name" && key != "type" && key != "inputs" && !asked_.contains(key))
      refuse(key, "a parameter", asked_);
  }
  const auto inputs = json_.find("inputs");
  if (inputs == json_.end()) return;
  if (!inputs->is_object()) fail("needs an object as \"inputs\"");
  for (const auto& [key, value] : inputs->items()) {
    if (!asked_inputs_.contains(key)) refuse(key, "an input", asked_inputs_);
  }
}

}  // namespace lightmill
