#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/messaging/bus_key.h"
#include "dmslam/recording/map_file.h"

namespace dmslam {

/// A saved map, or the map of a run's log, that stands for itself: nothing of it is missing.
struct WholeMap {
  std::string path;
  RebuiltMap rebuilt;
  const Map& map() const { return rebuilt.map; }
};

/// Throws InputError, which names the file, where it is no map or not a whole one.
WholeMap OpenWhole(const std::string& path, const std::optional<BusKey>& key);

/// Why `a` and `b` are not to be joined, whatever they show: another camera, another pyramid, or a session
/// that both have (unless `renumber`). Throws InputError that names both.
void CheckMayJoin(const WholeMap& a, const WholeMap& b, bool renumber);

/// What is in the file: a line about the file, and one about each of its maps. With a newline at the end.
std::string Listing(const std::string& path, const Map& map, const SessionStart& session);

struct MergeArguments {
  std::string a, b, save;
  std::string vocabulary, config;
  std::vector<std::string> overrides;
  bool renumber = false;  ///< sessions that both have get other numbers in `b`
  bool apart = false;     ///< what does not see the same place stays apart, in one file
};

// The commands. Each prints what it found, and returns the exit code. Throw InputError.

int ListMaps(const std::string& path, const std::optional<BusKey>& key);
/// 1: `a` and `b` do not see the same place; nothing is written, unless they may stay apart. Throws
/// MisfitError where one of them was made with another vocabulary.
int MergeMaps(const MergeArguments& arguments, const std::optional<BusKey>& key);
/// As diff(1): 0 where they are equal, 1 where they differ: in what is in them, or in camera, pyramid or
/// vocabulary.
int DiffMaps(const std::string& a, const std::string& b, const std::optional<BusKey>& key);
/// Writes PREFIX and its number and ".map" for each of the maps.
int SplitMaps(const std::string& path, const std::string& prefix, const std::optional<BusKey>& key);

}  // namespace dmslam
