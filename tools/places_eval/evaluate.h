#pragma once

#include <array>
#include <cstddef>
#include <cstdint>
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
  double near_distance =
      1.0;  ///< near view, which shows much of the same: the same with wider bounds; neither right
  double near_angle_deg = 45.0;  ///< nor a false place
  double accept_margin =
      0.1;  ///< an estimated pose must be closer than the bounds of the same view by this share
  size_t max_candidates = 10;  ///< places that are verified per query
  uint64_t seed = 1;
};

/// Which answers are compared: the place of the highest bag-of-words score; the one with most matches under
/// common nodes that agree on an essential matrix; the one with most matches to its points that agree on a
/// pose, among those whose pose makes them the same view. The points of a place are triangulated from views
/// next to it in time with the true poses, as if a map had been made before; the pose of the query is
/// estimated from them alone.
enum class Stage { kScore, kEssential, kPose };
inline constexpr size_t kNumStages = 3;

/// What was answered for one query at one stage.
struct PlaceAnswer {
  double confidence = 0;  ///< score or number of inliers; 0 = no answer
  bool right = false;     ///< same view
  bool near = false;      ///< near view
};

struct PlacesResult {
  struct Query {
    bool expected = false;  ///< an earlier view that is the same exists
    std::array<PlaceAnswer, kNumStages> answers;
  };
  std::vector<Query> queries;
  size_t num_expected = 0;
  double query_ms = 0;  ///< mean of a query, without verification
};

/// Recognises every view of a sequence among the earlier ones. Throws InputError for wrong input.
PlacesResult EvaluatePlaces(const PlacesOptions& options);

/// A point of a precision-recall curve: what results from accepting only answers with at least this
/// confidence.
struct CurvePoint {
  double threshold = 0;
  double precision = 1;        ///< right answers among all
  double place_precision = 1;  ///< right answers among right and false ones, near views left out
  double recall = 0;           ///< right answers among the views that have an earlier same view
};

/// Curve by falling threshold.
std::vector<CurvePoint> PrecisionRecall(const PlacesResult& result, Stage stage);

/// Largest recall without a wrong answer; `place`: near views are not counted as wrong. 0 when there is none.
CurvePoint BestWithoutError(const std::vector<CurvePoint>& curve, bool place);

using Curves = std::array<std::vector<CurvePoint>, kNumStages>;
const char* StageName(Stage stage);

/// Writes the curves as "stage,threshold,precision,place_precision,recall" and as a drawing.
void WriteCurvesCsv(const std::string& path, const Curves& curves);
void WriteCurvesSvg(const std::string& path, const Curves& curves);

}  // namespace dmslam
