#pragma once

#include <cstddef>
#include <map>
#include <optional>
#include <set>
#include <string>
#include <string_view>

namespace dmslam {

/// A request as a browser made it.
struct HttpRequest {
  std::string method, path;
  std::map<std::string, std::string> query;    ///< decoded
  std::map<std::string, std::string> headers;  ///< names in lower case
  bool keep_alive = true;

  /// Empty where it is not there.
  std::string Header(const std::string& name) const;
  std::string Cookie(const std::string& name) const;
};

/// What is asked of requests before anything is kept of them.
struct HttpLimits {
  size_t head_bytes = 16u << 10;  ///< request line and headers
  size_t headers = 64;
  size_t body_bytes = 4096;  ///< bodies are read and ignored; only those whose length is told before
};

/// What the bytes that have come so far are.
struct HttpParse {
  std::optional<HttpRequest> request;  ///< it is whole
  size_t consumed = 0;                 ///< its bytes, the body included
  int refusal = 0;                     ///< the status to refuse it with; 0 and no request: more must come
};

HttpParse ParseHttp(std::string_view bytes, const HttpLimits& limits = {});

/// Who may be served: pages of other origins, and names that lead here though they are not this machine's,
/// are not.
struct HttpGate {
  std::string token;            ///< empty: none is asked for
  std::set<std::string> names;  ///< host names that are served besides localhost and literal addresses
  /// The status to refuse it with; 0: it may be served.
  int Refusal(const HttpRequest& request) const;
  /// Whether the request itself names the token (in its address), so that the browser is to keep it.
  bool BringsToken(const HttpRequest& request) const;
};

/// Whether only this host can reach the address.
bool IsLoopback(const std::string& host);

}  // namespace dmslam
