#include "run/supervisor.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/prctl.h>
#include <sys/signalfd.h>
#include <sys/socket.h>
#include <sys/un.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <chrono>
#include <cstddef>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <set>
#include <sstream>
#include <system_error>
#include <utility>

#include "dmslam/runtime/exit_codes.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

int CodeOf(int status) { return WIFSIGNALED(status) ? kExitSignal + WTERMSIG(status) : WEXITSTATUS(status); }

/// A file that a child writes to. Where its folder was removed it is made again; where nothing helps, what is
/// said is lost, and not the child.
int OpenForChild(const std::string& path) {
  constexpr int kHow = O_WRONLY | O_CREAT | O_APPEND | O_CLOEXEC;
  if (path.empty()) return open("/dev/null", O_WRONLY | O_CLOEXEC);
  int fd = open(path.c_str(), kHow, 0644);
  if (fd < 0) {
    std::error_code ignored;
    std::filesystem::create_directories(std::filesystem::path(path).parent_path(), ignored);
    fd = open(path.c_str(), kHow, 0644);
  }
  return fd >= 0 ? fd : open("/dev/null", O_WRONLY | O_CLOEXEC);
}

/// A socket that is in no file system, for notices; they name the process that sent them.
int OpenNoticeSocket(std::string* address) {
  const int fd = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  if (fd < 0) return -1;
  const int yes = 1;
  sockaddr_un name{};
  name.sun_family = AF_UNIX;
  socklen_t length = sizeof(sa_family_t);  // the kernel finds a free name
  if (setsockopt(fd, SOL_SOCKET, SO_PASSCRED, &yes, sizeof(yes)) != 0 ||
      bind(fd, reinterpret_cast<sockaddr*>(&name), length) != 0) {
    close(fd);
    return -1;
  }
  length = sizeof(name);
  getsockname(fd, reinterpret_cast<sockaddr*>(&name), &length);
  address->assign(name.sun_path, length - offsetof(sockaddr_un, sun_path));
  address->front() = '@';
  return fd;
}

struct Notice {
  pid_t sender = 0;
  std::string text;  ///< lines of KEY=VALUE
};

/// The next one; none: there is none. Without a sender: the kernel did not say who.
std::optional<Notice> NextNotice(int fd) {
  char text[256], control[CMSG_SPACE(sizeof(ucred))];
  iovec part{text, sizeof(text)};
  msghdr message{};
  message.msg_iov = &part;
  message.msg_iovlen = 1;
  message.msg_control = control;
  message.msg_controllen = sizeof(control);
  const ssize_t size = recvmsg(fd, &message, MSG_DONTWAIT | MSG_CMSG_CLOEXEC);
  if (size < 0) return std::nullopt;
  Notice notice;
  notice.text.assign(text, static_cast<size_t>(size));
  for (cmsghdr* c = CMSG_FIRSTHDR(&message); c != nullptr; c = CMSG_NXTHDR(&message, c)) {
    if (c->cmsg_level != SOL_SOCKET || c->cmsg_type != SCM_CREDENTIALS) continue;
    ucred sender{};
    std::memcpy(&sender, CMSG_DATA(c), sizeof(sender));
    notice.sender = sender.pid;
  }
  return notice;
}

/// What a notice says of KEY; none where it does not name it.
std::optional<std::string> ValueOf(const std::string& notice, const std::string& key) {
  std::istringstream lines(notice);
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(key + "=")) return line.substr(key.size() + 1);
  }
  return std::nullopt;
}

}  // namespace

int64_t Supervisor::now_ns() {
  return std::chrono::duration_cast<std::chrono::nanoseconds>(
             std::chrono::steady_clock::now().time_since_epoch())
      .count();
}

Supervisor::Supervisor(Options options) : options_(options) {
  sigset_t signals;
  sigemptyset(&signals);
  for (const int signal : {SIGCHLD, SIGINT, SIGTERM, SIGHUP}) sigaddset(&signals, signal);
  pthread_sigmask(SIG_BLOCK, &signals, &former_mask_);
  signal_fd_ = signalfd(-1, &signals, SFD_NONBLOCK | SFD_CLOEXEC);
  DMSLAM_CHECK(signal_fd_ >= 0, "signalfd is part of every Linux");
  notice_fd_ = OpenNoticeSocket(&notice_address_);
  former_pipe_ = std::signal(SIGPIPE, SIG_IGN);  // a log that nobody reads any more ends no run
}

