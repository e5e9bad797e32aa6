#include <unistd.h>

#include "collector/make_collector.h"
#include "dmslam/messaging/roles.h"
#include "dmslam/runtime/process_main.h"

int main(int argc, char** argv) {
  dmslam::ProcessMain process(dmslam::roles::kCollector,
                              "Collects a run's trajectory, map and statuses and writes its results.");
  dmslam::CollectorOptions collector;
  process.app().AddOption("--out", collector.out_dir, "folder for the results").Required();
  process.app().AddOption("--ground-truth", collector.ground_truth,
                          "trajectory in TUM format; of several cameras one after another, - for none");
  collector.progress = isatty(STDERR_FILENO) != 0;
  return process.Run(argc, argv, [&](dmslam::NodeContext context, dmslam::NodeOptions options) {
    return dmslam::MakeCollector(std::move(context), std::move(options), collector);
  });
}
