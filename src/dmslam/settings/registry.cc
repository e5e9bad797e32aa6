#include "dmslam/settings/registry.h"

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <initializer_list>
#include <type_traits>
#include <utility>

#include "dmslam/features/orb_extractor.h"
#include "dmslam/initialization/initializer_options.h"
#include "dmslam/loops/loop_options.h"
#include "dmslam/map/feature_store.h"
#include "dmslam/mapping/mapper_options.h"
#include "dmslam/settings/run_options.h"
#include "dmslam/settings/setting_value.h"
#include "dmslam/slam/frontend_options.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

using Type = SettingInfo::Type;

template <typename T>
constexpr Type TypeOf() {
  if constexpr (std::is_same_v<T, float>) return Type::kSingle;
  if constexpr (std::is_floating_point_v<T>) return Type::kReal;
  return std::is_unsigned_v<T> ? Type::kUnsigned : Type::kWhole;
}

std::string JoinWithOr(const std::vector<std::string>& words) {
  std::string text;
  for (size_t i = 0; i < words.size(); ++i) {
    if (i > 0) text += i + 1 == words.size() ? " or " : ", ";
    text += words[i];
  }
  return text;
}

std::string FormatBound(double bound) {
  return std::abs(bound) < 1e15 ? FormatSetting(bound) : FormatSetting(static_cast<uint64_t>(-1));
}

/// Collects what options structs say of their fields.
class Collector {
 public:
  template <typename T>
  void Number(const char* key, T& field, double low, double high, const char* unit, const char* help) {
    SettingInfo& info = Add(key, FormatSetting(field), help, TypeOf<T>());
    info.unit = unit;
    info.low = low;
    info.high = high;
    info.allowed = FormatBound(low) + " to " + FormatBound(high);
  }
  void Switch(const char* key, bool& field, const char* help) {
    Add(key, FormatSetting(field), help, Type::kSwitch).allowed = "on or off";
  }
  template <typename Enum>
  void Choice(const char* key, Enum& field,
              std::initializer_list<SettingChoice<std::type_identity_t<Enum>>> choices, const char* help) {
    const auto chosen = std::ranges::find(choices, field, &SettingChoice<Enum>::value);
    DMSLAM_CHECK(chosen != choices.end(), key);
    SettingInfo& info = Add(key, chosen->word, help, Type::kChoice);
    for (const SettingChoice<Enum>& choice : choices) info.choices.push_back(choice.word);
    info.allowed = JoinWithOr(info.choices);
  }
  /// Of the setting just described: its value in the profile `baseline`.
  void InBaseline(const char* value) { settings_.back().baseline = value; }
  /// The same in the profile `paper`.
  void InPaper(const char* value) { settings_.back().paper = value; }
  /// What is computed is the same with any value of it.
  void ChangesNoResult() { settings_.back().changes_results = false; }
  /// A field that takes a setting which another struct describes: the defaults must be the same.
  template <typename T>
  void Shared(const char* key, T& field) {
    shared_.emplace_back(key, FormatSetting(field));
  }

  std::vector<SettingInfo> Finish() {
    for (const auto& [key, value] : shared_) {
      const auto setting = std::ranges::find(settings_, key, &SettingInfo::key);
      const std::string why = "the setting " + key + " has one default, wherever it is used";
      DMSLAM_CHECK(setting != settings_.end() && setting->value == value, why.c_str());
    }
    return std::move(settings_);
  }

 private:
  SettingInfo& Add(const char* key, std::string value, const char* help, Type type) {
    DMSLAM_CHECK(std::ranges::find(settings_, key, &SettingInfo::key) == settings_.end(), key);
    SettingInfo info;
    info.key = key;
    info.value = std::move(value);
    info.help = help;
    info.type = type;
    return settings_.emplace_back(std::move(info));
  }

  std::vector<SettingInfo> settings_;
  std::vector<std::pair<std::string, std::string>> shared_;
};

template <typename Options>
void Collect(Collector& collector, Options options) {
  options.Describe(collector);
}

