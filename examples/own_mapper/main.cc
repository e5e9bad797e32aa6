// The library's mapper under a main of its own, in place of the process dmslam-mapper: it reads and writes
// the same streams and takes the same options (--help). What is added here is a line at the end: how long its
// turns took.
#include <algorithm>
#include <cstdio>
#include <memory>
#include <utility>

#include "dmslam/messaging/event_loop.h"
#include "dmslam/runtime/process_main.h"
#include "mapper/make_mapper.h"

namespace {

/// Hands everything on to the mapper, and measures.
class MeasuredNode : public dmslam::NodeDecorator {
 public:
  using NodeDecorator::NodeDecorator;
  ~MeasuredNode() override {
    std::printf("own mapper: %d turns, the longest took %.1f ms\n", turns_, longest_ms_);
  }

  void Advance() override {
    const int64_t begin_ns = dmslam::EventLoop::now_ns();
    NodeDecorator::Advance();
    longest_ms_ = std::max(longest_ms_, 1e-6 * static_cast<double>(dmslam::EventLoop::now_ns() - begin_ns));
    ++turns_;
  }

 private:
  int turns_ = 0;
  double longest_ms_ = 0;
};

}  // namespace

int main(int argc, char** argv) {
  dmslam::ProcessMain process("mapper", "The library's mapper under a main of its own.");
  dmslam::MapperFiles files;
  dmslam::AddMapperOptions(process.app(), &files);
  return process.Run(argc, argv, [&](dmslam::NodeContext context, dmslam::NodeOptions options) {
    return std::make_unique<MeasuredNode>(dmslam::MakeMapper(std::move(context), std::move(options), files));
  });
}
