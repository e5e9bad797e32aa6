#include "dmslam/dataset/image_folder.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <initializer_list>

#include "dmslam/dataset/text_table.h"
#include "dmslam/util/check.h"
#include "dmslam/util/yaml_error.h"

namespace dmslam {
namespace {

namespace fs = std::filesystem;

struct NumberedFile {
  uint64_t number = 0;
  std::string path;
};

bool IsImageName(const fs::path& path) {
  std::string extension = path.extension().string();
  std::transform(extension.begin(), extension.end(), extension.begin(),
                 [](char c) { return c >= 'A' && c <= 'Z' ? static_cast<char>(c - 'A' + 'a') : c; });
  static constexpr std::string_view kExtensions[] = {".png", ".jpg", ".jpeg", ".pgm",
                                                     ".ppm", ".bmp", ".tif",  ".tiff"};
  return std::find(std::begin(kExtensions), std::end(kExtensions), extension) != std::end(kExtensions);
}

/// The last run of digits in a name without its extension.
std::optional<uint64_t> NumberOf(const fs::path& path) {
  constexpr const char* kDigits = "0123456789";
  const std::string stem = path.stem().string();
  const size_t last = stem.find_last_of(kDigits);
  if (last == std::string::npos) return std::nullopt;
  const size_t before = stem.find_last_not_of(kDigits, last);
  const size_t first = before == std::string::npos ? 0 : before + 1;
  uint64_t number = 0;
  const auto [end, error] = std::from_chars(stem.data() + first, stem.data() + last + 1, number);
  return error == std::errc() ? std::optional<uint64_t>(number) : std::nullopt;
}

std::vector<NumberedFile> NumberedImages(const std::string& folder) {
  std::vector<NumberedFile> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    const std::optional<uint64_t> number = NumberOf(entry.path());
    if (number && entry.is_regular_file() && IsImageName(entry.path()))
      files.push_back({*number, entry.path().string()});
  }
  std::sort(files.begin(), files.end(), [](const NumberedFile& a, const NumberedFile& b) {
    return a.number != b.number ? a.number < b.number : a.path < b.path;
  });
  return files;
}

StampedFile ParseEurocRow(std::span<const std::string_view> fields, const fs::path& folder,
                          const std::string& where) {
  int64_t stamp_ns = 0;
  if (fields.size() != 2) {
    throw InputError(where + ": has " + std::to_string(fields.size()) +
                     " columns; write two: stamp [ns], file name");
  }
  const auto [end, error] = std::from_chars(fields[0].data(), fields[0].data() + fields[0].size(), stamp_ns);
  if (error != std::errc() || end != fields[0].data() + fields[0].size()) {
    throw InputError(where + ": '" + std::string(fields[0]) + "' is not a stamp; write whole nanoseconds");
  }
  RequireStampOfImage(stamp_ns, where);
  return {stamp_ns, (folder / "data" / fields[1]).string()};
}

std::vector<double> ReadList(const YAML::Node& node, const std::string& path, const std::string& field,
                             size_t count) {
  std::vector<double> values;
  try {
    if (node[field]) values = node[field].as<std::vector<double>>();
  } catch (const YAML::Exception&) {
    values.clear();
  }
  if (values.size() != count) {
    throw InputError(path + ": field '" + field + "' is not a list of " + std::to_string(count) +
                     " numbers; give a camera file of your own with --camera");
  }
  return values;
}

/// What a field that names a model says: one of these, the first where it is left out.
std::string ReadModel(const YAML::Node& node, const std::string& path, const std::string& field,
                      std::initializer_list<std::string> supported) {
  std::string model = node[field] ? node[field].as<std::string>("") : *supported.begin();
  if (std::find(supported.begin(), supported.end(), model) != supported.end()) return model;
  throw InputError(path + ": field '" + field + "' is '" + model +
                   "', which is not supported; undistort to a pinhole camera first (see docs/camera.md)");
}

EncodedImage ReadEncoded(const std::string& path) {
  EncodedImage image;
  image.bytes = ReadFileBytes(path);
  image.encoding = DetectEncoding(image.bytes);
  return image;
}

}  // namespace

