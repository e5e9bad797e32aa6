#include "dmslam/motion_segmentation/dlrsac.h"

#include <Eigen/LU>
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>
#include <numeric>
#include <optional>

#include "dmslam/camera/image_scale.h"
#include "dmslam/geometry/symmetric_eigen.h"
#include "dmslam/geometry/two_view.h"
#include "dmslam/motion_segmentation/sampling.h"
#include "dmslam/util/check.h"
#include "dmslam/util/chi_squared.h"

namespace dmslam {
namespace {

/// A kept cell: its matches are `range` of the sorted arrays.
struct Cell {
  int index = 0;  ///< into StaticSelection::cells
  Range range;
  TwoViewModel model;
  std::vector<uint8_t> own;  ///< inliers of its own model, parallel to range
  int num_own = 0;
  CellState state = CellState::kNoModel;
  Eigen::Matrix3d rotation = Eigen::Matrix3d::Identity();  ///< for kPureRotation
  Eigen::Vector2d centroid_px = Eigen::Vector2d::Zero();
};

/// A cell with all that couple with it, and the motion of the whole set.
struct CoupledSet {
  std::vector<size_t> members;  ///< into the kept cells
  TwoViewModel model;
  double distribution_px = 0;
  int support = 0;  ///< inliers of the model in the member cells
};

/// A search that may be made beside others.
MinimaOptions Coarser(MinimaOptions options) {
  options.samples /= 3;
  options.samples_kept /= 2;
  options.directions /= 2;
  options.max_matches /= 2;
  return options;
}

/// One call's work.
class Segmentation {
 public:
  Segmentation(const DlrsacOptions& options, std::span<const Match> matches, const Camera& camera)
      : options_(options), matches_(matches), camera_(camera) {}

  StaticSelection Run(uint64_t seed) {
    seed_ = seed;
    SortIntoCells();
    if (Refused(static_cast<int>(kept_.size()), "enough matches")) return std::move(out_);
    FitCells(seed);
    if (Refused(NumModels(), "a model")) return std::move(out_);
    FillCoupleMatrix();
    const std::optional<CoupledSet> set = ChooseSet();
    if (!set)
      return Refuse(Refusal::kNoModel, "no cell determines a motion: all are degenerate", matches_.size());
    Select(*set);
    return std::move(out_);
  }

 private:
  ModelKind kind() const { return options_.sampling.kind; }
  double CellPx() const {
    return options_.cell_share * std::sqrt(static_cast<double>(camera_.width_px) * camera_.height_px);
  }

  void SortIntoCells();
  void FitCells(uint64_t seed);
  void FitCell(int iterations, Random& random, Cell* cell);
  CellState Classify(Cell* cell) const;
  bool MayLead(const Cell& cell) const;
  double CoupleByRotation(const Eigen::Matrix3d& R, const Cell& cell) const;
  bool SearchSetModel(CoupledSet* set);
  bool ExplainedByPlane(std::span<const int> own) const;
  bool ExplainedByRotation(Cell* cell) const;
  void FillCoupleMatrix();
  double Couple(const Eigen::Matrix3d& M, const Cell& cell) const;
  CoupledSet MakeSet(size_t leader);
  void Measure(CoupledSet* set) const;
  std::optional<CoupledSet> ChooseSet();
  void Select(const CoupledSet& set);
  void KeepLayer(const TwoViewModel& model, std::vector<uint8_t>* flags) const;
  void RefitOnAll(TwoViewModel* model, std::vector<uint8_t>* flags) const;
  double SpreadScore(std::span<const uint8_t> flags) const;
  void SearchMinima(TwoViewModel* model, std::vector<uint8_t>* flags) const;
  double RivalShare(std::span<const uint8_t> flags) const;
  bool RefusedAsAmbiguous(std::span<const uint8_t> flags);

