// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/image.h"

#include <doctest/doctest.h>

#include <algorithm>
#include <array>
#include <cstring>
#include <limits>

#include "tests/support/temp_folder.h"
#include "tools/io/lettering.h"
#include "tools/io/npy.h"

using namespace overtake;
using io::Picture;
using io::Rgb;

TEST_CASE("npy: float, int and byte arrays keep shape and bytes; the data starts on a cache line") {
  const TempFolder folder;
  const float real[] = {0.5f, -1, std::numeric_limits<float>::infinity(), 1e-42f, 3, 4};
  const int32_t integer[] = {-1, 0, INT32_MAX};
  const uint8_t byte[] = {0, 1, 255, 9};
  io::write_npy(folder.path("f"), real, {2, 3});
  io::write_npy(folder.path("i"), integer, {3});
  io::write_npy(folder.path("u"), byte, {1, 2, 2});
  io::write_npy(folder.path("empty"), byte, {0, 7});
  const auto check = [&](const char* name, const char* type, std::vector<int64_t> shape, const void* data,
                         std::size_t size) {
    const io::Npy npy = io::read_npy(folder.path(name));
    CHECK(npy.type == type);
    CHECK(npy.shape == shape);
    REQUIRE(npy.bytes.size() == size);
    CHECK(std::memcmp(npy.bytes.data(), data, size) == 0);
    CHECK((io::read_whole_file(folder.path(name)).size() - size) % 64 == 0);
  };
  check("f", "<f4", {2, 3}, real, sizeof real);
  check("i", "<i4", {3}, integer, sizeof integer);
  check("u", "|u1", {1, 2, 2}, byte, sizeof byte);
  check("empty", "|u1", {0, 7}, byte, 0);
  // The format that numpy.load reads: this is the whole header of v1.0.
  const std::string expected =
      std::string("\x93NUMPY\x01\x00\x76\x00", 10) + "{'descr': '<f4', 'fortran_order': False, 'shape': (2, 3), }";
  CHECK(io::read_whole_file(folder.path("f")).substr(0, expected.size()) == expected);
}

TEST_CASE("npy: a wrong or truncated file gives an error") {
  const TempFolder folder;
  const float real[] = {1, 2};
  io::write_npy(folder.path("f"), real, {2});
  const std::string good = io::read_whole_file(folder.path("f"));
  const auto error = [&](const std::string& bytes) {
    const std::string path = folder.write("bad", bytes);
    return error_of([&] { io::read_npy(path); }).substr(path.size());
  };
  CHECK(error("hello") == ": not a NPY v1.0 file");
  CHECK(error(good.substr(0, 40)) == ": the NPY header is cut off");
  CHECK(error(good.substr(0, good.size() - 1)) == ": the NPY data is not as long as its shape says");
  std::string huge = good;
  huge.replace(huge.find("(2,)"), 4, "(9223372036854775807, 4)").erase(huge.find('\n') - 20, 20);
  CHECK(error(huge) == ": the NPY data is not as long as its shape says");
}

TEST_CASE("png: a picture is read back pixel for pixel") {
  const TempFolder folder;
  Picture picture(7, 3);
  for (std::size_t i = 0; i < picture.pixels.size(); ++i)
    picture.pixels[i] = {uint8_t(i), uint8_t(255 - i), uint8_t(i * i)};
  io::write_png(folder.path("p.png"), picture);
  const Picture back = io::read_png(folder.path("p.png"));
  CHECK(back.width == 7);
  CHECK(back.height == 3);
  CHECK(back.pixels == picture.pixels);
  CHECK(error_of([&] {
          io::write_png(folder.path("no/p.png"), picture);
        }).rfind(folder.path("no/p.png") + ": cannot be written", 0) == 0);
  const std::string bad = folder.write("bad.png", "no picture");
  CHECK(error_of([&] { io::read_png(bad); }).rfind(bad + ": cannot be read", 0) == 0);
}

TEST_CASE("colours: the scale gets lighter everywhere and clamps at its ends") {
  const auto lightness = [](const Rgb& c) { return 0.2126 * c[0] + 0.7152 * c[1] + 0.0722 * c[2]; };
  for (int32_t i = 1; i <= 100; ++i)
    CHECK(lightness(io::scale_color(i / 100.0)) > lightness(io::scale_color((i - 1) / 100.0)));
  CHECK(io::scale_color(-1) == io::scale_color(0));
  CHECK(io::scale_color(2) == io::scale_color(1));
}

