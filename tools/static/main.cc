#include <algorithm>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <map>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

#include "dmslam/console/command_line.h"
#include "dmslam/dataset/frame_source.h"
#include "dmslam/map/keyframe.h"
#include "dmslam/motion_segmentation/match_frames.h"
#include "dmslam/util/build_version.h"
#include "dmslam/util/check.h"
#include "dmslam/util/machine.h"
#include "draw.h"
#include "judge.h"
#include "timing.h"

namespace dmslam {
namespace {

struct Settings {
  std::vector<std::string> images;
  std::string sequence;
  std::string camera;
  std::string gap = "auto";
  std::string method = "dlrsac";
  std::string model = "e";
  std::string out = "static";
  int pairs = 8;
  int features = 3000;
  uint64_t seed = 1;
  bool no_window = false;
  bool first_maps = false;
  bool gated = false;
};

struct JudgeSettings {
  std::string sequence;
  std::string camera;
  std::string table = "windows";
  std::string out;
  std::string json;
  std::vector<int> gaps{3, 5, 8, 12};
  std::string only;
  int count = 100;
  int window = SystemWindowOptions().frames;
  int features = 3000;
  uint64_t seed = 1;
  bool no_window = false;
};

struct TimeSettings {
  std::string sequence;
  std::string camera;
  std::string json;
  int gap = 5;
  int features = 3000;
  int matches = 1000;
  TimingOptions timing;
};

Camera ChooseCamera(const std::string& file, const std::string& sequence) {
  if (!file.empty()) return LoadCamera(file);
  if (const auto found = FindCamera(sequence, "config")) return *found;
  throw InputError("no camera is known for '" + sequence + "': give one with --camera FILE");
}

/// Of a first map; dlrsac-paper selects in single pairs only.
SelectorMethod ToSelectorMethod(const std::string& name) {
  if (name == "dlrsac") return SelectorMethod::kDlrsac;
  if (name == "arsac") return SelectorMethod::kArsac;
  if (name == "ransac") return SelectorMethod::kRansac;
  throw InputError("unknown method '" + name + "': use dlrsac, arsac or ransac");
}

nlohmann::json Describe(const StaticSelection& selection, size_t num_matches) {
  nlohmann::json json;
  json["accepted"] = selection.IsUsable();
  json["refusal"] = ToString(selection.refusal);
  json["explanation"] = selection.explanation;
  json["matches"] = num_matches;
  json["static"] = selection.num_static;
  json["distribution_px"] = selection.distribution_px;
  json["iterations"] = selection.iterations;
  return json;
}

double MedianDisplacement(const std::vector<Match>& matches) {
  std::vector<double> lengths;
  for (const Match& match : matches) lengths.push_back((match.uv1_px - match.uv0_px).norm());
  std::sort(lengths.begin(), lengths.end());
  return lengths.empty() ? 0.0 : lengths[lengths.size() / 2];
}

/// The frame that goes with `frame`: so many later, or with "auto" the first whose picture has moved by 20 px
/// while 150 matches remain (at most 24 frames later).
size_t Partner(JudgedSequence& sequence, size_t frame, const std::string& gap,
               const MatchingOptions& matching, FeatureMatcher* matcher) {
  if (gap != "auto") return frame + static_cast<size_t>(std::stoi(gap));
  size_t best = frame + 1;
  for (size_t other = frame + 2; other < std::min(sequence.size(), frame + 25); other += 2) {
    const auto matches = MatchFrames(*sequence.Features(frame), *sequence.Features(other), sequence.camera(),
                                     matching, matcher);
    if (matches.size() < 150) break;
    best = other;
    if (MedianDisplacement(matches) >= 20.0) break;
  }
  return best;
}

class Run {
 public:
  explicit Run(const Settings& settings)
      : settings_(settings),
        selector_(MakeSelector(settings.method,
                               settings.model == "f" ? ModelKind::kFundamental : ModelKind::kEssential)) {
    matching_.use_window = matching_.check_orientation = !settings.no_window;
    std::filesystem::create_directories(settings.out);
  }

