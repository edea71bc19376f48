#include "common/scene/gltf/animation/animations.h"

#include <algorithm>
#include <charconv>
#include <cmath>
#include <nlohmann/json.hpp>
#include <numeric>
#include <set>

namespace lightmill {
namespace {

using nlohmann::json;

constexpr size_t kMostWeights = 1 << 16;

std::string name_of(const GltfValue& animation, size_t index) {
  const std::string name = animation.is_object() ? animation.text_or("name", "") : "";
  return name.empty() ? std::to_string(index) : name;
}

/// What is left of a sampler when keys are dropped or put in order: the values of key i are those of
/// order[i] before.
void keep_keys(const std::vector<size_t>& order, size_t numbers, Keyframes* k) {
  Keyframes out = *k;
  out.times.clear();
  out.values.clear();
  for (const size_t i : order) {
    out.times.push_back(k->times[i]);
    const auto begin = k->values.begin() + static_cast<std::ptrdiff_t>(i * numbers);
    out.values.insert(out.values.end(), begin, begin + static_cast<std::ptrdiff_t>(numbers));
  }
  *k = std::move(out);
}

Keyframes::Interpolation interpolation_of(const GltfValue& sampler) {
  using enum Keyframes::Interpolation;
  const std::string how = sampler.text_or("interpolation", "LINEAR");
  if (how == "STEP") return kStep;
  if (how == "CUBICSPLINE") return kCubicSpline;
  if (how != "LINEAR") {
    sampler.require("interpolation")
        .mended("is neither STEP, LINEAR nor CUBICSPLINE: " + in_quotes(how) + "; LINEAR is used");
  }
  return kLinear;
}

/// The numbers of an accessor, one element after the other.
std::vector<float> numbers_of(const GltfAccessor& accessor) {
  const auto components = static_cast<size_t>(accessor.components());
  std::vector<float> out(accessor.count() * components);
  for (size_t i = 0; i < accessor.count(); ++i) accessor.read(i, &out[i * components]);
  return out;
}

}  // namespace

GltfAnimations::GltfAnimations(GltfScene& scene, GltfBuffers& buffers, const GltfValue& root,
                               const json& document, const PoseChoice& choice)
    : scene_(scene), buffers_(buffers), root_(root) {
  if (!choice.is_given()) return;
  for (const size_t i : chosen(root, choice.animation))
    scene_.attempt_optional([&] { read(root.require("animations")[i], document); });
}

/// The pointer that a channel's target means; "" if it names no node, which is to be skipped.
std::string GltfAnimations::pointer_of(const GltfValue& target) const {
  const std::string path = target.require("path").text();
  if (path == "pointer") {
    const auto extension = target.extension("KHR_animation_pointer");
    if (!extension) target.fail("needs \"KHR_animation_pointer\"");
    return extension->require("pointer").text();
  }
  if (path != "translation" && path != "rotation" && path != "scale" && path != "weights") {
    target.require("path").fail(
        "must be \"translation\", \"rotation\", \"scale\", \"weights\" or \"pointer\", not " +
        in_quotes(path));
  }
  const int node = target.index_or_none("node", root_.count("nodes"), "node");
  return node < 0 ? "" : "/nodes/" + std::to_string(node) + "/" + path;
}

/// The first animation, and those after it that move nothing that one before does.
std::vector<size_t> GltfAnimations::side_by_side(const GltfValue& root) const {
  std::vector<size_t> out;
  std::set<std::string> moved;
  for (size_t i = 0; i < root.count("animations"); ++i) {
    std::set<std::string> own;
    try {
      const GltfValue animation = root.require("animations")[i];
      for (size_t c = 0; c < animation.count("channels"); ++c)
        own.insert(pointer_of(animation.require("channels")[c].require("target")));
    } catch (const GltfProblem&) {  // will be said where it is read
    }
    own.erase("");
    if (std::any_of(own.begin(), own.end(), [&](const std::string& p) { return moved.contains(p); }))
      continue;
    moved.insert(own.begin(), own.end());
    out.push_back(i);
  }
  return out;
}

std::vector<size_t> GltfAnimations::chosen(const GltfValue& root, const std::string& choice) const {
  const size_t count = root.count("animations");
  std::vector<std::string> names;
  for (size_t i = 0; i < count; ++i) names.push_back(name_of(root.require("animations")[i], i));
  if (choice.empty()) return side_by_side(root);
  if (const auto found = std::find(names.begin(), names.end(), choice); found != names.end())
    return {static_cast<size_t>(found - names.begin())};
  if (choice == "none") return {};
  if (choice == "all") {
    std::vector<size_t> all(count);
    std::iota(all.begin(), all.end(), size_t{0});
    return all;
  }
  size_t number = 0;
  const auto [end, error] = std::from_chars(choice.data(), choice.data() + choice.size(), number);
  if (error == std::errc() && end == choice.data() + choice.size() && number < count) return {number};
  constexpr size_t kMostShown = 400;
  std::string list;
  for (const std::string& name : names) {
    if (list.size() > kMostShown) {
      list += ", ...";
      break;
    }
    list += (list.empty() ? "" : ", ") + in_quotes(name);
  }
  scene_.error({"/animations", "no animation of the scene is called " + in_quotes(choice) +
                                   (count == 0 ? "; there is none" : "; there are " + list) +
                                   (count > 1 ? ", or 0 to " + std::to_string(count - 1) : "")});
  return {};
}

void GltfAnimations::read(const GltfValue& animation, const json& document) {
  if (animation.count("channels") == 0) animation.mended("has no channels, so nothing moves by it");
  for (size_t c = 0; c < animation.count("channels"); ++c) {
    const GltfValue channels = animation.require("channels");
    scene_.attempt_optional([&] { read_channel(animation, channels[c], document); });
  }
}

void GltfAnimations::read_channel(const GltfValue& animation, const GltfValue& channel,
                                  const json& document) {
  const GltfValue at = channel.require("target");
  const std::string pointer = pointer_of(at);
  if (pointer.empty()) return;
  std::string why;
  auto target = gltf_target(document, pointer, &why);
  if (!target) at.fail("the pointer " + in_quotes(pointer) + " " + why);
  const int of = channel.index_or_none("sampler", animation.count("samplers"), "sampler");
  if (of < 0) channel.fail("needs \"sampler\"");
  Keyframes keyframes = read_sampler(animation.require("samplers")[static_cast<size_t>(of)], *target);
  const auto [entry, is_new] = by_pointer_.try_emplace(pointer, channels_.size());
  if (!is_new) {
    channel.mended("moves what another channel moves; the last one counts");
    channels_[entry->second] = {std::move(*target), std::move(keyframes)};
    return;
  }
  channels_.push_back({std::move(*target), std::move(keyframes)});
}

Keyframes GltfAnimations::read_sampler(const GltfValue& sampler, const GltfTarget& target) {
  const size_t accessors = root_.count("accessors");
  const auto open = [&](const char* key, std::initializer_list<int> components) {
    const int of = sampler.index_or_none(key, accessors, "accessor");
    if (of < 0) sampler.fail(std::string("needs \"") + key + "\"");
    GltfAccessor a = buffers_.accessor(static_cast<size_t>(of), components);
    buffers_.charge(a.count() * static_cast<size_t>(a.components()), sampler);
    return a;
  };
  const GltfAccessor input = open("input", {1});
  const auto components = static_cast<int>(target.components);
  const GltfAccessor output =
      components == 1 || components == 0 ? open("output", {1}) : open("output", {components});
  Keyframes k;
  k.interpolation = interpolation_of(sampler);
  k.rotations = target.kind == GltfTarget::Kind::kRotation;
  const std::vector<float> times = numbers_of(input);
  k.times.assign(times.begin(), times.end());
  k.values = numbers_of(output);
  const size_t per_key = k.interpolation == Keyframes::Interpolation::kCubicSpline ? 3 : 1;
  k.components = target.components;
  if (k.components == 0) {  // as many as there are targets
    k.components = k.times.empty() ? 0 : k.values.size() / (k.times.size() * per_key);
    if (k.components > kMostWeights) sampler.fail("has more than 65536 weights");
    if (k.components == 0 && !k.times.empty()) sampler.fail("has fewer values than keys");
  }
  const size_t numbers = k.components * per_key;
  const size_t keys = numbers == 0 ? 0 : std::min(k.times.size(), k.values.size() / numbers);
  if (keys != k.times.size() || keys * numbers != k.values.size()) {
    sampler.mended("has " + std::to_string(k.times.size()) + " times for values of " +
                   std::to_string(numbers == 0 ? 0 : k.values.size() / numbers) +
                   " keys; what has no counterpart is left out");
  }
  std::vector<size_t> order(keys);
  std::iota(order.begin(), order.end(), size_t{0});
  const size_t bad = std::erase_if(order, [&](size_t i) {
    const auto begin = k.values.begin() + static_cast<std::ptrdiff_t>(i * numbers);
    return !std::isfinite(k.times[i]) || !std::all_of(begin, begin + static_cast<std::ptrdiff_t>(numbers),
                                                      [](float x) { return std::isfinite(x); });
  });
  if (bad > 0) sampler.mended(std::to_string(bad) + " keys that are not finite are left out");
  const auto earlier = [&](size_t a, size_t b) { return k.times[a] < k.times[b]; };
  if (!std::is_sorted(order.begin(), order.end(), earlier)) {
    sampler.mended("has times out of order; its keys are put in order");
    std::stable_sort(order.begin(), order.end(), earlier);
  }
  if (order.empty()) sampler.fail("has no key");
  keep_keys(order, numbers, &k);
  return k;
}

void GltfAnimations::prepare(json* document) const {
  for (const Channel& c : channels_) {
    if (const int node = c.target.node(); node >= 0 && c.target.path[2] != "weights")
      take_matrix_apart(&(*document)["nodes"][static_cast<size_t>(node)]);
  }
}

void GltfAnimations::pose(double time, json* document) const {
  std::vector<double> value;
  for (const Channel& c : channels_) {
    value.resize(c.keyframes.components);
    c.keyframes.at(time, value.data());
    set_target(c.target, value, document);
  }
}

std::pair<double, double> GltfAnimations::span() const {
  double first = channels_.front().keyframes.times.front(), last = first;
  for (const Channel& c : channels_) {
    first = std::min(first, c.keyframes.times.front());
    last = std::max(last, c.keyframes.times.back());
  }
  return {first, last};
}

const GltfAnimations::Channel* GltfAnimations::channel(const std::string& pointer) const {
  const auto found = by_pointer_.find(pointer);
  return found == by_pointer_.end() ? nullptr : &channels_[found->second];
}

bool GltfAnimations::at(size_t node, const char* what, double time, std::vector<double>* out) const {
  const Channel* c = channel("/nodes/" + std::to_string(node) + "/" + what);
  if (c == nullptr) return false;
  out->resize(c->keyframes.components);
  c->keyframes.at(time, out->data());
  return true;
}

bool GltfAnimations::moves(size_t node) const {
  const std::string base = "/nodes/" + std::to_string(node) + "/";
  return by_pointer_.contains(base + "translation") || by_pointer_.contains(base + "rotation") ||
         by_pointer_.contains(base + "scale");
}

bool GltfAnimations::weights_at(size_t mesh, double time, std::vector<double>* out) const {
  const Channel* c = channel("/meshes/" + std::to_string(mesh) + "/weights");
  if (c == nullptr) return false;
  out->resize(c->keyframes.components);
  c->keyframes.at(time, out->data());
  return true;
}

}  // namespace lightmill
