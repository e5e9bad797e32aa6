#include "viewer/web_server.h"

#include <charconv>
#include <cstdio>
#include <filesystem>
#include <map>
#include <optional>
#include <random>
#include <utility>

#include "dmslam/dataset/image.h"
#include "dmslam/util/check.h"
#include "viewer/http_server.h"

namespace dmslam {
namespace {

constexpr int64_t kMostSeries = 4000;

struct File {
  std::string type;
  std::string content;
};

std::string TypeOf(const std::filesystem::path& path) {
  const std::string extension = path.extension().string();
  if (extension == ".html") return "text/html; charset=utf-8";
  if (extension == ".js") return "text/javascript; charset=utf-8";
  if (extension == ".css") return "text/css; charset=utf-8";
  if (extension == ".svg") return "image/svg+xml";
  return "application/octet-stream";
}

File Load(const std::string& path) {
  const std::vector<uint8_t> bytes = ReadFileBytes(path);
  return {TypeOf(path), std::string(bytes.begin(), bytes.end())};
}

File LoadLibrary(const std::string& path, const std::string& package, const std::string& option) {
  if (!std::filesystem::is_regular_file(path)) {
    throw InputError(path + ": not found; install " + package +
                     " (scripts/setup.sh viewer), or say where it is with " + option);
  }
  return Load(path);
}

/// All that is served as it is, by its address.
std::map<std::string, File> LoadFiles(const WebServerOptions& options) {
  std::map<std::string, File> files;
  for (const auto& entry : std::filesystem::directory_iterator(options.web_dir)) {
    if (entry.is_regular_file())
      files[std::string("/").append(entry.path().filename().string())] = Load(entry.path().string());
  }
  const auto index = files.find("/index.html");
  if (index == files.end()) {
    throw InputError(options.web_dir + ": there is no index.html; give the folder of the page with --web");
  }
  files["/"] = index->second;
  for (const char* name : {"/build/three.module.js", "/examples/jsm/controls/OrbitControls.js"}) {
    files[std::string("/three") + name] = LoadLibrary(options.three_dir + name, "libjs-three", "--three");
  }
  files["/chart.js"] = LoadLibrary(options.chart_dir + "/chart.min.js", "libjs-chart.js", "--chart");
  return files;
}

/// A number in the address's query; none where it is missing or no number.
template <typename Number>
std::optional<Number> Query(const HttpRequest& request, const std::string& name) {
  const auto it = request.query.find(name);
  if (it == request.query.end()) return std::nullopt;
  const std::string& text = it->second;
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

HttpResponse Content(std::string type, std::string body) {
  HttpResponse response;
  response.type = std::move(type);
  response.body = std::move(body);
  return response;
}

/// `health`: nothing where the viewer hangs, which no former answer may hide.
HttpResponse ServeHealth(const std::optional<HealthText>& health, bool metrics) {
  HttpResponse response;
  if (!health) {
    response = Content("application/json", "{\"well\": false, \"reason\": \"the viewer hangs\"}\n");
  } else if (metrics) {
    response = Content("text/plain; version=0.0.4; charset=utf-8", health->prometheus);
  } else {
    response = Content("application/json", health->json);
  }
  if (!health || (!metrics && !health->well)) response.status = 503;
  return response;
}

HttpResponse Status(int status) {
  HttpResponse response;
  response.status = status;
  return response;
}

std::string RandomToken() {
  std::random_device device;
  char text[33];
  std::snprintf(text, sizeof(text), "%08x%08x%08x%08x", device(), device(), device(), device());
  return text;
}

}  // namespace

struct WebServer::Impl {
  Impl(Exchange* the_exchange, PlaybackControl* the_control) : exchange(the_exchange), control(the_control) {}
  HttpResponse Handle(const HttpRequest& request) const;
  HttpResponse Serve(const HttpRequest& request) const;
  HttpResponse ServeScene(const HttpRequest& request) const;
  HttpResponse ServeImage(const HttpRequest& request) const;
  HttpResponse TakeWish(const HttpRequest& request) const;