  void OnImages() {
    const Camera camera = ChooseCamera(settings_.camera, settings_.images[0]);
    OrbExtractorOptions options;
    options.num_features = settings_.features;
    OrbExtractor extractor(options);
    std::vector<std::shared_ptr<const FrameFeatures>> features;
    std::vector<ColorImage> pictures;
    for (const std::string& path : settings_.images) {
      const GrayImage gray = LoadGray(path);
      CheckImageSize(path, gray, camera);
      FeatureSet set;
      extractor.Extract({gray.data.data(), gray.width, gray.height, gray.width}, &set);
      features.push_back(MakeFrameFeatures(std::move(set), camera, options.pyramid));
      EncodedImage encoded;
      encoded.bytes = ReadFileBytes(path);
      encoded.encoding = DetectEncoding(encoded.bytes);
      pictures.push_back(DecodeColor(encoded, path));
    }
    const auto matches = MatchFrames(*features[0], *features[1], camera, matching_, &matcher_);
    const StaticSelection selection = selector_->Select(matches, camera, settings_.seed);
    Write("pair", DrawSelection(pictures[0], pictures[1], matches, selection));
    Tell("pair", selection, matches.size());
    report_["pairs"].push_back(Describe(selection, matches.size()));
    Save();
  }

  void OnSequence() {
    const Camera camera = ChooseCamera(settings_.camera, settings_.sequence);
    JudgedSequence sequence(settings_.sequence, camera, settings_.features);
    const size_t reach = settings_.gap == "auto" ? 3 : static_cast<size_t>(std::stoi(settings_.gap)) + 1;
    if (sequence.size() < reach)
      throw InputError(settings_.sequence + ": fewer frames than the gap asks for");
    SelectionScore total;
    int accepted = 0;
    for (int k = 0; k < settings_.pairs; ++k) {
      const size_t frame =
          (sequence.size() - reach) * static_cast<size_t>(k) / static_cast<size_t>(settings_.pairs);
      const bool done = settings_.first_maps ? OnFirstMap(sequence, frame) : OnPair(sequence, frame, &total);
      accepted += done ? 1 : 0;
      sequence.ForgetBefore(frame);
    }
    report_["accept_rate"] = accepted / static_cast<double>(settings_.pairs);
    if (sequence.HasMasks() && !settings_.first_maps) {
      report_["precision"] = total.precision();
      report_["recall"] = total.recall();
    }
    Save();
  }

