#include "dmslam/settings/settings.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cstdio>
#include <functional>
#include <limits>
#include <type_traits>

#include "dmslam/util/check.h"
#include "dmslam/util/random.h"

namespace dmslam {
namespace {

/// A setting: how it is read and how it is written.
struct Entry {
  std::string key;
  std::string help;
  std::function<void(std::string_view, Settings*)> set;
  std::function<std::string(const Settings&)> get;
};

[[noreturn]] void BadValue(const std::string& key, std::string_view value, const std::string& wanted) {
  throw InputError("setting '" + key + "': '" + std::string(value) + "' is not " + wanted);
}

template <typename T>
T ParseValue(const std::string& key, std::string_view text) {
  if constexpr (std::is_same_v<T, bool>) {
    if (text == "on" || text == "true" || text == "yes" || text == "1") return true;
    if (text == "off" || text == "false" || text == "no" || text == "0") return false;
    BadValue(key, text, "'on' or 'off'");
  } else if constexpr (std::is_same_v<T, std::string>) {
    return std::string(text);
  } else {
    T value{};
    const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
    if (error != std::errc() || end != text.data() + text.size()) {
      BadValue(key, text, std::is_integral_v<T> ? "a whole number" : "a number");
    }
    return value;
  }
}

template <typename T>
std::string FormatValue(const T& value) {
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

/// `at`: Settings& -> reference to the field. Numbers must lie in [low, high].
template <typename Access>
Entry Make(std::string key, std::string help, Access at,
           double low = -std::numeric_limits<double>::infinity(),
           double high = std::numeric_limits<double>::infinity()) {
  using T = std::remove_cvref_t<decltype(at(std::declval<Settings&>()))>;
  Entry entry;
  entry.set = [key, at, low, high](std::string_view text, Settings* settings) {
    const T value = ParseValue<T>(key, text);
    if constexpr (std::is_arithmetic_v<T> && !std::is_same_v<T, bool>) {
      const double number = static_cast<double>(value);
      if (!(number >= low && number <= high)) {
        BadValue(key, text, "between " + FormatValue(low) + " and " + FormatValue(high));
      }
    }
    at(*settings) = value;
  };
  entry.get = [at](const Settings& settings) { return FormatValue<T>(at(const_cast<Settings&>(settings))); };
  entry.key = std::move(key);
  entry.help = std::move(help);
  return entry;
}

/// A text that must be one of `choices`.
template <typename Access>
Entry MakeChoice(std::string key, std::string help, Access at, std::vector<std::string> choices) {
  Entry entry = Make(key, std::move(help), at);
  entry.set = [key, at, choices](std::string_view text, Settings* settings) {
    if (std::find(choices.begin(), choices.end(), text) == choices.end()) {
      std::string wanted;
      for (const std::string& choice : choices) wanted += (wanted.empty() ? "'" : " or '") + choice + "'";
      BadValue(key, text, wanted);
    }
    at(*settings) = std::string(text);
  };
  return entry;
}

std::vector<Entry> GeneralEntries() {
  return {
      Make(
          "seed", "seed of everything random", [](Settings & s) -> auto& { return s.seed; }),
      Make(
          "features.count", "features per frame",
          [](Settings & s) -> auto& { return s.extractor.num_features; }, 50, 10000),
      Make(
          "features.levels", "levels of the image pyramid",
          [](Settings & s) -> auto& { return s.extractor.pyramid.levels; }, 1, 16),
      Make(
          "features.scale_factor", "between two levels",
          [](Settings & s) -> auto& { return s.extractor.pyramid.scale_factor; }, 1.05, 2),
      Make(
          "features.fast_threshold", "least contrast of a corner [grey values]",
          [](Settings & s) -> auto& { return s.extractor.fast_threshold; }, 1, 254),
      Make(
          "features.min_fast_threshold", "the same where there is no such corner",
          [](Settings & s) -> auto& { return s.extractor.min_fast_threshold; }, 1, 254),
      Make(
          "loop.enabled", "close loops", [](Settings & s) -> auto& { return s.loop.enabled; }),
      Make(
          "map.saved", "the run begins in the map that the mapper loads (--map)",
          [](Settings & s) -> auto& { return s.start.saved_map; }),
      Make(
          "map.localize_only", "nothing changes that map",
          [](Settings & s) -> auto& { return s.start.localize_only; }),
  };
}

std::vector<Entry> LoopEntries() {
  return {
      Make(
          "loop.consistency", "keyframes in a row that must name places that belong together",
          [](Settings & s) -> auto& { return s.loop.consistency; }, 1, 100),
      Make(
          "loop.min_matches", "landmarks of a place that must be found in the keyframe",
          [](Settings & s) -> auto& { return s.loop.min_matches; }, 10, 10000),
      Make(
          "loop.min_share", "of what should be seen of a place: enough to be followed",
          [](Settings & s) -> auto& { return s.loop.min_share; }, 0, 1),
      Make(
          "loop.min_confirmed_share", "of what should be seen of a place: enough to close the loop",
          [](Settings & s) -> auto& { return s.loop.min_confirmed_share; }, 0, 1),
      Make(
          "loop.min_proven",
          "of the landmarks found, seen for longer than people stand: fewer may be somebody who stood in two "
          "places",
          [](Settings & s) -> auto& { return s.loop.min_proven; }, 0, 10000),
      Make(
          "loop.max_drift_sigmas", "a loop that moves more than the keyframes can have drifted is refused",
          [](Settings & s) -> auto& { return s.loop.max_drift_sigmas; }, 0, 1e9),
      Make(
          "loop.confirmations", "later keyframes that must see the place again",
          [](Settings & s) -> auto& { return s.loop.confirmations; }, 1, 100),
      Make(
          "loop.global_adjustment", "adjust the whole map after a loop",
          [](Settings & s) -> auto& { return s.loop.global_adjustment; }),
  };
}

std::vector<Entry> InitializerEntries() {
  return {
      MakeChoice(
          "initializer.method", "dlrsac; arsac behind the same gates; or ransac: two frames and plain RANSAC",
          [](Settings & s) -> auto& { return s.frontend.initializer_method; }, {"dlrsac", "arsac", "ransac"}),
      Make(
          "initializer.feature_factor", "features of a frame while there is no map, times features.count",
          [](Settings & s) -> auto& { return s.frontend.initializer_feature_factor; }, 0.5, 5),
      Make(
          "initializer.min_matches", "matches a frame must have with the reference frame",
          [](Settings & s) -> auto& { return s.initializer.min_matches; }, 8, 10000),
      Make(
          "initializer.num_pairs", "pairs of frames that must agree",
          [](Settings & s) -> auto& { return s.initializer.num_pairs; }, 1, 5),
      Make(
          "initializer.min_agreement", "smallest Jaccard index of the pairs' static sets",
          [](Settings & s) -> auto& { return s.initializer.agreement.min_agreement; }, 0, 1),
      Make(
          "initializer.min_parallax_rad", "median parallax of the first map's points",
          [](Settings & s) -> auto& { return s.initializer.min_parallax_rad; }, 0, 1),
      Make(
          "initializer.min_distribution_px", "root of the static matches' distribution D",
          [](Settings & s) -> auto& { return s.initializer.agreement.min_distribution_px; }, 0, 10000),
      Make(
          "initializer.cell_px", "side of DLRSAC's cells",
          [](Settings & s) -> auto& { return s.initializer.selector.cell_px; }, 16, 4096),
      Make(
          "initializer.min_cell_matches", "matches that a cell needs",
          [](Settings & s) -> auto& { return s.initializer.selector.min_cell_matches; }, 8, 10000),
      Make(
          "initializer.couple_threshold", "share of a cell's inliers that couples it",
          [](Settings & s) -> auto& { return s.initializer.selector.couple_threshold; }, 0, 1),
  };
}

std::vector<Entry> TrackingEntries() {
  return {
      Make(
          "tracking.motion_belief", "landmarks that are believed to move have no vote",
          [](Settings & s) -> auto& { return s.frontend.tracking.dynamics.vote.motion_belief; }),
      Make(
          "tracking.motion_radius_px", "search around the motion model's prediction",
          [](Settings & s) -> auto& { return s.frontend.tracking.motion_radius_px; }, 1, 200),
      Make(
          "tracking.min_inliers", "fewer static inliers: the frame is not tracked",
          [](Settings & s) -> auto& { return s.frontend.tracking.min_local_inliers; }, 6, 10000),
      Make(
          "tracking.hidden_distance",
          "descriptor distance allowed where nothing of the map is found around [bits]",
          [](Settings & s) -> auto& { return s.frontend.tracking.dynamics.hidden.distance; }, 0, 256),
      Make(
          "tracking.hidden_distance_slope",
          "more of it, times the share of the map that is found around [bits]",
          [](Settings & s) -> auto& { return s.frontend.tracking.dynamics.hidden.distance_slope; }, 0, 10000),
      Make(
          "tracking.young_trust", "weight of a landmark that was just made",
          [](Settings & s) -> auto& { return s.frontend.tracking.dynamics.vote.young_trust; }, 0, 1),
      Make(
          "tracking.trusted_age_s", "age at which a landmark has full weight",
          [](Settings & s) -> auto& { return s.frontend.tracking.dynamics.vote.trusted_age_s; }, 0, 1000),
      Make(
          "tracking.smooth_at_end",
          "the poses told at the end: landmarks placed by all frames, weak frames looked for from the "
          "motion, and joined with it",
          [](Settings & s) -> auto& { return s.frontend.smooth_at_end; }),
      Make(
          "tracking.max_local_keyframes", "keyframes whose landmarks are searched for",
          [](Settings & s) -> auto& { return s.frontend.tracking.max_local_keyframes; }, 1, 1000),
      Make(
          "tracking.trial_s", "time for which a first map must predict the frames",
          [](Settings & s) -> auto& { return s.frontend.trial_s; }, 0, 60),
      Make(
          "tracking.new_map_after_s", "lost for so long: a new map is started",
          [](Settings & s) -> auto& { return s.frontend.new_map_after_s; }, 0.1, 3600),
      Make(
          "keyframe.at_end",
          "frames placed when the sequence has ended become keyframes too, and the map grows to where they "
          "see",
          [](Settings & s) -> auto& { return s.frontend.keyframes_at_end; }),
      Make(
          "keyframe.max_interval_s", "at least one keyframe in this time, where it helps",
          [](Settings & s) -> auto& { return s.frontend.keyframe.max_interval_s; }, 0, 60),
      Make(
          "keyframe.min_interval_s", "no two keyframes within this time, unless tracking is weak",
          [](Settings & s) -> auto& { return s.frontend.keyframe.min_interval_s; }, 0, 60),
      Make(
          "keyframe.tracked_ratio", "of the reference's landmarks; fewer tracked asks for a keyframe",
          [](Settings & s) -> auto& { return s.frontend.keyframe.tracked_ratio; }, 0, 1),
  };
}

std::vector<Entry> MappingEntries() {
  return {
      Make(
          "mapping.mutual_exclusion",
          "Algorithm 1: one new landmark per neighbourhood, and a bound on their number",
          [](Settings & s) -> auto& { return s.mapper.creation.mutual_exclusion; }),
      Make(
          "mapping.min_depth",
          "nearer to a keyframe than this share of what it sees in the median, a landmark goes at the end",
          [](Settings & s) -> auto& { return s.mapper.min_depth; }, 0, 1),
      Make(
          "mapping.neighbourhood_px", "half the side of the neighbourhood",
          [](Settings & s) -> auto& { return s.mapper.creation.neighbourhood_px; }, 0, 1000),
      Make(
          "mapping.alpha", "bound on the candidates, as a share of the tracked landmarks",
          [](Settings & s) -> auto& { return s.mapper.creation.alpha; }, 0, 100),
      Make(
          "mapping.min_candidates", "candidates that are always allowed",
          [](Settings & s) -> auto& { return s.mapper.creation.min_candidates; }, 0, 10000),
      Make(
          "mapping.confirmed_views",
          "points seen in so many views for a second are free of the bound and the neighbourhood; 0: none",
          [](Settings & s) -> auto& { return s.mapper.creation.confirmed_views; }, 0, 100),
      Make(
          "mapping.seen_through", "landmarks go that other keyframes see through (people who stood)",
          [](Settings & s) -> auto& { return s.mapper.seen_through.enabled; }),
      Make(
          "mapping.local_keyframes", "keyframes adjusted at a time",
          [](Settings & s) -> auto& { return s.mapper.local_keyframes; }, 2, 1000),
      Make(
          "mapping.redundant_share", "a keyframe goes when so much of it is seen by three others",
          [](Settings & s) -> auto& { return s.mapper.redundant_share; }, 0, 1),
      Make(
          "mapping.belief_found_step", "log odds taken by a frame that finds a landmark in its place",
          [](Settings & s) -> auto& { return s.mapper.belief.found_step; }, 0, 10),
      Make(
          "mapping.belief_moved_step", "log odds added by a frame that finds it elsewhere",
          [](Settings & s) -> auto& { return s.mapper.belief.moved_step; }, 0, 10),
      Make(
          "mapping.belief_remove_above", "log odds at which a landmark leaves the map",
          [](Settings & s) -> auto& { return s.mapper.belief.remove_above; }, 0, 100),
  };
}

std::vector<Entry> AllEntries() {
  std::vector<Entry> entries = GeneralEntries();
  for (auto* make : {&InitializerEntries, &TrackingEntries, &MappingEntries, &LoopEntries}) {
    for (Entry& entry : make()) entries.push_back(std::move(entry));
  }
  return entries;
}

constexpr int kKeptByBaseline = 300;  // frames without a pose

void ApplyProfile(std::string_view name, Settings* settings) {
  if (name != "dm" && name != "baseline") {
    throw InputError("setting 'profile': '" + std::string(name) + "' is not 'dm' or 'baseline'");
  }
  settings->profile = std::string(name);
  const bool dm = name == "dm";
  settings->mapper.creation.mutual_exclusion = dm;
  settings->mapper.min_depth = dm ? MapperOptions().min_depth : 0.0;
  settings->mapper.seen_through.enabled = dm;
  settings->frontend.tracking.dynamics.vote.motion_belief = dm;
  settings->frontend.smooth_at_end = dm;
  settings->frontend.keyframes_at_end = dm;
  settings->frontend.max_kept_frames = dm ? FrontendOptions().max_kept_frames : kKeptByBaseline;
  settings->frontend.initializer_method = dm ? "dlrsac" : "ransac";
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

std::string NearestKey(const std::vector<Entry>& entries, std::string_view key) {
  const auto nearest = std::min_element(entries.begin(), entries.end(), [&](const Entry& a, const Entry& b) {
    return EditDistance(a.key, key) < EditDistance(b.key, key);
  });
  return nearest->key;
}

void ApplyYaml(const YAML::Node& node, const std::string& prefix, const std::string& path,
               Settings* settings) {
  for (const auto& item : node) {
    const std::string key = prefix + item.first.as<std::string>();
    if (item.second.IsMap()) {
      ApplyYaml(item.second, key + ".", path, settings);
    } else if (item.second.IsScalar()) {
      try {
        ApplySetting(key, item.second.as<std::string>(), settings);
      } catch (const InputError& error) {
        throw InputError(path + ": " + error.what());
      }
    } else {
      throw InputError(path + ": setting '" + key + "' is neither a value nor a section; write 'key: value'");
    }
  }
}

}  // namespace

void ApplySetting(std::string_view key, std::string_view value, Settings* settings) {
  if (key == "profile") return ApplyProfile(value, settings);
  const std::vector<Entry> entries = AllEntries();
  for (const Entry& entry : entries) {
    if (entry.key != key) continue;
    entry.set(value, settings);
    settings->mapper.belief.enabled = settings->frontend.tracking.dynamics.vote.motion_belief;
    return;
  }
  throw InputError("setting '" + std::string(key) + "' does not exist; did you mean '" +
                   NearestKey(entries, key) + "'? (docs/configuration.md lists all)");
}

Settings LoadSettings(const std::string& path, const std::vector<std::string>& overrides) {
  Settings settings;
  if (!path.empty()) {
    try {
      const YAML::Node node = YAML::LoadFile(path);
      if (!node.IsMap() && !node.IsNull())
        throw InputError(path + ": is not a map of settings; write 'key: value' lines");
      if (node["profile"]) ApplySetting("profile", node["profile"].as<std::string>(""), &settings);
      ApplyYaml(node, "", path, &settings);
    } catch (const YAML::BadFile&) {
      throw InputError(path + ": cannot be read; check the path given with --config");
    } catch (const YAML::Exception& error) {
      throw InputError(path + ": is not valid YAML (" + error.what() + ")");
    }
  }
  for (const std::string& text : overrides) {
    const size_t equals = text.find('=');
    if (equals == std::string::npos) throw InputError("--set " + text + ": write key=value");
    ApplySetting(text.substr(0, equals), text.substr(equals + 1), &settings);
  }
  settings.mapper.belief.enabled = settings.frontend.tracking.dynamics.vote.motion_belief;
  return settings;
}

std::vector<SettingInfo> ListSettings(const Settings& settings) {
  std::vector<SettingInfo> list = {{"profile", settings.profile, "dm or baseline: sets several at once"}};
  for (const Entry& entry : AllEntries()) list.push_back({entry.key, entry.get(settings), entry.help});
  return list;
}

uint64_t SettingsHash(const Settings& settings) {
  uint64_t hash = 0;
  for (const SettingInfo& info : ListSettings(settings))
    hash = DeriveSeed(hash, 0, info.key + "=" + info.value);
  return hash;
}

}  // namespace dmslam
