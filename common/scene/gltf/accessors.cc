#include "common/scene/gltf/accessors.h"

#include <algorithm>

#include "common/base/error.h"
#include "common/scene/gltf/component_types.h"
#include "common/scene/gltf/json/container.h"
#include "common/scene/gltf/meshopt.h"
#include "common/scene/scene_files.h"

namespace lightmill {
namespace {

constexpr int64_t kMaxBytes = int64_t{1} << 40;
constexpr int64_t kMaxStride = int64_t{1} << 20;  // the specification's is 252
constexpr size_t kPadding = 3;                    // bytes at the end that files leave out
constexpr size_t kMaxBufferBytes = size_t{1} << 34;
/// Elements of an accessor without bytes of its own (all zeros but what is sparse).
constexpr int64_t kMaxZeros = int64_t{1} << 24;

int components_of(const GltfValue& type) {
  const std::string name = type.text();
  if (name == "SCALAR") return 1;
  if (name.size() == 4 && name.starts_with("VEC") && name[3] >= '2' && name[3] <= '4') return name[3] - '0';
  if (name == "MAT2" || name == "MAT3" || name == "MAT4") return (name[3] - '0') * (name[3] - '0');
  type.fail("must be SCALAR, VEC2 to VEC4 or MAT2 to MAT4, not " + in_quotes(name));
}

void check_components(const GltfValue& value, int components, std::initializer_list<int> allowed) {
  if (std::find(allowed.begin(), allowed.end(), components) == allowed.end())
    value.fail("has " + std::to_string(components) + " component(s), which does not fit what it is used for");
}

const unsigned char* data_of(const std::shared_ptr<const std::string>& bytes, size_t offset) {
  return reinterpret_cast<const unsigned char*>(bytes->data()) + offset;
}

}  // namespace

const unsigned char* GltfAccessor::element(size_t i) const {
  if (sparse_count_ > 0) {
    const size_t width = component_size(sparse_index_type_);
    size_t low = 0, high = sparse_count_;
    while (low < high) {
      const size_t middle = (low + high) / 2;
      const uint32_t at = decode_index(data_of(sparse_index_bytes_, sparse_index_offset_ + middle * width),
                                       sparse_index_type_);
      if (at == i) {
        const size_t size = component_size(component_type_) * static_cast<size_t>(components_);
        return data_of(sparse_value_bytes_, sparse_value_offset_ + middle * size);
      }
      if (at < i) {
        low = middle + 1;
      } else {
        high = middle;
      }
    }
  }
  return bytes_ ? data_of(bytes_, offset_ + i * stride_) : nullptr;
}

void GltfAccessor::read(size_t i, float* out) const {
  const unsigned char* from = element(i);
  const size_t size = component_size(component_type_);
  for (int c = 0; c < components_; ++c) {
    out[c] = from ? decode(from + static_cast<size_t>(c) * size, component_type_, normalized_) : 0;
  }
}

uint32_t GltfAccessor::read_index(size_t i) const {
  const unsigned char* from = element(i);
  return from ? decode_index(from, component_type_) : 0;
}

bool GltfAccessor::holds_indices() const {
  return components_ == 1 && is_index_type(component_type_) && !normalized_;
}

std::shared_ptr<const std::string> GltfBuffers::buffer(size_t index) {
  if (const auto found = buffers_.find(index); found != buffers_.end()) return found->second;
  const GltfValue value = root_.require("buffers")[index];
  const auto length = static_cast<size_t>(value.require("byteLength").integer(1, kMaxBytes));
  std::shared_ptr<const std::string> bytes;
  if (const auto uri = value.find("uri")) {
    const std::string text = uri->text();
    try {
      if (auto data = decode_data_uri(text)) {
        bytes = std::make_shared<const std::string>(std::move(*data));
      } else {
        const std::string path = scene_.open_reference(path_of_uri(text), uri->pointer());
        bytes = std::make_shared<const std::string>(read_scene_file(path, kMaxBufferBytes));
      }
    } catch (const GltfProblem& problem) {
      uri->fail(problem.message);
    } catch (const Error& error) {
      uri->fail("the file " + in_quotes(text) + " " + error.what());
    }
  } else if (index == 0 && scene_.glb_binary) {
    bytes = std::make_shared<const std::string>(std::move(*scene_.glb_binary));
    scene_.glb_binary.reset();
  } else {
    value.fail("has no \"uri\", and the file brings no bytes of its own");
  }
  if (bytes->size() < length && length - bytes->size() <= kPadding) {
    value.mended("should hold " + std::to_string(length) + " bytes and has " + std::to_string(bytes->size()) +
                 ": its padding is missing");
  } else if (bytes->size() < length) {
    value.fail("should hold " + std::to_string(length) + " bytes, but there are only " +
               std::to_string(bytes->size()) + "; the file is cut off");
  }
  bytes_read_ += bytes->size();
  return buffers_[index] = bytes;
}

GltfBuffers::View GltfBuffers::part_of_buffer(const GltfValue& value) {
  const int of = value.index_or_none("buffer", root_.count("buffers"), "buffer");
  if (of < 0) value.fail("needs \"buffer\"");
  View v;
  v.bytes = buffer(static_cast<size_t>(of));
  v.offset = static_cast<size_t>(value.integer_or("byteOffset", 0, 0, kMaxBytes));
  v.size = static_cast<size_t>(value.require("byteLength").integer(1, kMaxBytes));
  const size_t there = v.bytes->size() - std::min(v.bytes->size(), v.offset);
  if (v.size > there && v.size - there <= kPadding && there > 0) v.size = there;
  if (v.size > there) {
    value.fail("reaches to byte " + std::to_string(v.offset + v.size) + " of buffer " + std::to_string(of) +
               ", which has " + std::to_string(v.bytes->size()));
  }
  return v;
}

GltfBuffers::View GltfBuffers::view(size_t index) {
  const GltfValue value = root_.require("bufferViews")[index];
  auto extension = value.extension("EXT_meshopt_compression");
  if (!extension) extension = value.extension("KHR_meshopt_compression");
  View v;
  if (extension) {
    auto& unpacked = unpacked_views_[index];
    if (!unpacked) {
      const View packed = part_of_buffer(*extension);
      charge(meshopt_unpacked_size(*extension) / sizeof(float), *extension);
      unpacked = std::make_shared<const std::string>(
          unpack_meshopt(*extension, std::string_view(*packed.bytes).substr(packed.offset, packed.size)));
    }
    v.bytes = unpacked;
    v.size = unpacked->size();
  } else {
    v = part_of_buffer(value);
  }
  v.stride = static_cast<size_t>(value.integer_or("byteStride", 0, 0, kMaxStride));
  return v;
}

std::shared_ptr<const std::string> GltfBuffers::view_contents(size_t index) {
  const View v = view(index);
  return std::make_shared<const std::string>(v.bytes->substr(v.offset, v.size));
}

GltfAccessor GltfBuffers::without_elements(const GltfValue& value, std::initializer_list<int> allowed) {
  GltfAccessor a;
  a.components_ = components_of(value.require("type"));
  check_components(value, a.components_, allowed);
  a.component_type_ = static_cast<int>(value.require("componentType").integer(0, 100'000));
  a.stride_ = component_size(a.component_type_) * static_cast<size_t>(a.components_);
  if (a.stride_ == 0) value.require("componentType").fail("is none that glTF has");
  a.normalized_ = value.boolean_or("normalized", false);
  a.count_ = static_cast<size_t>(value.require("count").integer(0, kMaxBytes));
  return a;
}

GltfAccessor GltfBuffers::unpacked(size_t index, std::initializer_list<int> allowed,
                                   const DracoMesh::Attribute& held) {
  const GltfValue value = root_.require("accessors")[index];
  // What the accessor says of them is often wrong; the stream is what decoders go by.
  GltfAccessor a;
  a.components_ = held.components;
  check_components(value, a.components_, allowed);
  a.component_type_ = held.component_type;
  a.normalized_ = held.component_type != kFloat && (held.normalized || value.boolean_or("normalized", false));
  a.stride_ = component_size(a.component_type_) * static_cast<size_t>(a.components_);
  a.count_ = held.bytes->size() / a.stride_;
  a.bytes_ = held.bytes;
  return a;
}

GltfAccessor GltfBuffers::accessor(size_t index, std::initializer_list<int> allowed) {
  const GltfValue value = root_.require("accessors")[index];
  const size_t views = root_.count("bufferViews");
  GltfAccessor a = without_elements(value, allowed);
  const size_t size = a.stride_;
  const auto count = static_cast<int64_t>(a.count_);

  if (a.count_ == 0) return a;
  // Last byte + 1 of `n` elements within a view of which `room` bytes are left.
  const auto check_fits = [&](const GltfValue& who, size_t n, size_t stride, size_t element, size_t offset,
                              size_t room) {
    if (offset <= room && element <= room - offset && (n - 1) <= (room - offset - element) / stride) return;
    who.fail("its " + std::to_string(n) + " elements reach beyond their buffer view of " +
             std::to_string(room) + " bytes");
  };
  if (const int of = value.index_or_none("bufferView", views, "buffer view"); of >= 0) {
    const View v = view(static_cast<size_t>(of));
    const auto offset = static_cast<size_t>(value.integer_or("byteOffset", 0, 0, kMaxBytes));
    if (v.stride != 0) a.stride_ = v.stride;
    if (a.stride_ < size) {
      value.mended(
          "has elements that are larger than their view's \"byteStride\"; they are taken as packed tightly");
      a.stride_ = size;
    }
    check_fits(value, a.count_, a.stride_, size, offset, v.size);
    a.bytes_ = v.bytes;
    a.offset_ = v.offset + offset;
  } else if (count > kMaxZeros) {
    value.fail("has more than " + std::to_string(kMaxZeros) + " elements but no \"bufferView\"");
  }
  const auto sparse = value.find("sparse");
  if (sparse && sparse->require("count").integer(0, count) > 0) {
    a.sparse_count_ = static_cast<size_t>(sparse->require("count").integer(0, count));
    const GltfValue indices = sparse->require("indices"), values = sparse->require("values");
    a.sparse_index_type_ = static_cast<int>(indices.require("componentType").integer(0, 100'000));
    if (!is_index_type(a.sparse_index_type_)) indices.fail("must be unsigned whole numbers");
    const auto open = [&](const GltfValue& part, size_t element, size_t* offset) {
      const View v = view(static_cast<size_t>(part.require("bufferView").integer(0, kMaxBytes)));
      const auto within = static_cast<size_t>(part.integer_or("byteOffset", 0, 0, kMaxBytes));
      check_fits(part, a.sparse_count_, element, element, within, v.size);
      *offset = v.offset + within;
      return v.bytes;
    };
    a.sparse_index_bytes_ = open(indices, component_size(a.sparse_index_type_), &a.sparse_index_offset_);
    a.sparse_value_bytes_ = open(values, size, &a.sparse_value_offset_);
    const size_t step = component_size(a.sparse_index_type_);
    for (size_t i = 0, last = 0; i < a.sparse_count_; ++i) {
      const size_t at = decode_index(data_of(a.sparse_index_bytes_, a.sparse_index_offset_ + i * step),
                                     a.sparse_index_type_);
      if (at >= a.count_ || (i > 0 && at <= last))
        indices.fail("must increase and stay below the accessor's count of " + std::to_string(count));
      last = at;
    }
  }
  return a;
}

void GltfBuffers::charge(size_t elements, const GltfValue& value) {
  constexpr size_t kFree = size_t{1} << 26, kPerByte = 16;
  charged_ += elements;
  if (charged_ > kFree + kPerByte * bytes_read_)
    value.fail("the file uses its buffers so often that the meshes would not fit into memory");
}

}  // namespace lightmill