Supervisor::~Supervisor() {
  for (const Child& child : children_) {
    if (child.pid > 0) kill(child.pid, SIGKILL);
  }
  for (const Child& child : children_) {
    if (child.pid > 0) waitpid(child.pid, nullptr, 0);
  }
  close(signal_fd_);
  if (notice_fd_ >= 0) close(notice_fd_);
  pthread_sigmask(SIG_SETMASK, &former_mask_, nullptr);
  std::signal(SIGPIPE, former_pipe_);
}

void Supervisor::Start(ChildSpec spec) {
  std::erase_if(children_, [&](const Child& child) {
    return child.spec.name == spec.name && child.pid == 0 && child.due_ns == INT64_MAX && !child.waits;
  });
  children_.emplace_back();
  children_.back().spec = std::move(spec);
  if (MayBegin(children_.back())) Launch(&children_.back());
}

bool Supervisor::MayBegin(const Child& child) const {
  const auto is_ready = [this](const std::string& name) {
    return std::any_of(children_.begin(), children_.end(),
                       [&](const Child& other) { return other.spec.name == name && other.ready; });
  };
  return std::all_of(child.spec.after.begin(), child.spec.after.end(), is_ready);
}

void Supervisor::Launch(Child* child) {
  child->due_ns = INT64_MAX;
  child->heard_ns.reset();
  child->waits = child->hung = child->at_last_work = false;
  const int output = OpenForChild(child->spec.output);
  const int errors = child->spec.errors_to_ours ? dup(STDERR_FILENO) : OpenForChild(child->spec.errors);
  const pid_t parent = getpid();
  const pid_t pid = options_.fork();
  if (pid == 0) {
    prctl(PR_SET_PDEATHSIG, SIGTERM);  // whatever becomes of the supervisor
    if (getppid() != parent) _exit(kExitSignal + SIGTERM);
    BecomeChild(*child, output, errors);
  }
  close(output);
  close(errors);
  if (pid < 0) return OnNotStarted(child, std::strerror(errno));
  child->pid = pid;
  child->began_ns = now_ns();
  if (!child->spec.pid_file.empty()) std::ofstream(child->spec.pid_file) << pid << '\n';
}

/// A machine that has no memory or no processes left may have them again: who ran before is tried again.
void Supervisor::OnNotStarted(Child* child, const std::string& reason) {
  if (child->restarts == 0) throw InputError(child->spec.name + " cannot be started: " + reason);
  child->due_ns = now_ns() + options_.first_delay_ns;
}

void Supervisor::BecomeChild(const Child& child, int output, int errors) {
  std::signal(SIGINT, SIG_IGN);  // Ctrl-C is for the supervisor, who asks everybody to end
  std::signal(SIGQUIT, SIG_IGN);
  std::signal(SIGPIPE, former_pipe_);
  pthread_sigmask(SIG_SETMASK, &former_mask_, nullptr);
  const int nothing = open("/dev/null", O_RDONLY | O_CLOEXEC);
  dup2(nothing, STDIN_FILENO);
  dup2(output, STDOUT_FILENO);
  dup2(errors, STDERR_FILENO);
  if (notice_fd_ >= 0) setenv("NOTIFY_SOCKET", notice_address_.c_str(), 1);
  if (notice_fd_ >= 0 && options_.watchdog_ns > 0) {
    setenv("WATCHDOG_USEC", std::to_string(options_.watchdog_ns / 1000).c_str(), 1);
  }
  for (const auto& [name, value] : child.spec.environment) setenv(name.c_str(), value.c_str(), 1);
  std::vector<char*> arguments;
  for (const auto* list : {&child.spec.arguments, &child.spec.first}) {
    if (list == &child.spec.first && child.restarts > 0) break;
    for (const std::string& argument : *list) arguments.push_back(const_cast<char*>(argument.c_str()));
  }
  arguments.push_back(nullptr);
  execvp(arguments[0], arguments.data());
  std::fprintf(stderr, "%s cannot be started: %s\n", arguments[0], std::strerror(errno));
  std::fflush(stderr);
  _exit(kExitNoProgram);
}

