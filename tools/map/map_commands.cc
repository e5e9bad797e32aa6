#include "map_commands.h"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <iterator>
#include <map>
#include <memory>
#include <set>
#include <utility>

#include "dmslam/console/log.h"
#include "dmslam/map/map_difference.h"
#include "dmslam/map/renumbering.h"
#include "dmslam/place_recognition/vocabulary.h"
#include "dmslam/runtime/load_vocabulary.h"
#include "dmslam/settings/settings.h"
#include "dmslam/slam/map_merge.h"
#include "dmslam/util/check.h"
#include "dmslam/util/output_file.h"
#include "text.h"

namespace dmslam {
namespace {

double Seconds(int64_t ns) { return static_cast<double>(ns) * 1e-9; }

/// Of those that had a part in the map: their keyframes are in it, or were the first to see its landmarks.
SessionRuns RunsIn(const Map& map, const SessionRuns& runs) {
  std::set<uint32_t> sessions = SessionsOf(map);
  for (const LandmarkId id : map.LandmarkIdsSorted()) sessions.insert(map.At(id).first_keyframe.session());
  SessionRuns there;
  for (const uint32_t session : sessions) {
    if (const auto run = runs.find(session); run != runs.end()) there.insert(*run);
  }
  return there;
}

/// How a file that holds `map` begins: as the run does of which all of it is, if there is only one. What is
/// of several runs has the seed and settings of none. `start`: of the file of which it was taken.
SessionStart StartOf(SessionStart start, const Map& map, const SessionRuns& runs) {
  if (runs.size() == 1 && SessionsOf(map) == std::set{runs.begin()->first}) return runs.begin()->second;
  start.session = NewestSession(map);
  start.seed = start.configuration_hash = 0;
  start.profile.clear();
  return start;
}

std::string LineOf(const Map& map, MapId map_id) {
  const std::vector<const Keyframe*> keyframes = map.KeyframesOf(map_id);
  std::map<uint32_t, size_t> sessions;
  int64_t first_ns = INT64_MAX, last_ns = INT64_MIN;
  for (const Keyframe* keyframe : keyframes) {
    ++sessions[keyframe->id.session()];
    first_ns = std::min(first_ns, keyframe->stamp_ns);
    last_ns = std::max(last_ns, keyframe->stamp_ns);
  }
  std::string line = Format("map %-8u %6zu keyframes %8zu landmarks  %.3f to %.3f (%.1f s)", map_id,
                            keyframes.size(), map.LandmarksOf(map_id).size(), Seconds(first_ns),
                            Seconds(last_ns), Seconds(last_ns - first_ns));
  for (const auto& [session, count] : sessions) line += Format("  session %u: %zu", session, count);
  return line + "\n";
}

MapMergeOptions OptionsOf(const MergeArguments& arguments) {
  const Settings settings = LoadSettings(arguments.config, arguments.overrides);
  MapMergeOptions options;
  options.mapper = settings.Read<MapperOptions>();
  options.loop = settings.Read<LoopcloserOptions>();
  return options;
}

/// Says what is being done where it takes long.
class Progress {
 public:
  void operator()(const std::string& what, size_t done, size_t of) {
    const auto now = std::chrono::steady_clock::now();
    if (now - said_ < std::chrono::seconds(3)) return;
    said_ = now;
    LogInfo("{}: {} of {} keyframes", what, done, of);
  }

