// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include <png.h>

#include "tools/io/error.h"
#include "tools/io/image.h"
#include "tools/io/text.h"

namespace overtake::io {

namespace {

png_image describe(const Picture& picture) {
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  image.width = png_uint_32(picture.width);
  image.height = png_uint_32(picture.height);
  image.format = PNG_FORMAT_RGB;
  return image;
}

}  // namespace

std::string encode_png(const Picture& picture) {
  png_image image = describe(picture);
  std::string out(std::size_t(PNG_IMAGE_PNG_SIZE_MAX(image)), '\0');
  png_alloc_size_t size = out.size();
  if (!png_image_write_to_memory(&image, out.data(), &size, 0, picture.pixels.data(), 0, nullptr))
    throw Error("PNG", 0, std::string("cannot be made: ") + image.message);
  out.resize(size);
  return out;
}

void write_png(const std::string& path, const Picture& picture) { write_whole_file(path, encode_png(picture)); }

Picture read_png(const std::string& path) {
  constexpr png_uint_32 kMaxSide = 1 << 15;
  constexpr uint64_t kMostOfDeflate = 1032;  // largest expansion of a byte; a pixel takes at least a bit
  png_image image{};
  image.version = PNG_IMAGE_VERSION;
  const std::string bytes = read_whole_file(path, memory_limit() / 2);
  if (!png_image_begin_read_from_memory(&image, bytes.data(), bytes.size()))
    throw Error(path, 0, std::string("cannot be read: ") + image.message);
  const uint64_t pixels = uint64_t(image.width) * image.height;
  std::string wrong;
  if (image.width > kMaxSide || image.height > kMaxSide)
    wrong = "is larger than 32768 pixels a side";
  else if (pixels / 8 / kMostOfDeflate > bytes.size())
    wrong = "declares " + std::to_string(image.width) + " x " + std::to_string(image.height) + " pixels, which its " +
            format_size(bytes.size()) + " cannot hold";
  else
    wrong = beyond_memory(bytes.size() + 2 * sizeof(Rgb) * pixels, "unpacking it");
  if (!wrong.empty()) {
    png_image_free(&image);
    throw Error(path, 0, wrong);
  }
  image.format = PNG_FORMAT_RGB;
  Picture picture(int32_t(image.width), int32_t(image.height));
  if (!png_image_finish_read(&image, nullptr, picture.pixels.data(), 0, nullptr))
    throw Error(path, 0, std::string("cannot be read: ") + image.message);
  return picture;
}

}  // namespace overtake::io