  Exchange* exchange;
  PlaybackControl* control;
  std::map<std::string, File> files;
  HttpGate gate;
  std::unique_ptr<HttpServer> server;
};

HttpResponse WebServer::Impl::Handle(const HttpRequest& request) const {
  const int refusal = gate.Refusal(request);
  HttpResponse response = refusal != 0 ? Status(refusal) : Serve(request);
  response.headers.insert(response.headers.end(),
                          {{"Cache-Control", "no-store"},
                           {"X-Content-Type-Options", "nosniff"},
                           {"X-Frame-Options", "DENY"},
                           {"Referrer-Policy", "no-referrer"},
                           {"Cross-Origin-Resource-Policy", "same-origin"},
                           {"Content-Security-Policy", "default-src 'self'; img-src 'self' blob: data:"}});
  if (refusal == 0 && gate.BringsToken(request))
    response.headers.emplace_back("Set-Cookie",
                                  "dmslam_token=" + gate.token + "; HttpOnly; SameSite=Strict; Path=/");
  return response;
}

HttpResponse WebServer::Impl::Serve(const HttpRequest& request) const {
  if (request.method == "POST") return TakeWish(request);
  if (request.method != "GET" && request.method != "HEAD") return Status(405);
  if (const auto file = files.find(request.path); file != files.end())
    return Content(file->second.type, file->second.content);
  if (request.path == "/api/map") return ServeScene(request);
  if (request.path == "/api/frame.jpg") return ServeImage(request);
  if (request.path == "/api/series") {
    const int64_t since = Query<int64_t>(request, "since").value_or(0);
    const CameraId camera = Query<CameraId>(request, "camera").value_or(0);
    return Content("application/json", exchange->SeriesJson(since, kMostSeries, camera));
  }
  if (request.path == "/metrics" || request.path == "/healthz")
    return ServeHealth(exchange->Health(), request.path == "/metrics");
  if (request.path != "/api/events") return Status(404);
  HttpResponse response = Content("text/event-stream", "");
  response.events = true;
  return response;
}

HttpResponse WebServer::Impl::TakeWish(const HttpRequest& request) const {
  if (control == nullptr || request.path != "/api/playback") return Status(404);
  PlaybackWish wish{Query<double>(request, "position"), std::nullopt, Query<double>(request, "speed")};
  if (const auto playing = Query<int>(request, "playing")) wish.playing = *playing != 0;
  control->Wish(wish);
  return Status(204);
}

HttpResponse WebServer::Impl::ServeScene(const HttpRequest& request) const {
  const auto generation = Query<uint32_t>(request, "generation").value_or(0);
  const std::vector<uint8_t> bytes =
      exchange->EncodeScene(generation, Query<uint64_t>(request, "since").value_or(0));
  return Content("application/octet-stream", std::string(bytes.begin(), bytes.end()));
}

HttpResponse WebServer::Impl::ServeImage(const HttpRequest& request) const {
  const std::shared_ptr<ServedImage> image =
      exchange->FindImage(Query<uint32_t>(request, "frame"), Query<CameraId>(request, "camera").value_or(0));
  if (!image || image->Jpeg().empty()) return Status(204);
  const std::vector<uint8_t>& jpeg = image->Jpeg();
  HttpResponse response = Content("image/jpeg", std::string(jpeg.begin(), jpeg.end()));
  response.headers.emplace_back("X-Frame-Index", std::to_string(image->frame_index()));
  return response;
}

WebServer::WebServer(WebServerOptions options, Exchange* exchange, PlaybackControl* control)
    : impl_(std::make_unique<Impl>(exchange, control)) {
  impl_->files = LoadFiles(options);
  if (options.token.empty() && !IsLoopback(options.host)) options.token = RandomToken();
  impl_->gate.token = options.token;
  impl_->gate.names.insert(options.names.begin(), options.names.end());
  HttpServer::Options http;
  http.host = options.host;
  http.port = options.port;
  const auto handle = [impl = impl_.get()](const HttpRequest& request) { return impl->Handle(request); };
  try {
    impl_->server = std::make_unique<HttpServer>(http, &exchange->hub(), handle);
  } catch (const InputError&) {
    if (options.port == 0 || !options.or_any_port) throw;
    http.port = 0;
    impl_->server = std::make_unique<HttpServer>(http, &exchange->hub(), handle);
  }
  const std::string host =
      options.host.find(':') == std::string::npos ? options.host : "[" + options.host + "]";
  address_ = "http://" + host + ":" + std::to_string(impl_->server->port()) + "/";
  if (!options.token.empty()) address_ += "?token=" + options.token;
  impl_->server->Begin();
}

WebServer::~WebServer() { impl_->exchange->hub().Close(); }

}  // namespace dmslam
