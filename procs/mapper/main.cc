#include "common/process_main.h"
#include "mapper/mapper_node.h"

int main(int argc, char** argv) {
  dmslam::ProcessMain process("mapper", "Builds the map: the only process that writes it.");
  return process.Run(argc, argv, [](dmslam::NodeContext context, dmslam::NodeOptions options) {
    return std::make_unique<dmslam::MapperNode>(std::move(context), std::move(options));
  });
}
