#pragma once

namespace dmslam {

/// From now on the calling thread, with those that it starts, waits for others where cores are short (five
/// steps of niceness, a third of the time of a thread that competes). For work that nobody waits for from one
/// frame to the next. A thread cannot go back. Nothing happens where the system refuses.
void LetOthersGoFirst();

}  // namespace dmslam
