#include "dmslam/runtime/service_notice.h"

#include <sys/socket.h>
#include <sys/un.h>
#include <unistd.h>

#include <cstddef>
#include <cstdlib>
#include <cstring>

namespace dmslam {
namespace {

constexpr int64_t kNoticesPerPeriod = 4;

}  // namespace

ServiceNotice::ServiceNotice() {
  const char* address = std::getenv("NOTIFY_SOCKET");
  if (address == nullptr || (address[0] != '/' && address[0] != '@')) return;
  address_ = address;
  socket_ = socket(AF_UNIX, SOCK_DGRAM | SOCK_CLOEXEC | SOCK_NONBLOCK, 0);
  const char* period_us = std::getenv("WATCHDOG_USEC");
  if (period_us == nullptr) return;
  longest_silence_ns_ = std::atoll(period_us) * 1000;
  every_ns_ = longest_silence_ns_ / kNoticesPerPeriod;
  if (every_ns_ > 0) next_ns_ = INT64_MIN;
}

ServiceNotice::~ServiceNotice() {
  if (socket_ >= 0) close(socket_);
}

void ServiceNotice::Ready(std::string_view status) {
  std::string text = "READY=1";
  if (!status.empty()) text.append("\nSTATUS=").append(status);
  Send(text);
}

void ServiceNotice::Alive(int64_t now_ns, const std::function<bool()>& well) {
  if (every_ns_ <= 0 || now_ns < next_ns_) return;
  next_ns_ = now_ns + every_ns_;
  if (well()) Send("WATCHDOG=1");
}

void ServiceNotice::Send(std::string_view text) {
  if (socket_ < 0) return;
  sockaddr_un to{};
  if (address_.size() >= sizeof(to.sun_path)) return;
  to.sun_family = AF_UNIX;
  std::memcpy(to.sun_path, address_.data(), address_.size());
  if (address_[0] == '@') to.sun_path[0] = '\0';  // not in the file system
  const auto length = static_cast<socklen_t>(offsetof(sockaddr_un, sun_path) + address_.size());
  // Who does not listen any more needs no answer.
  (void)!sendto(socket_, text.data(), text.size(), MSG_NOSIGNAL, reinterpret_cast<sockaddr*>(&to), length);
}

}  // namespace dmslam
