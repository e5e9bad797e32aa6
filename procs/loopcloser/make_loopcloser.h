#pragma once

#include <memory>

#include "dmslam/runtime/node.h"
#include "dmslam/runtime/node_options.h"

namespace dmslam {

class Vocabulary;

/// A `LoopcloserNode`, for those who only run one: its own header is much to compile.
std::unique_ptr<Node> MakeLoopcloser(NodeContext context, NodeOptions options,
                                     std::shared_ptr<const Vocabulary> vocabulary);

}  // namespace dmslam
