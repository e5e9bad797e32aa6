#include "dmslam/dataset/text_table.h"

#include <filesystem>
#include <fstream>
#include <sstream>
#include <utility>

#include "dmslam/util/check.h"
#include "dmslam/util/time.h"

namespace dmslam {
namespace {

void Split(std::string_view line, std::string_view separators, std::vector<std::string_view>& fields) {
  fields.clear();
  size_t begin = line.find_first_not_of(separators);
  while (begin != std::string_view::npos) {
    const size_t end = line.find_first_of(separators, begin);
    fields.push_back(line.substr(begin, end - begin));
    begin = end == std::string_view::npos ? end : line.find_first_not_of(separators, end);
  }
}

}  // namespace

std::string FileLine(const std::string& path, size_t line_number) {
  return path + ":" + std::to_string(line_number);
}

void RequireStampOfImage(int64_t stamp_ns, const std::string& where) {
  if (stamp_ns >= 0) return;
  throw InputError(where + ": stamp " + FormatStampNs(stamp_ns) +
                   " is below zero; add the same time to the stamps of all images");
}

std::string ReadTextFile(const std::string& path) {
  if (std::filesystem::is_directory(path)) throw InputError(path + ": is a folder; name a file in it");
  std::ifstream file(path, std::ios::binary);
  if (!file) throw InputError(path + ": cannot be opened; check the path and its permissions");
  std::ostringstream text;
  if (file.peek() != std::ifstream::traits_type::eof()) text << file.rdbuf();
  if (file.bad()) throw InputError(path + ": cannot be read; is it a broken disk?");
  return std::move(text).str();
}

void ForEachRow(
    std::string_view text, std::string_view separators,
    const std::function<void(size_t line_number, std::span<const std::string_view> fields)>& row) {
  constexpr std::string_view kByteOrderMark = "\xEF\xBB\xBF";  // some editors put it before UTF-8
  if (text.starts_with(kByteOrderMark)) text.remove_prefix(kByteOrderMark.size());
  std::vector<std::string_view> fields;
  size_t line_number = 0;
  while (!text.empty()) {
    const size_t end = text.find('\n');
    std::string_view line = text.substr(0, end);
    text.remove_prefix(end == std::string_view::npos ? text.size() : end + 1);
    ++line_number;
    if (!line.empty() && line.back() == '\r') line.remove_suffix(1);
    Split(line, separators, fields);
    if (!fields.empty() && fields.front().front() != '#') row(line_number, fields);
  }
}

}  // namespace dmslam
