#include "judge.h"

#include <algorithm>
#include <cmath>
#include <iomanip>
#include <map>
#include <sstream>

#include "dmslam/motion_segmentation/dlrsac.h"
#include "dmslam/motion_segmentation/match_frames.h"
#include "dmslam/motion_segmentation/ransac.h"
#include "dmslam/optimization/bundle_adjustment.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr double kBadPrecision = 0.8;
constexpr double kDegrees = 180.0 / M_PI;

double Quantile(std::vector<double> values, double q) {
  if (values.empty()) return std::nan("");
  std::sort(values.begin(), values.end());
  return values[std::min(values.size() - 1, static_cast<size_t>(q * static_cast<double>(values.size())))];
}

std::string Number(double value, int decimals) {
  if (!std::isfinite(value)) return "-";
  std::ostringstream text;
  text << std::fixed << std::setprecision(decimals) << value;
  return text.str();
}

/// Answers of one selector over many pairs or windows.
struct Tally {
  int asked = 0;
  int bad = 0;
  std::vector<double> precision, recall;

  void Add(const SelectionScore& score) {
    precision.push_back(score.precision());
    recall.push_back(score.recall());
    bad += score.precision() < kBadPrecision ? 1 : 0;
  }
  double accepted() const {
    return asked == 0 ? std::nan("") : static_cast<double>(precision.size()) / asked;
  }
  double bad_share() const {
    return precision.empty() ? std::nan("") : bad / static_cast<double>(precision.size());
  }
  nlohmann::json ToJson(const std::string& method) const {
    return {{"method", method},
            {"asked", asked},
            {"accepted", accepted()},
            {"bad", bad_share()},
            {"median_precision", Quantile(precision, 0.5)},
            {"p10_precision", Quantile(precision, 0.1)},
            {"median_recall", Quantile(recall, 0.5)}};
  }
  std::string Cells() const {
    return Number(accepted(), 3) + " | " + Number(bad_share(), 3) + " | " +
           Number(Quantile(precision, 0.5), 3) + " | " + Number(Quantile(precision, 0.1), 3) + " | " +
           Number(Quantile(recall, 0.5), 3);
  }
};

std::vector<std::string> NamesOf(const std::vector<NamedSelector>& selectors) {
  std::vector<std::string> names;
  for (const NamedSelector& each : selectors) names.push_back(each.name);
  return names;
}

nlohmann::json ToJson(const std::vector<std::string>& names, const std::vector<Tally>& tallies) {
  nlohmann::json json = nlohmann::json::array();
  for (size_t s = 0; s < names.size(); ++s) json.push_back(tallies[s].ToJson(names[s]));
  return json;
}

constexpr const char* kTallyHead = "accepted | bad | median precision | 10th percentile | median recall";
constexpr const char* kTallyRule = "---|---|---|---|---";

NamedSelector MakeDlrsac(std::string name, const DlrsacOptions& options) {
  return {std::move(name), std::make_unique<Dlrsac>(options)};
}

/// Says how many of `count` could not be judged, where there are such.
void TellUnjudged(int unjudged, int count, const char* what, std::ostream& out) {
  if (unjudged == 0) return;
  out << unjudged << " of " << count << ' ' << what
      << " left out: groundtruth.txt has no pose within 20 ms of their frames.\n\n";
}

size_t StartOf(size_t k, size_t count, size_t frames, size_t reach) {
  return frames <= reach ? 0 : (frames - reach) * k / count;
}

}  // namespace

