#pragma once

#include <cstddef>
#include <cstdint>
#include <memory>
#include <optional>
#include <span>
#include <string>
#include <vector>

namespace dmslam {

/// An 8-bit grey image that owns its pixels: row by row from the top left, no padding between rows.
struct GrayImage {
  int width = 0;
  int height = 0;
  std::vector<uint8_t> data;

  GrayImage() = default;
  GrayImage(int width_px, int height_px, uint8_t value = 0)
      : width(width_px),
        height(height_px),
        data(static_cast<size_t>(width_px) * static_cast<size_t>(height_px), value) {}
  uint8_t& at(int x, int y) {
    return data[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
  }
  uint8_t at(int x, int y) const {
    return data[static_cast<size_t>(y) * static_cast<size_t>(width) + static_cast<size_t>(x)];
  }
  bool empty() const { return data.empty(); }
};

/// An 8-bit colour image that owns its pixels: red, green, blue interleaved, row by row, no padding.
struct ColorImage {
  int width = 0;
  int height = 0;
  std::vector<uint8_t> data;

  bool empty() const { return data.empty(); }
};

/// How the bytes of an image are to be understood. kFile is any other file format that OpenCV may know.
enum class ImageEncoding : uint8_t { kJpeg, kPng, kGray8, kRgb8, kBgr8, kFile };

/// An image as bytes: a compressed file's content, or raw pixels (row by row, no padding).
struct EncodedImage {
  ImageEncoding encoding = ImageEncoding::kFile;
  int width = 0;   ///< Of raw pixels; 0 where the bytes say it themselves.
  int height = 0;  ///< As `width`.
  std::vector<uint8_t> bytes;
};

/// The encoding that the first bytes announce: kJpeg, kPng or kFile.
ImageEncoding DetectEncoding(std::span<const uint8_t> bytes);

/// The whole of a file; throws InputError when it cannot be read.
std::vector<uint8_t> ReadFileBytes(const std::string& path);

/// Writes a file; throws InputError when that fails.
void WriteFileBytes(const std::string& path, std::span<const uint8_t> bytes);

/// Decodes images to grey and keeps what the decoder can use again: with JPEG and raw input of constant size
/// no memory is allocated after the first image. JPEG goes straight to grey (its luma; the chroma is never
/// decoded). Not for use by two threads at once.
class GrayDecoder {
 public:
  GrayDecoder();
  ~GrayDecoder();
  GrayDecoder(GrayDecoder&&) noexcept;
  GrayDecoder& operator=(GrayDecoder&&) noexcept;

  /// Decodes into `image`. `width`, `height` are read for raw encodings only. Throws InputError that starts
  /// with `name` when the bytes are no image, damaged or truncated, or larger than kMaxImageSidePx; such are
  /// not decoded.
  void Decode(ImageEncoding encoding, int width, int height, std::span<const uint8_t> bytes,
              const std::string& name, GrayImage& image);

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

/// One-off forms of GrayDecoder::Decode; the encoding of plain bytes is detected.
GrayImage DecodeGray(const EncodedImage& encoded, const std::string& name);
GrayImage DecodeGray(std::span<const uint8_t> bytes, const std::string& name);
GrayImage LoadGray(const std::string& path);

/// Decodes to colour (grey input gives three equal channels). Errors as for grey.
ColorImage DecodeColor(const EncodedImage& encoded, const std::string& name);

/// Encodes as JPEG; quality 1..100. Colour is subsampled 4:2:0. The same pixels give the same bytes.
std::vector<uint8_t> EncodeJpeg(const GrayImage& image, int quality);
std::vector<uint8_t> EncodeJpeg(const ColorImage& image, int quality);
/// Encodes as PNG, losslessly.
std::vector<uint8_t> EncodePng(const GrayImage& image);
std::vector<uint8_t> EncodePng(const ColorImage& image);

}  // namespace dmslam
