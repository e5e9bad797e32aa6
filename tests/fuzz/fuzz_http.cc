// Requests to the viewer: understood, refused, or not whole yet; always within the limits.
#include <algorithm>
#include <string>

#include "fuzz_target.h"
#include "memory_file.h"
#include "viewer/http_request.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  using dmslam::fuzz::Require;
  const std::string bytes(data, data + size);
  const dmslam::HttpLimits limits;
  const dmslam::HttpParse parse = dmslam::ParseHttp(bytes, limits);
  Require(!(parse.request && parse.refusal != 0), "a request is understood or refused");
  Require(parse.consumed <= size, "no more is taken than came");
  Require(parse.refusal == 0 || (parse.refusal >= 400 && parse.refusal < 600), "a refusal has a status");
  if (!parse.request) {
    Require(parse.refusal != 0 || size < limits.head_bytes + limits.body_bytes,
            "nobody is waited for without end");
    return 0;
  }
  Require(parse.consumed > 0, "a request has bytes");
  Require(parse.request->headers.size() <= limits.headers, "headers are bounded");
  const dmslam::HttpGate gate{"secret", {"robot"}};
  const int refusal = gate.Refusal(*parse.request);
  const bool named = bytes.find("secret") != std::string::npos || bytes.find('%') != std::string::npos;
  Require(refusal != 0 || named, "who does not name the token is not served");
  return 0;
}

namespace dmslam::fuzz {

std::vector<std::vector<uint8_t>> Seeds() {
  return {
      SeedOf("GET /events?token=secret HTTP/1.1\r\nHost: localhost:8080\r\nConnection: keep-alive\r\n\r\n"),
      SeedOf("POST /playback?at=%31.5 HTTP/1.1\r\nHost: [::1]:8080\r\nOrigin: http://[::1]:8080\r\n"
             "Cookie: a=b; token=secret\r\nContent-Length: 3\r\n\r\nabcGET / HTTP/1.0\r\n\r\n"),
      SeedOf("POST / HTTP/1.1\r\nHost: robot\r\nTransfer-Encoding: chunked\r\n\r\n3\r\nabc\r\n0\r\n\r\n")};
}

}  // namespace dmslam::fuzz
