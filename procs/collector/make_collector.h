#pragma once

#include <memory>
#include <string>
#include <vector>

#include "dmslam/runtime/node.h"
#include "dmslam/runtime/node_options.h"

namespace dmslam {

struct CollectorOptions {
  std::string out_dir;
  std::vector<std::string> ground_truth;  ///< TUM trajectory of each camera; empty, or left out: none
  bool progress = false;                  ///< show progress on the terminal
  bool for_people = true;                 ///< also draw trajectory.png, and print the summary
  bool checkpoints = true;                ///< as the settings say; false: none, whatever they say
};

/// A `CollectorNode`, for those who only run one: its own header is much to compile.
std::unique_ptr<Node> MakeCollector(NodeContext context, NodeOptions options, CollectorOptions collector);

}  // namespace dmslam
