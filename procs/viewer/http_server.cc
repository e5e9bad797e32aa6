#include "viewer/http_server.h"

#include <fcntl.h>
#include <linux/sockios.h>
#include <netdb.h>
#include <netinet/in.h>
#include <netinet/tcp.h>
#include <poll.h>
#include <sys/eventfd.h>
#include <sys/ioctl.h>
#include <sys/socket.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <utility>

#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr int kTickMs = 250;           // deadlines are looked at so often
constexpr size_t kReadBytes = 16384;   // at a time
constexpr int kEventBuffer = 1 << 17;  // of the kernel, for an event stream: a stall shows soon

const char* ReasonOf(int status) {
  switch (status) {
    case 200:
      return "OK";
    case 204:
      return "No Content";
    case 400:
      return "Bad Request";
    case 401:
      return "Unauthorized";
    case 403:
      return "Forbidden";
    case 404:
      return "Not Found";
    case 405:
      return "Method Not Allowed";
    case 411:
      return "Length Required";
    case 413:
      return "Payload Too Large";
    case 431:
      return "Request Header Fields Too Large";
    default:
      return "Service Unavailable";
  }
}

void Option(int fd, int level, int name, int value) { setsockopt(fd, level, name, &value, sizeof(value)); }

int BoundSocket(const addrinfo& address) {
  const int fd = socket(address.ai_family, SOCK_STREAM | SOCK_NONBLOCK | SOCK_CLOEXEC, 0);
  if (fd < 0) return -1;
  Option(fd, SOL_SOCKET, SO_REUSEADDR, 1);  // not SO_REUSEPORT: two viewers must not share a port unseen
  if (bind(fd, address.ai_addr, address.ai_addrlen) == 0 && listen(fd, SOMAXCONN) == 0) return fd;
  close(fd);
  return -1;
}

int PortOf(int fd) {
  sockaddr_storage name{};
  socklen_t length = sizeof(name);
  getsockname(fd, reinterpret_cast<sockaddr*>(&name), &length);
  if (name.ss_family == AF_INET6) return ntohs(reinterpret_cast<sockaddr_in6*>(&name)->sin6_port);
  return ntohs(reinterpret_cast<sockaddr_in*>(&name)->sin_port);
}

}  // namespace

HttpServer::HttpServer(Options options, EventHub* hub, Handler handler)
    : options_(std::move(options)), hub_(hub), handler_(std::move(handler)) {
  Bind();
  stop_fd_ = eventfd(0, EFD_NONBLOCK | EFD_CLOEXEC);
  DMSLAM_CHECK(stop_fd_ >= 0, "eventfd is part of every Linux");
}

HttpServer::~HttpServer() {
  eventfd_write(stop_fd_, 1);
  if (thread_.joinable()) thread_.join();
  for (Connection& connection : connections_) connection.done = true;
  DropDone();
  close(listen_fd_);
  close(stop_fd_);
}

void HttpServer::Bind() {
  addrinfo hints{};
  hints.ai_socktype = SOCK_STREAM;
  hints.ai_flags = AI_PASSIVE;
  addrinfo* found = nullptr;
  const std::string port = std::to_string(options_.port);
  if (getaddrinfo(options_.host.c_str(), port.c_str(), &hints, &found) == 0) {
    for (const addrinfo* a = found; a != nullptr && listen_fd_ < 0; a = a->ai_next)
      listen_fd_ = BoundSocket(*a);
    freeaddrinfo(found);
  }
  if (listen_fd_ < 0) {
    throw InputError("--http " + options_.host + ":" + port +
                     ": the address is taken, or not of this machine; choose another");
  }
  port_ = PortOf(listen_fd_);
}

void HttpServer::Begin() {
  thread_ = std::thread([this] { Run(); });
}

