#pragma once
// The large byte strings of a store whose rows lie elsewhere: files in a folder that coordinators may share.
// A file is whole and on disk, under a name of its own, before a row names it, and is never changed; the row
// has its digest. What no row names was left by a crash, or by a coordinator that lost its lease meanwhile.
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
  /// Throws Error(kFailed) if it is gone, can't be read or is not what had this SHA-256.
  std::string get(const std::string& name, const std::string& digest) const;
  /// Of a file that no row names any more. What can't be removed now is removed by keep_only().
  void remove(const std::string& name) const;
  /// Removes all other files.
  void keep_only(const std::set<std::string>& names) const;
  bool empty() const;
  /// Throws StoreError unless so many bytes can be written.
  void probe(size_t bytes) const;

 private:
  std::string folder_;
};

}  // namespace lightmill
