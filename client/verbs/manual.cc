// lightmill man: the manual page.
#include "common/command_line/manual.h"

#include <CLI/CLI.hpp>
#include <cstdio>
#include <memory>

#include "client/cli.h"
#include "client/options.h"
#include "common/build_id/build_id.h"

namespace lightmill::client {
namespace {

constexpr const char* kDescription = R"(Renders pbrt\-v4 and glTF 2.0 scenes, on this machine
.RB ( render )
or on a farm
.RB ( submit ", " watch ", " fetch ).
The image is the same, bit for bit, whoever rendered which part of it.
)";

constexpr const char* kClosing = R"(.SH EXIT STATUS
0: done. 1: it failed. 2: wrong usage or a bad scene. 3: the coordinator can't be reached, or refuses.
.SH ENVIRONMENT
.TP
.B LIGHTMILL_COORDINATOR
The coordinator's HOST:PORT; with standbys all of them, with commas between.
.TP
.B NO_COLOR
If set and not empty, nothing is coloured.
.TP
.B OCIO
An OpenColorIO configuration, whose views
.B \-\-view
can name.
.SH SEE ALSO
.BR lightmill\-coordinator (1),
.BR lightmill\-worker (1)
)";

}  // namespace

void add_manual(CLI::App& app, Action& action) {
  const auto common = std::make_shared<CommonOptions>();
  CLI::App* verb = add_verb(app, "man", "Print the manual page: lightmill man | man -l -", common.get());
  verb->callback([&app, &action, common] {
    action = [&app] {
      const ManualText text{"lightmill", "a distributed render farm for physically based light transport",
                            "lightmill " + project_version(), kDescription, kClosing};
      std::fputs(manual_page(app, text).c_str(), stdout);
      return 0;
    };
  });
}

}  // namespace lightmill::client