ImageFolder::ImageFolder(const std::string& folder, double fps) {
  DMSLAM_CHECK(fps > 0, "the frame rate must be positive");
  if (!fs::is_directory(folder)) throw InputError(folder + ": no such folder; check the path of the images");
  const std::vector<NumberedFile> files = NumberedImages(folder);
  if (files.empty()) throw InputError(folder + ": has no numbered image; name them like 000001.png");
  for (size_t i = 0; i < files.size(); ++i) {
    if (i > 0 && files[i].number == files[i - 1].number) {
      throw InputError(files[i].path + ": has the same number as " + files[i - 1].path +
                       "; rename or remove one");
    }
    frames_.push_back({std::llround(static_cast<double>(i) * 1e9 / fps), files[i].path});
  }
}

EncodedImage ImageFolder::Read(size_t index) { return ReadEncoded(frames_.at(index).path); }

bool ImageFolder::Recognises(const std::string& folder) {
  return fs::is_directory(folder) && !NumberedImages(folder).empty();
}

std::optional<std::string> EurocSequence::CameraFolder(const std::string& folder) {
  for (const char* below : {"mav0/cam0", "cam0", "."}) {
    const fs::path candidate = fs::path(folder) / below;
    if (fs::is_regular_file(candidate / "data.csv") && fs::is_directory(candidate / "data"))
      return candidate.string();
  }
  return std::nullopt;
}

EurocSequence::EurocSequence(const std::string& folder) {
  const std::optional<std::string> camera_folder = CameraFolder(folder);
  if (!camera_folder) throw InputError(folder + ": has no mav0/cam0/data.csv; is it an EuRoC sequence?");
  const std::string list = (fs::path(*camera_folder) / "data.csv").string();
  std::string first_missing;
  std::optional<int64_t> last_stamp_ns;
  ForEachRow(ReadTextFile(list), ", \t", [&](size_t line, std::span<const std::string_view> fields) {
    StampedFile file = ParseEurocRow(fields, *camera_folder, FileLine(list, line));
    if (last_stamp_ns && file.stamp_ns <= *last_stamp_ns) {
      throw InputError(FileLine(list, line) +
                       ": stamp is not later than the one before; sort the list by stamp");
    }
    last_stamp_ns = file.stamp_ns;
    if (fs::is_regular_file(file.path)) return frames_.push_back(std::move(file));
    if (missing_++ == 0) first_missing = file.path;
  });
  if (!last_stamp_ns) throw InputError(list + ": lists no image");
  if (frames_.empty()) {
    throw InputError(list + ": none of its " + std::to_string(missing_) +
                     " images is there (first: " + first_missing + "); fetch the images or correct the list");
  }
}

EncodedImage EurocSequence::Read(size_t index) { return ReadEncoded(frames_.at(index).path); }

Camera EurocSequence::ReadCamera(const std::string& sensor_yaml) {
  YAML::Node node;
  try {
    node = YAML::Load(ReadTextFile(sensor_yaml));
  } catch (const YAML::Exception& error) {
    throw InputError(NotYaml(sensor_yaml, error) + "; give a camera file with --camera");
  }
  if (!node.IsMap())
    throw InputError(sensor_yaml + ": is not a map of fields; give a camera file with --camera");
  ReadModel(node, sensor_yaml, "camera_model", {"pinhole"});
  const std::string lens =
      ReadModel(node, sensor_yaml, "distortion_model", {"radial-tangential", "equidistant"});
  const std::vector<double> resolution = ReadList(node, sensor_yaml, "resolution", 2);
  const std::vector<double> intrinsics = ReadList(node, sensor_yaml, "intrinsics", 4);
  const std::vector<double> distortion = ReadList(node, sensor_yaml, "distortion_coefficients", 4);
  Camera camera{.width_px = static_cast<int>(resolution[0]),
                .height_px = static_cast<int>(resolution[1]),
                .fx_px = intrinsics[0],
                .fy_px = intrinsics[1],
                .cx_px = intrinsics[2],
                .cy_px = intrinsics[3],
                .k1 = distortion[0],
                .k2 = distortion[1]};
  if (lens == "equidistant") {
    camera.lens = Lens::kFisheye;
    camera.k3 = distortion[2];
    camera.k4 = distortion[3];
  } else {
    camera.p1 = distortion[2];
    camera.p2 = distortion[3];
  }
  if (node["rate_hz"]) camera.fps = node["rate_hz"].as<double>(30.0);
  if (const auto problem = camera.Problem()) throw InputError(sensor_yaml + ": " + *problem + "; correct it");
  return camera;
}

}  // namespace dmslam
