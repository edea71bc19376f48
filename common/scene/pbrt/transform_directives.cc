// The directives that move things: transforms and named coordinate systems.
#include <algorithm>
#include <array>
#include <cmath>

#include "common/scene/motion.h"
#include "common/scene/pbrt/parser.h"
#include "common/scene/transform.h"

namespace lightmill {

void PbrtParser::on_identity(const Token& d) { apply(d, Transform{}, true); }

void PbrtParser::on_translate(const Token& d) {
  double v[3];
  if (take_numbers(d, v, 3)) apply(d, translation({v[0], v[1], v[2]}));
}

void PbrtParser::on_scale(const Token& d) {
  double v[3];
  if (take_numbers(d, v, 3)) apply(d, scaling({v[0], v[1], v[2]}));
}

void PbrtParser::on_rotate(const Token& d) {
  double v[4];
  if (!take_numbers(d, v, 4)) return;
  const Vec3d axis{v[1], v[2], v[3]};
  if (!(length(axis) > 0)) {
    problems_->warning(d.where.location(), "Rotate needs an axis that is not 0 0 0; it is left out");
    return;
  }
  apply(d, rotation(v[0], axis));
}

void PbrtParser::on_look_at(const Token& d) {
  double v[9];
  if (!take_numbers(d, v, 9)) return;
  const Vec3d eye{v[0], v[1], v[2]}, target{v[3], v[4], v[5]}, up{v[6], v[7], v[8]};
  if (look_at_is_degenerate(eye, target, up)) {
    problems_->error(d.where.location(),
                     "LookAt needs a target other than the eye, and an up vector not along the view");
    return;
  }
  apply(d, look_at(eye, target, up));
}

void PbrtParser::on_transform(const Token& d) {
  std::array<double, 16> v;
  if (take_numbers(d, v.data(), v.size())) apply(d, from_columns(v), true);
}

void PbrtParser::on_concat_transform(const Token& d) {
  std::array<double, 16> v;
  if (take_numbers(d, v.data(), v.size())) apply(d, from_columns(v));
}

void PbrtParser::on_coordinate_system(const Token& d) {
  if (const auto name = take_string(d, "a name"))
    coordinate_systems_[*name] = {state_.shape.ctm, state_.ctm_end};
}

void PbrtParser::on_coord_sys_transform(const Token& d) {
  const auto name = take_string(d, "a name");
  if (!name) return;
  if (const auto found = coordinate_systems_.find(*name); found != coordinate_systems_.end()) {
    if (state_.transforms_start) state_.shape.ctm = found->second.start;
    if (state_.transforms_end) state_.ctm_end = found->second.end;
    state_.flat.reset();
    return;
  }
  std::vector<std::string_view> names;
  for (const auto& [known, transform] : coordinate_systems_) names.push_back(known);
  problems_->error(d.where.location(),
                   "there is no coordinate system named " + in_quotes(*name) + nearest_hint(*name, names));
}

void PbrtParser::on_active_transform(const Token&) {
  const Token which = tokens_->next();
  if (which.text != "StartTime" && which.text != "EndTime" && which.text != "All") {
    problems_->error(which.where.location(),
                     "ActiveTransform needs StartTime, EndTime or All, not " + in_quotes(which.text));
    return;
  }
  state_.transforms_start = which.text != "EndTime";
  state_.transforms_end = which.text != "StartTime";
}

void PbrtParser::on_transform_steps(const Token& d) {
  const SourceLocation where = d.where.location();
  double count = 0;
  if (!take_numbers(d, &count, 1)) return;
  constexpr double kCounts[] = {3, 5, 9, 17, 33, 65};
  if (std::ranges::count(kCounts, count) == 0) {
    problems_->error(where, "TransformSteps needs 3, 5, 9, 17, 33 or 65 matrices, and their number first");
    skip_to_directive();
    return;
  }
  std::vector<double> numbers(static_cast<size_t>(16 * count));
  if (!take_numbers(d, numbers.data(), numbers.size())) return;
  auto steps = std::make_shared<std::vector<Transform>>();
  for (size_t i = 0; i < numbers.size(); i += 16) {
    std::array<double, 16> m;
    std::copy_n(&numbers[i], 16, m.begin());
    const Transform t = from_columns(m);
    if (!is_affine(t) || !is_good_ctm(t) || (i > 0 && !can_move(steps->front(), t))) {
      problems_->error(where,
                       "TransformSteps needs matrices that are affine, not singular, and of one handedness");
      return;
    }
    steps->push_back(t);
  }
  state_.flat.reset();
  state_.shape.ctm = steps->front();
  state_.ctm_end = steps->back();
  steps->pop_back();
  steps->erase(steps->begin());
  state_.steps = std::move(steps);
}

void PbrtParser::on_transform_times(const Token& d) {
  double v[2];
  if (!take_numbers(d, v, 2) || !require_options(d)) return;
  if (!(v[0] < v[1]) || !std::isfinite(v[1] - v[0])) {
    problems_->error(d.where.location(), "TransformTimes needs a start that is before the end");
    return;
  }
  times_.starts = v[0];
  times_.ends = v[1];
}

}  // namespace lightmill
