#include "viewer/http_server.h"

#include <arpa/inet.h>
#include <gtest/gtest.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include <latch>
#include <string>
#include <thread>
#include <vector>

namespace dmslam {
namespace {

using std::chrono::milliseconds;

constexpr size_t kLargeBytes = 64 << 20;

/// A raw connection.
class Client {
 public:
  explicit Client(int port, int receive_buffer = 0) : fd_(socket(AF_INET, SOCK_STREAM | SOCK_CLOEXEC, 0)) {
    if (receive_buffer > 0) setsockopt(fd_, SOL_SOCKET, SO_RCVBUF, &receive_buffer, sizeof(receive_buffer));
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_port = htons(static_cast<uint16_t>(port));
    address.sin_addr.s_addr = htonl(INADDR_LOOPBACK);
    connected_ = connect(fd_, reinterpret_cast<sockaddr*>(&address), sizeof(address)) == 0;
    const timeval most{4, 0};
    setsockopt(fd_, SOL_SOCKET, SO_RCVTIMEO, &most, sizeof(most));
  }
  ~Client() { close(fd_); }
  Client(const Client&) = delete;
  Client& operator=(const Client&) = delete;

  bool connected() const { return connected_; }
  bool Say(const std::string& text) const {
    return send(fd_, text.data(), text.size(), MSG_NOSIGNAL) == static_cast<ssize_t>(text.size());
  }
  /// What comes until `end` is in it, the other side closes, or four seconds are over.
  std::string Hear(const std::string& end) const {
    std::string heard;
    char buffer[4096];
    while (heard.find(end) == std::string::npos) {
      const ssize_t got = recv(fd_, buffer, sizeof(buffer), 0);
      if (got <= 0) break;
      heard.append(buffer, static_cast<size_t>(got));
    }
    return heard;
  }
  /// Whether the other side has closed, or does within four seconds.
  bool Closed() {
    ReadAll();
    return closed_;
  }
  /// The bytes that come until the other side closes, or says nothing for four seconds.
  size_t ReadAll() {
    char buffer[65536];
    size_t bytes = 0;
    ssize_t got = 0;
    while ((got = recv(fd_, buffer, sizeof(buffer), 0)) > 0) bytes += static_cast<size_t>(got);
    closed_ = got == 0 || errno == ECONNRESET;
    return bytes;
  }

 private:
  int fd_;
  bool closed_ = false;
  bool connected_ = false;
};

constexpr int kManyBlocks = 16384;  ///< of 4 KB: far more than sockets hold

class HttpServerTest : public testing::Test {
 protected:
  HttpServerTest() {
    options_.port = 0;
    options_.connections = 16;
    options_.head_time = milliseconds(300);
    options_.idle_time = milliseconds(600);
    options_.stall_time = milliseconds(400);
    options_.beat = milliseconds(100);
  }
  ~HttpServerTest() override { hub_.Close(); }
  void Begin() {
    server_ = std::make_unique<HttpServer>(options_, &hub_, [this](const HttpRequest& request) {
      if (request.path == "/long") {
        at_work_.count_down();
        enough_.wait();
      }
      HttpResponse response;
      response.type = "text/plain";
      response.body = request.path == "/large" ? std::string(kLargeBytes, 'x') : "here is " + request.path;
      response.events = request.path == "/events";
      return response;
    });
    server_->Begin();
  }
  /// Whether somebody who comes now is served.
  bool Serves() const {
    Client client(server_->port());
    return client.Say("GET /page HTTP/1.1\r\nHost: a\r\n\r\n") &&
           client.Hear("here is /page").find("200 OK") != std::string::npos;
  }

