#pragma once

#include <memory>
#include <string>

#include "dmslam/runtime/node.h"
#include "dmslam/runtime/node_options.h"

namespace dmslam {

class Vocabulary;

/// What a frontend is given besides its settings.
struct FrontendExtras {
  std::shared_ptr<const Vocabulary> vocabulary;
  std::string picture_dir;   ///< empty: no pictures
  int picture_every = 0;     ///< every Nth frame
  std::string frame_memory;  ///< folder of the frames that wait for their last poses; empty: they die with it
};

/// A `FrontendNode`, for those who only run one: its own header is much to compile.
std::unique_ptr<Node> MakeFrontend(NodeContext context, const NodeOptions& options, FrontendExtras extras);

}  // namespace dmslam
