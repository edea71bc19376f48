#pragma once
// Buffers, buffer views and accessors: the numbers of a glTF file, checked against the bytes that are there.
#include <cstdint>
#include <memory>
#include <string_view>

#include "common/scene/gltf/draco.h"
#include "common/scene/gltf/scene.h"

namespace lightmill {

/// Random access to the elements of an accessor, sparse ones too. Keeps the bytes alive.
class GltfAccessor {
 public:
  size_t count() const { return count_; }
  int components() const { return components_; }
  /// Element i < count(): components() floats; normalised integers are decoded.
  void read(size_t i, float* out) const;
  /// Component 0 of element i as it is stored: for indices.
  uint32_t read_index(size_t i) const;
  bool holds_indices() const;

 private:
  friend class GltfBuffers;
  const unsigned char* element(size_t i) const;  // null: zeros

  std::shared_ptr<const std::string> bytes_, sparse_index_bytes_, sparse_value_bytes_;
  size_t offset_ = 0, stride_ = 0, count_ = 0;
  int components_ = 1, component_type_ = 0;
  bool normalized_ = false;
  size_t sparse_count_ = 0, sparse_index_offset_ = 0, sparse_value_offset_ = 0;
  int sparse_index_type_ = 0;
};

class GltfBuffers {
 public:
  GltfBuffers(GltfScene& scene, const GltfValue& root) : scene_(scene), root_(root) {}

  /// Throws GltfProblem unless accessor `index` lies within its buffer and has one of the `allowed` numbers
  /// of components.
  GltfAccessor accessor(size_t index, std::initializer_list<int> allowed);
  /// The same for an accessor whose elements Draco holds.
  GltfAccessor unpacked(size_t index, std::initializer_list<int> allowed, const DracoMesh::Attribute& held);
  /// A copy of a buffer view's bytes.
  std::shared_ptr<const std::string> view_contents(size_t index);
  /// Counts elements that are read into memory; throws at `value` once the file asks for many times what its
  /// bytes can hold.
  void charge(size_t elements, const GltfValue& value);

 private:
  struct View {
    std::shared_ptr<const std::string> bytes;
    size_t offset = 0, size = 0, stride = 0;  // stride 0: tight
  };
  std::shared_ptr<const std::string> buffer(size_t index);
  View view(size_t index);
  View part_of_buffer(const GltfValue& value);
  GltfAccessor without_elements(const GltfValue& value, std::initializer_list<int> allowed);

  GltfScene& scene_;
  GltfValue root_;
  std::map<size_t, std::shared_ptr<const std::string>> buffers_;
  std::map<size_t, std::shared_ptr<const std::string>> unpacked_views_;
  size_t bytes_read_ = 0, charged_ = 0;
};

}  // namespace lightmill
