#pragma once
// What the translators of pbrt's directives share: the scene that is being built, the tables of names, and
// the files. Names of textures and materials may be used before they are declared, as in pbrt.
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "common/scene/load.h"
#include "common/scene/mesh/ply_read_ahead.h"
#include "common/scene/motion.h"
#include "common/scene/pbrt/syntax/params.h"
#include "common/scene/pbrt/v3/dialect.h"

namespace lightmill {

/// What a spectrum stands for; it decides its range and how spectra are reduced to RGB.
enum class SpectrumUse {
  kReflectance,  // within [0,1]
  kFactor,       // >= 0: eta, k, texture values
  kEmission,     // >= 0; spectra are scaled to luminance 1
};

/// AreaLightSource in force; becomes a light when a shape takes it.
struct PendingAreaLight {
  Rgb radiance;      // scale applied
  double power = 0;  // > 0: overrides the magnitude, per pbrt
  bool two_sided = false;
  SourceLocation where;
  std::optional<std::string> image_path;  // emission image, as open_image gives it; none: even
  SourceLocation image_where;
  int texture = -1;  // in SceneDescription::textures: as given, or once a shape took the image
  int index = -1;    // in SceneDescription::area_lights once a shape took it (without `power`)
  std::string light_group;
};

/// Attributes that a shape takes over.
struct ShapeAttributes {
  Transform ctm;
  int moves_to = -1;  // ShapeDescription::moves_to
  bool reverse_orientation = false;
  int material = -1;                             // -1: pbrt's default material
  std::shared_ptr<PendingAreaLight> area_light;  // null: none
  MediumInterface media{};
};

/// Files of meshes of an object: listed once an instance shows it.
struct ObjectFiles {
  std::vector<SourceFile> found;
  bool complete = true;  // the source has all
};

struct PbrtScene {
  PbrtScene(const FileSource& file_source, ProblemList* problem_list, const LoadOptions& options)
      : files(file_source),
        problems(problem_list),
        missing_textures(options.missing_textures),
        strict_lights(options.strict_lights),
        read_ahead(options.threads),
        most_generated_(options.most_generated_triangles) {}

  SceneDescription scene;
  const FileSource& files;
  ProblemList* problems;
  const bool missing_textures, strict_lights;  // as in LoadOptions
  Dialect dialect = Dialect::kV4;
  /// Where an integrator is chosen that in pbrt takes no account of media.
  std::optional<SourceLocation> media_left_out;

  /// Path of a referenced file, listed in scene.files; "" (reported at `where`) if it can't be opened.
  /// `in_use`: files that another name does not stand for.
  std::string open_reference(const std::string& reference, const SourceLocation& where,
                             const std::vector<std::string>* in_use = nullptr);
  /// Path of an image that a texture shows; nothing (reported at `where`) if it can't be opened. It is listed
  /// in scene.files by list_images, if something in the scene shows it. A source that may do without images
  /// gives "" for one that is not there, which is an error only then.
  std::optional<std::string> open_image(const std::string& reference, const SourceLocation& where);
  /// True (and warned of) for an image that is not there where that is no error.
  bool may_be_missing(const std::string& reference, const SourceLocation& where);
  /// Once the scene is complete, and free of errors.
  void list_images();
  /// Of the object that is being defined, if one is.
  std::optional<ObjectFiles> object_files;
  /// Path of a mesh, or "": reported at `where`, or missing from object_files.
  std::string open_mesh(const std::string& reference, const SourceLocation& where);
  void list(const std::vector<SourceFile>& found);
  /// Index of a named material or texture; made a placeholder on first use.
  int material_named(const std::string& name, const SourceLocation& where);
  int texture_named(const std::string& name, bool is_spectrum, const SourceLocation& where);
  /// Fills the named slot. A second definition holds for what comes after it.
  void define_material(MaterialDescription material);
  void define_texture(TextureDescription texture);
  bool texture_defined(const std::string& name, bool is_spectrum) const;
  bool material_defined(const std::string& name) const;
  /// Index of a float texture that shows the mean of a spectrum texture's channels; -1 if there can be none.
  int float_copy(const std::string& spectrum_texture);
  /// Index of a named medium, made a placeholder on first use; -1 for "": empty space.
  int medium_named(const std::string& name, const SourceLocation& where);
  void define_medium(MediumDescription medium);
  int add_material(MaterialDescription material);
  /// Index of pbrt's default material: diffuse 0.5.
  int default_material(const SourceLocation& where);
  /// Reports names that were used and never defined.
  void report_undefined();

  // Parameters that read names and files.
  Rgb spectrum(ParameterList& params, std::string_view name, SpectrumUse use, Rgb fallback);
  SpectrumInput spectrum_input(ParameterList& params, std::string_view name, SpectrumUse use, Rgb fallback);
  FloatInput float_input(ParameterList& params, std::string_view name, float fallback, double min,
                         double max);

  /// Counts triangles that a shape makes of few numbers; false (reported) if all of them together are more
  /// than LoadOptions allows.
  bool may_generate(size_t triangles, ParameterList& params);