std::vector<NamedSelector> AllSelectors(bool gated, const std::string& only) {
  std::vector<NamedSelector> selectors;
  selectors.push_back({"RANSAC, F", MakeSelector("ransac", ModelKind::kFundamental)});
  selectors.push_back({"RANSAC, E", MakeSelector("ransac", ModelKind::kEssential)});
  selectors.push_back({"ARSAC, F", MakeSelector("arsac", ModelKind::kFundamental)});
  selectors.push_back({"ARSAC, E", MakeSelector("arsac", ModelKind::kEssential)});
  selectors.push_back({"DLRSAC as written", MakeSelector("dlrsac-paper", ModelKind::kFundamental)});
  DlrsacOptions options;
  if (!gated) options.min_distribution_share = 0;
  selectors.push_back(MakeDlrsac("DLRSAC", options));
  std::erase_if(selectors,
                [&](const NamedSelector& each) { return each.name.find(only) == std::string::npos; });
  if (selectors.empty()) throw InputError("--only " + only + ": no method has a name like that");
  return selectors;
}

std::vector<NamedSelector> DlrsacAblations() {
  std::vector<NamedSelector> selectors;
  DlrsacOptions ungated;
  ungated.min_distribution_share = 0;
  selectors.push_back(MakeDlrsac("as written", DlrsacOptions::Paper()));
  DlrsacOptions essential = DlrsacOptions::Paper();
  essential.sampling.kind = ModelKind::kEssential;
  selectors.push_back(MakeDlrsac("as written, with E", essential));
  essential.scope = StaticScope::kImage;
  essential.sampling.refit_rounds = 3;
  essential.set_refit_rounds = 2;
  selectors.push_back(MakeDlrsac("+ refit to the set, selection over the image", essential));
  essential.inlier.scale_by_octave = true;
  selectors.push_back(MakeDlrsac("+ threshold by octave", essential));
  essential.layers.enabled = true;
  selectors.push_back(MakeDlrsac("+ disparity layers", essential));
  essential.search_minima = true;
  selectors.push_back(MakeDlrsac("+ search of all minima", essential));
  DlrsacOptions other = ungated;
  other.max_rival_share = 0;
  selectors.push_back(MakeDlrsac("+ degenerate cells told apart, stop by Eq. 4", other));
  selectors.push_back(MakeDlrsac("+ ambiguous motions refused (the default)", ungated));
  other = ungated;
  other.layers.enabled = false;
  selectors.push_back(MakeDlrsac("default without disparity layers", other));
  other = ungated;
  other.distribution_weight = DistributionWeight::kMatches;
  selectors.push_back(MakeDlrsac("default, D weighted by matches", other));
  other = ungated;
  other.couple_over_own_inliers = false;
  selectors.push_back(MakeDlrsac("default, couple degree over all matches", other));
  for (const double share : {0.75, 1.5}) {
    other = ungated;
    other.cell_share *= share;
    selectors.push_back(MakeDlrsac("default, cells " + Number(share, 2) + " times as wide and high", other));
  }
  return selectors;
}

namespace {

void PrintPairs(int gap, bool window_and_orientation, int count, const std::vector<NamedSelector>& selectors,
                const std::vector<Tally>& tallies, const std::vector<double>& moving, std::ostream& out) {
  out << "Gap " << gap
      << (window_and_orientation ? ", search window and orientation check"
                                 : ", neither window nor orientation check")
      << "; " << count << " pairs; moving share of the matches: median " << Number(Quantile(moving, 0.5), 2)
      << ", 90th percentile " << Number(Quantile(moving, 0.9), 2) << ".\n\n| method | " << kTallyHead
      << " |\n|---|" << kTallyRule << "|\n";
  for (size_t s = 0; s < selectors.size(); ++s) {
    out << "| " << selectors[s].name << " | " << tallies[s].Cells() << " |\n";
  }
  out << '\n';
}

}  // namespace

