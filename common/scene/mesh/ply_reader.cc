#include "common/scene/mesh/ply_reader.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <limits>

#include "common/base/error.h"
#include "common/scene/mesh/mesh_check.h"
#include "common/scene/mesh/ply_header.h"
#include "common/scene/mesh/ply_values.h"
#include "common/scene/problem_list.h"
#include "common/scene/scene_files.h"

namespace lightmill {
namespace {

/// Where a property's value goes: a component of a vertex, or nowhere.
enum Slot {
  kX,
  kY,
  kZ,
  kNx,
  kNy,
  kNz,
  kU,
  kV,
  kU2,
  kV2,
  kRed,
  kGreen,
  kBlue,
  kAlpha,
  kSlots,
  kNowhere = kSlots
};

Slot slot_of(const PlyProperty& property) {
  struct Entry {
    std::string_view name;
    Slot slot;
  };
  constexpr Entry kEntries[] = {{"x", kX},         {"y", kY},         {"z", kZ},         {"nx", kNx},
                                {"ny", kNy},       {"nz", kNz},       {"u", kU},         {"v", kV},
                                {"s", kU},         {"t", kV},         {"texture_u", kU}, {"texture_v", kV},
                                {"texture_s", kU}, {"texture_t", kV}, {"u2", kU2},       {"v2", kV2},
                                {"red", kRed},     {"green", kGreen}, {"blue", kBlue},   {"alpha", kAlpha}};
  for (const Entry& e : kEntries) {
    if (e.name != property.name) continue;
    // Bytes are display colours of scanners and the like, which are no part of pbrt's scenes.
    const bool is_color = e.slot >= kRed;
    return is_color && is_ply_integer(property.type) ? kNowhere : e.slot;
  }
  return kNowhere;
}

[[noreturn]] void truncated(const PlyElement& element, uint64_t done) {
  fail_scene("is truncated: " + std::to_string(done) + " of " + std::to_string(element.count) +
             " of element " + in_quotes(element.name));
}

/// Refuses a count that the rest of the data can't hold.
template <class Values>
void check_count(const PlyElement& element, const Values& values) {
  size_t least = 0;
  for (const PlyProperty& p : element.properties)
    least += Values::least_bytes(p.is_list ? p.count_type : p.type);
  if (least == 0) {
    if (element.count > 0) fail_scene("has the element " + in_quotes(element.name) + " without properties");
  } else if (element.count > values.remaining() / least) {
    fail_scene("is truncated: its header promises " + std::to_string(element.count) + " of element " +
               in_quotes(element.name));
  }
}

/// How many values a list of `count` >= 0 has: PLY allows floating point counts. No file has as many as 2^53.
uint64_t list_length(double count) { return static_cast<uint64_t>(std::ceil(std::min(count, 0x1p53))); }

template <class Values>
void skip_list(const PlyProperty& p, const PlyElement& element, uint64_t row, Values& values) {
  double count = 0, ignored = 0;
  if (!values.next(p.count_type, &count)) truncated(element, row);
  if (!(count >= 0)) fail_scene("has a list of negative length");
  const uint64_t length = list_length(count);
  for (uint64_t i = 0; i < length; ++i) {
    if (!values.next(p.type, &ignored)) truncated(element, row);
  }
}

struct VertexLayout {
  std::vector<Slot> slots;  // per property
  bool used[kSlots] = {};
  bool has_normals() const { return used[kNx] && used[kNy] && used[kNz]; }
  bool has_uvs() const { return used[kU] && used[kV]; }
  bool has_second_uvs() const { return used[kU2] && used[kV2]; }
  bool has_colors() const { return used[kRed] && used[kGreen] && used[kBlue]; }
};

VertexLayout layout_of(const PlyElement& element) {
  VertexLayout layout;
  for (const PlyProperty& p : element.properties) {
    Slot slot = p.is_list ? kNowhere : slot_of(p);
    if (slot != kNowhere && layout.used[slot]) slot = kNowhere;  // "u" and "s": the first counts
    if (slot != kNowhere) layout.used[slot] = true;
    layout.slots.push_back(slot);
  }
  if (!layout.used[kX] || !layout.used[kY] || !layout.used[kZ]) fail_scene("has vertices without x, y and z");
  return layout;
}

void add_vertex(const VertexLayout& layout, const double* v, TriangleMesh* mesh) {
  const auto f = [&](Slot s) { return static_cast<float>(v[s]); };
  mesh->positions.push_back({f(kX), f(kY), f(kZ)});
  if (layout.has_normals()) mesh->normals.push_back({f(kNx), f(kNy), f(kNz)});
  if (layout.has_uvs()) mesh->uvs.push_back({f(kU), f(kV)});
  if (layout.has_second_uvs()) mesh->second_uvs.push_back({f(kU2), f(kV2)});
  if (layout.has_colors())
    mesh->colors.push_back({f(kRed), f(kGreen), f(kBlue), layout.used[kAlpha] ? f(kAlpha) : 1.0f});
}

template <class Values>
void read_vertices(const PlyElement& element, Values& values, TriangleMesh* mesh) {
  const VertexLayout layout = layout_of(element);
  if (element.count > std::numeric_limits<uint32_t>::max())
    fail_scene("has more vertices than 32-bit indices reach");
  mesh->positions.reserve(element.count);
  if (layout.has_normals()) mesh->normals.reserve(element.count);
  if (layout.has_uvs()) mesh->uvs.reserve(element.count);
  if (layout.has_second_uvs()) mesh->second_uvs.reserve(element.count);
  if (layout.has_colors()) mesh->colors.reserve(element.count);
  std::array<double, kSlots + 1> v{};  // the last entry takes what goes nowhere
  for (uint64_t row = 0; row < element.count; ++row) {
    for (size_t i = 0; i < element.properties.size(); ++i) {
      const PlyProperty& p = element.properties[i];
      if (p.is_list) {
        skip_list(p, element, row, values);
      } else if (!values.next(p.type, &v[layout.slots[i]])) {
        truncated(element, row);
      }
    }
    add_vertex(layout, v.data(), mesh);
  }
}

bool is_index_list(const PlyProperty& p) {
  return p.is_list && (p.name == "vertex_indices" || p.name == "vertex_index");
}

/// Reads a polygon's indices and appends its fan of triangles.
template <class Values>
void read_polygon(const PlyProperty& p, const PlyElement& element, uint64_t row, Values& values,
                  TriangleMesh* mesh) {
  double count = 0;
  if (!values.next(p.count_type, &count)) truncated(element, row);
  if (!(count >= 3)) fail_scene("face " + std::to_string(row) + " has fewer than 3 corners");
  const uint64_t length = list_length(count);
  uint32_t first = 0, previous = 0;
  for (uint64_t i = 0; i < length; ++i) {
    double value = 0;
    if (!values.next(p.type, &value)) truncated(element, row);
    if (!(value >= 0) || value >= static_cast<double>(mesh->positions.size())) {
      fail_scene("face " + std::to_string(row) + " refers to a vertex that does not exist");
    }
    const auto index = static_cast<uint32_t>(value);
    if (i == 0) first = index;
    if (i >= 2) mesh->triangles.push_back({first, previous, index});
    previous = index;
  }
}

/// Fast path: binary faces that are only a byte count 3 and three 32-bit indices. Stops before the first face
/// of another size; returns the number read.
template <class Values>
uint64_t read_plain_triangles(const PlyElement&, Values&, TriangleMesh*) {
  return 0;
}
template <>
uint64_t read_plain_triangles(const PlyElement& element, BinaryValues& values, TriangleMesh* mesh) {
  const PlyProperty& p = element.properties[0];
  if (element.properties.size() != 1 || ply_type_size(p.count_type) != 1 || ply_type_size(p.type) != 4)
    return 0;
  constexpr size_t kStride = 13;
  const auto limit = static_cast<double>(mesh->positions.size());
  uint64_t row = 0;
  for (; row < element.count && values.has(kStride) && values.peek(p.count_type, 0) == 3; ++row) {
    std::array<uint32_t, 3> t;
    for (size_t k = 0; k < 3; ++k) {
      const double value = values.peek(p.type, 1 + 4 * k);
      if (!(value >= 0 && value < limit)) return row;  // the general path reports it
      t[k] = static_cast<uint32_t>(value);
    }
    mesh->triangles.push_back(t);
    values.skip(kStride);
  }
  return row;
}

template <class Values>
void read_faces(const PlyElement& element, Values& values, TriangleMesh* mesh) {
  size_t lists = 0;
  for (const PlyProperty& p : element.properties) {
    if (!is_index_list(p)) continue;
    if (!is_ply_integer(p.type)) fail_scene("has face indices that are not integers");
    ++lists;
  }
  if (lists != 1) fail_scene("has faces without exactly one list of vertex_indices");
  mesh->triangles.reserve(element.count);
  for (uint64_t row = read_plain_triangles(element, values, mesh); row < element.count; ++row) {
    for (const PlyProperty& p : element.properties) {
      double ignored = 0;
      if (is_index_list(p)) {
        read_polygon(p, element, row, values, mesh);
      } else if (p.is_list) {
        skip_list(p, element, row, values);
      } else if (!values.next(p.type, &ignored)) {
        truncated(element, row);
      }
    }
  }
}

template <class Values>
void skip_element(const PlyElement& element, Values& values) {
  for (uint64_t row = 0; row < element.count; ++row) {
    for (const PlyProperty& p : element.properties) {
      double ignored = 0;
      if (p.is_list) {
        skip_list(p, element, row, values);
      } else if (!values.next(p.type, &ignored)) {
        truncated(element, row);
      }
    }
  }
}

template <class Values>
TriangleMesh read_elements(const PlyHeader& header, Values values) {
  TriangleMesh mesh;
  bool vertices = false, faces = false;
  for (const PlyElement& element : header.elements) {
    if (vertices && faces) break;  // whatever follows is of no interest
    check_count(element, values);
    if (element.name == "vertex" && !vertices) {
      read_vertices(element, values, &mesh);
      vertices = true;
    } else if (element.name == "face" && vertices && !faces) {
      read_faces(element, values, &mesh);
      faces = true;
    } else if (element.name == "face") {
      fail_scene("has faces before vertices, or twice");
    } else {
      skip_element(element, values);
    }
  }
  if (!vertices) fail_scene("has no vertices");
  if (!faces) fail_scene("has no faces");
  require_valid_mesh(mesh);
  return mesh;
}

}  // namespace

TriangleMesh parse_ply(std::string_view data) {
  const PlyHeader header = parse_ply_header(data);
  const std::string_view body = data.substr(header.bytes);
  if (header.format == PlyFormat::kAscii) return read_elements(header, AsciiValues(body));
  return read_elements(header, BinaryValues(body, header.format == PlyFormat::kBigEndian));
}

TriangleMesh read_ply(const std::string& path) { return parse_ply(read_scene_file(path, kMaxPlyBytes)); }

}  // namespace lightmill
