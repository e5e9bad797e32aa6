#pragma once

#include <optional>
#include <string>
#include <string_view>
#include <vector>

namespace dmslam {

/// A setting, as the options struct that holds it describes it.
struct SettingInfo {
  std::string key;                      ///< "tracking.motion_belief"
  std::string value;                    ///< the default
  std::optional<std::string> baseline;  ///< in the profile of this name, where that sets it
  std::optional<std::string> paper;     ///< likewise
  bool changes_results = true;          ///< false: what is computed is the same with any value
  std::string unit;                     ///< empty: none
  std::string help;
  std::string allowed;  ///< "1 to 16", "on or off", "dlrsac, arsac or ransac"

  /// The canonical text of a value; none where the value is of another type or out of bounds.
  std::optional<std::string> Canonical(std::string_view text) const;

  enum class Type { kSwitch, kWhole, kUnsigned, kReal, kSingle, kChoice };
  Type type = Type::kSwitch;
  double low = 0, high = 0;          ///< bounds of numbers
  std::vector<std::string> choices;  ///< of a choice
};

/// All settings, in the order of the page docs/configuration.md. This is the only place that knows the
/// options of all rooms; it is compiled once.
const std::vector<SettingInfo>& AllSettings();

/// The setting of this name, or none.
const SettingInfo* FindSetting(std::string_view key);

/// The name that `key` is a slip of: one that differs in a few letters. None where none is so near.
std::optional<std::string> NearestSetting(std::string_view key);

/// Whether settings stand below this name, as "mapping".
bool IsSection(std::string_view name);

/// Why a setting that once was is no more, and what to do; empty where there never was one.
std::string WhyRemoved(std::string_view key);

}  // namespace dmslam
