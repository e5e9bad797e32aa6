#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace dmslam {

/// Where a value was read: "file:line", as editors understand it.
std::string FileLine(const std::string& path, size_t line_number);

/// Throws InputError for an image's stamp before 0: no message can hold it.
void RequireStampOfImage(int64_t stamp_ns, const std::string& where);

/// The whole of a file; throws InputError when it cannot be read.
std::string ReadTextFile(const std::string& path);

/// Calls `row(line_number, fields)` for each line of `text` that is neither blank nor a comment ('#' first).
/// Lines are counted from 1; fields are separated by any of `separators`; a carriage return at the end of a
/// line is dropped.
void ForEachRow(std::string_view text, std::string_view separators,
                const std::function<void(size_t line_number, std::span<const std::string_view> fields)>& row);

}  // namespace dmslam