/// Whoever has ended is asked for until nobody is left: signals of children that die together are one.
void Supervisor::Reap() {
  int status = 0;
  for (pid_t pid = waitpid(-1, &status, WNOHANG); pid > 0; pid = waitpid(-1, &status, WNOHANG)) {
    const auto child =
        std::find_if(children_.begin(), children_.end(), [pid](const Child& c) { return c.pid == pid; });
    if (child != children_.end()) OnDeath(&*child, CodeOf(status));
  }
}

void Supervisor::OnDeath(Child* child, int code) {
  ChildEvent event;
  event.name = child->spec.name;
  event.code = code;
  event.hung = child->hung;
  child->pid = 0;
  child->ready = false;
  const std::optional<int64_t> delay_ns = DelayBeforeRestart(child, code);
  event.kind = delay_ns ? ChildEvent::Kind::kRestarted : ChildEvent::Kind::kEnded;
  event.yields = code == kExitPresent && child->last_code == kExitSuperseded;
  child->last_code = code;
  if (delay_ns) {
    event.restarts = ++child->restarts;
    event.delay_ns = *delay_ns;
    child->due_ns = now_ns() + *delay_ns;
  }
  events_.push_back(std::move(event));
}

/// None: it stays dead.
std::optional<int64_t> Supervisor::DelayBeforeRestart(Child* child, int code) {
  if (!restarting_ || !child->spec.restart || !WorthRestarting(code)) return std::nullopt;
  const int64_t now = now_ns();
  const int64_t short_ns = code == kExitSuperseded ? options_.short_office_ns : options_.short_life_ns;
  const bool short_life = now - child->began_ns < short_ns;
  if (!short_life) {
    child->lived = true;
    child->short_lives = 0;
    child->missing_since_ns.reset();
  }
  ++child->short_lives;
  const int doubled = std::clamp(child->short_lives - 2, 0, 20);
  const int64_t delay =
      child->short_lives < 2 ? 0 : std::min(options_.longest_delay_ns, options_.first_delay_ns << doubled);
  if (code != kExitNotYet) {
    return child->short_lives <= options_.most_short_lives ? std::optional(delay) : std::nullopt;
  }
  if (!child->missing_since_ns) child->missing_since_ns = now;
  const bool patience = options_.wait_for_what_may_come ||
                        (child->lived && now - *child->missing_since_ns < options_.patience_ns);
  return patience ? std::optional(std::max(delay, options_.first_delay_ns)) : std::nullopt;
}

void Supervisor::StartDue() {
  const int64_t now = now_ns();
  for (Child& child : children_) {
    if (child.due_ns <= now || (child.waits && MayBegin(child))) Launch(&child);
  }
}

void Supervisor::HearNotices() {
  if (notice_fd_ < 0) return;
  while (const std::optional<Notice> notice = NextNotice(notice_fd_)) OnNotice(notice->sender, notice->text);
}

void Supervisor::OnNotice(pid_t sender, const std::string& text) {
  const auto child = std::find_if(children_.begin(), children_.end(),
                                  [&](const Child& c) { return c.pid > 0 && c.pid == sender; });
  if (child == children_.end()) return;
  child->heard_ns = now_ns();
  if (ValueOf(text, "STOPPING") == "1") child->at_last_work = true;
  if (ValueOf(text, "READY") != "1") return;
  child->ready = true;
  ChildEvent event;
  event.kind = ChildEvent::Kind::kReady;
  event.name = child->spec.name;
  event.text = ValueOf(text, "STATUS").value_or("");
  events_.push_back(std::move(event));
}