 private:
  bool OnPair(JudgedSequence& sequence, size_t frame, SelectionScore* total) {
    const size_t other = Partner(sequence, frame, settings_.gap, matching_, &matcher_);
    const auto matches = MatchFrames(*sequence.Features(frame), *sequence.Features(other), sequence.camera(),
                                     matching_, &matcher_);
    StaticSelection selection = selector_->Select(matches, sequence.camera(), settings_.seed + frame);
    const Agreement agreement =
        settings_.gated ? AskPairsBetween(sequence, frame, other, matches, &selection) : Agreement();
    const std::string name = "pair_" + std::to_string(frame) + "_" + std::to_string(other);
    Write(name, DrawSelection(sequence.Color(frame), sequence.Color(other), matches, selection));
    nlohmann::json json = Describe(selection, matches.size());
    json["frames"] = {frame, other};
    if (!agreement.IsUsable()) json["refusal"] = ToString(agreement.refusal);
    if (sequence.HasMasks() && selection.IsUsable()) {
      const SelectionScore score = ScoreSelection(sequence.Judge(frame, other, matches), selection.is_static);
      json["precision"] = score.precision();
      json["recall"] = score.recall();
      json["moving_share"] = score.moving_share();
      total->num_static += score.num_static;
      total->num_right += score.num_right;
      total->num_true += score.num_true;
      total->num_true_found += score.num_true_found;
    }
    Tell(name, selection, matches.size());
    report_["pairs"].push_back(std::move(json));
    return selection.IsUsable();
  }
  /// The gates of the initialiser: two pairs of the same first frame with frames between must call the same
  /// matches static. What not all of them call static is not.
  Agreement AskPairsBetween(JudgedSequence& sequence, size_t frame, size_t other,
                            const std::vector<Match>& matches, StaticSelection* selection) {
    std::vector<PairView> pairs;
    for (const size_t part : {size_t{1}, size_t{2}}) {
      const size_t between = frame + std::max<size_t>(1, (other - frame) * part / 3);
      PairView pair;
      pair.matches = MatchFrames(*sequence.Features(frame), *sequence.Features(between), sequence.camera(),
                                 matching_, &matcher_);
      pair.selection = selector_->Select(pair.matches, sequence.camera(), settings_.seed + frame + part);
      pairs.push_back(std::move(pair));
    }
    pairs.push_back({matches, *selection});
    std::vector<const PairView*> pointers;
    for (const PairView& pair : pairs) pointers.push_back(&pair);
    const Agreement agreement = Agree(pointers, sequence.camera(), InitializerOptions().agreement);
    selection->is_static = agreement.is_static;
    selection->num_static = agreement.num_static;
    selection->explanation = agreement.explanation;
    if (agreement.IsUsable()) return agreement;
    selection->refusal = Refusal::kNoModel;  // the report has the true reason
    selection->is_static.assign(matches.size(), 0);
    selection->num_static = 0;
    return agreement;
  }
  /// The points of the first map of an initialiser that is begun at `frame`.
  bool OnFirstMap(JudgedSequence& sequence, size_t frame) {
    InitializerOptions options;
    options.selector.sampling.kind = settings_.model == "f" ? ModelKind::kFundamental : ModelKind::kEssential;
    options.matching = matching_;
    std::map<std::string, int> waited;
    const auto found = FirstMapOf(sequence, {options, ToSelectorMethod(settings_.method)},
                                  {frame, frame, sequence.size()}, settings_.seed, &waited);
    if (!found) {
      std::cout << "from frame " << frame << ": no first map\n";
      report_["pairs"].push_back({{"first", frame}, {"accepted", false}, {"waited_for_frames", waited}});
      return false;
    }
    const FirstMap& map = found->map;
    StaticSelection selection;
    selection.is_static = MatchesWithPoint(map);
    selection.num_static = static_cast<int>(map.points.size());
    const std::string name = "map_" + std::to_string(frame) + "_" + std::to_string(map.frame0.index) + "_" +
                             std::to_string(map.frame1.index);
    Write(name, DrawSelection(sequence.Color(map.frame0.index), sequence.Color(map.frame1.index), map.matches,
                              selection));
    std::cout << name << ": " << selection.num_static << " points of " << map.matches.size() << " matches\n";
    nlohmann::json json{{"first", frame},
                        {"accepted", true},
                        {"frames", {map.frame0.index, map.frame1.index}},
                        {"matches", map.matches.size()},
                        {"points", map.points.size()},
                        {"waited_for_frames", waited}};
    if (sequence.HasMasks()) {
      const auto truth = sequence.Judge(map.frame0.index, map.frame1.index, map.matches);
      const SelectionScore score = ScoreSelection(truth, selection.is_static);
      json["precision"] = score.precision();
      json["recall"] = score.recall();
    }
    report_["pairs"].push_back(std::move(json));
    return true;
  }
  static void Tell(const std::string& name, const StaticSelection& selection, size_t num_matches) {
    std::cout << name << ": " << selection.num_static << " static of " << num_matches
              << (selection.IsUsable() ? "" : ", refused: " + selection.explanation) << '\n';
  }
  void Write(const std::string& name, const ColorImage& picture) const {
    WriteFileBytes(settings_.out + "/" + name + ".png", EncodePng(picture));
  }
  void Save() {
    report_["method"] = settings_.method;
    report_["seed"] = settings_.seed;
    std::ofstream file(settings_.out + "/static.json");
    file << report_.dump(2) << '\n';
    if (!file) throw InputError(settings_.out + "/static.json: cannot be written");
    std::cout << "wrote " << settings_.out << "/static.json and its pictures\n";
  }

