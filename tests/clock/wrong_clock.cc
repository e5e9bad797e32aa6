// clock_gettime with a wall clock that is WRONG_CLOCK_S seconds off. The monotonic clocks stay right.
#include <sys/syscall.h>
#include <unistd.h>

#include <cstdlib>
#include <ctime>

extern "C" int clock_gettime(clockid_t clock, timespec* time) noexcept {
  const int result = static_cast<int>(syscall(SYS_clock_gettime, clock, time));
  const char* offset = std::getenv("WRONG_CLOCK_S");
  if (result == 0 && clock == CLOCK_REALTIME && offset != nullptr) time->tv_sec += std::atol(offset);
  return result;
}
