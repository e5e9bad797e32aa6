#pragma once

#include <cstdint>
#include <map>
#include <set>

#include "dmslam/map/replica.h"

namespace dmslam {

/// Other names for the things of a map, so that it can stand in one file with another map. What is not listed
/// keeps its name.
struct Renumbering {
  std::map<uint32_t, uint32_t> sessions;  ///< of keyframes
  std::map<uint16_t, uint16_t> ordinals;  ///< of landmarks
  std::map<MapId, MapId> maps;
};

/// The sessions whose keyframes a map knows, living or culled.
std::set<uint32_t> SessionsOf(const Map& map);
/// The ordinals of the epochs whose landmarks a map knows, living or dead.
std::set<uint16_t> OrdinalsOf(const Map& map);
/// The session in which each epoch's living landmarks were made. Their ages count from a keyframe of it, or
/// of an earlier session where they have taken in a landmark of that one: it is the last of these sessions.
std::map<uint16_t, uint32_t> SessionsByOrdinal(const Map& map);
/// The numbers of the maps that have keyframes.
std::set<MapId> MapsOf(const Map& map);

/// What `b` is to be called beside `a`: its ordinals and its maps come behind those of `a`. Its sessions stay
/// as they are, unless `sessions_too`: then those that `a` has as well come behind the highest of both, and
/// so do the later ones of `b`, since the order of sessions is that of time. Throws InputError where there
/// are no ordinals left.
Renumbering NamesBeside(const Map& a, const Map& b, bool sessions_too);

/// The same delta with other names.
MapDelta Renumbered(MapDelta delta, const Renumbering& names);

/// `a` and `b` under their new names, side by side: nothing joins them. Camera and pyramid are those of `a`.
Replica Beside(const Map& a, const Map& b, const Renumbering& names_of_b);

/// One map of those in `map`, with all that is its own.
Replica OnlyMap(const Map& map, MapId map_id);

}  // namespace dmslam
