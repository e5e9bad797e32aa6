#pragma once

#include <cstdint>
#include <string>

#include "dmslam/util/format.h"

namespace dmslam {

/// Of a checksum.
inline std::string Hex(uint64_t checksum) {
  return Format("%016llx", static_cast<unsigned long long>(checksum));
}

/// Numbers with commas between them.
template <typename Numbers>
std::string Listed(const Numbers& numbers) {
  std::string text;
  for (const auto number : numbers) text += (text.empty() ? "" : ", ") + std::to_string(number);
  return text;
}

}  // namespace dmslam
