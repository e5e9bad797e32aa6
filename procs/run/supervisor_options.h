#pragma once

#include <sys/types.h>
#include <unistd.h>

#include <cstdint>

namespace dmslam {

/// How long a supervisor waits, and what it takes for hopeless.
struct SupervisorOptions {
  int64_t short_life_ns = 3'000'000'000;  ///< who lives for less has made no progress
  /// Nor has who is superseded within this time: it listens for others first, and waits for who asks for
  /// its place.
  int64_t short_office_ns = 60'000'000'000;
  int most_short_lives = 8;              ///< in a row; then it is past help
  int64_t first_delay_ns = 200'000'000;  ///< before the second start in a row; doubles with each
  int64_t longest_delay_ns = 5'000'000'000;
  int64_t patience_ns = 60'000'000'000;  ///< bus or camera may be gone for so long; never at the first start
  bool wait_for_what_may_come = false;   ///< ... for ever, and at the first start too
  int64_t watchdog_ns = 0;               ///< who says nothing for so long hangs; 0: nobody is asked
  /// ... as does who is known to speak, and has said no word since its start: what it begins with, as a
  /// large map, may take long to load.
  int64_t first_word_ns = 300'000'000'000;
  int64_t stop_ns = 10'000'000'000;        ///< who does not end when asked to is killed after so long...
  int64_t last_work_ns = 600'000'000'000;  ///< ... or, where it has said that it is at its last work
  pid_t (*fork)() = ::fork;                ///< a test lets it fail
};

}  // namespace dmslam
