#include "common/sandbox/sandbox.h"

#include <fcntl.h>
#include <grp.h>
#include <pwd.h>
#include <sched.h>
#include <seccomp.h>
#include <sys/prctl.h>
#include <sys/resource.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstring>
#include <fstream>
#include <memory>
#include <new>

#include "common/base/error.h"

namespace lightmill {
namespace {

/// Refused with EPERM: a renderer has no use for them, and who breaks into it has.
constexpr const char* kForbidden[] = {
    // other programs and processes
    "execve", "execveat", "fork", "vfork", "ptrace", "process_vm_readv", "process_vm_writev", "kcmp",
    "pidfd_getfd", "process_madvise",
    // other users
    "setuid", "setgid", "setreuid", "setregid", "setresuid", "setresgid", "setgroups", "setfsuid", "setfsgid",
    "capset",
    // being connected to
    "listen",
    // the machine
    "mount", "umount2", "move_mount", "open_tree", "fsopen", "fsconfig", "fsmount", "mount_setattr",
    "pivot_root", "chroot", "setns", "unshare", "reboot", "swapon", "swapoff", "sethostname", "setdomainname",
    "settimeofday", "clock_settime", "clock_adjtime", "adjtimex", "init_module", "finit_module",
    "delete_module", "kexec_load", "kexec_file_load", "iopl", "ioperm", "acct", "quotactl", "syslog", "mknod",
    "mknodat", "open_by_handle_at", "name_to_handle_at",
    // large and often broken parts of the kernel
    "bpf", "perf_event_open", "userfaultfd", "keyctl", "add_key", "request_key", "io_uring_setup",
    "io_uring_enter", "io_uring_register", "personality", "fanotify_init", "lookup_dcookie", "vmsplice"};

/// Refused too unless asked for.
constexpr const char* kAccepting[] = {"accept", "accept4"};

/// Refused too where files are only read.
constexpr const char* kWriting[] = {
    "creat",    "truncate",  "ftruncate", "fallocate", "unlink",    "unlinkat",  "rename",
    "renameat", "renameat2", "link",      "linkat",    "symlink",   "symlinkat", "mkdir",
    "mkdirat",  "rmdir",     "chmod",     "fchmod",    "fchmodat",  "chown",     "fchown",
    "lchown",   "fchownat",  "utimensat", "setxattr",  "fsetxattr", "lsetxattr"};

/// Of sockets those that reach a coordinator and ask for its address.
constexpr std::array kFamilies = {AF_UNIX, AF_INET, AF_INET6, AF_NETLINK};
constexpr int kLastFamily = 45;

void require(int result, const std::string& what) {
  if (result < 0) {
    throw Error(ErrorKind::kFailed, "the filter of system calls can't be built (" + what + ": " +
                                        std::strerror(-result) + "); start with --no-seccomp");
  }
}

/// Leaves of the calls that open files those that only read.
void forbid_writing(scmp_filter_ctx filter) {
  const uint32_t refused = SCMP_ACT_ERRNO(EPERM);
  for (const scmp_datum_t flag : {O_WRONLY, O_RDWR, O_CREAT, O_TRUNC}) {
    require(seccomp_rule_add(filter, refused, SCMP_SYS(open), 1, SCMP_A1(SCMP_CMP_MASKED_EQ, flag, flag)),
            "open");
    require(seccomp_rule_add(filter, refused, SCMP_SYS(openat), 1, SCMP_A2(SCMP_CMP_MASKED_EQ, flag, flag)),
            "openat");
  }
  // Its flags are in memory, where a filter does not see them: callers fall back.
  require(seccomp_rule_add(filter, SCMP_ACT_ERRNO(ENOSYS), SCMP_SYS(openat2), 0), "openat2");
}

/// False if this kernel has no such filters.
bool filter_system_calls(const SandboxOptions& options) {
  const std::unique_ptr<void, void (*)(void*)> filter(seccomp_init(SCMP_ACT_ALLOW), seccomp_release);
  if (!filter) require(-ENOMEM, "init");
  const uint32_t refused = SCMP_ACT_ERRNO(EPERM);
  const auto forbid = [&](const char* name) {
    const int number = seccomp_syscall_resolve_name(name);
    if (number != __NR_SCMP_ERROR) require(seccomp_rule_add(filter.get(), refused, number, 0), name);
  };
  for (const char* name : kForbidden) forbid(name);
  if (!options.accepts) {
    for (const char* name : kAccepting) forbid(name);
  }
  if (!options.writes) {
    for (const char* name : kWriting) forbid(name);
    forbid_writing(filter.get());
  }
  // All threads of the process, not this one alone.
  require(seccomp_attr_set(filter.get(), SCMP_FLTATR_CTL_TSYNC, 1), "tsync");
  for (int family = 0; family <= kLastFamily; ++family) {
    const bool known = std::find(kFamilies.begin(), kFamilies.end(), family) != kFamilies.end();
    if (known && options.network) continue;
    require(seccomp_rule_add(filter.get(), refused, SCMP_SYS(socket), 1,
                             SCMP_A0(SCMP_CMP_EQ, static_cast<scmp_datum_t>(family))),
            "socket");
  }
  require(seccomp_rule_add(filter.get(), refused, SCMP_SYS(socket), 1,
                           SCMP_A0(SCMP_CMP_GT, static_cast<scmp_datum_t>(kLastFamily))),
          "socket");
  // Threads, but no processes. What clone3 would do is in memory, where a filter does not see it: libc falls
  // back.
  require(seccomp_rule_add(filter.get(), refused, SCMP_SYS(clone), 1,
                           SCMP_A0(SCMP_CMP_MASKED_EQ, CLONE_THREAD, 0)),
          "clone");
  require(seccomp_rule_add(filter.get(), SCMP_ACT_ERRNO(ENOSYS), SCMP_SYS(clone3), 0), "clone3");
  return seccomp_load(filter.get()) == 0;
}

void become(const std::string& name) {
  errno = 0;
  const passwd* const user = getpwnam(name.c_str());
  if (!user) throw Error(ErrorKind::kUsage, "--run-as " + name + ": there is no such user");
  if (initgroups(name.c_str(), user->pw_gid) != 0 || setgid(user->pw_gid) != 0 || setuid(user->pw_uid) != 0) {
    throw Error(ErrorKind::kUsage,
                "--run-as " + name + ": " + std::strerror(errno) + "; only root may become another");
  }
}

/// A number in a file; 0 without one ("max").
uint64_t number_in(const char* path) {
  std::ifstream in(path);
  uint64_t value = 0;
  return in >> value ? value : 0;
}

std::string gibibytes(uint64_t bytes) {
  std::array<char, 32> text{};
  std::snprintf(text.data(), text.size(), "%.1f GiB", static_cast<double>(bytes) / double(1 << 30));
  return text.data();
}

}  // namespace

uint64_t usual_memory_limit() {
  uint64_t least =
      static_cast<uint64_t>(sysconf(_SC_PHYS_PAGES)) * static_cast<uint64_t>(sysconf(_SC_PAGESIZE));
  for (const char* file : {"/sys/fs/cgroup/memory.max", "/sys/fs/cgroup/memory/memory.limit_in_bytes"}) {
    const uint64_t limit = number_in(file);
    if (limit > 0) least = std::min(least, limit);
  }
  return least / 10 * 9;
}

std::string failure_text(const std::exception& failure) {
  if (!dynamic_cast<const std::bad_alloc*>(&failure)) return failure.what();
  rlimit limit{};
  if (getrlimit(RLIMIT_DATA, &limit) != 0 || limit.rlim_cur == RLIM_INFINITY) return "out of memory";
  return "out of memory: it takes more than the " + gibibytes(limit.rlim_cur) +
         " of this worker; raise its --memory-limit";
}

std::vector<std::string> enter_sandbox(const SandboxOptions& options) {
  std::vector<std::string> notes;
  if (!options.user.empty()) become(options.user);
  if (geteuid() == 0) {
    notes.emplace_back(
        "running as root, though scenes come from others; give --run-as USER, or start as one");
  }
  const rlimit none{0, 0};
  setrlimit(RLIMIT_CORE, &none);  // a core holds the token
  if (options.memory_bytes > 0) {
    const rlimit memory{options.memory_bytes, options.memory_bytes};
    if (setrlimit(RLIMIT_DATA, &memory) != 0) {
      notes.emplace_back("--memory-limit is above what this process may have; that stays");
    }
  }
  if (prctl(PR_SET_NO_NEW_PRIVS, 1, 0, 0, 0) != 0) notes.emplace_back("this kernel has no no_new_privs");
  if (!options.system_calls) {
    notes.emplace_back("--no-seccomp: system calls are not filtered");
  } else if (!filter_system_calls(options)) {
    notes.emplace_back("this kernel does not filter system calls (seccomp)");
  }
  return notes;
}

}  // namespace lightmill
