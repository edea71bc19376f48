#pragma once
// The directives of a pbrt-v4 file: the graphics state, attribute scopes, named coordinate systems, includes
// and object instances. What a directive's parameters mean is in the translators of scene.h.
#include <deque>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "common/scene/motion.h"
#include "common/scene/pbrt/scene.h"
#include "common/scene/pbrt/syntax/tokenizer.h"
#include "common/scene/pbrt/v3/upgrade.h"

namespace lightmill {

class PbrtParser {
 public:
  PbrtParser(const FileSource& files, ProblemList* problems, const LoadOptions& options)
      : out_(files, problems, options), problems_(problems) {}

  /// Reads the file `name` and all that it includes. The scene is complete if no error was reported.
  SceneDescription parse(const std::string& name);

 private:
  /// Parameters that an Attribute directive set for later shapes, lights, materials, ...
  using InheritedParameters = std::map<std::string, std::vector<Parameter>>;

  struct State {
    ShapeAttributes shape;
    std::shared_ptr<const InheritedParameters> inherited = std::make_shared<InheritedParameters>();
    ColorSpace color_space = ColorSpace::kSrgb;
    // The CTM at the end of motion (the one in `shape` is that at its start), and which of the two
    // ActiveTransform chose.
    Transform ctm_end;
    bool transforms_start = true, transforms_end = true;
    // TransformSteps: the CTM at even times between the two.
    std::shared_ptr<const std::vector<Transform>> steps;
    // The directive that flattened space, where one did: the CTM is then the one before it.
    std::optional<SourceLocation> flat;

    /// All that TransformBegin saves.
    void take_transforms(const State& other);
  };
  struct CoordinateSystem {
    Transform start, end;
  };
  struct Scope {
    enum class Kind { kAttribute, kTransform, kObject, kImport };
    Kind kind;
    State saved;
    SourceLocation where;
  };
  using Handler = void (PbrtParser::*)(const Token& directive);
  static const std::map<std::string_view, Handler>& handlers();

  /// `is_include`: parameters of the file's last directive may follow.
  void parse_file(const std::string& reference, const SourceLocation& where, bool is_include = false);
  void parse_tokens();
  void skip_to_directive();

  // Pieces of directives; nullopt/false means "reported".
  std::optional<std::string> take_string(const Token& directive, const char* what);
  bool take_numbers(const Token& directive, double* numbers, size_t count);
  /// The parameters, with those that an Attribute directive gives.
  std::vector<Parameter> take_values(const char* inherited_from);
  ParameterList take_parameters(const Token& directive, const std::string& owner, const char* inherited_from);
  /// The type and the parameters, in pbrt-v4's words.
  struct Typed {
    std::string type;
    ParameterList parameters;
  };
  std::optional<Typed> take_typed(const Token& directive, v3::Directive kind, const char* owner,
                                  const char* inherited_from);
  /// Index of the material, which is named unless `name` is empty.
  int add_material(const Token& directive, const std::string& name, std::string type,
                   std::vector<Parameter> parameters);
  /// The current material, or one of its kind with those of its parameters that a pbrt-v3 shape gives itself.
  int material_of_shape(const Token& directive, ParameterList& shape);
  /// Sets the dialect by the words of the main file, or of those that it includes.
  void choose_dialect(const std::string& text);
  bool require_world(const Token& directive);
  bool require_options(const Token& directive);
  /// An error of pbrt-v4's; what pbrt-v3 passes over is left out with a warning. Returns whether it is an
  /// error.
  bool misplaced(const SourceLocation& where, const std::string& message);
  void apply(const Token& directive, const Transform& transform, bool replace = false);
  /// Whether a CTM can be this: in range, and not singular.
  static bool is_good_ctm(const Transform& transform);
  bool ctm_moves() const { return state_.shape.ctm.m != state_.ctm_end.m; }
  /// ShapeDescription::moves_to of what moves from `start` to `end`; -1 if they are the same, or if nothing
  /// can (reported).
  int moves_to(const Token& directive, const Transform& start, const Transform& end);
  /// Says that `what` stays where it is at the start if the CTM moves.
  void stays(const Token& directive, const char* what);
  /// Whether space is flattened, in which case nothing can be put there: an error, one for each directive
  /// that flattens.
  bool refuse_if_flat();
  void push(Scope::Kind kind, const Token& directive);
  bool pop(Scope::Kind kind, const Token& directive, const char* opener);
  /// pbrt-v3 keeps transforms and attributes on stacks of their own, and does not look who began what: its
  /// scenes close objects by AttributeEnd. False if there is nothing to close.
  bool pop_across(const Token& directive);
  void finish();

