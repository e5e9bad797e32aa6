#include "viewer/http_request.h"

#include <arpa/inet.h>

#include <algorithm>
#include <cctype>
#include <charconv>

namespace dmslam {
namespace {

constexpr int kBadRequest = 400, kUnauthorized = 401, kForbidden = 403, kLengthRequired = 411,
              kTooLarge = 413, kHeadTooLarge = 431;
constexpr char kTokenName[] = "token", kCookieName[] = "dmslam_token";

std::string LowerCase(std::string_view text) {
  std::string lower(text);
  std::transform(lower.begin(), lower.end(), lower.begin(), [](unsigned char c) { return std::tolower(c); });
  return lower;
}

std::string_view Trimmed(std::string_view text) {
  const size_t begin = text.find_first_not_of(" \t");
  if (begin == std::string_view::npos) return {};
  return text.substr(begin, text.find_last_not_of(" \t") - begin + 1);
}

std::string Decoded(std::string_view text) {
  std::string decoded;
  for (size_t i = 0; i < text.size(); ++i) {
    unsigned value = 0;
    const char* digits = text.data() + i + 1;
    if (text[i] == '%' && i + 2 < text.size() &&
        std::from_chars(digits, digits + 2, value, 16).ptr == digits + 2) {
      decoded += static_cast<char>(value);
      i += 2;
    } else {
      decoded += text[i] == '+' ? ' ' : text[i];
    }
  }
  return decoded;
}

void ParseQuery(std::string_view text, std::map<std::string, std::string>* query) {
  while (!text.empty()) {
    const std::string_view item = text.substr(0, text.find('&'));
    text.remove_prefix(std::min(text.size(), item.size() + 1));
    const size_t equals = std::min(item.find('='), item.size());
    (*query)[Decoded(item.substr(0, equals))] =
        equals < item.size() ? Decoded(item.substr(equals + 1)) : std::string();
  }
}

bool ParseRequestLine(std::string_view line, HttpRequest* request) {
  const size_t first = line.find(' '), last = line.rfind(' ');
  if (first == std::string_view::npos || first == last || !line.substr(last + 1).starts_with("HTTP/1."))
    return false;
  request->method = line.substr(0, first);
  request->keep_alive = line.substr(last + 1) != "HTTP/1.0";
  const std::string_view target = line.substr(first + 1, last - first - 1);
  if (target.empty() || target.front() != '/') return false;
  const size_t mark = std::min(target.find('?'), target.size());
  request->path = Decoded(target.substr(0, mark));
  if (mark < target.size()) ParseQuery(target.substr(mark + 1), &request->query);
  return true;
}

/// The host without its port: "[::1]:80" is "::1".
std::string HostName(std::string_view host) {
  if (host.starts_with('[')) return LowerCase(host.substr(1, host.find(']') - 1));
  return LowerCase(host.substr(0, host.find(':')));
}

bool IsAddress(const std::string& host) {
  unsigned char address[16];
  return inet_pton(AF_INET, host.c_str(), address) == 1 || inet_pton(AF_INET6, host.c_str(), address) == 1;
}

/// In a time that does not tell how much of it is right.
bool Same(const std::string& a, const std::string& b) {
  unsigned difference = a.size() == b.size() ? 0 : 1;
  for (size_t i = 0; i < a.size(); ++i)
    difference |=
        static_cast<unsigned char>(a[i]) ^ static_cast<unsigned char>(b[i % std::max<size_t>(1, b.size())]);
  return difference == 0;
}

HttpParse Refused(int status) { return {std::nullopt, 0, status}; }

}  // namespace

std::string HttpRequest::Header(const std::string& name) const {
  const auto it = headers.find(name);
  return it == headers.end() ? std::string() : it->second;
}

std::string HttpRequest::Cookie(const std::string& name) const {
  const std::string cookies = "; " + Header("cookie");
  const size_t at = cookies.find("; " + name + "=");
  if (at == std::string::npos) return {};
  const size_t begin = at + name.size() + 3;
  return cookies.substr(begin, cookies.find(';', begin) - begin);
}

HttpParse ParseHttp(std::string_view bytes, const HttpLimits& limits) {
  const size_t end = bytes.substr(0, limits.head_bytes).find("\r\n\r\n");
  if (end == std::string_view::npos) return Refused(bytes.size() >= limits.head_bytes ? kHeadTooLarge : 0);
  std::string_view head = bytes.substr(0, end);
  HttpParse parse;
  parse.request.emplace();
  const std::string_view line = head.substr(0, head.find("\r\n"));
  if (!ParseRequestLine(line, &*parse.request)) return Refused(kBadRequest);
  head.remove_prefix(std::min(head.size(), line.size() + 2));
  for (size_t count = 0; !head.empty(); ++count) {
    const std::string_view header = head.substr(0, head.find("\r\n"));
    head.remove_prefix(std::min(head.size(), header.size() + 2));
    const size_t colon = header.find(':');
    if (colon == std::string_view::npos || colon == 0) return Refused(kBadRequest);
    if (count >= limits.headers) return Refused(kHeadTooLarge);
    const std::string name = LowerCase(header.substr(0, colon));
    if (name == "host" && parse.request->headers.contains(name)) return Refused(kBadRequest);
    parse.request->headers[name] = Trimmed(header.substr(colon + 1));
  }
  if (LowerCase(parse.request->Header("connection")) == "close") parse.request->keep_alive = false;
  if (parse.request->headers.contains("transfer-encoding")) return Refused(kLengthRequired);
  size_t body = 0;
  if (const std::string length = parse.request->Header("content-length"); !length.empty()) {
    const auto [rest, error] = std::from_chars(length.data(), length.data() + length.size(), body);
    if (error != std::errc() || rest != length.data() + length.size()) return Refused(kBadRequest);
    if (body > limits.body_bytes) return Refused(kTooLarge);
  }
  if (bytes.size() < end + 4 + body) return {};
  parse.consumed = end + 4 + body;
  return parse;
}

int HttpGate::Refusal(const HttpRequest& request) const {
  const std::string host = request.Header("host"), name = HostName(host);
  if (name != "localhost" && !IsAddress(name) && !names.contains(name)) return kForbidden;
  const std::string origin = request.Header("origin");
  if (!origin.empty() && LowerCase(origin) != "http://" + LowerCase(host)) return kForbidden;
  const bool elsewhere = request.Header("sec-fetch-site") == "cross-site";
  if (elsewhere && request.path.starts_with("/api")) return kForbidden;
  if (token.empty() || BringsToken(request) || Same(request.Cookie(kCookieName), token)) return 0;
  return Same(request.Header("authorization"), "Bearer " + token) ? 0 : kUnauthorized;
}

bool HttpGate::BringsToken(const HttpRequest& request) const {
  const auto it = request.query.find(kTokenName);
  return !token.empty() && it != request.query.end() && Same(it->second, token);
}

bool IsLoopback(const std::string& host) {
  return host == "localhost" || host == "::1" || host.starts_with("127.");
}

}  // namespace dmslam