nlohmann::json JudgePairs(JudgedSequence& sequence, int gap, bool window_and_orientation, int count,
                          const std::vector<NamedSelector>& selectors, std::ostream& out) {
  MatchingOptions matching;
  if (!window_and_orientation) {
    matching.use_window = false;
    matching.check_orientation = false;
  }
  FeatureMatcher matcher;
  std::vector<Tally> tallies(selectors.size());
  std::vector<double> moving;
  int unjudged = 0;
  for (int k = 0; k < count; ++k) {
    const size_t frame = StartOf(static_cast<size_t>(k), static_cast<size_t>(count), sequence.size(),
                                 static_cast<size_t>(gap) + 1);
    const size_t other = frame + static_cast<size_t>(gap);
    if (!sequence.TrueMotion(frame, other)) {
      ++unjudged;
      continue;
    }
    const auto matches = MatchFrames(*sequence.Features(frame), *sequence.Features(other), sequence.camera(),
                                     matching, &matcher);
    const auto truth = sequence.Judge(frame, other, matches);
    for (size_t s = 0; s < selectors.size(); ++s) {
      const StaticSelection selection = selectors[s].selector->Select(matches, sequence.camera(), frame);
      ++tallies[s].asked;
      const SelectionScore score = ScoreSelection(truth, selection.is_static);
      if (s == 0) moving.push_back(score.moving_share());
      if (selection.IsUsable()) tallies[s].Add(score);
    }
    sequence.ForgetBefore(frame);
  }
  PrintPairs(gap, window_and_orientation, count, selectors, tallies, moving, out);
  TellUnjudged(unjudged, count, "pairs", out);
  return {{"gap", gap},
          {"unjudged", unjudged},
          {"window_and_orientation", window_and_orientation},
          {"median_moving_share", Quantile(moving, 0.5)},
          {"methods", ToJson(NamesOf(selectors), tallies)}};
}

namespace {

struct Window {
  Agreement agreement;
  SelectionScore score;
};

/// One selector's answer for one window, over matches made before.
Window RunWindow(const std::vector<std::vector<Match>>& matches, std::span<const MatchTruth> truth,
                 const StaticSelector& selector, const Camera& camera, const AgreementOptions& options,
                 size_t frame) {
  std::vector<PairView> pairs(matches.size());
  std::vector<const PairView*> pointers;
  for (size_t p = 0; p < matches.size(); ++p) {
    pairs[p] = {matches[p], selector.Select(matches[p], camera, DeriveSeed(frame, p, "window"))};
    pointers.push_back(&pairs[p]);
  }
  Window window;
  window.agreement = Agree(pointers, camera, options);
  window.score = ScoreSelection(truth, window.agreement.is_static);
  return window;
}

void PrintWindowTable(const std::vector<std::string>& names, const std::vector<Tally>& tallies,
                      const std::string& title, std::ostream& out) {
  out << title << "\n\n| method | windows | " << kTallyHead << " |\n|---|---|" << kTallyRule << "|\n";
  for (size_t s = 0; s < names.size(); ++s) {
    out << "| " << names[s] << " | " << tallies[s].asked << " | " << tallies[s].Cells() << " |\n";
  }
  out << '\n';
}

/// Answers of every selector over windows.
struct WindowTallies {
  explicit WindowTallies(size_t selectors)
      : all(selectors), parallax(selectors), hard(selectors), refusals(selectors) {}
  std::vector<Tally> all, parallax, hard;
  std::vector<std::map<std::string, int>> refusals;
};

void PrintWindows(const std::vector<std::string>& names, const WindowOptions& options,
                  const WindowTallies& tallies, std::ostream& out) {
  PrintWindowTable(names, tallies.all, "All windows.", out);
  PrintWindowTable(names, tallies.parallax,
                   "Windows with a true baseline of " + Number(options.min_baseline_m, 2) + " m.", out);
  if (tallies.hard[0].asked > 0) {
    PrintWindowTable(
        names, tallies.hard,
        "Hard windows: more than " + Number(options.hard_moving_share, 2) + " of the matches moving.", out);
  }
  out << "Why windows were refused:\n\n";
  for (size_t s = 0; s < names.size(); ++s) {
    out << "- " << names[s] << ":";
    for (const auto& [reason, number] : tallies.refusals[s]) out << ' ' << reason << ' ' << number << ';';
    out << '\n';
  }
  out << '\n';
}

/// One window of every selector; false where it has no true pose.
bool AddSelectorWindow(JudgedSequence& sequence, const WindowOptions& options, size_t frame,
                       const std::vector<NamedSelector>& selectors, FeatureMatcher* matcher,
                       WindowTallies* tallies) {
  const size_t last = frame + static_cast<size_t>(options.gaps.back());
  const auto motion = sequence.TrueMotion(frame, last);
  if (!motion) return false;
  std::vector<std::vector<Match>> matches;
  for (const int gap : options.gaps) {
    matches.push_back(MatchFrames(*sequence.Features(frame),
                                  *sequence.Features(frame + static_cast<size_t>(gap)), sequence.camera(),
                                  options.matching, matcher));
  }
  const auto truth = sequence.Judge(frame, last, matches.back());
  const bool has_parallax = motion->translation.norm() >= options.min_baseline_m;
  for (size_t s = 0; s < selectors.size(); ++s) {
    const Window window =
        RunWindow(matches, truth, *selectors[s].selector, sequence.camera(), options.agreement, frame);
    ++tallies->refusals[s][std::string(ToString(window.agreement.refusal))];
    const bool is_hard = window.score.moving_share() > options.hard_moving_share;
    for (Tally* tally : {&tallies->all[s], has_parallax ? &tallies->parallax[s] : nullptr,
                         is_hard ? &tallies->hard[s] : nullptr}) {
      if (!tally) continue;
      ++tally->asked;
      if (window.agreement.IsUsable()) tally->Add(window.score);
    }
  }
  return true;
}

}  // namespace

