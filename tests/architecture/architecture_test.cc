// The direction between rooms, read from the includes: who may use whom, and where third-party libraries may
// appear.

#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <map>
#include <regex>
#include <set>
#include <string>
#include <vector>

namespace {

namespace fs = std::filesystem;
using Names = std::set<std::string>;

/// The rooms that a room may use besides itself.
const std::map<std::string, Names>& AllowedRooms() {
  static const std::map<std::string, Names> allowed = [] {
    std::map<std::string, Names> a;
    a["util"] = a["console"] = {};
    a["geometry"] = {"util"};
    a["camera"] = a["robust"] = {"util", "geometry"};
    a["features"] = {"util", "geometry", "camera", "robust"};
    a["motion_segmentation"] = a["map"] = {"util", "geometry", "camera", "robust", "features"};
    a["triangulation"] = {"util", "geometry", "camera", "features", "map"};
    a["dynamics"] = {"util", "geometry", "camera", "features", "map"};
    a["optimization"] =
        a["place_recognition"] = {"util", "geometry", "camera", "robust", "features", "map", "dynamics"};
    const Names heart = {
        "util",         "geometry",          "camera",       "robust", "features", "map", "dynamics",
        "optimization", "place_recognition", "triangulation"};
    const auto above = [](Names below, const Names& more) {
      below.insert(more.begin(), more.end());
      return below;
    };
    a["mapping"] = a["loops"] = heart;
    a["tracking"] = a["initialization"] = above(heart, {"motion_segmentation"});
    a["refinement"] = above(heart, {"tracking"});
    a["slam"] = above(heart, {"motion_segmentation", "initialization", "tracking", "refinement", "mapping",
                              "loops", "dataset"});
    a["settings"] = above(a["slam"], {"slam"});
    a["dataset"] = {"util", "geometry", "camera"};
    a["synthetic"] = a["evaluation"] = {"util", "geometry", "camera", "dataset"};
    a["messaging"] = {"util"};
    a["wire"] = {"util", "geometry", "camera", "features", "map", "messaging"};
    a["runtime"] = {"util", "console",           "geometry", "camera",    "features",
                    "map",  "place_recognition", "settings", "messaging", "wire"};
    a["recording"] = {"util", "geometry", "camera", "features", "map", "dataset", "messaging", "wire"};
    return a;
  }();
  return allowed;
}

struct Include {
  std::string file;  ///< relative to the project
  int line = 0;
  std::string target;  ///< as written between the quotes or brackets
};

fs::path SourceDir() {
  const char* dir = std::getenv("DMSLAM_SOURCE_DIR");
  return dir != nullptr ? fs::path(dir) : fs::current_path();
}

bool IsSource(const fs::path& path) {
  return path.extension() == ".h" || path.extension() == ".cc" || path.extension() == ".cpp" ||
         path.extension() == ".hpp";
}

std::vector<Include> ReadIncludes(const std::string& text, const std::string& file) {
  static const std::regex pattern(R"re(^\s*#\s*include\s*[<"]([^>"]+)[>"])re");
  std::vector<Include> includes;
  std::istringstream lines(text);
  int number = 0;
  for (std::string line; std::getline(lines, line);) {
    ++number;
    std::smatch match;
    if (std::regex_search(line, match, pattern)) includes.push_back({file, number, match[1]});
  }
  return includes;
}

/// Sources and headers below a folder, by their paths relative to the project.
std::map<std::string, std::string> TextsOf(const std::string& folder) {
  std::map<std::string, std::string> texts;
  if (!fs::is_directory(SourceDir() / folder)) return texts;
  for (const fs::directory_entry& entry : fs::recursive_directory_iterator(SourceDir() / folder)) {
    if (!entry.is_regular_file() || !IsSource(entry.path())) continue;
    std::ifstream stream(entry.path());
    texts[fs::relative(entry.path(), SourceDir()).string()] = {std::istreambuf_iterator<char>(stream), {}};
  }
  return texts;
}

std::vector<Include> ReadFolder(const std::string& folder) {
  std::vector<Include> all;
  for (const auto& [file, text] : TextsOf(folder)) {
    const std::vector<Include> found = ReadIncludes(text, file);
    all.insert(all.end(), found.begin(), found.end());
  }
  return all;
}

/// The types that a header defines in namespace dmslam itself; clang-format leaves them in the first column.
Names TypesOf(const std::string& header) {
  static const std::regex type(R"(^(?:struct|class|enum|enum class) (\w+)(?: final)?(?: :.*)? \{.*)");
  Names types;
  bool own = false;
  std::istringstream lines(header);
  for (std::string line; std::getline(lines, line);) {
    std::smatch match;
    if (line.rfind("namespace ", 0) == 0) own = line == "namespace dmslam {";
    if (own && std::regex_match(line, match, type)) types.insert(match[1]);
  }
  return types;
}

bool StartsWith(const std::string& text, const std::string& start) { return text.rfind(start, 0) == 0; }
bool EndsWith(const std::string& text, const std::string& end) {
  return text.size() >= end.size() && text.compare(text.size() - end.size(), end.size(), end) == 0;
}

/// "geometry" of "src/dmslam/geometry/rigid3.h" and of "dmslam/geometry/rigid3.h"; empty for other paths.
std::string RoomOf(const std::string& path) {
  static const std::regex pattern(R"(^(?:src/)?dmslam/([a-z_0-9]+)/)");
  std::smatch match;
  return std::regex_search(path, match, pattern) ? match[1].str() : "";
}

std::string FileName(const std::string& path) { return fs::path(path).filename().string(); }

/// Why an include of a room is an arrow in the wrong direction; empty where it is not.
std::string Upward(const Include& include) {
  const std::string room = RoomOf(include.file);
  const auto allowed = AllowedRooms().find(room);
  if (allowed == AllowedRooms().end()) return "the room '" + room + "' has no place in the order";
  const std::string used = RoomOf(include.target);
  if (used.empty() || used == room || allowed->second.count(used) > 0) return "";
  return room + " may not use " + used;
}

/// Why a third-party header may not be included here; empty where it may.
std::string Misplaced(const Include& include) {
  const std::string room = RoomOf(include.file);
  const std::string& target = include.target;
  if (StartsWith(target, "ceres/")) {
    if (room == "optimization" || (room == "geometry" && target == "ceres/tiny_solver.h")) return "";
    return "Ceres belongs to optimization";
  }
  if (StartsWith(target, "lcm/") || EndsWith(target, "_t.hpp")) {
    return room == "messaging" || room == "wire" ? ""
                                                 : "LCM and its generated types belong to messaging and wire";
  }
  if (target == "sodium.h") return room == "messaging" ? "" : "libsodium belongs to messaging";
  if (StartsWith(target, "opencv2/")) {
    const bool drawing = FileName(include.file).find("plot") != std::string::npos ||
                         FileName(include.file).find("picture") != std::string::npos ||
                         FileName(include.file).find("draw") != std::string::npos;
    if (room == "features" || room == "dataset" || drawing || StartsWith(include.file, "tools/")) return "";
    return "OpenCV belongs to features, dataset and drawing code";
  }
  return "";
}

/// The algorithms know no bus and no threads. The one way by which they use several is ForEachInParallel
/// (util/parallel.h): it waits for all, and no piece of work depends on another, so that results are the same
/// whatever the number of threads. (optimization/bundle_adjustment.cc has a task for its heap's sake alone.)
std::string NotForCores(const Include& include) {
  static const std::regex core(
      R"(^(src/dmslam/(initialization|dynamics|tracking|mapping|loops|refinement|slam)/|procs/[a-z]+/.*_core\.).*(h|cc)$)");
  if (!std::regex_search(include.file, core)) return "";
  const std::string used = RoomOf(include.target);
  if (used == "messaging" || used == "wire") return "a core knows no " + used;
  static const Names threads = {"thread", "mutex", "condition_variable", "future", "atomic"};
  return threads.count(include.target) > 0 ? "a core knows no threads" : "";
}

/// The folders of procs/, each of them a process.
Names Processes() {
  Names processes;
  for (const fs::directory_entry& entry : fs::directory_iterator(SourceDir() / "procs")) {
    if (entry.is_directory()) processes.insert(FileName(entry.path().string()));
  }
  return processes;
}

/// Processes share rooms of the library, never each other's files.
std::string Neighbour(const Include& include) {
  static const std::regex place(R"(^procs/([a-z_]+)/)");
  static const std::regex used(R"(^([a-z_]+)/[a-z_0-9]+\.h$)");
  std::smatch from, to;
  if (!std::regex_search(include.file, from, place) || !std::regex_search(include.target, to, used))
    return "";
  static const Names processes = Processes();
  if (processes.count(to[1]) == 0 || to[1] == from[1]) return "";
  return "procs/" + from[1].str() + " may not use procs/" + to[1].str();
}

using Rule = std::string (*)(const Include&);

void ExpectNone(const std::vector<Include>& includes, Rule rule) {
  for (const Include& include : includes) {
    const std::string why = rule(include);
    EXPECT_EQ(why, "") << include.file << ":" << include.line << " includes " << include.target;
  }
}

TEST(ArchitectureTest, RoomsUseOnlyRoomsBelowThem) {
  const std::vector<Include> includes = ReadFolder("src/dmslam");
  ASSERT_GT(includes.size(), 200u) << "no sources under " << SourceDir() << "; set DMSLAM_SOURCE_DIR";
  ExpectNone(includes, &Upward);
}

TEST(ArchitectureTest, TheOrderHasNoCircle) {
  for (const auto& [room, below] : AllowedRooms()) {
    for (const std::string& other : below) {
      ASSERT_TRUE(AllowedRooms().count(other)) << other;
      EXPECT_EQ(AllowedRooms().at(other).count(room), 0u) << room << " and " << other;
    }
  }
}

TEST(ArchitectureTest, ThirdPartyLibrariesStayInTheirRooms) {
  for (const char* folder : {"src", "procs", "tools"}) ExpectNone(ReadFolder(folder), &Misplaced);
}

TEST(ArchitectureTest, CoresKnowNoBusAndNoThreads) {
  for (const char* folder : {"src", "procs"}) ExpectNone(ReadFolder(folder), &NotForCores);
}

TEST(ArchitectureTest, ProcessesDoNotUseEachOther) {
  ASSERT_GE(Processes().size(), 7u);
  ExpectNone(ReadFolder("procs"), &Neighbour);
}

// Two types of one name in one program are undefined behaviour, which neither compiler nor linker reports.
TEST(ArchitectureTest, EachTypeHasANameOfItsOwn) {
  std::map<std::string, std::string> definer;
  for (const char* folder : {"src", "procs", "tools"}) {
    for (const auto& [file, text] : TextsOf(folder)) {
      if (!EndsWith(file, ".h")) continue;
      for (const std::string& type : TypesOf(text)) {
        const auto [known, is_new] = definer.emplace(type, file);
        EXPECT_TRUE(is_new) << type << " is defined in " << known->second << " and in " << file;
      }
    }
  }
  EXPECT_GT(definer.size(), 300u);
}

TEST(ArchitectureTest, RulesSeeWhatIsWrong) {
  const auto one = [](const std::string& file, const std::string& target) {
    const std::vector<Include> found = ReadIncludes("// text\n  # include \"" + target + "\"\n", file);
    EXPECT_EQ(found.size(), 1u);
    EXPECT_EQ(found.at(0).line, 2);
    return found.at(0);
  };
  EXPECT_EQ(TypesOf("namespace dmslam {\nstruct A {\n  struct Within {};\n};\nclass B final : public A {\n"),
            (Names{"A", "B"}));
  EXPECT_EQ(TypesOf("namespace dmslam::testing {\nstruct A {\n"), Names());
  EXPECT_NE(Upward(one("src/dmslam/geometry/x.cc", "dmslam/map/map.h")), "");
  EXPECT_NE(Upward(one("src/dmslam/messaging/x.cc", "dmslam/wire/codec.h")), "");
  EXPECT_NE(Upward(one("src/dmslam/unheard/x.cc", "dmslam/util/check.h")), "");
  EXPECT_EQ(Upward(one("src/dmslam/map/x.cc", "dmslam/geometry/rigid3.h")), "");
  EXPECT_NE(Misplaced(one("src/dmslam/map/x.cc", "ceres/ceres.h")), "");
  EXPECT_NE(Misplaced(one("src/dmslam/mapping/mapper_core.cc", "opencv2/core.hpp")), "");
  EXPECT_NE(Misplaced(one("procs/mapper/mapper_node.cc", "dmslam/map_record_t.hpp")), "");
  EXPECT_EQ(Misplaced(one("src/dmslam/optimization/x.cc", "ceres/ceres.h")), "");
  EXPECT_NE(NotForCores(one("src/dmslam/mapping/mapper_core.cc", "dmslam/messaging/bus.h")), "");
  EXPECT_NE(NotForCores(one("src/dmslam/slam/frontend_core.h", "thread")), "");
  EXPECT_NE(Neighbour(one("procs/frontend/frontend_node.cc", "mapper/mapper_node.h")), "");
}

}  // namespace
