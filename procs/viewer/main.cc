
#include <optional>

#include "dmslam/console/command_line.h"
#include "dmslam/console/log.h"
#include "dmslam/messaging/event_loop.h"
#include "dmslam/messaging/roles.h"
#include "dmslam/runtime/process_main.h"
#include "dmslam/util/http_address.h"
#include "viewer/log_playback.h"
#include "viewer/viewer_node.h"
#include "viewer/web_server.h"

namespace {

/// The viewer with all it needs, in the order in which it must die.
class ServedViewer : public dmslam::Node {
 public:
  ServedViewer(dmslam::NodeContext context, dmslam::NodeOptions options, const dmslam::ViewerOptions& viewer,
               const dmslam::WebServerOptions& web)
      : node_(std::move(context), std::move(options), viewer, &exchange_), server_(web, &exchange_) {
    dmslam::LogInfo("{}", ready_text());
  }
  void Advance() override { node_.Advance(); }
  int64_t deadline_ns() const override { return node_.deadline_ns(); }
  void Stop() override { node_.Stop(); }
  std::optional<int> exit_code() const override { return node_.exit_code(); }
  std::string problem() const override { return node_.problem(); }
  std::string ready_text() const override { return "watch it live at " + server_.address(); }

 private:
  dmslam::Exchange exchange_;
  dmslam::ViewerNode node_;
  dmslam::WebServer server_;
};

/// Shows a log until somebody asks to stop.
int ShowLog(const std::string& log, const dmslam::NodeOptions& options, const dmslam::ViewerOptions& viewer,
            const dmslam::WebServerOptions& web) {
  dmslam::EventLoop loop;
  dmslam::Exchange exchange([] { return int64_t{0}; });  // a log that stands still is not ill
  dmslam::PlaybackControl control;
  dmslam::LogPlayback playback(log, options, viewer, &exchange);
  const dmslam::WebServer server(web, &exchange, &control);
  dmslam::LogInfo("watch it at {}", server.address());
  loop.Watch(control.fd(), [&] { playback.Fulfil(control.Take(), dmslam::EventLoop::now_ns()); });
  while (loop.PumpOnce(playback.deadline_ns())) playback.Advance(dmslam::EventLoop::now_ns());
  return 0;
}

/// There and nowhere else.
void ServeAt(const dmslam::HttpAddress& address, dmslam::WebServerOptions* web) {
  web->host = address.host;
  web->port = address.port;
  web->or_any_port = false;
}

}  // namespace

int main(int argc, char** argv) {
  dmslam::ProcessMain process(dmslam::roles::kViewer,
                              "Shows a running system in browsers; reads the bus and writes nothing to it.");
  dmslam::ViewerOptions viewer;
  dmslam::WebServerOptions web;
  web.three_dir = DMSLAM_THREE_DIR;
  web.chart_dir = DMSLAM_CHART_DIR;
  std::string http, log;
  dmslam::CommandLine& app = process.app();
  app.AddOption(
      "--http", http,
      "HOST:PORT to serve on, port 0: any that is free; default: 127.0.0.1:8080, or any where that is taken");
  app.AddOption(
      "--http-token", web.token,
      "ask every browser for this word (?token=WORD); default: a random one where HOST can be reached from "
      "elsewhere, else none");
  app.AddOption(
      "--http-name", web.names,
      "serve requests for this host name too; default: localhost and literal addresses. May be repeated");
  app.AddOption("--log", log, "show this log of lcm-logger instead of a running system");
  app.AddOption("--ground-truth", viewer.ground_truth,
                "trajectory in TUM format; default: what the player says");
  app.AddOption("--web", web.web_dir, "folder of the page; default: the one that ships");
  app.AddOption("--three", web.three_dir, "folder of three.js").ShowDefault();
  app.AddOption("--chart", web.chart_dir, "folder of Chart.js").ShowDefault();
  const auto complete = [&] {
    if (!http.empty()) ServeAt(dmslam::ParseHttpAddress(http), &web);
    if (web.web_dir.empty()) web.web_dir = dmslam::FindDataFolder("procs/viewer/web");
  };
  process.SetOffline([&](const dmslam::NodeOptions& options) -> std::optional<int> {
    complete();
    return log.empty() ? std::nullopt : std::optional(ShowLog(log, options, viewer, web));
  });
  return process.Run(argc, argv, [&](dmslam::NodeContext context, dmslam::NodeOptions options) {
    return std::make_unique<ServedViewer>(std::move(context), std::move(options), viewer, web);
  });
}
