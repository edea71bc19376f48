#include "coordinator/hooks/hook.h"

#include "common/base/error.h"
#include "coordinator/hooks/command_hook.h"
#include "coordinator/hooks/url_hook.h"

namespace lightmill {

std::unique_ptr<Hook> make_hook(const std::string& what, const WebhookSecret& secret) {
  if (what.find_first_not_of(" \t\n") == std::string::npos)
    throw Error(ErrorKind::kUsage, "--on-done is empty; give an URL or a command");
  if (what.starts_with("http://") || what.starts_with("https://"))
    return std::make_unique<UrlHook>(what, secret);
  return std::make_unique<CommandHook>(what);
}

}  // namespace lightmill
