#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <vector>

#include "dmslam/geometry/pinhole.h"

namespace dmslam {

/// What is evaluated, and what counts as the same view.
struct PlacesOptions {
  std::string sequence;  ///< TUM RGB-D folder with groundtruth.txt
  std::string vocabulary;
  Pinhole camera;  ///< of images without distortion
  int features = 1000;
  int every = 5;              ///< every n-th frame is a view
  double min_gap_s = 5.0;     ///< views closer in time are not compared
  double max_distance = 0.3;  ///< same view: camera centres at most this far apart [unit of the ground truth]
  double max_angle_deg = 20.0;  ///< and at most this much turned
  size_t max_candidates = 10;   ///< places that are verified per query
  uint64_t seed = 1;
};

/// What was answered for one query: the view that looks most alike, and the one with most verified matches.
struct PlaceAnswer {
  double score = 0;  ///< L1 score of the best place; 0 = none
  bool score_right = false;
  int inliers = 0;  ///< verified matches of the best verified place; 0 = none
  bool inliers_right = false;
  bool expected = false;  ///< an earlier view that is the same exists
};

struct PlacesResult {
  std::vector<PlaceAnswer> answers;  ///< one per view
  size_t num_views = 0;
  size_t num_expected = 0;
  double query_ms = 0;  ///< mean of a query, without verification
};

/// Recognises every view of a sequence among the earlier ones: places by the bag of words, verified by
/// matches under common nodes of the vocabulary that agree on an essential matrix. Throws InputError for
/// wrong input.
PlacesResult EvaluatePlaces(const PlacesOptions& options);

/// A point of a precision-recall curve: what results from accepting only answers with at least this
/// confidence.
struct CurvePoint {
  double threshold = 0;
  double precision = 1;
  double recall = 0;
};

enum class Confidence { kScore, kInliers };

/// Curve by falling threshold. Recall: right answers among the views that have an earlier same view.
std::vector<CurvePoint> PrecisionRecall(const PlacesResult& result, Confidence confidence);

/// The point of largest recall among those without a wrong answer; none when the first answer is wrong.
std::optional<CurvePoint> BestWithoutError(const std::vector<CurvePoint>& curve);

/// Writes the curves as "stage,threshold,precision,recall" and as a drawing.
void WriteCurvesCsv(const std::string& path, const std::vector<CurvePoint>& by_score,
                    const std::vector<CurvePoint>& by_inliers);
void WriteCurvesSvg(const std::string& path, const std::vector<CurvePoint>& by_score,
                    const std::vector<CurvePoint>& by_inliers);

}  // namespace dmslam
