#include "dmslam/console/command_line.h"
#include "dmslam/runtime/process_main.h"
#include "tour_node.h"

int main(int argc, char** argv) {
  dmslam::ProcessMain process(
      "map-tour", "Writes a made-up map of any size to the bus, in a mapper's place: to try viewers.");
  dmslam::TourNodeOptions tour;
  dmslam::CommandLine& app = process.app();
  app.AddOption("--keyframes", tour.tour.keyframes).InRange(1, 1'000'000).ShowDefault();
  app.AddOption("--landmarks", tour.tour.landmarks).InRange(1, 100'000'000).ShowDefault();
  app.AddOption("--features", tour.tour.features, "of a keyframe, at least").InRange(0, 10'000).ShowDefault();
  app.AddOption("--seed", tour.tour.seed).ShowDefault();
  app.AddOption("--rate", tour.rate, "keyframes per second").InRange(0.1, 1e6).ShowDefault();
  return process.Run(argc, argv, [&](dmslam::NodeContext context, dmslam::NodeOptions options) {
    return std::make_unique<dmslam::TourNode>(std::move(context), std::move(options), tour);
  });
}
