// The files that a .pbrt scene refers to: opened where they are named, and listed for the scene's bundle.
#include <algorithm>

#include "common/scene/parts_in_use.h"
#include "common/scene/pbrt/scene.h"
#include "common/scene/scene_files.h"

namespace lightmill {

std::string PbrtScene::readable(const std::string& reference, const SourceLocation& where,
                                const std::vector<std::string>* in_use) {
  std::string how;
  std::string path = files.resolve(reference, &how);
  if (!how.empty() && in_use != nullptr && std::ranges::find(*in_use, path) != in_use->end()) path.clear();
  if (path.empty()) {
    problems->error(where, "there is no file " + in_quotes(reference) +
                               "; names are relative to the main scene file" + files.hint(reference));
    return "";
  }
  if (!how.empty()) problems->warning(where, "there is no file " + in_quotes(reference) + "; " + how);
  if (const std::string why = why_unreadable(path); !why.empty()) {
    problems->error(where, "can't read the file " + in_quotes(reference) + ": " + why);
    return "";
  }
  return path;
}

bool PbrtScene::may_be_missing(const std::string& reference, const SourceLocation& where) {
  if (!missing_textures || !files.resolve(reference).empty()) return false;
  problems->warning(
      where, "there is no file " + in_quotes(reference) + "; one grey is taken" + files.hint(reference));
  return true;
}

void PbrtScene::list(const SourceFile& file) {
  if (listed_files_.insert(file.name).second) scene.files.push_back(file);
}

void PbrtScene::list(const std::vector<SourceFile>& found) {
  for (const SourceFile& file : found) list(file);
}

std::string PbrtScene::open_reference(const std::string& reference, const SourceLocation& where,
                                      const std::vector<std::string>* in_use) {
  std::string path = readable(reference, where, in_use);
  if (!path.empty()) list(SourceFile{bundle_name(reference), path});
  return path;
}

std::string PbrtScene::open_mesh(const std::string& reference, const SourceLocation& where) {
  if (!object_files) return open_reference(reference, where);
  if (!files.has_unused_files() && files.resolve(reference).empty()) {
    object_files->complete = false;
    return "";
  }
  std::string path = readable(reference, where);
  if (!path.empty()) object_files->found.push_back({bundle_name(reference), path});
  return path;
}

std::optional<std::string> PbrtScene::open_image(const std::string& reference, const SourceLocation& where) {
  if (!files.has_unused_files() && files.resolve(reference).empty()) return "";
  if (may_be_missing(reference, where)) return "";
  std::string path = readable(reference, where);
  if (path.empty()) return std::nullopt;
  image_names_[path].insert(bundle_name(reference));
  return path;
}

void PbrtScene::list_images() {
  const PartsInUse parts = parts_in_use(scene);
  for (size_t i = 0; i < scene.textures.size(); ++i) {
    TextureDescription& texture = scene.textures[i];
    const auto* image = std::get_if<ImageTexture>(&texture.kind);
    if (!parts.textures[i] || image == nullptr) continue;
    if (image->path.empty() && missing_textures) {
      texture.kind = ConstantTexture{{0.5f, 0.5f, 0.5f}};
    } else if (image->path.empty()) {
      problems->error(texture.location, "the image of the texture " + in_quotes(texture.name) +
                                            " is missing; submit the scene again");
    } else {
      for (const std::string& name : image_names_.at(image->path)) list(SourceFile{name, image->path});
    }
  }
}

void PbrtScene::expect_meshes(std::string_view text) {
  std::vector<std::string> paths;
  for (const std::string& name : plymesh_files(text)) {
    if (std::string path = files.resolve(name); !path.empty()) paths.push_back(std::move(path));
  }
  read_ahead.expect(paths);
}

}  // namespace lightmill
