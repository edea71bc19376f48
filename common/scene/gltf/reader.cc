#include "common/scene/gltf/reader.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "common/base/error.h"
#include "common/job/settings.h"
#include "common/scene/gltf/default_light.h"
#include "common/scene/gltf/json/container.h"
#include "common/scene/gltf/view.h"
#include "common/scene/scene_files.h"
#include "common/scene/transform.h"

namespace lightmill {
namespace {

constexpr size_t kMaxFileBytes = size_t{1} << 32;

/// A file of another version is refused by name; so old ones are told how they become new.
void check_version(const GltfValue& root) {
  const auto asset = root.find("asset");
  const bool says = asset && asset->is_object() && asset->find("version");
  // In glTF 1.0 meshes and the like are objects with names.
  const auto meshes = root.find("meshes");
  if (!says && (!meshes || !meshes->is_object())) {
    root.mended("does not say its version (\"asset\"); it is read as glTF 2.0");
    return;
  }
  const std::string version = says ? asset->text_or_number("version") : "1.0";
  if (version.starts_with("1"))
    root.fail("this is glTF " + version + "; convert it: gltf-pipeline -i old.gltf -o new.gltf");
  if (version.starts_with("0"))
    root.fail("this is glTF " + version + ", which came before 1.0; export the scene anew as glTF 2.0");
  if (version.empty()) {
    asset->mended("does not say its version; it is read as glTF 2.0");
    return;
  }
  if (!version.starts_with("2")) asset->fail("glTF version " + in_quotes(version) + "; 2.0 is needed");
}

/// Extensions without which all that is in the file can still be read, as far as their names tell.
bool can_do_without(const std::string& extension) {
  for (const char* family : {"KHR_materials_",
                             "KHR_animation",
                             "KHR_audio",
                             "KHR_interactivity",
                             "KHR_node_",
                             "KHR_physics",
                             "KHR_rigid",
                             "KHR_collision",
                             "KHR_xmp",
                             "KHR_lights_",
                             "EXT_lights_",
                             "EXT_materials_",
                             "MSFT_lod",
                             "MSFT_packing",
                             "ADOBE_materials",
                             "OMI_",
                             "VRM",
                             "FB_",
                             "KHR_technique",
                             "CESIUM_primitive_outline",
                             "CESIUM_RTC",
                             "EXT_mesh_features",
                             "EXT_structural_metadata",
                             "EXT_mesh_manifold",
                             "EXT_texture_avif"}) {
    if (extension.starts_with(family)) return true;
  }
  return false;
}

/// Refuses what the file says it can't be read without, and names what is left out.
void check_extensions(GltfScene& out, const GltfValue& root) {
  const size_t required = root.count("extensionsRequired");
  for (size_t i = 0; i < required; ++i) {
    const GltfValue name = root.require("extensionsRequired")[i];
    const std::string text = name.text();
    if (knows_gltf_extension(text)) continue;
    if (can_do_without(text)) {
      out.unsupported(name.pointer(), "the extension " + in_quotes(text) + "; the scene is shown without");
    } else {
      out.error({name.pointer(), "the file can't be read without " + in_quotes(text) +
                                     ", which is not supported; export it without"});
    }
  }
}

GltfExposure exposure_of(const PoseChoice& pose) {
  const double time = pose.time.value_or(0);
  return {time, time + pose.opens, time + pose.closes};
}

void add_environment(GltfScene& out, const std::string& file) {
  if (file.empty()) {
    light_up_if_dark(out);
    return;
  }
  InfiniteLight light;
  light.radiance = {1, 1, 1};
  light.lat_long = true;
  out.attempt([&] {
    light.image_path = out.open_reference(file, "--environment");
    out.scene.chosen_environment = bundle_name(file);
    out.scene.lights.push_back({light, {out.name, 1, 1}});
  });
}

}  // namespace

SceneDescription read_gltf(const std::string& name, const FileSource& files, const LoadOptions& options,
                           ProblemList* problems) {
  GltfScene out(files, problems);
  const GltfMended mended = [&](const std::string& pointer, const std::string& message) {
    out.mended(pointer, message);
  };
  out.name = name;
  out.missing_textures = options.missing_textures;
  out.scene.film.filename = std::filesystem::path(name).stem().string() + ".exr";
  out.scene.sampling.max_depth = kUnlimitedDepth;
  out.scene.chosen_camera = options.camera;
  out.scene.format = "glTF 2.0";
  SourceLocation place{name, 1, 1};
  try {
    const std::string path = out.open_reference(name, "");
    GltfContainer container = open_gltf_container(read_scene_file(path, kMaxFileBytes));
    out.json_text = std::move(container.json);
    out.glb_binary = std::move(container.binary);
    nlohmann::json document = parse_gltf_json(out.json_text, &place, problems);
    const GltfValue root(document, "", &mended);
    check_version(root);
    check_extensions(out, root);
    if (problems->errors() > 0) {
      out.say_kinds();
      return std::move(out.scene);
    }
    GltfBuffers buffers(out, root);
    const GltfExposure exposure = exposure_of(options.pose);
    // Before all that depends on it is read.
    const GltfAnimations animations(out, buffers, root, document, options.pose);
    animations.prepare(&document);
    animations.pose(exposure.time, &document);
    GltfNodeTree tree(out, root, animations, exposure);
    GltfTextures textures(out, buffers, root);
    GltfMaterials materials(out, textures, root);
    GltfMeshes meshes(out, buffers, materials, root);
    GltfNodes nodes(out, buffers, meshes, tree, animations, root);
    nodes.visit_scene();
    const bool empty = out.scene.shapes.empty() && out.scene.instances.empty();
    if (empty && options.environment.empty() && problems->errors() == 0) {
      if (animations.empty())
        throw GltfProblem{"/scenes", "the file shows nothing: none of its nodes has a mesh that can be seen"};
      out.warning("/scenes", "nothing is seen at this time of the animation");
    }
    choose_gltf_camera(out, nodes.cameras(), options.camera, nodes.reach());
    add_environment(out, options.environment);
  } catch (const GltfProblem& problem) {
    if (problem.pointer.empty()) {
      problems->error(place, problem.message);
    } else {
      out.error(problem);
    }
  } catch (const Error& error) {
    problems->error(place, std::string("the file ") + error.what());
  }
  out.say_kinds();
  return std::move(out.scene);
}

}  // namespace lightmill
