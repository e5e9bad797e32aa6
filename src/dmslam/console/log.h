#pragma once

#include <concepts>
#include <cstdint>
#include <initializer_list>
#include <string>
#include <string_view>
#include <variant>

namespace dmslam {

/// A value in a line of the log.
class LogValue {
 public:
  template <std::signed_integral T>
  LogValue(T value) : value_(static_cast<int64_t>(value)) {}  // NOLINT(google-explicit-constructor)
  template <std::unsigned_integral T>
  LogValue(T value) : value_(static_cast<uint64_t>(value)) {}  // NOLINT(google-explicit-constructor)
  LogValue(double value) : value_(value) {}                    // NOLINT(google-explicit-constructor)
  LogValue(std::string_view value) : value_(value) {}          // NOLINT(google-explicit-constructor)
  LogValue(const std::string& value)
      : value_(std::string_view(value)) {}                          // NOLINT(google-explicit-constructor)
  LogValue(const char* value) : value_(std::string_view(value)) {}  // NOLINT(google-explicit-constructor)

  using Held = std::variant<int64_t, uint64_t, double, std::string_view>;
  const Held& held() const { return value_; }

 private:
  Held value_;
};

enum class LogLevel : uint8_t { kInfo, kWarning, kError, kCritical };

/// `format` with a value for each {}; what stands within the braces is fmt's ("{:.1f}").
std::string FormatLine(std::string_view format, std::initializer_list<LogValue> values);

/// Writes a line to standard error, with time, program and level.
void LogLine(LogLevel level, std::string_view format, std::initializer_list<LogValue> values);

template <typename... Values>
void LogInfo(std::string_view format, const Values&... values) {
  LogLine(LogLevel::kInfo, format, {LogValue(values)...});
}
template <typename... Values>
void LogWarning(std::string_view format, const Values&... values) {
  LogLine(LogLevel::kWarning, format, {LogValue(values)...});
}
template <typename... Values>
void LogError(std::string_view format, const Values&... values) {
  LogLine(LogLevel::kError, format, {LogValue(values)...});
}
template <typename... Values>
void LogCritical(std::string_view format, const Values&... values) {
  LogLine(LogLevel::kCritical, format, {LogValue(values)...});
}

/// Called once, by main. `quiet`: warnings and errors only.
void SetUpLog(const std::string& program, bool quiet = false);

}  // namespace dmslam
