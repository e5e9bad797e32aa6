#include "dmslam/runtime/process_main.h"
#include "tour_node.h"

int main(int argc, char** argv) {
  dmslam::ProcessMain process(
      "map-tour", "Writes a made-up map of any size to the bus, in a mapper's place: to try viewers.");
  dmslam::TourNodeOptions tour;
  CLI::App& app = process.app();
  app.add_option("--keyframes", tour.tour.keyframes)->check(CLI::Range(1, 1'000'000))->capture_default_str();
  app.add_option("--landmarks", tour.tour.landmarks)
      ->check(CLI::Range(1, 100'000'000))
      ->capture_default_str();
  app.add_option("--seed", tour.tour.seed)->capture_default_str();
  app.add_option("--rate", tour.rate, "keyframes per second")
      ->check(CLI::Range(0.1, 1e6))
      ->capture_default_str();
  return process.Run(argc, argv, [&](dmslam::NodeContext context, dmslam::NodeOptions options) {
    return std::make_unique<dmslam::TourNode>(std::move(context), std::move(options), tour);
  });
}
