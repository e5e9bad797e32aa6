#include "dmslam/util/http_address.h"

#include <charconv>

#include "dmslam/util/check.h"

namespace dmslam {

HttpAddress ParseHttpAddress(const std::string& text) {
  const size_t colon = text.rfind(':');
  const InputError error("--http " + text +
                         ": write HOST:PORT, the port between 0 and 65535, as 127.0.0.1:8080");
  if (colon == std::string::npos || colon == 0) throw error;
  HttpAddress address{text.substr(0, colon), 0};
  if (address.host.front() == '[' && address.host.back() == ']')
    address.host = address.host.substr(1, address.host.size() - 2);
  const char* begin = text.data() + colon + 1;
  const auto [end, code] = std::from_chars(begin, text.data() + text.size(), address.port);
  if (code != std::errc() || end != text.data() + text.size() || address.port < 0 || address.port > 65535)
    throw error;
  return address;
}

}  // namespace dmslam
