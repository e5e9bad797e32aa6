#pragma once

#include <string>

#include "dmslam/wire/status.h"
#include "viewer/process_board.h"

namespace dmslam {

/// How a system fares, for machines.
struct HealthText {
  bool well = false;       ///< nobody who was heard is silent, and all whom a run needs have been heard
  std::string json;        ///< {"well": true, "processes": {"mapper": "up", ...}}
  std::string prometheus;  ///< the text format of Prometheus, version 0.0.4
};

HealthText WriteHealth(const ProcessBoard& board, const FrontendStatus& frontend, const MapperStatus& mapper);

}  // namespace dmslam