void HttpServer::Run() {
  while (true) {
    std::vector<pollfd> fds = {{stop_fd_, POLLIN, 0}, {listen_fd_, POLLIN, 0}, {hub_->fd(), POLLIN, 0}};
    for (const Connection& c : connections_)
      fds.push_back({c.fd, static_cast<int16_t>((HasRoom(c) ? POLLIN : 0) | (c.writing() ? POLLOUT : 0)), 0});
    const Clock::time_point before = Clock::now();
    poll(fds.data(), fds.size(), kTickMs);
    if (fds[0].revents != 0) return;
    if (fds[2].revents != 0) hub_->ClearFd();
    size_t i = 3;
    for (Connection& c : connections_) {
      const short events = fds[i++].revents;
      if ((events & POLLIN) != 0) ReadFrom(&c);
      if ((events & (POLLHUP | POLLERR)) != 0) c.done = true;
      if (!c.done && c.listener) SpeakEvents(&c);
      if (!c.done && c.writing()) WriteTo(&c);
      if (!c.done && !c.writing() && !c.listener) Answer(&c);
      CheckTimes(before, &c);
    }
    DropDone();
    if (fds[1].revents != 0) Accept();
  }
}

void HttpServer::Accept() {
  while (true) {
    const int fd = accept4(listen_fd_, nullptr, nullptr, SOCK_NONBLOCK | SOCK_CLOEXEC);
    if (fd < 0) return;
    if (connections_.size() >= options_.connections) MakeRoom();
    Option(fd, IPPROTO_TCP, TCP_NODELAY, 1);
    Connection& connection = connections_.emplace_back();
    connection.fd = fd;
    connection.since = connection.progress = connection.spoke = Clock::now();
  }
}

/// Of those that have asked for nothing yet the oldest goes; where there is none, who has read nothing for
/// the longest time.
void HttpServer::MakeRoom() {
  const auto worth = [](const Connection& c) {
    const bool busy = c.writing() || c.listener;
    return std::pair(busy, busy ? c.progress : c.since);
  };
  const auto least =
      std::min_element(connections_.begin(), connections_.end(),
                       [&](const Connection& a, const Connection& b) { return worth(a) < worth(b); });
  if (least == connections_.end()) return;
  least->done = true;
  DropDone();
}

/// What is not answered yet is bounded.
bool HttpServer::HasRoom(const Connection& c) const {
  return c.in.size() < options_.limits.head_bytes + options_.limits.body_bytes;
}

void HttpServer::ReadFrom(Connection* c) {
  char buffer[kReadBytes];
  const size_t most = options_.limits.head_bytes + options_.limits.body_bytes;
  while (c->in.size() < most) {
    const ssize_t got = recv(c->fd, buffer, std::min(sizeof(buffer), most - c->in.size()), 0);
    if (got == 0 || (got < 0 && errno != EAGAIN && errno != EINTR)) c->done = true;
    if (got <= 0) return;
    if (c->listener) continue;  // who listens has no more to say
    if (c->in.empty()) c->since = Clock::now();
    c->in.append(buffer, static_cast<size_t>(got));
  }
}

/// The next request, if it is whole. One at a time: the next one is looked at when this one is answered.
void HttpServer::Answer(Connection* c) {
  if (c->close_after) {
    c->done = true;
    return;
  }
  if (c->in.empty()) return;
  const HttpParse parse = ParseHttp(c->in, options_.limits);
  if (parse.refusal != 0) return Refuse(c, parse.refusal);
  if (!parse.request) return;
  c->in.erase(0, parse.consumed);
  c->since = Clock::now();
  c->close_after = !parse.request->keep_alive;
  Respond(c, *parse.request, handler_(*parse.request));
}

void HttpServer::Refuse(Connection* c, int status) {
  c->in.clear();
  HttpRequest request;
  request.keep_alive = false;
  c->close_after = true;
  HttpResponse response;
  response.status = status;
  Respond(c, request, std::move(response));
}

