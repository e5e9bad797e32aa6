#pragma once

#include <cstdint>

namespace dmslam {

/// How a process of the system ends. The same for dmslam-run, which starts again what is worth it, and for
/// the units in config/systemd (RestartPreventExitStatus); docs/operations.md lists them.
enum ExitCode : int {
  kExitDone = 0,         ///< ended, or was asked to
  kExitInput = 1,        ///< input that cannot be used: a file, a field, a setting
  kExitMisfit = 2,       ///< does not fit the session: another camera, settings, vocabulary, message types
  kExitPresent = 3,      ///< another process writes this stream
  kExitSuperseded = 4,   ///< another one took the stream over
  kExitNoFrontend = 5,   ///< no frontend answered the end of the sequence
  kExitNoFrame = 6,      ///< no frame was tracked
  kExitNotYet = 7,       ///< needs what is not there (yet): a multicast route, the TCP service, the camera
  kExitNewerMap = 8,     ///< another process holds a newer map than the mapper began with
  kExitUsage = 64,       ///< the command line
  kExitInternal = 70,    ///< an internal error
  kExitNoProgram = 127,  ///< the program is not there; said by who starts it
  kExitSignal = 128,     ///< plus the number of the signal that ended it
};

/// Where no frontend is heard for so long after the end of the sequence, none comes any more: the player ends
/// with kExitNoFrontend, and the collector makes the results of what there is.
inline constexpr int64_t kNoFrontendNs = 60'000'000'000;

/// Whether a process that ended so may do better when it is started again. What it refused, as a wrong option
/// or a stream that somebody else writes, it would refuse again.
constexpr bool WorthRestarting(int code) {
  return code == kExitSuperseded || code == kExitNotYet || code == kExitNewerMap || code == kExitInternal ||
         code > kExitSignal;
}

}  // namespace dmslam
