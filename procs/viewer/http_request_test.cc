#include "viewer/http_request.h"

#include <gtest/gtest.h>

namespace dmslam {
namespace {

HttpRequest RequestFor(const std::string& host, const std::string& path = "/api/frame.jpg") {
  HttpRequest request;
  request.method = "GET";
  request.path = path;
  request.headers["host"] = host;
  return request;
}

TEST(HttpRequestTest, IsReadWhenItIsWhole) {
  const std::string text =
      "POST /api/playback?position=1.5&name=a%20b HTTP/1.1\r\nHost: localhost:8080\r\nCookie: x=1; "
      "dmslam_token=abc\r\nContent-Length: 3\r\n\r\nxyz";
  for (size_t size = 0; size < text.size(); ++size) {
    const HttpParse parse = ParseHttp(text.substr(0, size));
    EXPECT_FALSE(parse.request.has_value() && parse.consumed > 0) << size;
    EXPECT_EQ(parse.refusal, 0) << size;
  }
  const HttpParse parse = ParseHttp(text + "GET");
  ASSERT_TRUE(parse.request.has_value());
  EXPECT_EQ(parse.consumed, text.size());
  EXPECT_EQ(parse.request->path, "/api/playback");
  EXPECT_EQ(parse.request->query.at("position"), "1.5");
  EXPECT_EQ(parse.request->query.at("name"), "a b");
  EXPECT_EQ(parse.request->Cookie("dmslam_token"), "abc");
  EXPECT_EQ(parse.request->Cookie("token"), "");
}

TEST(HttpRequestTest, WhatIsTooMuchIsRefused) {
  EXPECT_EQ(ParseHttp("nonsense\r\n\r\n").refusal, 400);
  EXPECT_EQ(ParseHttp("GET http://elsewhere/ HTTP/1.1\r\n\r\n").refusal, 400);
  EXPECT_EQ(ParseHttp("POST / HTTP/1.1\r\nTransfer-Encoding: chunked\r\n\r\n").refusal, 411);
  EXPECT_EQ(ParseHttp("POST / HTTP/1.1\r\nContent-Length: 5000\r\n\r\n").refusal, 413);
  EXPECT_EQ(ParseHttp("POST / HTTP/1.1\r\nContent-Length: -1\r\n\r\n").refusal, 400);
  EXPECT_EQ(ParseHttp("GET / HTTP/1.1\r\nHost: a\r\nHost: b\r\n\r\n").refusal, 400);
  EXPECT_EQ(ParseHttp("GET / HTTP/1.1\r\nX: " + std::string(20000, 'x')).refusal, 431);
  std::string many = "GET / HTTP/1.1\r\n";
  for (int i = 0; i < 100; ++i) many += "X-" + std::to_string(i) + ": y\r\n";
  EXPECT_EQ(ParseHttp(many + "\r\n").refusal, 431);
}

TEST(HttpGateTest, NamesThatLeadHereFromElsewhereAreNotServed) {
  HttpGate gate;
  for (const char* host : {"localhost:8080", "127.0.0.1:8080", "[::1]:8080", "192.168.1.7", "LOCALHOST"})
    EXPECT_EQ(gate.Refusal(RequestFor(host)), 0) << host;
  for (const char* host : {"evil.example:8080", "127.0.0.1.evil.example", "localhost.evil.example", ""})
    EXPECT_EQ(gate.Refusal(RequestFor(host)), 403) << host;
  EXPECT_EQ(gate.Refusal(RequestFor("robot.local")), 403);
  gate.names.insert("robot.local");
  EXPECT_EQ(gate.Refusal(RequestFor("robot.local:8080")), 0);
}

TEST(HttpGateTest, PagesOfOtherOriginsAreNotServed) {
  HttpGate gate;
  HttpRequest request = RequestFor("localhost:8080");
  request.headers["origin"] = "http://localhost:8080";
  EXPECT_EQ(gate.Refusal(request), 0);
  for (const char* origin :
       {"http://evil.example", "http://localhost:9090", "null", "https://localhost:8080"}) {
    request.headers["origin"] = origin;
    EXPECT_EQ(gate.Refusal(request), 403) << origin;
  }
  request.headers.erase("origin");
  request.headers["sec-fetch-site"] = "cross-site";
  EXPECT_EQ(gate.Refusal(request), 403) << "a picture in a page of somebody else";
  EXPECT_EQ(gate.Refusal([&] {
    request.path = "/";
    return request;
  }()),
            0)
      << "a link to the page";
}

TEST(HttpGateTest, ATokenIsAskedForWhereThereIsOne) {
  HttpGate gate;
  gate.token = "0123456789abcdef";
  HttpRequest request = RequestFor("192.168.1.7:8080");
  EXPECT_EQ(gate.Refusal(request), 401);
  request.query["token"] = "0123456789abcdee";
  EXPECT_EQ(gate.Refusal(request), 401);
  EXPECT_FALSE(gate.BringsToken(request));
  request.query["token"] = "";
  EXPECT_EQ(gate.Refusal(request), 401);
  request.query["token"] = gate.token;
  EXPECT_EQ(gate.Refusal(request), 0);
  EXPECT_TRUE(gate.BringsToken(request));
  request.query.clear();
  request.headers["cookie"] = "dmslam_token=" + gate.token;
  EXPECT_EQ(gate.Refusal(request), 0);
  request.headers.erase("cookie");
  request.headers["authorization"] = "Bearer " + gate.token;
  EXPECT_EQ(gate.Refusal(request), 0);
}

TEST(HttpGateTest, KnowsWhatOnlyThisHostReaches) {
  for (const char* host : {"127.0.0.1", "localhost", "::1", "127.1.2.3"})
    EXPECT_TRUE(IsLoopback(host)) << host;
  for (const char* host : {"0.0.0.0", "::", "192.168.1.7", "robot"}) EXPECT_FALSE(IsLoopback(host)) << host;
}

}  // namespace
}  // namespace dmslam