  /// Meshes by path, so that a file that is used twice is read once.
  std::map<std::string, std::shared_ptr<const TriangleMesh>> meshes;
  std::map<std::string, std::shared_ptr<const MeasuredTable>> measured;  // likewise
  /// Files that are not yet there.
  PlyReadAhead read_ahead;
  /// Begins to read the meshes that this text of a scene file seems to use.
  void expect_meshes(std::string_view text);
  /// The mesh of the last shape if that is of curves and may take more of them; see curves.h.
  std::shared_ptr<TriangleMesh> open_curves;
  double film_diagonal = 35;              // mm; of a realistic camera
  double displacement_edge_scale = 1;     // of "edgelength"
  bool flips_x = false, flips_y = false;  // the picture: the camera's x and y axes point the other way
  bool named_empty_curves = false;        // what is said once a scene
  /// Materials of which nothing is seen; shapes of them are boundaries of media, or left out at the end.
  std::set<int> invisible_materials;
  /// By material: the alpha of its shapes that have none of their own (pbrt-v3's "uber").
  std::map<int, FloatInput> opacities;

 private:
  struct Named {
    int index = -1;
    bool defined = false;
    SourceLocation first_use;
  };
  /// Path that can be read, or "" (reported at `where`).
  std::string readable(const std::string& reference, const SourceLocation& where,
                       const std::vector<std::string>* in_use = nullptr);
  void list(const SourceFile& file);
  void warn_of_redefinition(const SourceLocation& where, const char* what, const std::string& name);
  int float_copy(int texture);
  /// Index of the texture that a parameter names; nothing (reported) if pbrt-v3 would take none.
  std::optional<int> texture_given(ParameterList& params, std::string_view name, const Parameter& parameter,
                                   bool is_spectrum);
  Rgb read_spectrum(const Parameter& parameter, SpectrumUse use, ParameterList& params, Rgb fallback);

  std::map<std::string, Named> named_materials_, named_media_;
  std::map<std::pair<bool, std::string>, Named> named_textures_;
  std::map<int, int> float_copies_;  // by the index of the spectrum texture
  std::set<std::string> listed_files_;
  std::map<std::string, std::set<std::string>> image_names_;  // in a bundle, by path
  int default_material_ = -1;
  size_t generated_triangles_ = 0, most_generated_;
};

// Translators; each asks for its parameters and reports the rest. `type` is the directive's first string.

/// materials/materials.cc: reports an unknown type; an unsupported one becomes grey diffuse.
MaterialDescription translate_material(PbrtScene& out, const std::string& type, ParameterList& params);
/// pbrt's material for a boundary between media that has no surface: nothing is seen of it.
bool is_interface_material(const std::string& type);
/// media.cc: a medium of an unsupported kind is empty.
MediumDescription translate_medium(PbrtScene& out, const std::string& name, ParameterList& params,
                                   const Transform& ctm);
/// media_grids.cc: the grid of a medium of type "uniformgrid", "rgbgrid" or "cloud", and the coefficients
/// of the second; null (reported) if there is none.
std::shared_ptr<const MediumGrid> read_medium_grid(const std::string& type, ParameterList& params,
                                                   const Transform& ctm, MediumDescription* medium);
/// The same of a medium of type "nanovdb" or "vdb", whose values stay in their file.
std::shared_ptr<const MediumGrid> refer_to_volume_file(PbrtScene& out, ParameterList& params,
                                                       const Transform& ctm, MediumDescription* medium);
/// materials/textures.cc: `ctm` is the texture's space.
void translate_texture(PbrtScene& out, const std::string& name, const std::string& value_type,
                       const std::string& type, ParameterList& params, const Transform& ctm);
/// shapes/shapes.cc: appends to scene.shapes unless the shape is left out.
void translate_shape(PbrtScene& out, const std::string& type, ParameterList& params,
                     const ShapeAttributes& attributes);
/// lights.cc
void translate_light(PbrtScene& out, const std::string& type, ParameterList& params, const Transform& ctm);
std::shared_ptr<PendingAreaLight> translate_area_light(PbrtScene& out, const std::string& type,
                                                       ParameterList& params);
/// visibility.cc: the kinds of rays in "string hidden".
RayKinds hidden_from(ParameterList& params);
/// part_names.cc: the names in "string object", "string asset" and "string materialname", the numbers in
/// "integer objectid" and "integer materialid".
PartNames part_names_from(ParameterList& params, SceneDescription* scene);
/// light_groups.cc: the name in "string lightgroup"; empty: none.
std::string light_group_from(ParameterList& params);
/// view/: camera, film and the directives about sampling.
/// `times` receives those of the shutter.
void translate_camera(PbrtScene& out, const std::string& type, ParameterList& params, const Transform& ctm,
                      MotionTimes* times);
/// `iso_ratio` receives iso/100; `exposure_time` an explicit exposure time, or is left alone.
void translate_film(PbrtScene& out, const std::string& type, ParameterList& params, double* iso_ratio,
                    double* exposure_time);
void translate_filter(PbrtScene& out, const std::string& type, ParameterList& params);
void translate_sampler(PbrtScene& out, const std::string& type, ParameterList& params);
void translate_integrator(PbrtScene& out, const std::string& type, ParameterList& params);
void translate_accelerator(PbrtScene& out, const std::string& type, ParameterList& params);
void translate_option(PbrtScene& out, ParameterList& params);

/// Numbers of a file in free form, with '#' comments; empty if a word is no number, or for too many.
std::vector<double> read_number_file(const std::string& path);
/// Warns of a word that pbrt doesn't have, with the nearest one, and says what comes of it.
void report_unknown_word(ParameterList& params, const std::string& kind, const std::string& word,
                         const std::vector<std::string_view>& known, const std::string& consequence);

}  // namespace lightmill
