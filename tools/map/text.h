#pragma once

#include <cstdarg>
#include <cstdint>
#include <cstdio>
#include <string>

namespace dmslam {

/// As printf, at most 399 characters.
[[gnu::format(printf, 1, 2)]] inline std::string Text(const char* format, ...) {
  char text[400];
  va_list values;
  va_start(values, format);
  std::vsnprintf(text, sizeof(text), format, values);
  va_end(values);
  return text;
}

/// Of a checksum.
inline std::string Hex(uint64_t checksum) {
  return Text("%016llx", static_cast<unsigned long long>(checksum));
}

/// Numbers with commas between them.
template <typename Numbers>
std::string Listed(const Numbers& numbers) {
  std::string text;
  for (const auto number : numbers) text += (text.empty() ? "" : ", ") + std::to_string(number);
  return text;
}

}  // namespace dmslam
