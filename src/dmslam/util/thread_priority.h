#pragma once

namespace dmslam {

/// A thread that competes with one that is so much nicer has three times its processor time.
inline constexpr int kNicer = 5;

/// Lowers the priority of the calling thread, and of those that it starts from now on, by kNicer steps. For
/// work that nobody waits for from one frame to the next. A thread cannot go back. Nothing happens where the
/// system refuses, or where the priority is the lowest already.
void LetOthersGoFirst();

}  // namespace dmslam
