#include "dmslam/settings/settings.h"

#include <yaml-cpp/yaml.h>

#include <utility>

#include "dmslam/settings/registry.h"
#include "dmslam/util/check.h"
#include "dmslam/util/random.h"
#include "dmslam/util/yaml_error.h"

namespace dmslam {
namespace {

/// A value and where it stands.
struct Given {
  std::string key;
  std::string value;
  std::string place;  ///< "config.yaml:12", "--set seed=3"
};

[[noreturn]] void ThrowUnknown(std::string_view key) {
  const std::string name = "setting '" + std::string(key) + "' ";
  if (const std::string why = WhyRemoved(key); !why.empty()) throw InputError(name + "was removed: " + why);
  if (IsSection(key))
    throw InputError("'" + std::string(key) +
                     "' is a section and has no value; write its settings below it, or as 'section.key' "
                     "(docs/configuration.md lists all)");
  const std::optional<std::string> nearest = NearestSetting(key);
  throw InputError(name + "does not exist; " +
                   (nearest ? "did you mean '" + *nearest + "'? (docs/configuration.md lists all)"
                            : "docs/configuration.md lists all"));
}

/// "a number from 0 to 1 [s]"
std::string WhatIsAllowed(const SettingInfo& setting) {
  using Kind = SettingInfo::Type;
  const bool is_whole = setting.type == Kind::kWhole || setting.type == Kind::kUnsigned;
  const bool is_number = setting.choices.empty() && setting.type != Kind::kSwitch;
  const std::string unit = setting.unit.empty() ? "" : " [" + setting.unit + "]";
  return (is_whole ? "a whole number from " : is_number ? "a number from " : "") + setting.allowed + unit;
}

/// The value as it is kept.
std::string CanonicalValue(std::string_view key, std::string_view value) {
  const SettingInfo* setting = FindSetting(key);
  if (setting == nullptr) ThrowUnknown(key);
  if (std::optional<std::string> canonical = setting->Canonical(value)) return *canonical;
  throw InputError("setting '" + setting->key + "': '" + std::string(value) + "' is not allowed; write " +
                   WhatIsAllowed(*setting));
}

std::string PlaceOf(const std::string& path, const YAML::Mark& mark) {
  return mark.is_null() ? path : path + ":" + std::to_string(mark.line + 1);
}

void CollectYaml(const YAML::Node& node, const std::string& prefix, const std::string& path,
                 std::vector<Given>* all) {
  for (const auto& item : node) {
    const std::string place = PlaceOf(path, item.first.Mark());
    if (!item.first.IsScalar())
      throw InputError(place + ": is not the name of a setting; write 'key: value'");
    const std::string name = item.first.as<std::string>();
    if (name.empty()) throw InputError(place + ": the name of a setting is missing; write 'key: value'");
    const std::string key = prefix + name;
    if (item.second.IsMap()) {
      CollectYaml(item.second, key + ".", path, all);
    } else if (item.second.IsScalar()) {
      all->push_back({key, item.second.as<std::string>(), place});
    } else {
      const SettingInfo* setting = FindSetting(key);
      throw InputError(place + ": setting '" + key + "' is neither a value nor a section; write " +
                       (setting != nullptr ? WhatIsAllowed(*setting) : "'key: value'"));
    }
  }
}

void RefuseRepeated(const std::vector<Given>& all) {
  std::map<std::string, std::string> places;
  for (const Given& given : all) {
    const auto [other, first] = places.emplace(given.key, given.place);
    if (!first)
      throw InputError(given.place + ": setting '" + given.key + "' stands at " + other->second +
                       " too; delete one of them");
  }
}

std::vector<Given> ReadFile(const std::string& path) {
  std::vector<Given> all;
  try {
    const YAML::Node node = YAML::LoadFile(path);
    if (!node.IsMap() && !node.IsNull())
      throw InputError(path + ": is not a map of settings; write 'key: value' lines");
    CollectYaml(node, "", path, &all);
  } catch (const YAML::BadFile&) {
    throw InputError(path + ": cannot be read; check the path given with --config");
  } catch (const YAML::Exception& error) {
    throw InputError(NotYaml(path, error) + "; indent with spaces, not tabs, and write 'key: value' lines");
  }
  RefuseRepeated(all);
  return all;
}

std::vector<Given> ReadOverrides(const std::vector<std::string>& overrides) {
  std::vector<Given> all;
  for (const std::string& text : overrides) {
    const size_t equals = text.find('=');
    if (equals == std::string::npos || equals == 0) throw InputError("--set " + text + ": write key=value");
    all.push_back({text.substr(0, equals), text.substr(equals + 1), "--set " + text});
  }
  return all;
}

/// Calls `act`; what it throws gets the place before it.
template <typename Act>
void At(const Given& given, Act act) {
  try {
    act();
  } catch (const InputError& error) {
    throw InputError(given.place + ": " + error.what());
  }
}

}  // namespace

Settings::Settings(std::string_view profile) {
  const std::string name = CanonicalValue("profile", profile);
  if (name == "dm") return;
  for (const SettingInfo& setting : AllSettings()) {
    const std::optional<std::string>& own = name == "baseline" ? setting.baseline : setting.paper;
    if (own) changed_[setting.key] = *own;
  }
}

void Settings::Set(std::string_view key, std::string_view value) {
  DMSLAM_CHECK(key != "profile", "a profile is chosen before anything is set");
  changed_[std::string(key)] = CanonicalValue(key, value);
}

std::string Settings::Value(std::string_view key) const {
  if (const auto changed = changed_.find(key); changed != changed_.end()) return changed->second;
  const SettingInfo* setting = FindSetting(key);
  const std::string name(key);
  DMSLAM_CHECK(setting != nullptr, name.c_str());
  return setting->value;
}

uint64_t Settings::Hash() const {
  uint64_t hash = 0;
  for (const SettingInfo& setting : AllSettings()) {
    if (setting.changes_results) hash = DeriveSeed(hash, 0, setting.key + "=" + Value(setting.key));
  }
  return hash;
}

Settings LoadSettings(const std::string& path, const std::vector<std::string>& overrides) {
  std::vector<Given> all = path.empty() ? std::vector<Given>() : ReadFile(path);
  for (Given& given : ReadOverrides(overrides)) all.push_back(std::move(given));
  Settings settings;
  for (const Given& given : all) {
    if (given.key == "profile") At(given, [&] { settings = Settings(given.value); });
  }
  for (const Given& given : all) {
    if (given.key != "profile") At(given, [&] { settings.Set(given.key, given.value); });
  }
  return settings;
}

}  // namespace dmslam