TEST_CASE("colours: consecutive labels differ clearly from each other, from ground and from no label") {
  const auto distance = [](const Rgb& a, const Rgb& b) {
    return std::abs(a[0] - b[0]) + std::abs(a[1] - b[1]) + std::abs(a[2] - b[2]);
  };
  for (int32_t label = 1; label < 2000; ++label) {
    CAPTURE(label);
    CHECK(distance(io::label_color(label), io::label_color(label + 1)) > 100);
    CHECK(distance(io::label_color(label), io::label_color(0)) > 100);
    CHECK(distance(io::label_color(label), io::label_color(-1)) > 100);
  }
}

TEST_CASE("text: capitals begin at their corner; it keeps to its width; letters differ; edges are smooth") {
  constexpr int32_t kSize = 20, kX = 30, kY = 10;
  const Rgb ink = {255, 200, 0}, paper = {0, 0, 40};
  const auto draw = [&](std::string_view text) {
    Picture picture(400, 40, paper);
    io::draw_text(picture, kX, kY, text, ink, kSize);
    return picture;
  };
  const auto touched = [&](Picture& picture) {  // left, top, right, bottom
    std::array<int32_t, 4> box = {picture.width, picture.height, -1, -1};
    for (int32_t y = 0; y < picture.height; ++y)
      for (int32_t x = 0; x < picture.width; ++x)
        if (picture.at(x, y) != paper)
          box = {std::min(box[0], x), std::min(box[1], y), std::max(box[2], x), std::max(box[3], y)};
    return box;
  };
  Picture capitals = draw("HEAD");
  const auto box = touched(capitals);
  CHECK(std::abs(box[0] - kX) <= 2);
  CHECK(box[1] == kY);
  CHECK(box[2] <= kX + io::text_width("HEAD", kSize));
  CHECK(box[3] - box[1] + 1 >= kSize * 7 / 10);
  CHECK(box[3] - box[1] + 1 <= kSize * 8 / 10);
  std::size_t solid = 0, between = 0;
  for (const Rgb& pixel : capitals.pixels) {
    solid += pixel == ink;
    between += pixel != ink && pixel != paper;
  }
  CHECK(solid > 50);
  CHECK(between > 50);
  Picture low = draw("head");
  CHECK(low.pixels != capitals.pixels);
  CHECK(draw("m/s").pixels != draw("M/S").pixels);
  CHECK(io::text_width("wide", kSize) > io::text_width("ill", kSize));
  CHECK(io::text_width("wide", 2 * kSize) > io::text_width("wide", kSize) * 3 / 2);
  CHECK(io::text_width("", kSize) == 0);
}

TEST_CASE("text: UTF-8; each byte that is none becomes one replacement character; nothing beyond the picture") {
  constexpr int32_t kSize = 16;
  const auto width = [](std::string_view text) { return io::text_width(text, kSize); };
  const int32_t wrong = width("\xEF\xBF\xBD");
  CHECK(wrong > 0);
  CHECK(width("\xC3\xA9") == width("e"));  // e with an acute accent
  CHECK(width("\xFF") == wrong);
  CHECK(width("\xC3") == wrong);  // cut off
  CHECK(width("\xC3"
              "a") == wrong + width("a"));
  CHECK(width("\x80\x80") == 2 * wrong);
  CHECK(width("\xF8\x80\x80\x80\x80") == 5 * wrong);
  for (const auto& [x, y] : {std::pair{-20, 3}, {85, 3}, {5, -9}, {5, 28}, {-500, -500}, {500, 500}}) {
    Picture picture(90, 30);  // the address sanitizer looks
    io::draw_text(picture, x, y, "a car at 80 m", {255, 255, 255}, kSize);
    CHECK(picture.pixels.size() == 90u * 30u);
  }
}

TEST_CASE("pictures: every pixel of the image is a block of its colour below the caption") {
  // 2 rows, 200 columns, one red pixel at (1, 150)
  std::vector<Rgb> colors(400, Rgb{0, 0, 40});
  colors[350] = {255, 0, 0};
  io::ImageStyle style;
  style.zoom_x = 2;
  style.zoom_y = 5;
  style.caption = "range";
  const Picture picture = io::render_image(2, 200, colors, style);
  CHECK(picture.width == 400);
  std::size_t red = 0;
  for (int32_t y = 0; y < picture.height; ++y)
    for (int32_t x = 0; x < picture.width; ++x)
      if (picture.pixels[std::size_t(y * picture.width + x)] == Rgb{255, 0, 0}) {
        ++red;
        CHECK(x / 2 == 150);
        CHECK((y - (picture.height - 10)) / 5 == 1);
      }
  CHECK(red == 10);
}