nlohmann::json JudgeWindows(JudgedSequence& sequence, const WindowOptions& options, int count,
                            const std::vector<NamedSelector>& selectors, std::ostream& out) {
  FeatureMatcher matcher;
  WindowTallies tallies(selectors.size());
  int unjudged = 0;
  for (int k = 0; k < count; ++k) {
    const size_t frame = StartOf(static_cast<size_t>(k), static_cast<size_t>(count), sequence.size(),
                                 static_cast<size_t>(options.gaps.back()) + 1);
    unjudged += AddSelectorWindow(sequence, options, frame, selectors, &matcher, &tallies) ? 0 : 1;
    sequence.ForgetBefore(frame);
  }
  const std::vector<std::string> names = NamesOf(selectors);
  PrintWindows(names, options, tallies, out);
  TellUnjudged(unjudged, count, "windows", out);
  return {{"all", ToJson(names, tallies.all)},
          {"with_parallax", ToJson(names, tallies.parallax)},
          {"hard", ToJson(names, tallies.hard)},
          {"unjudged", unjudged}};
}

std::optional<FoundMap> FirstMapOf(JudgedSequence& sequence, InitializerChoice choice, const FrameSpan& span,
                                   uint64_t seed, std::map<std::string, int>* waited) {
  choice.options.past.first = static_cast<int>(span.first - span.past);
  Initializer initializer(choice.options, sequence.camera(), seed, MakeAdjustment(sequence.camera()),
                          choice.method);
  for (size_t frame = span.past; frame < std::min(span.end, sequence.size()); ++frame) {
    InitializerReport report = initializer.AddFrame(
        {static_cast<uint32_t>(frame), sequence.StampNs(frame), sequence.Features(frame)});
    if (report.result) return FoundMap{std::move(*report.result), frame};
    if (waited) ++(*waited)[std::string(ToString(report.wait))];
  }
  return std::nullopt;
}

std::vector<uint8_t> MatchesWithPoint(const FirstMap& map) {
  std::vector<uint8_t> has_point(map.matches.size(), 0);
  for (size_t m = 0, p = 0; m < map.matches.size() && p < map.points.size(); ++m) {
    if (map.matches[m].index0 != map.points[p].feature0) continue;
    has_point[m] = 1;
    ++p;
  }
  return has_point;
}

