#pragma once

#include <string>

namespace dmslam {

/// Where something is served over HTTP.
struct HttpAddress {
  std::string host;  ///< without the brackets of an IPv6 address
  int port = 0;      ///< 0: any that is free
};

/// What --http says: "HOST:PORT", also "[::1]:8080". Throws InputError.
HttpAddress ParseHttpAddress(const std::string& text);

}  // namespace dmslam