  // One per directive, in the order of handlers().
  void on_accelerator(const Token& d);
  void on_active_transform(const Token& d);
  void on_area_light(const Token& d);
  void on_attribute(const Token& d);
  void on_attribute_begin(const Token& d);
  void on_attribute_end(const Token& d);
  void on_camera(const Token& d);
  void on_color_space(const Token& d);
  void on_concat_transform(const Token& d);
  void on_coord_sys_transform(const Token& d);
  void on_coordinate_system(const Token& d);
  void on_film(const Token& d);
  void on_identity(const Token& d);
  void on_import(const Token& d);
  void on_include(const Token& d);
  void on_integrator(const Token& d);
  void on_left_out(const Token& d);
  void on_light(const Token& d);
  void on_look_at(const Token& d);
  void on_make_named_material(const Token& d);
  void on_make_named_medium(const Token& d);
  void on_material(const Token& d);
  void on_medium_interface(const Token& d);
  void on_named_material(const Token& d);
  void on_object_begin(const Token& d);
  void on_object_end(const Token& d);
  void on_object_instance(const Token& d);
  void on_option(const Token& d);
  void on_pixel_filter(const Token& d);
  void on_reverse_orientation(const Token& d);
  void on_rotate(const Token& d);
  void on_sampler(const Token& d);
  void on_scale(const Token& d);
  void on_shape(const Token& d);
  void on_texture(const Token& d);
  void on_transform(const Token& d);
  void on_transform_begin(const Token& d);
  void on_transform_end(const Token& d);
  void on_transform_steps(const Token& d);
  void on_transform_times(const Token& d);
  void on_translate(const Token& d);
  void on_world_begin(const Token& d);
  void on_world_end(const Token& d);

  PbrtScene out_;
  ProblemList* problems_;
  State state_;
  std::vector<Scope> scopes_;
  std::map<std::string, CoordinateSystem> coordinate_systems_;
  bool in_world_ = false, world_ended_ = false;
  std::map<std::string, SourceLocation> once_;  // directives that count once, and where they were

  /// Object instancing: a finished object and the corners of its box, in the space of its instances.
  struct KnownObject {
    int index = -1;  // in SceneDescription::objects
    std::vector<Vec3d> corners;
    ObjectFiles files;
  };
  std::map<std::string, KnownObject> objects_;
  std::optional<std::string> open_object_;
  size_t object_first_shape_ = 0;

  struct MaterialText {
    std::string type;
    std::vector<Parameter> parameters;
  };
  std::map<int, MaterialText> material_texts_;     // of pbrt-v3's materials, by index
  std::optional<SourceLocation> direct_lighting_;  // pbrt-v3's integrator of that kind

  MotionTimes times_;
  std::vector<LightMotion> moving_lights_;
  Transform last_start_;  // of what scene.later ends with, and its steps
  std::shared_ptr<const std::vector<Transform>> last_steps_;
  double iso_ratio_ = 1;
  std::optional<double> film_exposure_time_;
  SourceLocation flat_reported_;

  PbrtTokenizer* tokens_ = nullptr;      // of the file that is being read
  std::deque<std::string> file_names_;   // stable addresses for positions
  std::vector<std::string> open_files_;  // the chain of includes, for cycles
  size_t files_read_ = 0;
  size_t bytes_read_ = 0;
};

}  // namespace lightmill
