#include "common/scene/file_source.h"

#include <algorithm>
#include <filesystem>

#include "common/base/lower_case.h"
#include "common/base/unicode/canonical_form.h"
#include "common/scene/problem_list.h"

namespace lightmill {
namespace {

namespace fs = std::filesystem;

/// Entries of a folder that are looked at: a name is not worth reading millions.
constexpr int kMostEntries = 100000;

bool is_there(const fs::path& path) {
  std::error_code ignored;
  return fs::exists(path, ignored);
}

int hex_digit(char c) {
  if (c >= '0' && c <= '9') return c - '0';
  const char low = lower_case(c);
  return low >= 'a' && low <= 'f' ? low - 'a' + 10 : -1;
}

/// "%20" and the like as what they stand for.
std::string without_percents(const std::string& text) {
  std::string out;
  for (size_t i = 0; i < text.size(); ++i) {
    const int high = text[i] == '%' && i + 2 < text.size() ? hex_digit(text[i + 1]) : -1;
    const int low = high >= 0 ? hex_digit(text[i + 2]) : -1;
    if (low >= 0 && (high > 0 || low > 0)) {
      out += static_cast<char>(16 * high + low);
      i += 2;
    } else {
      out += text[i];
    }
  }
  return out;
}

/// The one entry of `folder` whose name is `name` but for capitals and the two ways to spell accents; empty if
/// there are none or several.
std::string but_for_case(const fs::path& folder, const std::string& name) {
  std::string found;
  int looked_at = 0;
  std::error_code error;
  const std::string wanted = lower_case(decomposed(name));
  for (fs::directory_iterator entry(folder.empty() ? "." : folder, error), end; !error && entry != end;
       entry.increment(error)) {
    if (++looked_at > kMostEntries) return "";
    std::string other = entry->path().filename().string();
    if (lower_case(decomposed(other)) != wanted) continue;
    if (!found.empty()) return "";
    found = std::move(other);
  }
  return found;
}

/// `path`, or the one file that differs by capitals; empty if there is none.
fs::path find_in_any_case(const fs::path& path) {
  if (is_there(path)) return path;
  fs::path found;
  for (const fs::path& part : path) {
    if (found.empty() || part == "/" || part == ".." || part == "." || is_there(found / part)) {
      found /= part;
      continue;
    }
    const std::string other = but_for_case(found, part.string());
    if (other.empty()) return {};
    found /= other;
  }
  return is_there(found) ? found : fs::path();
}

/// Without the drive, and with slashes.
std::string in_slashes(std::string name) {
  std::ranges::replace(name, '\\', '/');
  if (name.size() > 2 && name[1] == ':' && name[2] == '/') name.erase(0, 2);
  return name;
}

}  // namespace

std::string FileSource::hint(const std::string&) const { return ""; }

std::string DirectoryFiles::resolve(const std::string& name, std::string* how) const {
  if (name.empty() || name.find('\0') != std::string::npos) return "";
  // Normalised as bundle_name does it, so that both mean the same file even across symbolic links.
  const auto full = [&](const std::string& text) {
    const fs::path path = fs::path(text).lexically_normal();
    return path.is_absolute() ? path : fs::path(folder_) / path;
  };
  const auto take = [&](const fs::path& path) {
    if (how != nullptr) {
      const fs::path shown = path.lexically_relative(folder_);
      *how = "the file " + in_quotes(shown.empty() ? path.string() : shown.string()) + " is taken";
    }
    return path.string();
  };
  for (const auto& [from, to] : map_) {
    const std::string start = in_slashes(from), whole = in_slashes(name);
    if (!whole.starts_with(start)) continue;
    if (const fs::path mapped = find_in_any_case(full(to + whole.substr(start.size()))); !mapped.empty())
      return mapped.string();  // as it was asked for
  }
  if (is_there(full(name))) return full(name).string();
  const std::string slashes = in_slashes(name), plain = without_percents(slashes);
  for (const std::string& other : {slashes, plain}) {
    if (const fs::path found = find_in_any_case(full(other)); !found.empty()) return take(found);
  }
  // A path of another machine: its tail, the longest first.
  const fs::path path = fs::path(plain).lexically_normal();
  for (auto part = path.begin(); part != path.end(); ++part) {
    if (*part == "/" || *part == "..") continue;
    fs::path tail;
    for (auto rest = part; rest != path.end(); ++rest) tail /= *rest;
    if (const fs::path found = find_in_any_case(fs::path(folder_) / tail); !found.empty()) return take(found);
  }
  return "";
}

std::string DirectoryFiles::hint(const std::string& name) const {
  const fs::path path = fs::path(in_slashes(name)).lexically_normal();
  fs::path folder = path.is_absolute() ? path : fs::path(folder_) / path;
  folder = folder.parent_path();
  if (!is_there(folder)) folder = folder_;
  std::vector<std::string> names;
  std::error_code error;
  for (fs::directory_iterator entry(folder.empty() ? "." : folder, error), end;
       !error && entry != end && names.size() < 10000; entry.increment(error)) {
    names.push_back(entry->path().filename().string());
  }
  std::ranges::sort(names);
  return nearest_hint(path.filename().string(), {names.begin(), names.end()});
}

}  // namespace lightmill
