#pragma once

#include <algorithm>
#include <cstddef>
#include <cstdint>
#include <map>
#include <optional>
#include <string>

namespace dmslam {

/// Tells whether another process reads a session's streams in the same part as this one, by what every reader
/// acknowledges at least once a second: of a part that one process alone may have, and that writes no stream,
/// so that no beacon says who has it. One message proves nothing, for it may be forged, and echoes of a
/// reader that has died end within a tenth of a second (kNoCopyNs): a reader is there when it has spoken for
/// half a second, and is not silent. Keeps a few: the one that was heard longest ago makes room.
class OtherReaders {
 public:
  struct Reader {
    int64_t id = 0;
    std::string name;  ///< as it is told to people
  };
  /// What an acknowledgement says of who sent it.
  struct Word {
    int64_t reader = 0;
    std::string name;
    int64_t session = 0;
    int64_t utime = 0;
  };
  /// Whoever has been there for two seconds before this is known by the end of it.
  static constexpr int64_t kListenNs = 2'500'000'000;

  /// `own_id`: as this process's readers have it; what they say is not heard.
  explicit OtherReaders(int64_t own_id) : own_id_(own_id) {}

  void Hear(const Word& word, int64_t now_ns) {
    if (word.reader == own_id_) return;
    const auto [found, is_new] = heard_.try_emplace(word.reader, Heard{{}, 0, now_ns, now_ns, word.utime});
    Heard& heard = found->second;
    if (!is_new && word.utime <= heard.utime) return;  // a copy
    if (!is_new && now_ns - heard.last_ns > kSilentNs) heard.since_ns = now_ns;
    heard.name = word.name;
    heard.session = word.session;
    heard.last_ns = now_ns;
    heard.utime = word.utime;
    if (heard_.size() > kMost) Forget();
  }
  /// One of the session that is there now; none: there is none.
  std::optional<Reader> Find(int64_t session, int64_t now_ns) const {
    for (const auto& [id, heard] : heard_) {
      const bool is_there =
          heard.last_ns - heard.since_ns >= kLongEnoughNs && now_ns - heard.last_ns <= kSilentNs;
      if (heard.session == session && is_there) return Reader{id, heard.name};
    }
    return std::nullopt;
  }

 private:
  static constexpr size_t kMost = 16;
  static constexpr int64_t kLongEnoughNs = 500'000'000;
  static constexpr int64_t kSilentNs = 2'000'000'000;
  struct Heard {
    std::string name;
    int64_t session = 0;
    int64_t since_ns = 0, last_ns = 0;
    int64_t utime = 0;  // of the newest one
  };

  void Forget() {
    heard_.erase(std::min_element(heard_.begin(), heard_.end(), [](const auto& a, const auto& b) {
      return a.second.last_ns < b.second.last_ns;
    }));
  }

  int64_t own_id_;
  std::map<int64_t, Heard> heard_;  // by reader
};

}  // namespace dmslam