  const Settings& settings_;
  std::unique_ptr<StaticSelector> selector_;
  MatchingOptions matching_;
  FeatureMatcher matcher_;
  nlohmann::json report_;
};

/// Frames that the table's longest pair or window needs.
size_t FramesNeeded(const JudgeSettings& settings) {
  int last = 1;
  if (settings.table == "pairs" || settings.table == "ablation") {
    last = *std::max_element(settings.gaps.begin(), settings.gaps.end());
  } else if (settings.table == "windows") {
    last = WindowOptions().gaps.back();
  } else if (settings.table == "system") {
    last = SystemWindowOptions().hard_gap;
  }
  return static_cast<size_t>(last) + 1;
}

/// Throws InputError for what makes the table impossible, before anything is written.
void CheckJudge(const JudgeSettings& settings, JudgedSequence& sequence) {
  if (!sequence.HasPoses()) {
    throw InputError(settings.sequence +
                     "/groundtruth.txt: missing or empty; nothing can be judged without true poses: put them "
                     "there, or look at what dmslam-static --sequence draws");
  }
  if (sequence.size() < FramesNeeded(settings)) {
    throw InputError(settings.sequence + ": fewer frames than the gap asks for");
  }
  sequence.Features(0);  // of the camera's size
  if (settings.table == "pairs" || settings.table == "windows") AllSelectors(false, settings.only);
  if (settings.table != "system") return;
  SystemWindowOptions options;
  options.only = settings.only;
  RequireMethods(options);
}

/// Prints the table and returns its key in the report, with the numbers.
std::pair<std::string, nlohmann::json> JudgeTable(const JudgeSettings& settings, JudgedSequence& sequence,
                                                  std::ostream& out) {
  if (settings.table == "pairs" || settings.table == "ablation") {
    const auto selectors = settings.table == "pairs" ? AllSelectors(false, settings.only) : DlrsacAblations();
    nlohmann::json json;
    for (const int gap : settings.gaps) {
      json.push_back(JudgePairs(sequence, gap, !settings.no_window, settings.count, selectors, out));
    }
    return {"gaps", json};
  }
  if (settings.table == "windows") {
    WindowOptions options;
    options.matching.use_window = options.matching.check_orientation = !settings.no_window;
    return {"windows",
            JudgeWindows(sequence, options, settings.count, AllSelectors(true, settings.only), out)};
  }
  if (settings.table == "system") {
    SystemWindowOptions options;
    options.frames = settings.window;
    options.only = settings.only;
    return {"system", JudgeSystem(sequence, options, settings.count, settings.seed, out)};
  }
  return {"starts", JudgeStarts(sequence, InitializerOptions(), settings.count, settings.seed, out)};
}

void RunJudge(const JudgeSettings& settings) {
  static const std::set<std::string> kTables{"pairs", "ablation", "windows", "system", "starts"};
  if (!kTables.contains(settings.table)) {
    throw InputError("unknown table '" + settings.table +
                     "': use pairs, ablation, windows, system or starts");
  }
  JudgedSequence sequence(settings.sequence, ChooseCamera(settings.camera, settings.sequence),
                          settings.features);
  CheckJudge(settings, sequence);
  std::ofstream file;
  if (!settings.out.empty()) {
    file.open(settings.out, std::ios::app);
    if (!file) throw InputError(settings.out + ": cannot be written");
  }
  std::ostream& out = settings.out.empty() ? std::cout : file;
  const std::string name = std::filesystem::path(settings.sequence).filename().string();
  out << "### " << name << ", " << settings.table << "\n\n";
  const auto [key, numbers] = JudgeTable(settings, sequence, out);
  if (settings.json.empty()) return;
  const nlohmann::json json{{"sequence", name},
                            {"table", settings.table},
                            {"count", settings.count},
                            {"features", settings.features},
                            {key, numbers}};
  std::ofstream json_file(settings.json);
  json_file << json.dump(2) << '\n';
  if (!json_file) throw InputError(settings.json + ": cannot be written");
}

/// Matches of the pair in the middle of the sequence, spread evenly over them where there are more.
std::vector<Match> MatchesToTime(const TimeSettings& settings, const Camera& camera) {
  JudgedSequence sequence(settings.sequence, camera, settings.features);
  const size_t gap = static_cast<size_t>(settings.gap);
  if (sequence.size() <= gap) throw InputError(settings.sequence + ": fewer frames than --gap asks for");
  const size_t frame = (sequence.size() - gap) / 2;
  MatchingOptions matching;
  matching.use_window = matching.check_orientation = false;
  matching.max_ratio = 1.0;
  FeatureMatcher matcher;
  return ChooseEvenly(
      MatchFrames(*sequence.Features(frame), *sequence.Features(frame + gap), camera, matching, &matcher),
      static_cast<size_t>(settings.matches));
}

void RunTime(const TimeSettings& settings) {
  const Camera camera = ChooseCamera(settings.camera, settings.sequence);
  const std::vector<Match> matches = MatchesToTime(settings, camera);
  const MethodTimes times = TimeMethods(matches, camera, settings.timing);
  for (const auto& [method, iterations] : times.iterations) {
    if (iterations > 0) continue;
    throw InputError(settings.sequence + ": " + method + " made no iterations with the " +
                     std::to_string(matches.size()) +
                     " matches of the pair in the middle; give another --gap, or a sequence that moves");
  }
  const std::string machine =
      ThisMachine().processor + ", " + std::to_string(matches.size()) + " matches, one thread";
  std::cout << "| | RANSAC | ARSAC | DLRSAC |\n|---|---:|---:|---:|\n| " << machine << " [ms] | "
            << times.ransac_ms << " | " << times.arsac_ms << " | " << times.dlrsac_ms << " |\n";
  if (settings.json.empty()) return;
  const nlohmann::json json{{"ransac_ms", times.ransac_ms},   {"arsac_ms", times.arsac_ms},
                            {"dlrsac_ms", times.dlrsac_ms},   {"machine", machine},
                            {"iterations", times.iterations}, {"matches", matches.size()}};
  std::ofstream file(settings.json);
  file << json.dump(2) << '\n';
  if (!file) throw InputError(settings.json + ": cannot be written");
}

void AddTime(dmslam::CommandLine& app, TimeSettings& s) {
  dmslam::CommandLine& time = app.AddSubcommand(
      "time",
      "Time the methods as the paper's Table 1 does: fundamental matrices, so many iterations in total");
  time.AddOption("--sequence", s.sequence, "TUM RGB-D folder; the pair in its middle is matched").Required();
  time.AddOption("--camera", s.camera, "Camera file (YAML)");
  time.AddOption("--gap", s.gap, "Frames between the two of the pair").InRange(1, 100000).ShowDefault();
  time.AddOption("--features", s.features, "Most features per image").ShowDefault();
  time.AddOption("--matches", s.matches, "Most matches").InRange(8, 100000).ShowDefault();
  time.AddOption("--iterations", s.timing.iterations, "In total; DLRSAC shares them among its cells")
      .InRange(1, 1000000)
      .ShowDefault();
  time.AddOption("--rounds", s.timing.rounds, "Measurements of each method, of which the median is told")
      .InRange(1, 100000)
      .ShowDefault();
  time.AddOption("--json", s.json, "File for the same numbers, as the report reads them");
  time.OnParsed([&s] { RunTime(s); });
}

void AddOptions(dmslam::CommandLine& app, Settings& s) {
  app.AddOption("images", s.images, "Two images of the same camera").Count(0, 2);
  app.AddOption("--sequence", s.sequence, "TUM RGB-D folder, instead of two images");
  app.AddOption("--gap", s.gap, "Frames between the two of a pair, or auto").ShowDefault();
  app.AddOption("--pairs", s.pairs, "Pairs spread over the sequence").InRange(1, 100000).ShowDefault();
  app.AddOption("--method", s.method, "dlrsac, dlrsac-paper, arsac or ransac").ShowDefault();
  app.AddOption("--model", s.model,
                "e (essential matrix, five points) or f (fundamental matrix, eight points)")
      .OneOf({"e", "f"})
      .ShowDefault();
  app.AddOption("--camera", s.camera, "Camera file (YAML)");
  app.AddOption("--features", s.features, "Most features per image").ShowDefault();
  app.AddOption("--seed", s.seed, "Same input and seed: same answer").ShowDefault();
  app.AddFlag("--no-window", s.no_window, "Match over the whole image, without the orientation check");
  app.AddFlag("--first-maps", s.first_maps,
              "Instead of pairs: the first maps of an initialiser begun at so many frames of --sequence");
  app.AddFlag("--gated", s.gated, "Pairs with two frames between must agree, as the initialiser asks them");
  app.AddOption("--out", s.out, "Folder for pictures and static.json").ShowDefault();
}

void AddJudge(dmslam::CommandLine& app, JudgeSettings& s) {
  dmslam::CommandLine& judge =
      app.AddSubcommand("judge", "Measure against masks and true poses; prints Markdown tables");
  judge
      .AddOption("--sequence", s.sequence,
                 "TUM RGB-D folder with groundtruth.txt, and mask.txt where there are movers")
      .Required();
  judge.AddOption("--table", s.table, "pairs, ablation, windows, system or starts").ShowDefault();
  judge.AddOption("--count", s.count, "Pairs, windows or starts, spread over the sequence")
      .InRange(1, 100000)
      .ShowDefault();
  judge.AddOption("--window", s.window, "Frames of a window of table 'system'")
      .InRange(2, 100000)
      .ShowDefault();
  judge.AddOption("--only", s.only,
                  "Of pairs, windows and system: only methods whose name contains this, as DLRSAC");
  judge.AddOption("--gaps", s.gaps, "Gaps of the pairs [frames]").InRange(1, 100000).ShowDefault();
  judge.AddOption("--camera", s.camera, "Camera file (YAML)");
  judge.AddOption("--features", s.features, "Most features per image").ShowDefault();
  judge.AddOption("--seed", s.seed, "Same input and seed: same answer").ShowDefault();
  judge.AddFlag("--no-window", s.no_window, "Match over the whole image, without the orientation check");
  judge.AddOption("--out", s.out, "File to append to, instead of standard output");
  judge.AddOption("--json", s.json, "File for the same numbers as JSON");
  judge.OnParsed([&s] { RunJudge(s); });
}

void RunSelection(const Settings& settings) {
  if (settings.gap != "auto" && (settings.gap.find_first_not_of("0123456789") != std::string::npos ||
                                 settings.gap.empty() || settings.gap.size() > 6 || settings.gap == "0")) {
    throw InputError("--gap '" + settings.gap + "': give a number of frames, at least 1, or auto");
  }
  if (!settings.sequence.empty() && !settings.images.empty()) {
    throw InputError("give two images or --sequence DIR, not both");
  }
  Run run(settings);
  if (!settings.sequence.empty()) {
    run.OnSequence();
  } else if (settings.first_maps || settings.gated) {
    throw InputError("--first-maps and --gated need more than two frames: give --sequence DIR");
  } else if (settings.images.size() == 2) {
    run.OnImages();
  } else {
    throw InputError("give two images, or --sequence DIR");
  }
}

}  // namespace
}  // namespace dmslam

int main(int argc, char** argv) {
  dmslam::CommandLine app("Finds which matches of two frames belong to the static world", "dmslam-static");
  app.SetVersion(dmslam::BuildVersion());
  dmslam::Settings settings;
  dmslam::JudgeSettings judge;
  dmslam::AddOptions(app, settings);
  dmslam::AddJudge(app, judge);
  dmslam::TimeSettings time;
  dmslam::AddTime(app, time);
  return app.Run(argc, argv, [&] {
    if (!app.HasSubcommand()) dmslam::RunSelection(settings);
  });
}