  HttpServer::Options options_;
  EventHub hub_;
  std::latch at_work_{1}, enough_{1};  ///< the handler of /long has begun, and may end
  std::unique_ptr<HttpServer> server_;
};

TEST_F(HttpServerTest, ServesOneRequestAfterTheOther) {
  Begin();
  Client client(server_->port());
  ASSERT_TRUE(client.Say("GET /a HTTP/1.1\r\nHost: a\r\n\r\nGET /b HTTP/1.1\r\nHost: a\r\n\r\n"));
  EXPECT_NE(client.Hear("here is /b").find("here is /a"), std::string::npos);
}

TEST_F(HttpServerTest, AnEndlessBodyIsNotTaken) {
  Begin();
  Client client(server_->port());
  client.Say("POST /a HTTP/1.1\r\nHost: a\r\nTransfer-Encoding: chunked\r\n\r\n");
  int sent = 0;
  while (sent < kManyBlocks && client.Say("1000\r\n" + std::string(4096, 'x') + "\r\n")) ++sent;
  EXPECT_LT(sent, kManyBlocks) << "what is sent is taken as long as its time is not over";
  EXPECT_TRUE(client.Closed());
  EXPECT_TRUE(Serves());
}

TEST_F(HttpServerTest, EndlessHeadersAreNotTaken) {
  Begin();
  Client client(server_->port());
  client.Say("GET /a HTTP/1.1\r\nHost: a\r\n");
  int sent = 0;
  while (sent < kManyBlocks &&
         client.Say("X-" + std::to_string(sent) + ": " + std::string(4096, 'y') + "\r\n"))
    ++sent;
  EXPECT_LT(sent, kManyBlocks) << "what is sent is taken as long as its time is not over";
  EXPECT_TRUE(client.Closed());
  EXPECT_TRUE(Serves());
}

TEST_F(HttpServerTest, SlowConnectionsShutNobodyOut) {
  Begin();
  std::vector<std::unique_ptr<Client>> slow;
  for (int i = 0; i < 200; ++i) {
    slow.push_back(std::make_unique<Client>(server_->port()));
    slow.back()->Say("GET /a HT");
    if (i % 50 == 49) {
      EXPECT_TRUE(Serves()) << i;
    }
  }
  EXPECT_TRUE(slow.back()->Closed()) << "a request must be whole within its time";
}

TEST_F(HttpServerTest, WhoSaysNothingIsDropped) {
  Begin();
  Client idle(server_->port());
  ASSERT_TRUE(idle.connected());
  EXPECT_TRUE(idle.Closed());
}

TEST_F(HttpServerTest, WhoAsksWhileTheServerIsBusyIsNotLate) {
  options_.idle_time = milliseconds(2000);  // nobody is idle for so long by chance
  Begin();
  const Client first(server_->port()), second(server_->port());
  for (const Client* client : {&first, &second}) {  // the server knows both, in this order
    client->Say("GET /page HTTP/1.1\r\nHost: a\r\n\r\n");
    client->Hear("here is /page");
  }
  first.Say("GET /long HTTP/1.1\r\nHost: a\r\n\r\n");
  at_work_.wait();
  second.Say("GET /page HTTP/1.1\r\nHost: a\r\n\r\n");
  std::this_thread::sleep_for(options_.idle_time * 3 / 2);
  enough_.count_down();
  EXPECT_NE(second.Hear("here is /page").find("200 OK"), std::string::npos);
}

TEST_F(HttpServerTest, WhoDoesNotReadIsDroppedAndShutsNobodyOut) {
  options_.connections = 256;
  Begin();
  std::vector<std::unique_ptr<Client>> stalled;
  for (int i = 0; i < 70; ++i) {
    stalled.push_back(std::make_unique<Client>(server_->port(), 4096));
    stalled.back()->Say("GET /events HTTP/1.1\r\nHost: a\r\n\r\n");
  }
  for (const auto& client : stalled) client->Hear("\r\n\r\n");
  EXPECT_EQ(hub_.num_listeners(), EventHub::kMostListeners);
  hub_.Send(EventKind::kPose, std::string(200'000, 'x'));  // more than all buffers hold
  EXPECT_TRUE(hub_.WaitForListeners(0, std::chrono::seconds(10)));
  const Client reader(server_->port());
  reader.Say("GET /events HTTP/1.1\r\nHost: a\r\n\r\n");
  EXPECT_NE(reader.Hear("event: pose").find("200 OK"), std::string::npos);
  Client large(server_->port(), 4096);
  large.Say("GET /large HTTP/1.1\r\nHost: a\r\n\r\n");
  EXPECT_TRUE(Serves());
  EXPECT_TRUE(Client(server_->port()).Closed()) << "its time is longer than that of who does not read";
  EXPECT_LT(large.ReadAll(), kLargeBytes);
}

/// Little is said, so that those who do not read are not found out by their buffers.
TEST_F(HttpServerTest, WhoListensWithoutReadingShutsNobodyOut) {
  options_.connections = 256;
  options_.stall_time = milliseconds(60'000);
  Begin();
  std::vector<std::unique_ptr<Client>> idle;
  for (size_t i = 0; i < EventHub::kMostListeners; ++i) {
    idle.push_back(std::make_unique<Client>(server_->port()));
    idle.back()->Say("GET /events HTTP/1.1\r\nHost: a\r\n\r\n");
    idle.back()->Hear("\r\n\r\n");
  }
  std::vector<std::unique_ptr<Client>> readers;
  for (int i = 0; i < 3; ++i) {
    readers.push_back(std::make_unique<Client>(server_->port()));
    readers.back()->Say("GET /events HTTP/1.1\r\nHost: a\r\n\r\n");
    EXPECT_NE(readers.back()->Hear("\r\n\r\n").find("200 OK"), std::string::npos);
  }
  EXPECT_EQ(hub_.num_listeners(), EventHub::kMostListeners);
  EXPECT_TRUE(idle.front()->Closed()) << "who came first has left";
  hub_.Send(EventKind::kPose, "1");
  for (const auto& reader : readers)
    EXPECT_NE(reader->Hear("event: pose").find("event: pose"), std::string::npos);
}

TEST_F(HttpServerTest, AStreamLastsAsLongAsItIsRead) {
  Begin();
  const Client reader(server_->port());
  reader.Say("GET /events HTTP/1.1\r\nHost: a\r\n\r\n");
  EXPECT_NE(reader.Hear(":\n\n:\n\n").find("text/event-stream"), std::string::npos);
  std::string beats;
  for (int i = 0; i < 9; ++i) beats += ":\n\n";  // longer than a connection may be idle
  EXPECT_NE(reader.Hear(beats).find(beats), std::string::npos);
  hub_.Send(EventKind::kMap, "7");
  EXPECT_NE(reader.Hear("data: 7").find("event: map"), std::string::npos);
  EXPECT_EQ(hub_.num_listeners(), 1u);
}

}  // namespace
}  // namespace dmslam
