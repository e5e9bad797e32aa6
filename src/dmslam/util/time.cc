#include "dmslam/util/time.h"

#include <charconv>
#include <cstdio>

namespace dmslam {
namespace {

constexpr int64_t kNsPerSecond = 1'000'000'000;

std::optional<int64_t> ParseDigits(std::string_view digits) {
  int64_t value = 0;
  const auto [end, error] = std::from_chars(digits.data(), digits.data() + digits.size(), value);
  if (error != std::errc() || end != digits.data() + digits.size() || digits.front() == '-')
    return std::nullopt;
  return value;
}

/// The fraction's digits, as nanoseconds.
std::optional<int64_t> ParseFraction(std::string_view digits) {
  while (digits.size() > 9 && digits.back() == '0') digits.remove_suffix(1);
  if (digits.empty()) return 0;
  if (digits.size() > 9) return std::nullopt;
  std::optional<int64_t> value = ParseDigits(digits);
  for (size_t i = digits.size(); value && i < 9; ++i) *value *= 10;
  return value;
}

}  // namespace

std::optional<int64_t> ParseStampNs(std::string_view text) {
  const bool negative = !text.empty() && text.front() == '-';
  if (negative) text.remove_prefix(1);
  const size_t dot = text.find('.');
  const std::string_view whole = text.substr(0, dot);
  if (whole.empty()) return std::nullopt;
  const std::optional<int64_t> seconds = ParseDigits(whole);
  const std::optional<int64_t> fraction =
      ParseFraction(dot == std::string_view::npos ? std::string_view() : text.substr(dot + 1));
  if (!seconds || !fraction || *seconds > 9'000'000'000) return std::nullopt;
  const int64_t stamp_ns = *seconds * kNsPerSecond + *fraction;
  return negative ? -stamp_ns : stamp_ns;
}

std::string FormatStampNs(int64_t stamp_ns) {
  const bool negative = stamp_ns < 0;
  const int64_t magnitude = negative ? -stamp_ns : stamp_ns;
  const int64_t fraction = magnitude % kNsPerSecond;
  char buffer[40];
  if (fraction % 1000 == 0) {
    std::snprintf(buffer, sizeof(buffer), "%s%lld.%06lld", negative ? "-" : "",
                  static_cast<long long>(magnitude / kNsPerSecond), static_cast<long long>(fraction / 1000));
  } else {
    std::snprintf(buffer, sizeof(buffer), "%s%lld.%09lld", negative ? "-" : "",
                  static_cast<long long>(magnitude / kNsPerSecond), static_cast<long long>(fraction));
  }
  return buffer;
}

}  // namespace dmslam