/// How long a child that is alive may say nothing; after that it hangs. No end: it is asked nothing.
int64_t Supervisor::SilentUntil(const Child& child) const {
  if (options_.watchdog_ns <= 0 || child.pid <= 0 || child.hung || child.at_last_work) return INT64_MAX;
  if (child.heard_ns) return *child.heard_ns + options_.watchdog_ns;
  return child.spec.speaks ? child.began_ns + options_.first_word_ns : INT64_MAX;
}

void Supervisor::KillHung() {
  const int64_t now = now_ns();
  for (Child& child : children_) {
    if (now <= SilentUntil(child)) continue;
    child.hung = true;
    kill(child.pid, SIGKILL);
  }
}

void Supervisor::TakeSignals() {
  signalfd_siginfo info;
  while (read(signal_fd_, &info, sizeof(info)) == static_cast<ssize_t>(sizeof(info))) {
    if (info.ssi_signo == SIGCHLD) continue;
    ChildEvent event;
    event.kind = ChildEvent::Kind::kSignal;
    event.code = static_cast<int>(info.ssi_signo);
    events_.push_back(event);
  }
}

int64_t Supervisor::NextDeadline() const {
  int64_t deadline = INT64_MAX;
  for (const Child& child : children_) {
    deadline = std::min(deadline, child.due_ns);
    const int64_t silent_until = SilentUntil(child);
    if (silent_until != INT64_MAX) deadline = std::min(deadline, silent_until + 1);
  }
  return deadline;
}

void Supervisor::Poll(int64_t deadline_ns) {
  pollfd fds[2] = {{signal_fd_, POLLIN, 0}, {notice_fd_, POLLIN, 0}};
  const int64_t until_ns = std::min(deadline_ns, NextDeadline());
  const int64_t wait_ns = std::max<int64_t>(0, until_ns - now_ns());
  const timespec timeout{wait_ns / 1'000'000'000, wait_ns % 1'000'000'000};
  ppoll(fds, 2, until_ns == INT64_MAX ? nullptr : &timeout, nullptr);
  TakeSignals();
  HearNotices();  // who has just died may have said something before
  Reap();
  KillHung();
  StartDue();
}

ChildEvent Supervisor::Wait(int64_t deadline_ns) {
  while (events_.empty()) {
    Poll(deadline_ns);
    if (events_.empty() && now_ns() >= deadline_ns) return {};
  }
  ChildEvent event = std::move(events_.front());
  events_.pop_front();
  return event;
}

void Supervisor::StopRestarting() {
  restarting_ = false;
  for (Child& child : children_) {
    child.due_ns = INT64_MAX;
    child.waits = false;
  }
}

void Supervisor::StopAll() {
  StopRestarting();
  for (const Child& child : children_) {
    if (child.pid > 0) kill(child.pid, child.spec.stop_signal);
    if (child.pid > 0) kill(child.pid, SIGCONT);  // who was stopped cannot end
  }
  const int64_t asked_ns = now_ns();
  const auto may_live_until = [&](const Child& child) {
    return asked_ns + (child.at_last_work ? options_.last_work_ns : options_.stop_ns);
  };
  std::set<pid_t> killed;
  const auto is_asked = [&](const Child& child) { return child.pid > 0 && !killed.contains(child.pid); };
  while (size() > 0) {
    int64_t deadline_ns = INT64_MAX;
    for (const Child& child : children_) {
      if (is_asked(child)) deadline_ns = std::min(deadline_ns, may_live_until(child));
    }
    const bool impatient = Wait(deadline_ns).kind == ChildEvent::Kind::kSignal;
    for (const Child& child : children_) {
      if (!is_asked(child) || (!impatient && now_ns() < may_live_until(child))) continue;
      kill(child.pid, SIGKILL);
      killed.insert(child.pid);
    }
  }
}

bool Supervisor::Alive(const std::string& name) const { return PidOf(name) > 0; }

size_t Supervisor::size() const {
  return static_cast<size_t>(std::count_if(children_.begin(), children_.end(), [](const Child& child) {
    return child.pid > 0 || child.due_ns != INT64_MAX || child.waits;
  }));
}

pid_t Supervisor::PidOf(const std::string& name) const {
  for (const Child& child : children_) {
    if (child.spec.name == name) return child.pid;
  }
  return 0;
}

}  // namespace dmslam
