#pragma once
// Where a scene's files are found: the seam between "a folder" and "blobs of a bundle".
#include <string>
#include <utility>
#include <vector>

namespace lightmill {

class FileSource {
 public:
  virtual ~FileSource() = default;
  /// Path that can be opened for the file named `name` (relative to the main scene file's folder, or
  /// absolute), or empty if there is none. `how`, if given, receives what was taken where the name is not
  /// quite the file's ("the file \"Wood.png\" is taken"); it stays empty where the name is right.
  virtual std::string resolve(const std::string& name, std::string* how) const = 0;
  std::string resolve(const std::string& name) const { return resolve(name, nullptr); }
  /// `; did you mean "x"?` for a file that is there and nearly has this name; empty if there is none.
  virtual std::string hint(const std::string& name) const;
  /// False where images of textures and meshes of objects may be absent that nothing in the scene shows, as
  /// in a bundle.
  virtual bool has_unused_files() const { return true; }
};

/// FROM and TO: names that begin with the first are looked for where they begin with the second instead.
using PathMap = std::vector<std::pair<std::string, std::string>>;

/// Files relative to the folder of the main scene file. A name that leads to no file is looked for as other
/// programs and other machines write it: with backslashes, percent signs, capitals that differ (if there is
/// just one such file), or below the scene's folder by the tail of its path.
class DirectoryFiles : public FileSource {
 public:
  explicit DirectoryFiles(std::string folder, PathMap map = {})
      : folder_(std::move(folder)), map_(std::move(map)) {}
  using FileSource::resolve;
  std::string resolve(const std::string& name, std::string* how) const override;
  std::string hint(const std::string& name) const override;

 private:
  std::string folder_;
  PathMap map_;
};

}  // namespace lightmill
