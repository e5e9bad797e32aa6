#include "dmslam/dataset/image.h"

#include <turbojpeg.h>

#include <algorithm>
#include <cstring>
#include <filesystem>
#include <fstream>
#include <opencv2/imgcodecs.hpp>
#include <string_view>

#include "dmslam/camera/camera.h"
#include "dmslam/util/check.h"

namespace dmslam {
namespace {

constexpr std::array<uint8_t, 8> kPngMagic{0x89, 'P', 'N', 'G', '\r', '\n', 0x1a, '\n'};
constexpr size_t kPngHeaderBytes = 24;

struct TurboDeleter {
  void operator()(void* handle) const { tjDestroy(handle); }
};
using TurboHandle = std::unique_ptr<void, TurboDeleter>;

TurboHandle MakeDecompressor() {
  TurboHandle handle(tjInitDecompress());
  DMSLAM_CHECK(handle != nullptr, "libturbojpeg gives no decompressor");
  return handle;
}

void CheckSize(int64_t width, int64_t height, const std::string& name) {
  if (width < 1 || height < 1 || width > kMaxImageSidePx || height > kMaxImageSidePx) {
    throw InputError(name + ": image of " + std::to_string(width) + "x" + std::to_string(height) +
                     " pixels is outside 1.." + std::to_string(kMaxImageSidePx) + "; resize it");
  }
}

/// Warnings about stray bytes between markers do no harm; all others mean that pixels are missing or wrong.
bool IsHarmless(tjhandle handle) {
  return tjGetErrorCode(handle) == TJERR_WARNING &&
         std::string_view(tjGetErrorStr2(handle)).find("extraneous") != std::string_view::npos;
}

void DecodeJpeg(tjhandle handle, std::span<const uint8_t> bytes, int pixel_format, const std::string& name,
                int& width, int& height, std::vector<uint8_t>& data) {
  int subsampling = 0, colorspace = 0;
  const auto size = static_cast<unsigned long>(bytes.size());
  if (tjDecompressHeader3(handle, bytes.data(), size, &width, &height, &subsampling, &colorspace) != 0) {
    throw InputError(name + ": is not a JPEG image (" + tjGetErrorStr2(handle) + "); fetch the file again");
  }
  CheckSize(width, height, name);
  const auto channels = static_cast<size_t>(tjPixelSize[pixel_format]);
  data.resize(static_cast<size_t>(width) * static_cast<size_t>(height) * channels);
  if (tjDecompress2(handle, bytes.data(), size, data.data(), width, 0, height, pixel_format, 0) != 0 &&
      !IsHarmless(handle)) {
    throw InputError(name + ": JPEG image is damaged (" + tjGetErrorStr2(handle) + "); fetch the file again");
  }
}

uint32_t BigEndian(std::span<const uint8_t> bytes, size_t at) {
  return (uint32_t{bytes[at]} << 24) | (uint32_t{bytes[at + 1]} << 16) | (uint32_t{bytes[at + 2]} << 8) |
         bytes[at + 3];
}

/// PNG states its size in its first chunk, so that a bomb is refused before it is unpacked; its chunks state
/// their lengths, so that a truncated file is refused before the decoder fills the rest with anything.
void CheckPng(std::span<const uint8_t> bytes, const std::string& name) {
  if (bytes.size() < kPngHeaderBytes || !std::equal(kPngMagic.begin(), kPngMagic.end(), bytes.begin())) {
    throw InputError(name + ": is not a PNG image; fetch the file again");
  }
  CheckSize(BigEndian(bytes, 16), BigEndian(bytes, 20), name);
  constexpr size_t kChunkFrameBytes = 12;
  constexpr uint32_t kEndChunk = 0x49454e44;  // "IEND"
  for (size_t at = kPngMagic.size(); at + kChunkFrameBytes <= bytes.size();) {
    if (BigEndian(bytes, at + 4) == kEndChunk) return;
    at += kChunkFrameBytes + BigEndian(bytes, at);
  }
  throw InputError(name + ": PNG image is truncated; fetch the file again");
}

cv::Mat DecodeWithOpenCv(std::span<const uint8_t> bytes, int flags, const std::string& name) {
  cv::Mat decoded;
  if (!bytes.empty() && bytes.size() < (size_t{1} << 30)) {
    const cv::Mat input(1, static_cast<int>(bytes.size()), CV_8UC1, const_cast<uint8_t*>(bytes.data()));
    try {
      decoded = cv::imdecode(input, flags | cv::IMREAD_IGNORE_ORIENTATION);
    } catch (const cv::Exception&) {
      decoded.release();
    }
  }
  if (decoded.empty()) throw InputError(name + ": is no readable image; PNG and JPEG are understood");
  CheckSize(decoded.cols, decoded.rows, name);
  return decoded;
}

void CopyPixels(const cv::Mat& from, int& width, int& height, std::vector<uint8_t>& data) {
  width = from.cols;
  height = from.rows;
  const size_t row_bytes = static_cast<size_t>(width) * from.elemSize();
  data.resize(row_bytes * static_cast<size_t>(height));
  for (int y = 0; y < height; ++y)
    std::memcpy(data.data() + static_cast<size_t>(y) * row_bytes, from.ptr(y), row_bytes);
}

void CheckRaw(int width, int height, size_t channels, size_t size, const std::string& name) {
  CheckSize(width, height, name);
  const size_t wanted = static_cast<size_t>(width) * static_cast<size_t>(height) * channels;
  if (size != wanted) {
    throw InputError(name + ": has " + std::to_string(size) + " bytes where " + std::to_string(width) + "x" +
                     std::to_string(height) + " raw pixels need " + std::to_string(wanted) +
                     "; correct the size");
  }
}

/// Luma of BT.601 in 8-bit fixed point (the weights that JPEG uses).
uint8_t Luma(uint8_t r, uint8_t g, uint8_t b) {
  return static_cast<uint8_t>((19595u * r + 38470u * g + 7471u * b + 32768u) >> 16);
}

void DecodeRawGray(ImageEncoding encoding, int width, int height, std::span<const uint8_t> bytes,
                   const std::string& name, GrayImage& image) {
  const size_t channels = encoding == ImageEncoding::kGray8 ? 1 : 3;
  CheckRaw(width, height, channels, bytes.size(), name);
  image.width = width;
  image.height = height;
  image.data.resize(bytes.size() / channels);
  if (channels == 1) {
    std::copy(bytes.begin(), bytes.end(), image.data.begin());
    return;
  }
  const size_t red = encoding == ImageEncoding::kRgb8 ? 0 : 2;
  for (size_t i = 0; i < image.data.size(); ++i) {
    image.data[i] = Luma(bytes[3 * i + red], bytes[3 * i + 1], bytes[3 * i + 2 - red]);
  }
}

void SwapRedAndBlue(std::vector<uint8_t>& data) {
  for (size_t i = 0; i + 2 < data.size(); i += 3) std::swap(data[i], data[i + 2]);
}

std::vector<uint8_t> Compress(const std::vector<uint8_t>& data, int width, int height, int pixel_format,
                              int subsampling, int quality) {
  const std::unique_ptr<void, TurboDeleter> handle(tjInitCompress());
  DMSLAM_CHECK(handle != nullptr, "libturbojpeg gives no compressor");
  unsigned char* buffer = nullptr;
  unsigned long size = 0;
  const int result = tjCompress2(handle.get(), data.data(), width, 0, height, pixel_format, &buffer, &size,
                                 subsampling, quality, TJFLAG_ACCURATEDCT);
  const std::unique_ptr<unsigned char, decltype(&tjFree)> owner(buffer, &tjFree);
  DMSLAM_CHECK(result == 0, "libturbojpeg cannot compress this image");
  return std::vector<uint8_t>(buffer, buffer + size);
}

std::vector<uint8_t> PngOf(const cv::Mat& mat) {
  std::vector<uint8_t> bytes;
  DMSLAM_CHECK(cv::imencode(".png", mat, bytes, {cv::IMWRITE_PNG_COMPRESSION, 3}), "OpenCV cannot write PNG");
  return bytes;
}

}  // namespace

ImageEncoding DetectEncoding(std::span<const uint8_t> bytes) {
  if (bytes.size() >= 3 && bytes[0] == 0xff && bytes[1] == 0xd8 && bytes[2] == 0xff)
    return ImageEncoding::kJpeg;
  if (bytes.size() >= kPngMagic.size() && std::equal(kPngMagic.begin(), kPngMagic.end(), bytes.begin())) {
    return ImageEncoding::kPng;
  }
  return ImageEncoding::kFile;
}

std::vector<uint8_t> ReadFileBytes(const std::string& path) {
  if (std::filesystem::is_directory(path)) throw InputError(path + ": is a folder; name a file in it");
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  if (!file) throw InputError(path + ": cannot be opened; check the path and its permissions");
  const std::streamoff size = file.tellg();
  std::vector<uint8_t> bytes(static_cast<size_t>(std::max<std::streamoff>(size, 0)));
  file.seekg(0);
  file.read(reinterpret_cast<char*>(bytes.data()), size);
  if (!file) throw InputError(path + ": cannot be read to its end; is it a broken disk?");
  return bytes;
}

void WriteFileBytes(const std::string& path, std::span<const uint8_t> bytes) {
  std::ofstream file(path, std::ios::binary);
  file.write(reinterpret_cast<const char*>(bytes.data()), static_cast<std::streamsize>(bytes.size()));
  file.flush();
  if (!file) throw InputError(path + ": cannot be written; check that the folder exists and has space");
}

struct GrayDecoder::Impl {
  TurboHandle turbo = MakeDecompressor();
};

GrayDecoder::GrayDecoder() : impl_(std::make_unique<Impl>()) {}
GrayDecoder::~GrayDecoder() = default;
GrayDecoder::GrayDecoder(GrayDecoder&&) noexcept = default;
GrayDecoder& GrayDecoder::operator=(GrayDecoder&&) noexcept = default;

void GrayDecoder::Decode(ImageEncoding encoding, int width, int height, std::span<const uint8_t> bytes,
                         const std::string& name, GrayImage& image) {
  switch (encoding) {
    case ImageEncoding::kGray8:
    case ImageEncoding::kRgb8:
    case ImageEncoding::kBgr8:
      return DecodeRawGray(encoding, width, height, bytes, name, image);
    case ImageEncoding::kJpeg:
      return DecodeJpeg(impl_->turbo.get(), bytes, TJPF_GRAY, name, image.width, image.height, image.data);
    case ImageEncoding::kPng:
      CheckPng(bytes, name);
      break;
    case ImageEncoding::kFile:
      break;
  }
  CopyPixels(DecodeWithOpenCv(bytes, cv::IMREAD_GRAYSCALE, name), image.width, image.height, image.data);
}

GrayImage DecodeGray(const EncodedImage& encoded, const std::string& name) {
  GrayImage image;
  GrayDecoder().Decode(encoded.encoding, encoded.width, encoded.height, encoded.bytes, name, image);
  return image;
}

GrayImage DecodeGray(std::span<const uint8_t> bytes, const std::string& name) {
  GrayImage image;
  GrayDecoder().Decode(DetectEncoding(bytes), 0, 0, bytes, name, image);
  return image;
}

GrayImage LoadGray(const std::string& path) { return DecodeGray(ReadFileBytes(path), path); }

ColorImage DecodeColor(const EncodedImage& encoded, const std::string& name) {
  ColorImage image;
  switch (encoded.encoding) {
    case ImageEncoding::kGray8:
      CheckRaw(encoded.width, encoded.height, 1, encoded.bytes.size(), name);
      for (const uint8_t value : encoded.bytes) image.data.insert(image.data.end(), 3, value);
      break;
    case ImageEncoding::kRgb8:
    case ImageEncoding::kBgr8:
      CheckRaw(encoded.width, encoded.height, 3, encoded.bytes.size(), name);
      image.data = encoded.bytes;
      if (encoded.encoding == ImageEncoding::kBgr8) SwapRedAndBlue(image.data);
      break;
    case ImageEncoding::kJpeg:
      DecodeJpeg(MakeDecompressor().get(), encoded.bytes, TJPF_RGB, name, image.width, image.height,
                 image.data);
      return image;
    case ImageEncoding::kPng:
      CheckPng(encoded.bytes, name);
      [[fallthrough]];
    case ImageEncoding::kFile:
      CopyPixels(DecodeWithOpenCv(encoded.bytes, cv::IMREAD_COLOR, name), image.width, image.height,
                 image.data);
      SwapRedAndBlue(image.data);
      return image;
  }
  image.width = encoded.width;
  image.height = encoded.height;
  return image;
}

std::vector<uint8_t> EncodeJpeg(const GrayImage& image, int quality) {
  return Compress(image.data, image.width, image.height, TJPF_GRAY, TJSAMP_GRAY, quality);
}

std::vector<uint8_t> EncodeJpeg(const ColorImage& image, int quality) {
  return Compress(image.data, image.width, image.height, TJPF_RGB, TJSAMP_420, quality);
}

std::vector<uint8_t> EncodePng(const GrayImage& image) {
  return PngOf(cv::Mat(image.height, image.width, CV_8UC1, const_cast<uint8_t*>(image.data.data())));
}

std::vector<uint8_t> EncodePng(const ColorImage& image) {
  std::vector<uint8_t> bgr = image.data;
  SwapRedAndBlue(bgr);
  return PngOf(cv::Mat(image.height, image.width, CV_8UC3, bgr.data()));
}

}  // namespace dmslam
