#pragma once

#include <cstdint>
#include <initializer_list>
#include <map>
#include <optional>
#include <string>
#include <string_view>
#include <type_traits>
#include <vector>

#include "dmslam/settings/setting_value.h"

namespace dmslam {

/// Everything that can be set: the same file and the same `--set`s go to every
/// process. Here settings are text; each process reads the options that it needs out of them, and compiles
/// nobody else's:
///
///   const MapperOptions options = settings.Read<MapperOptions>();
///
/// An options struct says with a template `Describe(visitor)` which of its fields can be set (see any of
/// them), and dmslam/settings/registry.cc collects them.
class Settings {
 public:
  /// The defaults: profile dm.
  Settings() = default;
  /// Of a profile. Throws InputError for one that does not exist.
  explicit Settings(std::string_view profile);

  /// Sets one value. Throws InputError that names the key (and the one that it may be a slip of) and what is
  /// allowed. A profile is chosen before everything else, so it cannot be set here.
  void Set(std::string_view key, std::string_view value);
  /// A value as text: "2000", "on". Throws InvariantError for a key that does not exist.
  std::string Value(std::string_view key) const;
  std::string profile() const { return Value("profile"); }

  /// The options of a room with what is set. Defaults of its other fields are kept.
  template <typename Options>
  Options Read() const;

  /// Over all values that change results: two processes with the same hash compute the same.
  uint64_t Hash() const;

 private:
  std::map<std::string, std::string, std::less<>> changed_;  ///< what differs from the defaults
};

/// Reads a configuration file (YAML: sections of keys) and then the overrides "key=value". The profile comes
/// first wherever it stands; of an override given twice the last one counts. Throws InputError that names
/// file, line, key and what is allowed.
Settings LoadSettings(const std::string& path, const std::vector<std::string>& overrides);

namespace internal {

/// Takes values over into the fields of an options struct.
class SettingsReader {
 public:
  explicit SettingsReader(const Settings& settings) : settings_(settings) {}
  template <typename T>
  void Number(const char* key, T& field, double, double, const char*, const char*) {
    Shared(key, field);
  }
  void Switch(const char* key, bool& field, const char*) { Shared(key, field); }
  template <typename Enum>
  void Choice(const char* key, Enum& field,
              std::initializer_list<SettingChoice<std::type_identity_t<Enum>>> choices, const char*) {
    const std::string word = settings_.Value(key);
    for (const SettingChoice<Enum>& choice : choices) {
      if (choice.word == word) field = choice.value;
    }
  }
  void InBaseline(const char*) {}
  void InPaper(const char*) {}
  void ChangesNoResult() {}
  template <typename T>
  void Shared(const char* key, T& field) {
    if (const std::optional<T> value = ParseSetting<T>(settings_.Value(key))) field = *value;
  }

 private:
  const Settings& settings_;
};

}  // namespace internal

template <typename Options>
Options Settings::Read() const {
  Options options;
  internal::SettingsReader reader(*this);
  options.Describe(reader);
  return options;
}

}  // namespace dmslam