namespace {

struct NamedInitializer {
  std::string name;
  InitializerChoice choice;
};

/// The initialiser with each of the selectors.
std::vector<NamedInitializer> AllInitializers(const SystemWindowOptions& options) {
  std::vector<NamedInitializer> initializers;
  const auto add = [&](const std::string& name, SelectorMethod method, ModelKind kind) {
    if (name.find(options.only) == std::string::npos) return;
    InitializerOptions own = options.initializer;
    own.selector.sampling.kind = kind;
    initializers.push_back({name, {own, method}});
  };
  add("RANSAC, F", SelectorMethod::kRansac, ModelKind::kFundamental);
  add("RANSAC, E", SelectorMethod::kRansac, ModelKind::kEssential);
  add("ARSAC, F", SelectorMethod::kArsac, ModelKind::kFundamental);
  add("ARSAC, E", SelectorMethod::kArsac, ModelKind::kEssential);
  add("DLRSAC", SelectorMethod::kDlrsac, ModelKind::kEssential);
  return initializers;
}

/// What the windows of one method add up to.
struct SystemTally {
  Tally all, parallax, hard;
  int unjudged = 0;                   ///< windows that are in none of them, for want of true poses
  std::map<std::string, int> waited;  ///< frames, by reason
  nlohmann::json bad_windows = nlohmann::json::array();
};

/// What the first frame of a window shows against one a little later.
struct WindowKind {
  bool has_poses = false;
  bool has_parallax = false;
  bool is_hard = false;
};

WindowKind KindOfWindow(JudgedSequence& sequence, const SystemWindowOptions& options, size_t first,
                        FeatureMatcher* matcher) {
  const size_t other = first + static_cast<size_t>(options.hard_gap);
  const auto motion = sequence.TrueMotion(first, other);
  if (!motion) return {};
  const auto matches = MatchFrames(*sequence.Features(first), *sequence.Features(other), sequence.camera(),
                                   options.initializer.matching, matcher);
  const std::vector<uint8_t> none(matches.size(), 0);
  const SelectionScore score = ScoreSelection(sequence.Judge(first, other, matches), none);
  return {true, motion->translation.norm() >= options.min_baseline_m,
          score.moving_share() > options.hard_moving_share};
}

/// Adds what was found in the window that begins with frame `first`.
void AddWindow(JudgedSequence& sequence, size_t first, const std::optional<FoundMap>& found,
               const WindowKind& kind, SystemTally* tally) {
  if (!kind.has_poses || (found && !sequence.TrueMotion(found->map.frame0.index, found->map.frame1.index))) {
    ++tally->unjudged;
    return;
  }
  std::optional<SelectionScore> score;
  if (found) {
    const FirstMap& map = found->map;
    score = ScoreSelection(sequence.Judge(map.frame0.index, map.frame1.index, map.matches),
                           MatchesWithPoint(map));
    if (score->precision() < kBadPrecision) {
      tally->bad_windows.push_back({{"frame", first},
                                    {"first_keyframe", map.frame0.index},
                                    {"second_keyframe", map.frame1.index},
                                    {"precision", score->precision()}});
    }
  }
  for (Tally* each :
       {&tally->all, kind.has_parallax ? &tally->parallax : nullptr, kind.is_hard ? &tally->hard : nullptr}) {
    if (!each) continue;
    ++each->asked;
    if (score) each->Add(*score);
  }
}

nlohmann::json PrintSystem(const SystemWindowOptions& options,
                           const std::vector<NamedInitializer>& initializers,
                           const std::vector<SystemTally>& tallies, std::ostream& out) {
  std::vector<std::string> names;
  std::vector<Tally> all, parallax, hard;
  for (size_t s = 0; s < initializers.size(); ++s) {
    names.push_back(initializers[s].name);
    all.push_back(tallies[s].all);
    parallax.push_back(tallies[s].parallax);
    hard.push_back(tallies[s].hard);
  }
  PrintWindowTable(names, all, "All windows.", out);
  const std::string over = " over " + std::to_string(options.hard_gap) + " frames";
  PrintWindowTable(names, parallax,
                   "Windows with a true baseline of " + Number(options.min_baseline_m, 2) + " m" + over + ".",
                   out);
  if (hard[0].asked > 0) {
    PrintWindowTable(names, hard,
                     "Hard windows: more than " + Number(options.hard_moving_share, 2) + " of the matches" +
                         over + " moving.",
                     out);
  }
  nlohmann::json json{
      {"all", ToJson(names, all)}, {"with_parallax", ToJson(names, parallax)}, {"hard", ToJson(names, hard)}};
  for (size_t s = 0; s < names.size(); ++s) {
    json["waited_for_frames"][names[s]] = tallies[s].waited;
    json["unjudged"][names[s]] = tallies[s].unjudged;
    json["bad_windows"][names[s]] = tallies[s].bad_windows;
    TellUnjudged(tallies[s].unjudged, tallies[s].unjudged + tallies[s].all.asked,
                 ("windows of " + names[s]).c_str(), out);
  }
  return json;
}

}  // namespace

