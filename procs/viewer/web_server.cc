#include "viewer/web_server.h"

#include <httplib.h>
#include <sys/socket.h>

#include <charconv>
#include <filesystem>
#include <future>
#include <map>
#include <thread>
#include <utility>

#include "dmslam/dataset/image.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr size_t kThreads = EventHub::kMostListeners + 32;  // a listener keeps one busy
constexpr std::chrono::milliseconds kKeepAlive{1000};
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
std::optional<Number> Query(const httplib::Request& request, const std::string& name) {
  const std::string text = request.get_param_value(name);
  Number value{};
  const auto [end, error] = std::from_chars(text.data(), text.data() + text.size(), value);
  if (error != std::errc() || end != text.data() + text.size()) return std::nullopt;
  return value;
}

}  // namespace

void ParseHttpAddress(const std::string& text, WebServerOptions* options) {
  options->or_any_port = false;
  const size_t colon = text.rfind(':');
  const InputError error("--http " + text + ": write HOST:PORT, as 127.0.0.1:8080");
  if (colon == std::string::npos || colon == 0) throw error;
  options->host = text.substr(0, colon);
  if (options->host.front() == '[' && options->host.back() == ']')
    options->host = options->host.substr(1, options->host.size() - 2);
  const char* begin = text.data() + colon + 1;
  const auto [end, code] = std::from_chars(begin, text.data() + text.size(), options->port);
  if (code != std::errc() || end != text.data() + text.size() || options->port < 0 || options->port > 65535)
    throw error;
}

struct WebServer::Impl {
  Impl(Exchange* the_exchange, PlaybackControl* the_control) : exchange(the_exchange), control(the_control) {}
  void Route();
  void ServeScene(const httplib::Request& request, httplib::Response& response) const;
  void ServeImage(const httplib::Request& request, httplib::Response& response) const;
  void ServeEvents(httplib::Response& response) const;

  Exchange* exchange;
  PlaybackControl* control;
  std::map<std::string, File> files;
  httplib::Server server;
  std::thread thread;
};

void WebServer::Impl::Route() {
  for (const auto& item : files) {
    const File& file = item.second;
    std::string pattern;
    for (const char c : item.first) pattern += c == '.' ? std::string("\\.") : std::string(1, c);
    server.Get(pattern, [&file](const httplib::Request&, httplib::Response& response) {
      response.set_content(file.content, file.type);
    });
  }
  server.Get("/api/map", [this](const auto& request, auto& response) { ServeScene(request, response); });
  server.Get("/api/frame\\.jpg",
             [this](const auto& request, auto& response) { ServeImage(request, response); });
  server.Get("/api/series", [this](const auto& request, auto& response) {
    response.set_content(exchange->SeriesJson(Query<int64_t>(request, "since").value_or(0), kMostSeries),
                         "application/json");
  });
  server.Get("/api/events", [this](const auto&, auto& response) { ServeEvents(response); });
  if (control == nullptr) return;
  server.Post("/api/playback", [this](const auto& request, auto& response) {
    PlaybackWish wish{Query<double>(request, "position"), std::nullopt, Query<double>(request, "speed")};
    if (const auto playing = Query<int>(request, "playing")) wish.playing = *playing != 0;
    control->Wish(wish);
    response.status = 204;
  });
}

void WebServer::Impl::ServeScene(const httplib::Request& request, httplib::Response& response) const {
  const auto generation = Query<uint32_t>(request, "generation").value_or(0);
  const std::vector<uint8_t> bytes =
      exchange->EncodeScene(generation, Query<uint64_t>(request, "since").value_or(0));
  response.set_content(std::string(bytes.begin(), bytes.end()), "application/octet-stream");
}

void WebServer::Impl::ServeImage(const httplib::Request& request, httplib::Response& response) const {
  const std::shared_ptr<ServedImage> image = exchange->FindImage(Query<uint32_t>(request, "frame"));
  if (!image || image->Jpeg().empty()) {
    response.status = 204;
    return;
  }
  const std::vector<uint8_t>& jpeg = image->Jpeg();
  response.set_header("X-Frame-Index", std::to_string(image->frame_index()));
  response.set_content(std::string(jpeg.begin(), jpeg.end()), "image/jpeg");
}

/// The one request that lasts. A browser that does not read blocks its own thread, until the write times out.
void WebServer::Impl::ServeEvents(httplib::Response& response) const {
  EventHub* hub = &exchange->hub();
  const std::shared_ptr<EventHub::Listener> listener = hub->Join();
  if (!listener) {
    response.status = 503;
    return;
  }
  response.set_chunked_content_provider(
      "text/event-stream",
      [listener](size_t, httplib::DataSink& sink) {
        const std::string text = listener->Next(kKeepAlive);
        return !text.empty() && sink.write(text.data(), text.size());
      },
      [hub, listener](bool) { hub->Leave(listener); });
}

WebServer::WebServer(WebServerOptions options, Exchange* exchange, PlaybackControl* control)
    : impl_(std::make_unique<Impl>(exchange, control)) {
  impl_->files = LoadFiles(options);
  httplib::Server& server = impl_->server;
  std::promise<void> serving;  // only then can it be stopped
  server.new_task_queue = [&serving] {
    serving.set_value();
    return new httplib::ThreadPool(kThreads);
  };
  server.set_socket_options(
      [](socket_t socket) {  // not SO_REUSEPORT: two viewers must not share a port unseen
        const int yes = 1;
        setsockopt(socket, SOL_SOCKET, SO_REUSEADDR, &yes, sizeof(yes));
      });
  server.set_tcp_nodelay(true);
  server.set_keep_alive_max_count(10000);
  server.set_keep_alive_timeout(3);
  server.set_write_timeout(10);
  server.set_payload_max_length(4096);
  server.set_default_headers({{"Cache-Control", "no-store"},
                              {"X-Content-Type-Options", "nosniff"},
                              {"Content-Security-Policy", "default-src 'self'; img-src 'self' blob: data:"}});
  impl_->Route();
  bool bound = options.port > 0 && server.bind_to_port(options.host, options.port);
  if (!bound && (options.port == 0 || options.or_any_port)) {
    const int port = server.bind_to_any_port(options.host);
    bound = port > 0;
    if (bound) options.port = port;
  }
  const std::string host =
      options.host.find(':') == std::string::npos ? options.host : "[" + options.host + "]";
  if (!bound) {
    throw InputError("--http " + host + ":" + std::to_string(options.port) +
                     ": the address is taken, or not of this machine; choose another");
  }
  address_ = "http://" + host + ":" + std::to_string(options.port) + "/";
  impl_->thread = std::thread([this] { impl_->server.listen_after_bind(); });
  serving.get_future().wait();
}

WebServer::~WebServer() {
  impl_->exchange->hub().Close();
  impl_->server.stop();
  impl_->thread.join();
}

}  // namespace dmslam