  int NumModels() const {
    return static_cast<int>(
        std::count_if(kept_.begin(), kept_.end(), [](const Cell& c) { return c.num_own > 0; }));
  }
  bool Refused(int cells, const char* what) {
    if (cells >= options_.min_cells) return false;
    out_.refusal = Refusal::kTooFewCells;
    out_.explanation =
        std::to_string(cells) + " cells with " + what + ", " + std::to_string(options_.min_cells) + " needed";
    out_.is_static.assign(matches_.size(), 0);
    return true;
  }

  const DlrsacOptions& options_;
  std::span<const Match> matches_;
  const Camera& camera_;
  std::vector<uint32_t> order_;
  MatchArrays arrays_;
  std::vector<Eigen::Vector2d> positions_px_;  ///< uv0, parallel to arrays_
  std::vector<Cell> kept_;
  /// What was found for sets whose leader knows none; several leaders may couple with the same cells.
  std::map<std::vector<size_t>, std::optional<TwoViewModel>> searched_;
  StaticSelection out_;
  uint64_t seed_ = 0;
};

/// Steps 2: cells, kept ones and their centroids.
void Segmentation::SortIntoCells() {
  out_.columns = std::max(1, static_cast<int>(std::lround(camera_.width_px / CellPx())));
  out_.rows = std::max(1, static_cast<int>(std::lround(camera_.height_px / CellPx())));
  out_.cells.resize(static_cast<size_t>(out_.columns) * static_cast<size_t>(out_.rows));
  const auto cell_of = [&](const Match& match) {
    const int c = static_cast<int>(match.uv0_px.x() * out_.columns / camera_.width_px);
    const int r = static_cast<int>(match.uv0_px.y() * out_.rows / camera_.height_px);
    return std::clamp(r, 0, out_.rows - 1) * out_.columns + std::clamp(c, 0, out_.columns - 1);
  };
  std::vector<int> cell(matches_.size());
  std::transform(matches_.begin(), matches_.end(), cell.begin(), cell_of);
  order_.resize(matches_.size());
  std::iota(order_.begin(), order_.end(), 0U);
  std::stable_sort(order_.begin(), order_.end(), [&](uint32_t a, uint32_t b) { return cell[a] < cell[b]; });
  arrays_ = MakeArrays(matches_, order_, camera_, options_.inlier);
  for (const uint32_t i : order_) positions_px_.push_back(matches_[i].uv0_px);
  const int needed = std::max(options_.min_cell_matches, SampleSize(kind()));
  size_t next = 0;
  for (int index = 0; index < out_.columns * out_.rows; ++index) {
    CellReport& report = out_.cells[static_cast<size_t>(index)];
    report.column = index % out_.columns;
    report.row = index / out_.columns;
    Range range{next, next};
    while (range.end < order_.size() && cell[order_[range.end]] == index) {
      report.centroid_px += matches_[order_[range.end++]].uv0_px;
    }
    next = range.end;
    report.num_matches = static_cast<int>(range.size());
    if (range.size() > 0) report.centroid_px /= static_cast<double>(range.size());
    if (report.num_matches < needed) continue;
    Cell kept;
    kept.index = index;
    kept.range = range;
    kept.centroid_px = report.centroid_px;
    kept_.push_back(std::move(kept));
  }
}

/// Step 3: every kept cell gets its share of the iterations.
void Segmentation::FitCells(uint64_t seed) {
  const int share = std::max(1, options_.sampling.max_iterations / static_cast<int>(kept_.size()));
  for (Cell& cell : kept_) {
    Random random(DeriveSeed(seed, static_cast<uint64_t>(cell.index), "dlrsac-cell"));
    FitCell(share, random, &cell);
    CellReport& report = out_.cells[static_cast<size_t>(cell.index)];
    report.state = cell.state;
    report.num_inliers = cell.num_own;
  }
}

void Segmentation::FitCell(int iterations, Random& random, Cell* cell) {
  const BestSample best = DrawModels(options_.sampling, arrays_, cell->range, iterations, random,
                                     InlierCount{arrays_, cell->range}, InlierShare{arrays_, cell->range});
  out_.iterations += best.iterations;
  if (!best.found()) return;
  std::vector<uint8_t> flags(arrays_.size(), 0);
  const int inliers = FlagInliers(best.model.M, arrays_, cell->range, flags);
  // A sample agrees with itself; a model needs more than that.
  if (inliers <= SampleSize(kind())) return;
  cell->model = best.model;
  cell->num_own = inliers;
  cell->own.assign(flags.begin() + static_cast<ptrdiff_t>(cell->range.begin),
                   flags.begin() + static_cast<ptrdiff_t>(cell->range.end));
  if (kind() == ModelKind::kEssential) ChooseEssentialPose(arrays_, flags, &cell->model);
  cell->state = Classify(cell);
}

CellState Segmentation::Classify(Cell* cell) const {
  if (!options_.tell_degenerate) return CellState::kGeneral;
  std::vector<int> own;
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  for (size_t k = 0; k < cell->own.size(); ++k) {
    if (!cell->own[k]) continue;
    own.push_back(static_cast<int>(cell->range.begin + k));
    mean += matches_[order_[cell->range.begin + k]].uv0_px;
  }
  const double n = static_cast<double>(own.size());
  mean /= n;
  Eigen::Matrix2d scatter = Eigen::Matrix2d::Zero();
  for (const int i : own) {
    const Eigen::Vector2d offset = matches_[order_[static_cast<size_t>(i)]].uv0_px - mean;
    scatter += offset * offset.transpose() / n;
  }
  const double across_px = std::sqrt(std::max(0.0, SmallerEigenvalue(scatter)));
  if (across_px < options_.collinear_share * CellPx()) return CellState::kCollinear;
  if (ExplainedByRotation(cell)) return CellState::kPureRotation;
  if (ExplainedByPlane(own)) return CellState::kPlane;
  return CellState::kGeneral;
}

bool Segmentation::ExplainedByRotation(Cell* cell) const {
  std::vector<uint8_t> use(arrays_.size(), 0);
  std::copy(cell->own.begin(), cell->own.end(), use.begin() + static_cast<ptrdiff_t>(cell->range.begin));
  if (!RefineRotation(arrays_, use, 5, &cell->rotation)) return false;
  return CountRotationInliers(cell->rotation, arrays_, cell->range) >=
         options_.degenerate_share * cell->num_own;
}

bool Segmentation::ExplainedByPlane(std::span<const int> own) const {
  const auto H = HomographyLinear(arrays_.p0, arrays_.p1, own);
  if (!H) return false;
  int explained = 0;
  for (const int index : own) {
    const auto i = static_cast<size_t>(index);
    const double bound = kTwoResidualsForOne * (arrays_.bound0[i] + arrays_.bound1[i]);
    if (TransferErrorSquared(*H, arrays_.p0[i], arrays_.p1[i]) <= bound) ++explained;
  }
  return explained >= options_.degenerate_share * static_cast<double>(own.size());
}

/// Step 4. Cells without a model couple with nothing and are coupled with nothing.
double Segmentation::Couple(const Eigen::Matrix3d& M, const Cell& cell) const {
  if (cell.num_own == 0) return 0;
  if (!options_.couple_over_own_inliers) {
    return CountInliers(M, arrays_, cell.range) / static_cast<double>(cell.range.size());
  }
  std::vector<uint8_t> flags(arrays_.size());
  FlagInliers(M, arrays_, cell.range, flags);
  int shared = 0;
  for (size_t k = 0; k < cell.own.size(); ++k) shared += cell.own[k] & flags[cell.range.begin + k];
  return shared / static_cast<double>(cell.num_own);
}

void Segmentation::FillCoupleMatrix() {
  const auto n = static_cast<Eigen::Index>(out_.cells.size());
  out_.couple = Eigen::MatrixXd::Zero(n, n);
  for (const Cell& leader : kept_) {
    if (leader.num_own == 0) continue;
    const bool rotation = leader.state == CellState::kPureRotation;
    for (const Cell& other : kept_) {
      out_.couple(leader.index, other.index) =
          rotation ? CoupleByRotation(leader.rotation, other) : Couple(leader.model.M, other);
    }
  }
}

/// A cell without visible parallax knows its rotation only: which share of the other cell's own inliers it
/// explains.
double Segmentation::CoupleByRotation(const Eigen::Matrix3d& R, const Cell& cell) const {
  if (cell.num_own == 0) return 0;
  int shared = 0;
  for (size_t k = 0; k < cell.own.size(); ++k) {
    const size_t i = cell.range.begin + k;
    if (cell.own[k]) shared += CountRotationInliers(R, arrays_, {i, i + 1});
  }
  return shared / static_cast<double>(cell.num_own);
}

/// The motion of a set whose leader knows none: the lowest minimum of the epipolar cost over the members.
bool Segmentation::SearchSetModel(CoupledSet* set) {
  if (const auto known = searched_.find(set->members); known != searched_.end()) {
    if (known->second) set->model = *known->second;
    return known->second.has_value();
  }
  std::optional<TwoViewModel>& found = searched_[set->members];
  std::vector<uint8_t> use(arrays_.size(), 0);
  for (const size_t j : set->members) {
    std::copy(kept_[j].own.begin(), kept_[j].own.end(),
              use.begin() + static_cast<ptrdiff_t>(kept_[j].range.begin));
  }
  // Coarser, as there may be many sets.
  const std::vector<EssentialMinimum> minima =
      FindEssentialMinima(arrays_, use, Coarser(options_.minima), seed_);
  if (minima.empty()) return false;
  set->model = minima.front().model;
  found = set->model;
  return true;
}

/// Step 5: the set that `leader` couples with, refined as the options say.
CoupledSet Segmentation::MakeSet(size_t leader) {
  CoupledSet set;
  set.model = kept_[leader].model;
  for (int round = 0;; ++round) {
    std::vector<size_t> members;
    for (size_t j = 0; j < kept_.size(); ++j) {
      const double degree =
          round == 0 ? out_.couple(kept_[leader].index, kept_[j].index) : Couple(set.model.M, kept_[j]);
      if (j == leader || degree > options_.couple_threshold) members.push_back(j);
    }
    const bool settled = round > 0 && members == set.members;
    const bool search = round == 0 && kept_[leader].state == CellState::kPureRotation;
    set.members = std::move(members);
    if (search && SearchSetModel(&set)) continue;
    if (settled || round >= options_.set_refit_rounds) break;
    std::vector<uint8_t> use(arrays_.size(), 0);
    for (const size_t j : set.members) FlagInliers(set.model.M, arrays_, kept_[j].range, use);
    KeepLayer(set.model, &use);
    if (!Refine(kind(), arrays_, use, 5, &set.model)) break;
  }
  Measure(&set);
  return set;
}

/// D over the members' centroids (paper Eq. 3).
void Segmentation::Measure(CoupledSet* set) const {
  Eigen::Vector2d mean = Eigen::Vector2d::Zero();
  double total = 0, sum = 0;
  set->support = 0;
  const auto weight = [&](const Cell& cell) {
    return options_.distribution_weight == DistributionWeight::kCells
               ? 1.0
               : static_cast<double>(cell.range.size());
  };
  for (const size_t j : set->members) {
    mean += weight(kept_[j]) * kept_[j].centroid_px;
    total += weight(kept_[j]);
    set->support += CountInliers(set->model.M, arrays_, kept_[j].range);
  }
  mean /= total;
  for (const size_t j : set->members) sum += weight(kept_[j]) * (kept_[j].centroid_px - mean).squaredNorm();
  set->distribution_px = std::sqrt(sum / total);
}

bool Segmentation::MayLead(const Cell& cell) const {
  if (cell.num_own == 0) return false;
  if (cell.state == CellState::kGeneral) return true;
  const bool essential = kind() == ModelKind::kEssential;
  return essential && (cell.state == CellState::kPlane || cell.state == CellState::kPureRotation);
}

/// Step 6: the widest set; of equally wide ones that with more support.
std::optional<CoupledSet> Segmentation::ChooseSet() {
  std::optional<CoupledSet> best;
  for (size_t i = 0; i < kept_.size(); ++i) {
    if (!MayLead(kept_[i])) continue;
    CoupledSet set = MakeSet(i);
    const bool better = !best || set.distribution_px > best->distribution_px ||
                        (set.distribution_px == best->distribution_px && set.support > best->support);
    if (!better) continue;
    best = std::move(set);
    out_.leading_cell = kept_[i].index;
  }
  return best;
}

/// The answer: model and flags of the chosen set.
void Segmentation::Select(const CoupledSet& set) {
  for (const size_t j : set.members) out_.cells[static_cast<size_t>(kept_[j].index)].chosen = true;
  const double asked_px = options_.min_distribution_share * DiagonalPx(camera_);
  if (set.distribution_px < asked_px) {
    out_.refusal = Refusal::kDistributionTooSmall;
    out_.explanation = "the widest coupled set spreads over " + std::to_string(set.distribution_px) +
                       " px, " + std::to_string(asked_px) + " asked for";
    out_.is_static.assign(matches_.size(), 0);
    return;
  }
  TwoViewModel model = set.model;
  std::vector<uint8_t> flags(arrays_.size(), 0);
  if (options_.scope == StaticScope::kImage) {
    RefitOnAll(&model, &flags);
    SearchMinima(&model, &flags);
    if (RefusedAsAmbiguous(flags)) return;
  } else {
    for (const size_t j : set.members) FlagInliers(model.M, arrays_, kept_[j].range, flags);
    if (options_.scope == StaticScope::kCoupledCells) {
      for (const size_t j : set.members) {
        for (size_t k = kept_[j].range.begin; k < kept_[j].range.end; ++k) flags[k] = 1;
      }
    }
  }
  Finish(matches_, order_, flags, model, kind(), camera_, options_.min_static, &out_);
  for (const Cell& cell : kept_) {
    CellReport& report = out_.cells[static_cast<size_t>(cell.index)];
    for (size_t k = cell.range.begin; k < cell.range.end; ++k) report.num_static += out_.is_static[order_[k]];
  }
}

void Segmentation::KeepLayer(const TwoViewModel& model, std::vector<uint8_t>* flags) const {
  if (kind() != ModelKind::kEssential || !options_.layers.enabled) return;
  KeepWidestLayer(options_.layers, model, arrays_, positions_px_, *flags);
}

/// Selects over the whole image, within the widest layer, and refits to what was selected.
void Segmentation::RefitOnAll(TwoViewModel* model, std::vector<uint8_t>* flags) const {
  const Range all{0, arrays_.size()};
  for (int round = 0;; ++round) {
    std::vector<uint8_t> selected(arrays_.size());
    FlagInliers(model->M, arrays_, all, selected);
    KeepLayer(*model, &selected);
    const bool settled = round > 0 && selected == *flags;
    *flags = std::move(selected);
    if (settled || round >= options_.sampling.refit_rounds || !Refine(kind(), arrays_, *flags, 5, model))
      break;
  }
}

/// D over the flagged matches, times their number.
double Segmentation::SpreadScore(std::span<const uint8_t> flags) const {
  std::vector<Eigen::Vector2d> points;
  for (size_t k = 0; k < flags.size(); ++k) {
    if (flags[k]) points.push_back(positions_px_[k]);
  }
  const double spread = Spread(points);
  return spread * spread * static_cast<double>(points.size());
}

void Segmentation::SearchMinima(TwoViewModel* model, std::vector<uint8_t>* flags) const {
  if (kind() != ModelKind::kEssential || !options_.search_minima) return;
  std::vector<uint8_t> loose(arrays_.size(), 0);
  for (size_t k = 0; k < arrays_.size(); ++k) {
    loose[k] = NormalizedSampson(model->M, arrays_, k) <= options_.loose_bound ? 1 : 0;
  }
  const std::vector<EssentialMinimum> minima = FindEssentialMinima(arrays_, loose, options_.minima, seed_);
  double best = SpreadScore(*flags);
  for (const EssentialMinimum& minimum : minima) {
    if (minimum.cost > options_.minima_slack * minima.front().cost) break;
    TwoViewModel other = minimum.model;
    std::vector<uint8_t> other_flags;
    RefitOnAll(&other, &other_flags);
    const double score = SpreadScore(other_flags);
    if (score <= best) continue;
    best = score;
    *model = other;
    *flags = std::move(other_flags);
  }
}

/// D times number of the widest motion among the matches not flagged, as a share of that of the flagged. It
/// may be the chosen motion again, in a layer of disparity that KeepLayer left out.
double Segmentation::RivalShare(std::span<const uint8_t> flags) const {
  std::vector<uint8_t> rest(flags.size());
  std::transform(flags.begin(), flags.end(), rest.begin(), [](uint8_t f) -> uint8_t { return f ? 0 : 1; });
  const double chosen = SpreadScore(flags);
  // D times number is a sum of squares and grows with each match: mostly all the rest is too little.
  if (!(chosen > 0) || SpreadScore(rest) <= options_.max_rival_share * chosen) return 0;
  double widest = 0;
  for (const EssentialMinimum& minimum :
       FindEssentialMinima(arrays_, rest, Coarser(options_.minima), seed_)) {
    std::vector<uint8_t> rival(flags.size());
    FlagInliers(minimum.model.M, arrays_, {0, arrays_.size()}, rival);
    for (size_t k = 0; k < rival.size(); ++k) rival[k] &= rest[k];
    KeepLayer(minimum.model, &rival);
    if (std::accumulate(rival.begin(), rival.end(), 0) < options_.min_static) continue;
    widest = std::max(widest, SpreadScore(rival));
  }
  return widest / chosen;
}

bool Segmentation::RefusedAsAmbiguous(std::span<const uint8_t> flags) {
  if (kind() != ModelKind::kEssential || options_.max_rival_share <= 0) return false;
  const double share = RivalShare(flags);
  if (share <= options_.max_rival_share) return false;
  out_.refusal = Refusal::kAmbiguous;
  char text[128];
  std::snprintf(text, sizeof(text),
                "another motion or depth layer has %.2f of the chosen one's spread, %.2f allowed", share,
                options_.max_rival_share);
  out_.explanation = text;
  out_.is_static.assign(matches_.size(), 0);
  return true;
}

}  // namespace

DlrsacOptions DlrsacOptions::Paper() {
  DlrsacOptions options;
  options.sampling.stop_confidence = 0.0;
  options.sampling.kind = ModelKind::kFundamental;
  options.sampling.refit_rounds = 0;
  options.inlier.scale_by_octave = false;
  options.set_refit_rounds = 0;
  options.scope = StaticScope::kCoupledCells;
  options.tell_degenerate = false;
  options.layers.enabled = false;
  options.search_minima = false;
  options.min_distribution_share = 0.0;
  options.max_rival_share = 0.0;
  return options;
}

void DlrsacOptions::Check() const {
  const auto require = [](bool holds, const char* field, const char* range) {
    if (!holds) throw InputError(std::string("dlrsac: ") + field + " must be " + range);
  };
  const auto is_share = [](double value) { return value >= 0 && value <= 1; };
  require(cell_share > 0 && cell_share <= 4, "cell_share", "above 0 and at most 4");
  require(min_cells >= 1, "min_cells", "at least 1");
  require(is_share(couple_threshold), "couple_threshold", "in 0..1");
  require(is_share(degenerate_share), "degenerate_share", "in 0..1");
  require(is_share(min_distribution_share), "min_distribution_share", "in 0..1");
  require(is_share(max_rival_share), "max_rival_share", "in 0..1");
}

StaticSelection Dlrsac::Select(std::span<const Match> matches, const Camera& camera, uint64_t seed) const {
  if (const auto problem = CheckMatches(matches, camera, options_.input)) {
    return Refuse(problem->refusal, problem->explanation, matches.size());
  }
  return Segmentation(options_, matches, camera).Run(seed);
}

}  // namespace dmslam
