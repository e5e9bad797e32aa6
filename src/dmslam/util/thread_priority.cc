#include "dmslam/util/thread_priority.h"

#include <sys/resource.h>

namespace dmslam {

void LetOthersGoFirst() {
  // On Linux "this process" is this thread. What is refused leaves it as it was.
  setpriority(PRIO_PROCESS, 0, getpriority(PRIO_PROCESS, 0) + kNicer);
}

}  // namespace dmslam
