#pragma once
// Manual pages, in the man macros of roff, made of what the parser knows: no option can be forgotten.
//
//   add_manual_flag(app, {"lightmill-worker", "renders tiles", "lightmill 0.1.0", "Renders.\n", ""});
#include <string>

namespace CLI {
class App;
}

namespace lightmill {

/// What the parser does not know. Roff, but for the name, the summary and the version.
struct ManualText {
  std::string name, summary, version;
  std::string description;  // the section's paragraphs
  std::string closing;      // sections after the options and the commands
};

std::string manual_page(const CLI::App& app, const ManualText& text);

/// --man, which prints the page as --version prints the version. To be added last.
void add_manual_flag(CLI::App& app, const ManualText& text);

}  // namespace lightmill
