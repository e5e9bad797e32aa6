#pragma once

#include <charconv>
#include <optional>
#include <string>
#include <string_view>
#include <system_error>
#include <type_traits>

namespace dmslam {

/// A word that a setting may have for its value, and what it means.
template <typename Enum>
struct SettingChoice {
  const char* word;
  Enum value;
};

/// A setting's value as text: "on" or "off", the shortest text that is read as the same number, or a word.
template <typename T>
std::string FormatSetting(const T& value) {
  if constexpr (std::is_same_v<T, bool>) {
    return value ? "on" : "off";
  } else if constexpr (std::is_same_v<T, std::string>) {
    return value;
  } else {
    char buffer[64];
    const auto [end, error] = std::to_chars(buffer, buffer + sizeof(buffer), value);
    return std::string(buffer, end);
  }
}

/// What `text` says; none where it is not of this type.
template <typename T>
std::optional<T> ParseSetting(std::string_view text) {
  if constexpr (std::is_same_v<T, bool>) {
    if (text == "on" || text == "true" || text == "yes" || text == "1") return true;
    if (text == "off" || text == "false" || text == "no" || text == "0") return false;
    return std::nullopt;
  } else if constexpr (std::is_same_v<T, std::string>) {
    return std::string(text);
  } else {
    T value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
    return value;
  }
}

}  // namespace dmslam
