#pragma once

#include <memory>
#include <string>

#include "dmslam/console/command_line.h"
#include "dmslam/runtime/node.h"
#include "dmslam/runtime/node_options.h"

namespace dmslam {

/// Maps as files; empty: none.
struct MapperFiles {
  std::string load;        ///< a saved map, or a log: the map to begin with
  std::string save;        ///< where the map is written at the end
  std::string checkpoint;  ///< of this session, written by the collector: begun with where nobody has the map
};

/// The options that say them, and DMSLAM_CHECKPOINT; `files` must outlive the parsing.
void AddMapperOptions(CommandLine& app, MapperFiles* files);

/// A `MapperNode`, for those who only run one: its own header is much to compile.
std::unique_ptr<Node> MakeMapper(NodeContext context, NodeOptions options, MapperFiles files = {});

}  // namespace dmslam
