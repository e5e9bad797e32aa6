#include "timing.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <memory>

#include "dmslam/evaluation/statistics.h"
#include "dmslam/motion_segmentation/dlrsac.h"
#include "dmslam/motion_segmentation/ransac.h"

namespace dmslam {
namespace {

SamplingOptions Sampling(int iterations) {
  SamplingOptions sampling;
  sampling.kind = ModelKind::kFundamental;
  sampling.max_iterations = iterations;
  sampling.stop_confidence = 0;
  sampling.refit_rounds = 0;  // sampling alone
  return sampling;
}

std::array<std::unique_ptr<StaticSelector>, 3> Methods(int iterations) {
  RansacSelectorOptions ransac;
  ransac.sampling = Sampling(iterations);
  ArsacOptions arsac;
  arsac.sampling = Sampling(iterations);
  DlrsacOptions dlrsac = DlrsacOptions::Paper();
  dlrsac.sampling.kind = ModelKind::kFundamental;
  dlrsac.sampling.max_iterations = iterations;
  dlrsac.sampling.stop_confidence = 0;
  return {std::make_unique<RansacSelector>(ransac), std::make_unique<Arsac>(arsac),
          std::make_unique<Dlrsac>(dlrsac)};
}

}  // namespace

MethodTimes TimeMethods(const std::vector<Match>& matches, const Camera& camera,
                        const TimingOptions& options) {
  const auto methods = Methods(options.iterations);
  std::array<std::vector<double>, 3> times_ms;
  MethodTimes result;
  for (int round = 0; round < std::max(1, options.rounds); ++round) {
    for (size_t i = 0; i < methods.size(); ++i) {
      const auto start = std::chrono::steady_clock::now();
      const StaticSelection selection = methods[i]->Select(matches, camera, static_cast<uint64_t>(round));
      const std::chrono::duration<double, std::milli> took = std::chrono::steady_clock::now() - start;
      times_ms[i].push_back(took.count());
      result.iterations[std::string(methods[i]->name())] = selection.iterations;
    }
  }
  result.ransac_ms = Median(times_ms[0]);
  result.arsac_ms = Median(times_ms[1]);
  result.dlrsac_ms = Median(times_ms[2]);
  return result;
}

}  // namespace dmslam
