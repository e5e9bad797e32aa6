#pragma once

#include <cstdint>
#include <optional>
#include <string>

namespace dmslam {

/// Says for whom a process waits: once, when it has waited for them for a while. Who waits for others for a
/// moment only says nothing, and who waits again for the same ones later says it again.
class WaitNotice {
 public:
  explicit WaitNotice(int64_t after_ns = 2'000'000'000) : after_ns_(after_ns) {}

  /// `who`: for whom it waits now, with commas; empty: for nobody. What is to be said now, if anything.
  std::optional<std::string> Due(const std::string& who, int64_t now_ns) {
    if (who != who_) {
      who_ = who;
      since_ns_ = now_ns;
      said_ = false;
    }
    if (who.empty() || said_ || now_ns - since_ns_ < after_ns_) return std::nullopt;
    said_ = true;
    return "waiting for " + who;
  }

 private:
  int64_t after_ns_;
  std::string who_;
  int64_t since_ns_ = 0;
  bool said_ = false;
};

}  // namespace dmslam
