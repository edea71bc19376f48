#pragma once
// The large byte strings of a store whose rows are elsewhere: files in a folder that coordinators may share.
// Before a row names a file, it is complete and on disk, under a name of its own. It is never changed, and
// the row has its digest. A file that no row names was left by a crash, or by a coordinator that lost its
// lease meanwhile.
#include <cstddef>
#include <set>
#include <string>
#include <string_view>

namespace lightmill {

class LayerFiles {
 public:
  /// Makes the folder if it is absent. Throws StoreError.
  explicit LayerFiles(const std::string& folder);
  /// Durable when it returns. Throws StoreError.
  void put(const std::string& name, std::string_view bytes) const;
  /// Throws DamagedLayers if the file does not have this SHA-256 or is gone while others are there,
  /// Error(kFailed) if it can't be read now.
  std::string get(const std::string& name, const std::string& digest) const;
  /// Removes a file that no row names any more. If that fails now, keep_only() will do it.
  void remove(const std::string& name) const;
  /// Removes all other files.
  void keep_only(const std::set<std::string>& names) const;
  bool empty() const;
  /// Throws StoreError unless `bytes` bytes can be written.
  void probe(size_t bytes) const;

 private:
  std::string folder_;
};

}  // namespace lightmill
