#include <cstdlib>

#include "dmslam/messaging/roles.h"
#include "dmslam/runtime/process_main.h"
#include "mapper/make_mapper.h"

int main(int argc, char** argv) {
  dmslam::ProcessMain process(dmslam::roles::kMapper, "Builds the map: the only process that writes it.");
  dmslam::MapperFiles files;
  if (const char* checkpoint = std::getenv("DMSLAM_CHECKPOINT")) files.checkpoint = checkpoint;
  process.app().AddOption("--map", files.load,
                          "saved map or log: begin with this map (needs the setting map.saved)");
  process.app().AddOption("--checkpoint", files.checkpoint,
                          "the collector's checkpoint of this session: go on from it where no other process "
                          "has the map any more; default: what DMSLAM_CHECKPOINT names");
  process.app().AddOption("--save-map", files.save, "write the map into this file at the end");
  return process.Run(argc, argv, [&](dmslam::NodeContext context, dmslam::NodeOptions options) {
    return dmslam::MakeMapper(std::move(context), std::move(options), files);
  });
}