 private:
  std::chrono::steady_clock::time_point said_ = std::chrono::steady_clock::now();
};

/// What the two files say of their runs.
SessionRuns RunsOfBoth(const WholeMap& a, const WholeMap& b, const Renumbering& names_of_b) {
  SessionRuns runs = a.rebuilt.runs;
  for (const auto& [session, run] : b.rebuilt.runs) {
    const auto renamed = names_of_b.sessions.find(session);
    const uint32_t named = renamed == names_of_b.sessions.end() ? session : renamed->second;
    runs.insert_or_assign(named, run).first->second.session = named;
  }
  return runs;
}

/// `start`: of the file of which the map was taken.
void Save(const std::string& path, const Map& map, const SessionStart& start, const SessionRuns& known) {
  const SessionRuns runs = RunsIn(map, known);
  const SessionStart session = StartOf(start, map, runs);
  SaveMap(path, map, session, runs);
  std::fputs(Listing(path, map, session).c_str(), stdout);
}

/// Frames of both files may have one number.
void PrintWeld(const MapMergeReport::Weld& weld, const std::string& a, const std::string& b) {
  const auto file = [&](const MapMergeReport::Weld::End& end) { return (end.of_b ? b : a).c_str(); };
  std::printf("joined: frame %u of %s and frame %u of %s: %s\n", weld.keyframe.frame_index,
              file(weld.keyframe), weld.place.frame_index, file(weld.place), weld.note.c_str());
}

// ---- The difference ----

template <typename Id>
std::string CountsOf(const char* name, const NamesApart<Id>& names) {
  return Format("%-11s %8zu only in A  %8zu only in B  %8zu in both", name, names.only_a.size(),
                names.only_b.size(), names.both);
}

void PrintKeyframes(const char* mark, const std::vector<KeyframeId>& ids) {
  constexpr size_t kPerLine = 16;
  size_t on_line = 0;
  uint32_t session = 0;
  for (const KeyframeId id : ids) {
    if (id.session() != session || on_line == kPerLine) {
      std::printf("%s%s session %u frames", session == 0 ? "" : "\n", mark, id.session());
      session = id.session();
      on_line = 0;
    }
    std::printf(" %u", id.frame_index());
    ++on_line;
  }
  if (!ids.empty()) std::printf("\n");
}

std::string DisplacementText(const char* name, const Displacement& displacement, size_t of) {
  return Format("  %-9s %zu of %zu moved, median %.5f, largest %.5f of the depth\n", name, displacement.moved,
                of, displacement.median_depths, displacement.max_depths);
}

void PrintCommon(const CommonMap& common) {
  std::printf("map %u of A is in map %u of B", common.a, common.b);
  if (common.S_b_a) {
    const Eigen::Vector3d& t = common.S_b_a->translation;
    std::printf("; as a whole it is scaled by %.5f, turned by %.5f rad, shifted by (%.5f %.5f %.5f)",
                common.S_b_a->scale, LogSo3(common.S_b_a->rotation).norm(), t.x(), t.y(), t.z());
  }
  std::printf("\n%s%s", DisplacementText("keyframes", common.cameras, common.keyframes).c_str(),
              DisplacementText("landmarks", common.points, common.landmarks).c_str());
}

/// What two maps were made with, where that differs: a line each, "camera  fx 500 in A  fx 510 in B".
std::string MadeApart(const SessionStart& a, const SessionStart& b) {
  std::string text;
  const auto add = [&text](const char* what, const std::string& in_a, const std::string& in_b) {
    text += Format("%-11s %s in A  %s in B\n", what, in_a.c_str(), in_b.c_str());
  };
  if (const auto differ = FirstDifference(a.camera, b.camera)) add("camera", differ->a, differ->b);
  const auto pyramid = [](const SessionStart& made) {
    return Format("levels=%d scale_factor=%g", made.pyramid.levels, made.pyramid.scale_factor);
  };
  if (pyramid(a) != pyramid(b)) add("features", pyramid(a), pyramid(b));
  const auto &words_a = a.vocabulary_checksum, &words_b = b.vocabulary_checksum;
  if (words_a && words_b && words_a != words_b) add("vocabulary", Hex(*words_a), Hex(*words_b));
  return text;
}

/// The sessions of both of which it is known that they are other runs, a line each.
std::string RunsApart(const SessionRuns& a, const SessionRuns& b, std::set<uint32_t>* other_runs) {
  std::string text;
  const auto named = [](const SessionStart& run) {
    return Format("seed %llu, configuration %s, sequence ", static_cast<unsigned long long>(run.seed),
                  Hex(run.configuration_hash).c_str()) +
           run.sequence;
  };
  for (const auto& [session, run] : a) {
    const auto other = b.find(session);
    if (other == b.end() || named(run) == named(other->second)) continue;
    other_runs->insert(session);
    text += Format("session %u is another run in each: ", session) + named(run) + " in A; " +
            named(other->second) + " in B\n";
  }
  return text;
}

/// Sessions that are other runs by what is in the maps, a line each.
std::string SeenApart(const MapDifference& difference) {
  std::string text;
  for (const auto& [session, why] : difference.other_runs) {
    if (why == OtherRun::kNoKeyframe)
      text += Format("session %u: neither has a keyframe of the other one's; its numbers are not compared\n",
                     session);
    if (why == OtherRun::kOtherLandmarks)
      text += Format("session %u is another run in each: other frames see the landmarks of one number\n",
                     session);
    if (why != OtherRun::kOtherTimes) continue;
    const auto first = std::ranges::find(difference.other_times, session,
                                         [](const OtherTime& time) { return time.id.session(); });
    text += Format("session %u is another run in each: its frame %u was taken at %.6f in A, at %.6f in B\n",
                   session, first->id.frame_index(), Seconds(first->in_a_ns), Seconds(first->in_b_ns));
  }
  return text;
}

void Print(const MapDifference& difference) {
  if (difference.NothingInCommon())
    std::printf(
        "A and B have nothing in common: none of the keyframes and landmarks of one is in the other\n");
  std::printf("%s\n", CountsOf("maps", difference.maps).c_str());
  std::printf("%s, %zu of them with other links\n", CountsOf("keyframes", difference.keyframes).c_str(),
              difference.changed_keyframes);
  std::printf("%s, %zu of them with another history", CountsOf("landmarks", difference.landmarks).c_str(),
              difference.changed_landmarks);
  if (difference.renumbered_landmarks > 0)
    std::printf(", %zu by another ordinal", difference.renumbered_landmarks);
  std::printf("\n");
  if (difference.NothingInCommon()) return;
  PrintKeyframes("<", difference.keyframes.only_a);
  PrintKeyframes(">", difference.keyframes.only_b);
  for (const CommonMap& common : difference.common) PrintCommon(common);
}

}  // namespace

WholeMap OpenWhole(const std::string& path, const std::optional<BusKey>& key) {
  WholeMap whole{path, LoadMap(path, key)};
  if (whole.rebuilt.missing > 0) {
    throw InputError(path + ": is not whole: " + std::to_string(whole.rebuilt.missing) +
                     " map records are missing; what is there is taken with dmslam-map --log " + path +
                     " --save FILE");
  }
  if (whole.rebuilt.skipped > 0) {
    LogWarning("{}: {} references in it lead to keyframes or landmarks that it does not hold; left out", path,
               whole.rebuilt.skipped);
  }
  return whole;
}

void CheckMayJoin(const WholeMap& a, const WholeMap& b, bool renumber) {
  const std::string both = a.path + " and " + b.path + ": ";
  if (const auto differ = FirstDifference(a.map().camera(), b.map().camera())) {
    throw InputError(both + "were made with different cameras: " + differ->a + " and " + differ->b +
                     "; join maps of one camera file");
  }
  const Pyramid &of_a = a.map().pyramid(), &of_b = b.map().pyramid();
  if (of_a.levels != of_b.levels || of_a.scale_factor != of_b.scale_factor)
    throw InputError(both + "were made with other features.levels or features.scale_factor");
  const auto &words_a = a.rebuilt.session.vocabulary_checksum,
             &words_b = b.rebuilt.session.vocabulary_checksum;
  if (words_a && words_b && *words_a != *words_b) {
    throw MisfitError(both + "were made with different vocabularies (checksums " + Hex(*words_a) + " and " +
                      Hex(*words_b) +
                      "), and can never be joined: make one of them anew, with the vocabulary of the other");
  }
  const std::set<uint32_t> sessions_a = SessionsOf(a.map()), sessions_b = SessionsOf(b.map());
  std::vector<uint32_t> common;
  std::ranges::set_intersection(sessions_a, sessions_b, std::back_inserter(common));
  if (!common.empty() && !renumber) {
    throw InputError(
        both + "both hold session " + Listed(common) +
        "; where these are different runs, or parts of one, --renumber gives those of the second "
        "file another number");
  }
}

std::string Listing(const std::string& path, const Map& map, const SessionStart& session) {
  const std::set<MapId> maps = MapsOf(map);
  std::string text = Format("%s: %zu map%s, sessions %s, vocabulary %s, sequence %s\n", path.c_str(),
                            maps.size(), maps.size() == 1 ? "" : "s", Listed(SessionsOf(map)).c_str(),
                            session.vocabulary_checksum ? Hex(*session.vocabulary_checksum).c_str() : "none",
                            session.sequence.c_str());
  for (const MapId map_id : maps) text += LineOf(map, map_id);
  return text;
}

int ListMaps(const std::string& path, const std::optional<BusKey>& key) {
  const RebuiltMap rebuilt = LoadMap(path, key);
  if (rebuilt.missing > 0) LogWarning("{}: {} map records are missing", path, rebuilt.missing);
  if (!rebuilt.ended && !LogIndex(path, key).Session().IsSavedMap())
    LogWarning("{}: the log ends before its run did; the map is that of this time", path);
  std::fputs(Listing(path, rebuilt.map, rebuilt.session).c_str(), stdout);
  return 0;
}

int MergeMaps(const MergeArguments& arguments, const std::optional<BusKey>& key) {
  CheckFolderOf(arguments.save);
  const WholeMap a = OpenWhole(arguments.a, key), b = OpenWhole(arguments.b, key);
  CheckMayJoin(a, b, arguments.renumber);
  const std::shared_ptr<const Vocabulary> vocabulary = LoadVocabulary(arguments.vocabulary);
  for (const WholeMap* map : {&a, &b})
    CheckVocabulary(map->path, map->rebuilt.session, vocabulary->checksum());
  const Renumbering names = NamesBeside(a.map(), b.map(), arguments.renumber);
  MapMerge merge(a.map(), b.map(), names, OptionsOf(arguments));
  const MapMergeReport report = merge.Run(vocabulary, Progress());
  if (!report.joined && !arguments.apart) {
    LogError(
        "{} and {}: do not show the same place: of {} keyframes {} places looked alike, {} of them held in "
        "part, none well enough to join the maps; nothing is written (--apart keeps both in one file)",
        a.path, b.path, report.keyframes_asked, report.places_tried, report.places_proposed);
    return 1;
  }
  for (const auto& [session, number] : names.sessions)
    std::printf("session %u of %s is called %u\n", session, b.path.c_str(), number);
  for (const MapMergeReport::Weld& weld : report.welds) PrintWeld(weld, a.path, b.path);
  if (report.joined)
    std::printf("fused: %lld landmarks, %lld new observations, beside those of the welds\n",
                static_cast<long long>(report.fused.landmarks),
                static_cast<long long>(report.fused.observations));
  SessionStart start = a.rebuilt.session;
  start.sequence += " + " + b.rebuilt.session.sequence;
  Save(arguments.save, merge.map(), start, RunsOfBoth(a, b, names));
  return 0;
}

int DiffMaps(const std::string& path_a, const std::string& path_b, const std::optional<BusKey>& key) {
  const WholeMap a = OpenWhole(path_a, key), b = OpenWhole(path_b, key);
  std::set<uint32_t> other_runs;
  const std::string runs_apart = RunsApart(a.rebuilt.runs, b.rebuilt.runs, &other_runs);
  const MapDifference difference = Compare(a.map(), b.map(), other_runs);
  const std::string made_apart = MadeApart(a.rebuilt.session, b.rebuilt.session);
  if (difference.Equal() && made_apart.empty()) return 0;
  std::printf("A: %sB: %s", Listing(a.path, a.map(), a.rebuilt.session).c_str(),
              Listing(b.path, b.map(), b.rebuilt.session).c_str());
  std::fputs((made_apart + runs_apart + SeenApart(difference)).c_str(), stdout);
  Print(difference);
  return 1;
}

int SplitMaps(const std::string& path, const std::string& prefix, const std::optional<BusKey>& key) {
  CheckFolderOf(prefix + "1.map");
  const WholeMap whole = OpenWhole(path, key);
  const std::set<MapId> maps = MapsOf(whole.map());
  if (maps.size() == 1)
    throw InputError(path + ": holds one map, number " + Listed(maps) + "; there is nothing to split");
  for (const MapId map_id : maps) {
    const Replica only = OnlyMap(whole.map(), map_id);
    Save(prefix + std::to_string(map_id) + ".map", only, whole.rebuilt.session, whole.rebuilt.runs);
  }
  return 0;
}

}  // namespace dmslam
