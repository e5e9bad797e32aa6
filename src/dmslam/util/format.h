#pragma once

#include <cstdarg>
#include <cstdio>
#include <string>

namespace dmslam {

/// printf into a string (up to 1 KiB).
[[gnu::format(printf, 1, 2)]] inline std::string Format(const char* format, ...) {
  char buffer[1024];
  va_list arguments;
  va_start(arguments, format);
  std::vsnprintf(buffer, sizeof(buffer), format, arguments);
  va_end(arguments);
  return buffer;
}

}  // namespace dmslam
