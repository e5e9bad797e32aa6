#include "dmslam/messaging/roles.h"
#include "dmslam/runtime/process_main.h"
#include "mapper/make_mapper.h"

int main(int argc, char** argv) {
  dmslam::ProcessMain process(dmslam::roles::kMapper, "Builds the map: the only process that writes it.");
  dmslam::MapperFiles files;
  dmslam::AddMapperOptions(process.app(), &files);
  return process.Run(argc, argv, [&](dmslam::NodeContext context, dmslam::NodeOptions options) {
    return dmslam::MakeMapper(std::move(context), std::move(options), files);
  });
}
