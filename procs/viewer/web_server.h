#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "viewer/exchange.h"
#include "viewer/playback_control.h"

namespace dmslam {

struct WebServerOptions {
  std::string host = "127.0.0.1";
  int port = 8080;          ///< 0: any that is free
  bool or_any_port = true;  ///< takes any free port where that one is taken
  std::string token;  ///< asked of every browser; empty: one is made where others than this host can come
  std::vector<std::string> names;  ///< by which this host is called, besides localhost and its addresses
  std::string web_dir;             ///< the page
  std::string three_dir;           ///< three.js, as Debian's libjs-three lays it out
  std::string chart_dir;           ///< Chart.js, as Debian's libjs-chart.js lays it out
};

/// Serves the page, the map and the events over HTTP, in a thread of its own that touches nothing but the
/// exchange. Where others than this host can come, who comes must bring a token.
class WebServer {
 public:
  /// Binds and begins to serve. Throws InputError that names what is missing and the cure.
  /// With `control` browsers may say what part of a log they want to see; nothing else can be sent to it.
  WebServer(WebServerOptions options, Exchange* exchange, PlaybackControl* control = nullptr);
  ~WebServer();

  /// "http://127.0.0.1:8080/", with the token behind it where one is asked for.
  const std::string& address() const { return address_; }

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
  std::string address_;
};

}  // namespace dmslam