SettingInfo ProfileInfo() {
  SettingInfo info;
  info.key = "profile";
  info.value = "dm";
  info.baseline = "baseline";
  info.paper = "paper";
  info.help = "sets several at once, before all others";
  info.type = Type::kChoice;
  info.choices = {"dm", "baseline", "paper"};
  info.allowed = JoinWithOr(info.choices);
  return info;
}

std::vector<SettingInfo> CollectAll() {
  Collector collector;
  Collect(collector, RunOptions());
  Collect(collector, FeatureStoreOptions());
  Collect(collector, OrbExtractorOptions());
  Collect(collector, InitializerOptions());
  Collect(collector, FrontendOptions());
  Collect(collector, MapperOptions());
  Collect(collector, LoopcloserOptions());
  Collect(collector, CheckpointOptions());
  std::vector<SettingInfo> all = collector.Finish();
  all.insert(all.begin(), ProfileInfo());
  return all;
}

template <typename T>
std::optional<std::string> CanonicalNumber(std::string_view text, double low, double high) {
  const std::optional<T> value = ParseSetting<T>(text);
  if (!value || !(static_cast<double>(*value) >= low && static_cast<double>(*value) <= high))
    return std::nullopt;
  return FormatSetting(*value);
}

size_t EditDistance(std::string_view a, std::string_view b) {
  std::vector<size_t> row(b.size() + 1);
  for (size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (size_t i = 1; i <= a.size(); ++i) {
    size_t diagonal = std::exchange(row[0], i);
    for (size_t j = 1; j <= b.size(); ++j) {
      const size_t replaced = diagonal + (a[i - 1] == b[j - 1] ? 0 : 1);
      diagonal = row[j];
      row[j] = std::min({row[j] + 1, row[j - 1] + 1, replaced});
    }
  }
  return row.back();
}

}  // namespace

std::optional<std::string> SettingInfo::Canonical(std::string_view text) const {
  switch (type) {
    case Type::kSwitch: {
      const std::optional<bool> on = ParseSetting<bool>(text);
      return on ? std::optional(FormatSetting(*on)) : std::nullopt;
    }
    case Type::kWhole:
      return CanonicalNumber<int64_t>(text, low, high);
    case Type::kUnsigned:
      return CanonicalNumber<uint64_t>(text, low, high);
    case Type::kReal:
      return CanonicalNumber<double>(text, low, high);
    case Type::kSingle:
      return CanonicalNumber<float>(text, low, high);
    case Type::kChoice:
      break;
  }
  const auto choice = std::ranges::find(choices, text);
  return choice != choices.end() ? std::optional(*choice) : std::nullopt;
}

const std::vector<SettingInfo>& AllSettings() {
  static const std::vector<SettingInfo> all = CollectAll();
  return all;
}

const SettingInfo* FindSetting(std::string_view key) {
  const auto setting = std::ranges::find(AllSettings(), key, &SettingInfo::key);
  return setting != AllSettings().end() ? &*setting : nullptr;
}

std::optional<std::string> NearestSetting(std::string_view key) {
  constexpr size_t kMostSlips = 3;
  const auto distance = [&](const SettingInfo& setting) { return EditDistance(setting.key, key); };
  const SettingInfo& nearest = *std::ranges::min_element(AllSettings(), {}, distance);
  const bool is_near = distance(nearest) <= std::min(kMostSlips, key.size() / 2);
  return is_near ? std::optional(nearest.key) : std::nullopt;
}

bool IsSection(std::string_view name) {
  const std::string prefix = std::string(name) + ".";
  return std::ranges::any_of(AllSettings(),
                             [&](const SettingInfo& setting) { return setting.key.starts_with(prefix); });
}

std::string WhyRemoved(std::string_view key) {
  if (key == "keyframe.max_interval_s") {
    return "it could have no effect beside 'keyframe.min_interval_s'; delete it";
  }
  return "";
}

}  // namespace dmslam