void RequireMethods(const SystemWindowOptions& options) {
  if (AllInitializers(options).empty()) {
    throw InputError("--only " + options.only + ": no method has a name like that");
  }
}

nlohmann::json JudgeSystem(JudgedSequence& sequence, const SystemWindowOptions& options, int count,
                           uint64_t seed, std::ostream& out) {
  const std::vector<NamedInitializer> initializers = AllInitializers(options);
  RequireMethods(options);
  FeatureMatcher matcher;
  std::vector<SystemTally> tallies(initializers.size());
  const auto before = static_cast<size_t>(options.frames_before);
  const auto reach = static_cast<size_t>(std::max(options.frames, options.hard_gap + 1));
  for (int k = 0; k < count; ++k) {
    const size_t first = StartOf(static_cast<size_t>(k), static_cast<size_t>(count), sequence.size(), reach);
    const WindowKind kind = KindOfWindow(sequence, options, first, &matcher);
    for (size_t s = 0; s < initializers.size(); ++s) {
      const size_t end = first + static_cast<size_t>(options.frames);
      std::optional<FoundMap> found;
      if (kind.has_poses) {
        found = FirstMapOf(sequence, initializers[s].choice, {first - std::min(before, first), first, end},
                           seed, &tallies[s].waited);
      }
      AddWindow(sequence, first, found, kind, &tallies[s]);
    }
    sequence.ForgetBefore(first - std::min(first, before));
  }
  return PrintSystem(options, initializers, tallies, out);
}

AdjustFunction MakeAdjustment(const Camera& camera) {
  return [pinhole = camera.Ideal()](std::vector<Rigid3d>* poses, std::vector<Eigen::Vector3d>* points,
                                    std::span<const InitialObservation> observations) {
    BundleProblem problem;
    problem.camera = pinhole;
    problem.T_cam_world = *poses;
    problem.pose_fixed.assign(poses->size(), 0);
    problem.pose_fixed[0] = 1;
    problem.points = *points;
    for (const InitialObservation& o : observations) {
      problem.observations.push_back({o.pose, o.point, o.uv_px, o.inv_sigma_squared});
    }
    if (!AdjustBundle(GlobalBundleOptions(10), problem).usable) return false;
    *poses = problem.T_cam_world;
    *points = problem.points;
    return true;
  };
}