void HttpServer::Respond(Connection* c, const HttpRequest& request, HttpResponse response) {
  if (response.events) {
    if (hub_->num_listeners() >= EventHub::kMostListeners) MakeRoomForStream();
    c->listener = hub_->Join();
    response.type = "text/event-stream";
    if (!c->listener) response = HttpResponse{503, "", "", {}, false};
  }
  if (response.status >= 400) c->close_after = true;
  std::string head = "HTTP/1.1 ";
  head.append(std::to_string(response.status)).append(" ").append(ReasonOf(response.status)).append("\r\n");
  for (const auto& [name, value] : response.headers)
    head.append(name).append(": ").append(value).append("\r\n");
  if (!response.type.empty()) head += "Content-Type: " + response.type + "\r\n";
  if (c->listener) {
    c->close_after = true;
  } else if (response.status != 204) {
    head += "Content-Length: " + std::to_string(response.body.size()) + "\r\n";
  }
  head += c->close_after ? "Connection: close\r\n\r\n" : "\r\n";
  c->out = std::move(head);
  if (request.method != "HEAD") c->out += response.body;
  c->sent = 0;
  c->progress = Clock::now();
  if (c->listener) BeginEvents(c);
  WriteTo(c);
}

/// Of those who listen goes who has left most unread, and then who came first: a browser that is still there
/// joins again by itself.
void HttpServer::MakeRoomForStream() {
  Connection* least = nullptr;
  std::pair<int, Clock::duration> most_left;
  for (Connection& c : connections_) {
    int unread = 0;
    if (c.done || !c.listener || ioctl(c.fd, SIOCOUTQ, &unread) != 0) continue;
    const std::pair left(unread, Clock::now() - c.joined);
    if (least != nullptr && left <= most_left) continue;
    least = &c;
    most_left = left;
  }
  if (least == nullptr) return;
  hub_->Leave(std::exchange(least->listener, nullptr));
  least->done = true;
}

void HttpServer::BeginEvents(Connection* c) {
  c->joined = Clock::now();
  Option(c->fd, SOL_SOCKET, SO_SNDBUF, kEventBuffer);
  c->spoke = Clock::now();
}

/// What is new, once the former has gone out: what comes meanwhile replaces what was not fetched.
void HttpServer::SpeakEvents(Connection* c) {
  if (c->writing()) return;
  std::string text = c->listener->Next(std::chrono::milliseconds(0));
  const Clock::time_point now = Clock::now();
  if (text.empty()) {  // the hub is closed
    c->done = true;
    return;
  }
  const bool nothing_new = text.front() == ':';
  if (nothing_new && now - c->spoke < options_.beat) return;
  c->spoke = c->progress = now;
  c->out = std::move(text);
  c->sent = 0;
}

void HttpServer::WriteTo(Connection* c) {
  while (c->writing()) {
    const ssize_t sent = send(c->fd, c->out.data() + c->sent, c->out.size() - c->sent, MSG_NOSIGNAL);
    if (sent < 0 && errno != EAGAIN && errno != EINTR) c->done = true;
    if (sent <= 0) return;
    c->sent += static_cast<size_t>(sent);
    c->progress = Clock::now();
  }
  c->out.clear();
  c->sent = 0;
  c->since = Clock::now();
}

/// `before`: a time until which all that had come is read. What comes while the server is busy with others is
/// not late.
void HttpServer::CheckTimes(Clock::time_point before, Connection* c) {
  if (c->writing()) {
    c->done = c->done || before - c->progress > options_.stall_time;
  } else if (!c->listener) {
    c->done = c->done || before - c->since > (c->in.empty() ? options_.idle_time : options_.head_time);
  }
}

void HttpServer::DropDone() {
  for (Connection& c : connections_) {
    if (!c.done) continue;
    if (c.listener) hub_->Leave(c.listener);
    close(c.fd);
  }
  std::erase_if(connections_, [](const Connection& c) { return c.done; });
}

}  // namespace dmslam
