// Image textures: how a point becomes a place in the picture.
#include "common/scene/texture_graph/graph_json.h"

namespace lightmill {
namespace {

constexpr float kInvPi = 0.31830988618379067154f;

/// Looks up images that share all but their channel.
class Picture {
 public:
  explicit Picture(GraphNode& node) : node_(node) {
    image_.file = node.text("image");
    if (image_.file.empty()) node.fail("needs an \"image\", the name of a file");
    image_.color_space = node.choice("colorspace", {"sRGB", "Linear", "Non-Color"}, "sRGB");
    const std::string interpolation = node.choice("interpolation", {"Linear", "Closest", "Cubic"}, "Linear");
    if (interpolation == "Closest") image_.filter = TexelFilter::kNearest;
    if (interpolation == "Cubic") image_.filter = TexelFilter::kCubic;
  }
  void extend(const std::string& extension) { image_.extension = extension; }

  GraphVector color(const GraphNumber& s, const GraphNumber& t) { return lookup(false, s, t); }
  GraphNumber alpha(const GraphNumber& s, const GraphNumber& t) { return lookup(true, s, t).x; }

 private:
  GraphVector lookup(bool alpha, const GraphNumber& s, const GraphNumber& t) {
    int& number = number_[alpha];
    std::vector<GraphImage>& all = node_.graph().images;
    if (number < 0) {
      if (all.size() >= 2 * kMostGraphImages)
        node_.fail("is one image too many; a graph has " + std::to_string(kMostGraphImages) + " at most");
      number = static_cast<int>(all.size());
      all.push_back(image_);
      all.back().alpha = alpha;
    }
    return GraphBuilder::triple(node_.builder().add(GraphOp::kImage, {s, t}, number));
  }

  GraphNode& node_;
  GraphImage image_;
  int number_[2] = {-1, -1};
};

GraphNumber half_turns(const GraphNumber& y, const GraphNumber& x) {
  return apply(GraphOp::kArctan2, y, x) * kInvPi;
}

/// Elevation of a point in (0, 1).
GraphNumber elevation(const GraphVector& p) {
  const GraphNumber l = length(p);
  return 1.0f - apply(GraphOp::kArccosine, p.z / l) * kInvPi;
}

/// How much each axis counts where pictures from three sides meet, as Cycles blends them: one alone, or two,
/// or three over a strip as wide as `blend_width` on the sum of the normal's parts.
GraphVector box_weights(const GraphVector& normal, float width) {
  GraphBuilder& g = *normal.x.builder;
  const GraphVector a = each(normal, absolute);
  const GraphVector n = each(a, [&](const GraphNumber& x) { return x / (a.x + a.y + a.z); });
  const GraphNumber zero = g.constant(0), one = g.constant(1);
  const float limit = 0.5f * (1 + width), rest = 1 - limit;
  const auto where = [](const GraphNumber& some, const GraphVector& yes, const GraphVector& no) {
    return each(yes, no, [&](const GraphNumber& x, const GraphNumber& y) { return choose(some, x, y); });
  };
  GraphVector w{one, zero, zero};
  if (width > 0) {
    const auto share = [&](const GraphNumber& x, const GraphNumber& y) {
      return unit_clamp((x / (x + y) - 0.5f * (1 - width)) / width);
    };
    const GraphNumber xy = share(n.x, n.y), yz = share(n.y, n.z), xz = share(n.x, n.z);
    const float k = 1 / (2 * limit - 1);
    w = each(n, [&](const GraphNumber& x) { return (x * (2 - limit) + (limit - 1)) * k; });
    w = where((n.x + n.z) * rest - n.y, {xz, zero, 1.0f - xz}, w);
    w = where((n.y + n.z) * rest - n.x, {zero, yz, 1.0f - yz}, w);
    w = where((n.x + n.y) * rest - n.z, {xy, 1.0f - xy, zero}, w);
  }
  const auto alone = [&](const GraphNumber& x, const GraphNumber& y, const GraphNumber& z) {
    return minimum(x - (x + y) * limit, x - (x + z) * limit);
  };
  w = where(alone(n.z, n.x, n.y), {zero, zero, one}, w);
  w = where(alone(n.y, n.x, n.z), {zero, one, zero}, w);
  return where(alone(n.x, n.y, n.z), {one, zero, zero}, w);
}

/// Pictures along the three axes of the object, by the direction of its surface.
void read_box(GraphNode& node, Picture& picture, const GraphVector& p) {
  const GraphVector normal = object_normal(node.graph());
  const GraphVector w = box_weights(normal, static_cast<float>(node.parameter("projection_blend", 0, 0, 1)));
  // Not mirrored on the back.
  const GraphNumber sx = choose(normal.x * -1.0f, 1.0f - p.y, p.y), sy = choose(normal.y, 1.0f - p.x, p.x),
                    sz = choose(normal.z, 1.0f - p.y, p.y);
  node.out_color("Color",
                 picture.color(sx, p.z) * w.x + picture.color(sy, p.z) * w.y + picture.color(sz, p.x) * w.z);
  node.out("Alpha",
           picture.alpha(sx, p.z) * w.x + picture.alpha(sy, p.z) * w.y + picture.alpha(sz, p.x) * w.z);
}

}  // namespace

void read_image_node(GraphNode& node) {
  const std::string projection = node.choice("projection", {"FLAT", "BOX", "SPHERE", "TUBE"}, "FLAT");
  Picture picture(node);
  picture.extend(node.choice("extension", {"REPEAT", "EXTEND", "CLIP", "MIRROR"}, "REPEAT"));
  GraphBuilder& g = node.builder();
  GraphVector p = node.vector("Vector", 0, 0, 0);
  if (!node.has_input("Vector")) p = {g.input(GraphInput::kU), g.input(GraphInput::kV), g.constant(0)};
  if (projection == "BOX") return read_box(node, picture, p);
  node.parameter("projection_blend", 0, 0, 1);
  GraphNumber s = p.x, t = p.y;
  if (projection != "FLAT") {
    // Around the axis from (0.5, 0.5, 0) up; -1 to 1 in each direction.
    const GraphVector q = each(p, [](const GraphNumber& x) { return x * 2.0f - 1.0f; });
    const GraphNumber around = (1.0f - half_turns(q.x, q.y)) * 0.5f;
    s = choose(absolute(q.x) + absolute(q.y), around, g.constant(0));
    t = projection == "SPHERE" ? elevation(q) : (q.z + 1.0f) * 0.5f;
  }
  node.out_color("Color", picture.color(s, t));
  node.out("Alpha", picture.alpha(s, t));
}

void read_environment_node(GraphNode& node) {
  node.choice("projection", {"EQUIRECTANGULAR"}, "EQUIRECTANGULAR");
  Picture picture(node);
  if (!node.has_input("Vector")) node.fail("needs a \"Vector\", the direction");
  const GraphVector d = node.vector("Vector", 0, 0, 0);
  node.out_color("Color", picture.color(0.5f - half_turns(d.y, d.x) * 0.5f, elevation(d)));
}

}  // namespace lightmill
