// The graphics state: where directives may stand, the transforms, and the scopes that save it.
#include <algorithm>

#include "common/scene/motion.h"
#include "common/scene/pbrt/parser.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

constexpr size_t kMaxScopes = 200000;

}  // namespace

bool PbrtParser::misplaced(const SourceLocation& where, const std::string& message) {
  if (out_.dialect == Dialect::kV3) {
    problems_->warning(where, message + "; as by pbrt-v3, that is passed over");
    return false;
  }
  problems_->error(where, message);
  return true;
}

bool PbrtParser::require_world(const Token& directive) {
  if (in_world_) return true;
  if (!misplaced(directive.where.location(), std::string(directive.text) + " must come after WorldBegin"))
    skip_to_directive();
  return false;
}

bool PbrtParser::require_options(const Token& directive) {
  const SourceLocation where = directive.where.location();
  if (in_world_) {
    if (!misplaced(where, std::string(directive.text) + " must come before WorldBegin")) skip_to_directive();
    return false;
  }
  const auto [previous, is_first] = once_.try_emplace(std::string(directive.text), where);
  if (!is_first) {
    problems_->warning(where, std::string(directive.text) + " is given again; it replaces the one at line " +
                                  std::to_string(previous->second.line));
    previous->second = where;
  }
  return true;
}

void PbrtParser::apply(const Token& directive, const Transform& given, bool replace) {
  const SourceLocation where = directive.where.location();
  // Points are divided by their last coordinate, so that a matrix means the same times any factor.
  Transform transform = given;
  if (const double w = given.m[3][3]; w != 1 && w != 0) {
    for (auto& row : transform.m) {
      for (double& x : row) x /= w;
    }
    problems_->warning(where, std::string(directive.text) + " has " + plain_number(w) +
                                  " as its last number, by which all of them are divided");
  }
  if (!is_affine(transform)) {
    problems_->warning(
        where, std::string(directive.text) + " is not affine: the last row must be 0 0 0 1, which is taken");
    transform.m[3] = {0, 0, 0, 1};
  }
  if (is_singular(transform)) {
    // Exporters write such nodes with nothing in them: what is put there is refused.
    if (in_world_ && state_.transforms_start && state_.transforms_end) {
      state_.flat = where;
      return;
    }
    problems_->error(where,
                     std::string(directive.text) + " is singular: it flattens space; no factor may be 0");
    return;
  }
  if (replace) state_.flat.reset();
  const auto apply_to = [&](Transform* ctm) {
    const Transform next = replace ? transform : *ctm * transform;
    const bool good = is_good_ctm(next);
    if (good) *ctm = next;
    return good;
  };
  if (replace || !state_.transforms_start || !state_.transforms_end) {
    state_.steps.reset();
  } else if (state_.steps) {
    std::vector<Transform> steps = *state_.steps;
    for (Transform& step : steps) apply_to(&step);
    state_.steps = std::make_shared<const std::vector<Transform>>(std::move(steps));
  }
  const bool together = state_.transforms_start && state_.transforms_end && !ctm_moves();
  bool good = !state_.transforms_start || apply_to(&state_.shape.ctm);
  if (together) {
    state_.ctm_end = state_.shape.ctm;
  } else if (good && state_.transforms_end) {
    good = apply_to(&state_.ctm_end);
  }
  if (!good) {
    problems_->error(
        where, std::string(directive.text) + " makes the transform singular or leave the range of numbers");
  }
}

bool PbrtParser::is_good_ctm(const Transform& transform) {
  return is_in_range(transform) && !is_singular(transform) && is_in_range(inverse(transform));
}

int PbrtParser::moves_to(const Token& directive, const Transform& start, const Transform& end) {
  const std::vector<Transform>* steps = state_.steps.get();
  if (start.m == end.m && steps == nullptr) return -1;
  if (!can_move(start, end)) {
    problems_->error(
        directive.where.location(),
        "what moves here would be turned inside out on its way: a Scale of one sign at the start "
        "and of the other at the end");
    return -1;
  }
  std::vector<Transform>& later = out_.scene.later;
  if (later.empty() || later.back().m != end.m || last_start_.m != start.m || last_steps_ != state_.steps) {
    later.push_back(end);
    last_start_ = start;
    last_steps_ = state_.steps;
    if (steps != nullptr) out_.scene.between[static_cast<int>(later.size()) - 1] = *steps;
  }
  return static_cast<int>(later.size()) - 1;
}

void PbrtParser::stays(const Token& directive, const char* what) {
  if (ctm_moves()) {
    problems_->unsupported(directive.where.location(),
                           std::string(what) + " that moves: it stays as at its start time");
  }
}

bool PbrtParser::refuse_if_flat() {
  if (!state_.flat) return false;
  const SourceLocation& where = *state_.flat;
  if (flat_reported_.file != where.file || flat_reported_.line != where.line) {
    problems_->error(where, "the transform is singular: it flattens what is put there; no factor may be 0");
    flat_reported_ = where;
  }
  return true;
}

void PbrtParser::push(Scope::Kind kind, const Token& directive) {
  if (scopes_.size() >= kMaxScopes) {
    problems_->error(directive.where.location(), "attribute scopes are nested more than 200000 deep");
    return;
  }
  scopes_.push_back({kind, state_, directive.where.location()});
}

void PbrtParser::State::take_transforms(const State& other) {
  shape.ctm = other.shape.ctm;
  ctm_end = other.ctm_end;
  transforms_start = other.transforms_start;
  transforms_end = other.transforms_end;
  flat = other.flat;
  steps = other.steps;
}

bool PbrtParser::pop(Scope::Kind kind, const Token& directive, const char* opener) {
  if (scopes_.empty() || scopes_.back().kind != kind) {
    if (out_.dialect == Dialect::kV3 && kind != Scope::Kind::kTransform && pop_across(directive)) return true;
    const std::string message = std::string(directive.text) + " without " + opener;
    if (scopes_.empty() && kind == Scope::Kind::kAttribute) {  // pbrt-v4 goes on, too
      problems_->warning(directive.where.location(), message + "; it is passed over");
    } else {
      misplaced(directive.where.location(), scopes_.empty()
                                                ? message
                                                : message + "; the scope open here began at line " +
                                                      std::to_string(scopes_.back().where.line));
    }
    return false;
  }
  if (kind == Scope::Kind::kTransform) {
    state_.take_transforms(scopes_.back().saved);
  } else {
    state_ = std::move(scopes_.back().saved);
  }
  scopes_.pop_back();
  return true;
}

bool PbrtParser::pop_across(const Token& directive) {
  const auto keeps_attributes = [](const Scope& s) {
    return s.kind == Scope::Kind::kAttribute || s.kind == Scope::Kind::kObject;
  };
  const auto closed = std::find_if(scopes_.rbegin(), scopes_.rend(),
                                   [&](const Scope& s) { return s.kind != Scope::Kind::kTransform; });
  if (closed == scopes_.rend() || !keeps_attributes(*closed)) return false;
  problems_->warning(directive.where.location(), std::string(directive.text) +
                                                     " closes the scope that began at line " +
                                                     std::to_string(closed->where.line) + ", as by pbrt-v3");
  state_ = closed->saved;
  state_.take_transforms(scopes_.back().saved);
  closed->kind = Scope::Kind::kTransform;  // of the two stacks only that of attributes lost this one
  scopes_.pop_back();
  return true;
}

}  // namespace lightmill
