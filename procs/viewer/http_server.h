#pragma once

#include <chrono>
#include <cstdint>
#include <functional>
#include <list>
#include <string>
#include <thread>
#include <vector>

#include "viewer/event_hub.h"
#include "viewer/http_connection.h"
#include "viewer/http_request.h"

namespace dmslam {

struct HttpResponse {
  int status = 200;
  std::string type;
  std::string body;
  std::vector<std::pair<std::string, std::string>> headers;
  bool events = false;  ///< instead of a body: the events of the hub, as long as the browser reads them
};

/// Serves HTTP/1.1 from one thread that waits for nobody: who speaks slowly, asks for too much, or does not
/// read what it asked for is dropped, and never in anybody's way.
class HttpServer {
 public:
  using Handler = std::function<HttpResponse(const HttpRequest&)>;
  struct Options {
    std::string host = "127.0.0.1";
    int port = 8080;
    HttpLimits limits;
    size_t connections = 256;  ///< beyond them the one that is least worth keeping makes room
    std::chrono::milliseconds head_time{5000};   ///< from the first byte of a request to its last
    std::chrono::milliseconds idle_time{15000};  ///< between requests
    std::chrono::milliseconds stall_time{5000};  ///< who reads nothing for so long is dropped
    std::chrono::milliseconds beat{1000};        ///< a comment in an event stream where nothing happens
  };

  /// Binds. Throws InputError where the address is taken, or not of this machine.
  HttpServer(Options options, EventHub* hub, Handler handler);
  ~HttpServer();
  HttpServer(const HttpServer&) = delete;
  HttpServer& operator=(const HttpServer&) = delete;

  int port() const { return port_; }
  void Begin();

 private:
  using Clock = HttpConnection::Clock;
  using Connection = HttpConnection;
  void Bind();
  void Run();
  void Accept();
  void MakeRoom();
  bool HasRoom(const Connection& connection) const;
  void ReadFrom(Connection* connection);
  void Answer(Connection* connection);
  void Refuse(Connection* connection, int status);
  void Respond(Connection* connection, const HttpRequest& request, HttpResponse response);
  void MakeRoomForStream();
  void BeginEvents(Connection* connection);
  void SpeakEvents(Connection* connection);
  void WriteTo(Connection* connection);
  void CheckTimes(Clock::time_point before, Connection* connection);
  void DropDone();

  Options options_;
  EventHub* hub_;
  Handler handler_;
  int port_ = 0, listen_fd_ = -1, stop_fd_ = -1;
  std::list<Connection> connections_;
  std::thread thread_;
};

}  // namespace dmslam
