#pragma once

#include <string>

#include "dmslam/dataset/image.h"
#include "dmslam/wire/player_messages.h"

namespace dmslam {

/// How pixels become a frame's bytes.
struct EncodingOptions {
  FrameEncoding encoding = FrameEncoding::kJpeg;  ///< of what is encoded: JPEG, PNG or 8-bit grey
  int jpeg_quality = 90;
  bool reencode = false;  ///< files that are JPEG or PNG travel as they are, unless this is set
};

/// "jpeg", "png" or "raw" (8-bit grey).
FrameEncoding ParseFrameEncoding(const std::string& text);

/// Fills in the frame's encoding, size and data. `keep_raw`: raw pixels travel as they are too. Throws
/// InputError that starts with `name` when the image cannot be decoded.
void EncodeFrame(const EncodedImage& image, const std::string& name, const EncodingOptions& options,
                 bool keep_raw, Frame* frame);

}  // namespace dmslam