namespace {

struct Start {
  size_t first = 0;  ///< frame it began with
  bool found = false;
  bool judged = true;  ///< the two frames of the first map have true poses
  double wait_s = 0, rotation_deg = 0, direction_deg = 0;
  double precision = 1;  ///< share of the points that lie on nothing that moves
  bool IsGood() const {
    return found && judged && rotation_deg < 2.0 && direction_deg < 10.0 && precision >= kBadPrecision;
  }
  nlohmann::json ToJson() const {
    return {{"first", first},
            {"found", found},
            {"judged", judged},
            {"wait_s", wait_s},
            {"rotation_deg", rotation_deg},
            {"direction_deg", direction_deg},
            {"precision", precision},
            {"right", IsGood()}};
  }
};

Start RunStart(JudgedSequence& sequence, const InitializerOptions& options, size_t first, uint64_t seed,
               std::map<std::string, int>* waited) {
  Start start;
  start.first = first;
  const auto found = FirstMapOf(sequence, {options}, {first, first, sequence.size()}, seed, waited);
  if (!found) return start;
  const FirstMap& map = found->map;
  start.found = true;
  start.wait_s = static_cast<double>(sequence.StampNs(found->frame) - sequence.StampNs(first)) * 1e-9;
  const auto truth = sequence.TrueMotion(map.frame0.index, map.frame1.index);
  start.judged = truth.has_value();
  if (truth) {
    start.rotation_deg = kDegrees * AngleBetween(truth->rotation, map.T_1_0.rotation);
    const double cosine = truth->translation.normalized().dot(map.T_1_0.translation.normalized());
    const bool scored = truth->translation.norm() >= 0.05;
    start.direction_deg = scored ? kDegrees * std::acos(std::clamp(cosine, -1.0, 1.0)) : 0.0;
    const auto on_what = sequence.Judge(map.frame0.index, map.frame1.index, map.matches);
    start.precision = ScoreSelection(on_what, MatchesWithPoint(map)).precision();
  }
  return start;
}

/// What starts add up to; those that cannot be judged are in none of the numbers but their own.
struct StartTally {
  int found = 0, good = 0, unjudged = 0;
  std::vector<double> wait, rotation, direction, precision;

  void Add(const Start& start) {
    if (!start.judged) {
      ++unjudged;
      return;
    }
    good += start.IsGood() ? 1 : 0;
    wait.push_back(start.found ? start.wait_s : 1e9);
    if (!start.found) return;
    ++found;
    rotation.push_back(start.rotation_deg);
    direction.push_back(start.direction_deg);
    precision.push_back(start.precision);
  }
};

void PrintStarts(const StartTally& tally, const std::map<std::string, int>& reasons, std::ostream& out) {
  out << "| starts | first map | right | of all starts | median wait [s] | 75th | 90th | median rotation "
         "error "
         "[deg] | median direction error [deg] | 90th | smallest precision |\n"
         "|---|---|---|---|---|---|---|---|---|---|---|\n| "
      << tally.wait.size() << " | " << tally.found << " | " << tally.good << " | "
      << Number(tally.good / static_cast<double>(tally.wait.size()), 2);
  for (const double q : {0.5, 0.75, 0.9}) {
    const double value = Quantile(tally.wait, q);
    out << " | " << (value > 1e8 ? "none" : Number(value, 2));
  }
  out << " | " << Number(Quantile(tally.rotation, 0.5), 2) << " | "
      << Number(Quantile(tally.direction, 0.5), 1) << " | " << Number(Quantile(tally.direction, 0.9), 1)
      << " | " << Number(Quantile(tally.precision, 0.0), 2) << " |\n\nWhat was waited for [frames]:";
  for (const auto& [reason, number] : reasons) out << ' ' << reason << ' ' << number << ';';
  out << "\n\n";
}

}  // namespace

nlohmann::json JudgeStarts(JudgedSequence& sequence, const InitializerOptions& options, int count,
                           uint64_t seed, std::ostream& out) {
  StartTally tally;
  nlohmann::json each = nlohmann::json::array();
  std::map<std::string, int> reasons;
  for (int k = 0; k < count; ++k) {
    const size_t first =
        StartOf(static_cast<size_t>(k), static_cast<size_t>(count), sequence.size(), sequence.size() / 3);
    const Start start = RunStart(sequence, options, first, seed, &reasons);
    tally.Add(start);
    each.push_back(start.ToJson());
    sequence.ForgetBefore(first);
  }
  PrintStarts(tally, reasons, out);
  TellUnjudged(tally.unjudged, count, "starts", out);
  return {{"starts", tally.wait.size()}, {"first_map", tally.found},     {"right", tally.good},
          {"unjudged", tally.unjudged},  {"waited_for_frames", reasons}, {"each", each}};
}

}  // namespace dmslam
