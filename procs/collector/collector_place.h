#pragma once

#include <cstdint>
#include <optional>
#include <string>

#include "dmslam/runtime/other_readers.h"

namespace dmslam {

/// The place of a session's collector, which one process alone may have. A collector writes no stream, so no
/// election says whether there is another one: it listens for a while before it begins.
class CollectorPlace {
 public:
  struct Setup {
    int64_t own_id = 0;
    bool others_may_be = true;  ///< false: the whole system begins with this process, and nobody is heard
    bool takes_over = false;    ///< it waits for the place of the one that has it
  };
  CollectorPlace(const Setup& setup, int64_t now_ns);

  /// What a reader in a collector's part acknowledges.
  void Hear(const OtherReaders::Word& word, int64_t now_ns);
  /// It goes on with what a collector before it has written, and begins at once: what a frontend has kept for
  /// it is lost when the frontend dies. Not where it takes over: the one before may still be there.
  void GoOn() { goes_on_ = !setup_.takes_over; }
  bool MayBegin(int64_t session, int64_t now_ns) const;
  void OnBegun(int64_t now_ns) { begun_ns_ = now_ns; }
  /// When it has listened for long enough to begin; INT64_MAX: it need not listen any more.
  int64_t deadline_ns(int64_t now_ns) const;
  /// For how long it has been at work: no time before it has begun.
  int64_t AtWorkNs(int64_t now_ns) const { return begun_ns_ ? now_ns - *begun_ns_ : 0; }

  /// What follows from the other one that is there.
  struct Yield {
    enum class How : uint8_t { kLeave, kWait } how = How::kLeave;
    std::string other;  ///< its name
  };
  /// None: nobody else is there, or the other one leaves. Who comes later leaves, before it has written
  /// anything. Of two that began together, and could not hear each other before, it is the one with the
  /// larger id, or the one that took itself for the other's successor. That it waits is told once.
  std::optional<Yield> TakeYield(int64_t session, int64_t now_ns);

 private:
  bool IsMine(int64_t other_id, int64_t now_ns) const;

  Setup setup_;
  OtherReaders others_;
  int64_t listens_until_ns_;
  bool goes_on_ = false;
  bool told_to_wait_ = false;
  std::optional<int64_t> begun_ns_;
};

}  // namespace dmslam
