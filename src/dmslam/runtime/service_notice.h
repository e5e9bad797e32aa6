#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <string_view>

namespace dmslam {

/// Tells whoever started this process, dmslam-run or systemd, that it is ready and, again and again, that it
/// is alive: one that hangs is killed and started again. Speaks the protocol of sd_notify (NOTIFY_SOCKET,
/// WATCHDOG_USEC); where nobody asked for it, says nothing.
class ServiceNotice {
 public:
  /// Reads the environment.
  ServiceNotice();
  ~ServiceNotice();
  ServiceNotice(const ServiceNotice&) = delete;
  ServiceNotice& operator=(const ServiceNotice&) = delete;

  /// `status`: one line that is shown with it; may be empty.
  void Ready(std::string_view status = "");
  /// That what follows is the last work, which may take long: nobody listens for `Alive` any more.
  void Stopping() { Send("STOPPING=1"); }
  /// Says so, four times within the time that was asked for. Cheap: to be called from every turn of a loop.
  /// `well`: asked when it is due; where it is false nothing is said.
  void Alive(int64_t now_ns, const std::function<bool()>& well);
  /// Who says nothing for so long is killed; 0: nobody asked.
  int64_t longest_silence_ns() const { return longest_silence_ns_; }
  /// When Alive wants to be called next.
  int64_t deadline_ns() const { return next_ns_; }

 private:
  void Send(std::string_view text);

  int socket_ = -1;
  std::string address_;
  int64_t longest_silence_ns_ = 0;
  int64_t every_ns_ = 0;  ///< 0: nobody asked
  int64_t next_ns_ = INT64_MAX;
};

}  // namespace dmslam
