#pragma once
// The names that Cryptomatte gives to what a scene shows: of objects, of materials and of assets.
//
//   MatteNames names;
//   const uint32_t cube = names.number("Cube");  // the same for the same name
#include <cstdint>
#include <string>
#include <string_view>
#include <unordered_map>
#include <vector>

namespace lightmill {

/// Bounds of a scene's names, so that no scene or partial can fill a coordinator's memory with them. All
/// names together may have kMaxMatteText bytes.
inline constexpr int kMatteNameBits = 20;
inline constexpr size_t kMaxMatteNames = size_t{1} << kMatteNameBits, kMaxMatteName = 256,
                        kMaxMatteText = size_t{16} << 20;
/// Of what has no name, and what those are called that are too many.
inline constexpr const char *kUnnamedMatte = "unnamed", *kOtherMatte = "other";

/// `text` as a name: one line of valid UTF-8. One that is too long is cut, and ends in its hash, so that
/// names that begin alike stay apart.
std::string matte_name(std::string_view text);
/// Whether matte_name leaves it as it is. Of untrusted bytes.
bool valid_matte_name(std::string_view name);

/// Numbers names from 0 in the order in which they come. So the same calls give the same numbers.
class MatteNames {
 public:
  /// The number of matte_name(text); of kOtherMatte if there is no room.
  uint32_t number(std::string_view text);
  const std::vector<std::string>& names() const { return names_; }
  /// How many calls got kOtherMatte for want of room.
  size_t left_out() const { return left_out_; }

 private:
  uint32_t add(std::string name);

  std::vector<std::string> names_;
  std::unordered_map<std::string, uint32_t> numbers_;
  size_t text_bytes_ = 0, left_out_ = 0;
};

}  // namespace lightmill
