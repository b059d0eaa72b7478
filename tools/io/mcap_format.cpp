// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/mcap_format.h"

#include <lz4frame.h>
#include <zlib.h>
#include <zstd.h>

#include <algorithm>
#include <memory>
#include <stdexcept>

#include "tools/io/memory_limit.h"

namespace overtake::io {
namespace {

constexpr std::size_t kStep = std::size_t(1) << 20;  // minimum growth of the output
// Largest expansion of one compressed byte: each further byte of LZ4 lengthens a match by 255; a block of Zstandard
// takes 4 bytes and holds at most 128 KiB.
constexpr uint64_t kMostOfLz4 = 255, kMostOfZstd = 32768;

struct FreeLz4 {
  void operator()(LZ4F_dctx* context) const { LZ4F_freeDecompressionContext(context); }
};
struct FreeZstd {
  void operator()(ZSTD_DCtx* context) const { ZSTD_freeDCtx(context); }
};

// Makes room after `used`: doubles it, up to `size` plus one byte, so that output beyond `size` is detected. Reserves
// address space for all of it at once, so that growing copies nothing; pages are allocated when written.
void make_room(std::string& out, std::size_t used, uint64_t size) {
  if (used < out.size()) return;
  out.reserve(std::size_t(size + 1));
  const uint64_t want = std::max<uint64_t>(used + kStep, 2 * uint64_t(used));
  out.resize(std::size_t(std::min<uint64_t>(want, size + 1)));
}

std::string decompress_lz4(std::string_view bytes, uint64_t size, std::string& out) {
  LZ4F_dctx* raw = nullptr;
  if (LZ4F_isError(LZ4F_createDecompressionContext(&raw, LZ4F_VERSION))) throw std::bad_alloc();
  const std::unique_ptr<LZ4F_dctx, FreeLz4> context(raw);
  std::size_t used = 0;
  std::string wrong;
  while (true) {
    make_room(out, used, size);
    std::size_t written = out.size() - used, read = bytes.size();
    const std::size_t code = LZ4F_decompress(raw, out.data() + used, &written, bytes.data(), &read, nullptr);
    if (LZ4F_isError(code)) {
      wrong = std::string("lz4 says ") + LZ4F_getErrorName(code);
      break;
    }
    used += written;
    bytes.remove_prefix(read);
    if (used > size || code == 0) break;  // too much output, or the frame is complete
    if (bytes.empty() && written == 0) break;
    if (read == 0 && written == 0) break;
  }
  out.resize(used);
  return wrong;
}

std::string decompress_zstd(std::string_view bytes, uint64_t size, std::string& out) {
  // The usual case takes one call: the frame declares its size, which equals the chunk's.
  constexpr uint64_t kBelieved = uint64_t(1) << 26;
  if (size <= kBelieved && ZSTD_getFrameContentSize(bytes.data(), bytes.size()) == size) {
    out.resize(std::size_t(size));
    if (ZSTD_decompress(out.data(), out.size(), bytes.data(), bytes.size()) == size) return "";
    out.clear();
  }
  const std::unique_ptr<ZSTD_DCtx, FreeZstd> context(ZSTD_createDCtx());
  if (!context) throw std::bad_alloc();
  int window_log = 27;  // Zstandard's limit, 128 MiB
  while (window_log > 17 && uint64_t(1) << window_log > memory_limit() / 4) --window_log;
  ZSTD_DCtx_setParameter(context.get(), ZSTD_d_windowLogMax, window_log);
  std::size_t used = 0;
  std::string wrong;
  ZSTD_inBuffer in{bytes.data(), bytes.size(), 0};
  while (true) {
    make_room(out, used, size);
    ZSTD_outBuffer target{out.data() + used, out.size() - used, 0};
    const std::size_t before = in.pos;
    const std::size_t code = ZSTD_decompressStream(context.get(), &target, &in);
    if (ZSTD_isError(code)) {
      used += target.pos;
      wrong = std::string("zstd says ") + ZSTD_getErrorName(code);
      break;
    }
    used += target.pos;
    if (used > size || code == 0) break;
    if (in.pos == before && target.pos == 0) break;
  }
  out.resize(used);
  return wrong;
}

}  // namespace

uint32_t update_crc32(uint32_t crc, std::string_view bytes) {
  return uint32_t(crc32_z(crc, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

std::string compress_chunk(const std::string& compression, int32_t level, std::string_view bytes) {
  if (compression.empty()) return std::string(bytes);
  std::string out;
  if (compression == "zstd") {
    out.resize(ZSTD_compressBound(bytes.size()));
    const std::size_t size = ZSTD_compress(out.data(), out.size(), bytes.data(), bytes.size(), level);
    if (ZSTD_isError(size)) throw std::runtime_error(ZSTD_getErrorName(size));
    out.resize(size);
    return out;
  }
  if (compression == "lz4") {
    LZ4F_preferences_t preferences = LZ4F_INIT_PREFERENCES;
    preferences.compressionLevel = level;
    preferences.frameInfo.contentSize = bytes.size();
    out.resize(LZ4F_compressFrameBound(bytes.size(), &preferences));
    const std::size_t size = LZ4F_compressFrame(out.data(), out.size(), bytes.data(), bytes.size(), &preferences);
    if (LZ4F_isError(size)) throw std::runtime_error(LZ4F_getErrorName(size));
    out.resize(size);
    return out;
  }
  throw std::runtime_error("unknown compression '" + compression + "' (known: none, lz4, zstd)");
}

std::string refuse_chunk(std::string_view compression, uint64_t packed, uint64_t size, bool whole) {
  const uint64_t most = compression == "lz4" ? kMostOfLz4 : kMostOfZstd;
  if (whole && (compression == "lz4" || compression == "zstd") && size / most > packed)
    return "it declares " + format_size(size) + ", its " + format_size(packed) + " cannot hold more than " +
           format_size(packed * most);
  if (size > kMostMcapChunk)
    return "it declares " + format_size(size) + ", chunks of at most " + format_size(kMostMcapChunk) + " are read";
  return beyond_memory(packed + size, "unpacking it");
}

std::string decompress_chunk(std::string_view compression, std::string_view bytes, uint64_t size, std::string& out,
                             bool& damaged) {
  out.clear();
  std::string wrong;
  if (compression.empty())
    out.assign(bytes);
  else if (compression == "lz4")
    wrong = decompress_lz4(bytes, size, out);
  else if (compression == "zstd")
    wrong = decompress_zstd(bytes, size, out);
  else
    return damaged = true, "its compression '" + std::string(compression.substr(0, 32)) + "' is neither lz4 nor zstd";
  damaged = !wrong.empty();
  if (damaged) return wrong;
  if (out.size() == size) return "";
  const bool more = out.size() > size;
  if (more) out.resize(std::size_t(size));
  return "it holds " + std::string(more ? "more" : "fewer") + " than the declared " + std::to_string(size) + " bytes";
}

}  // namespace overtake::io
