// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/client/console.h"

#include <unistd.h>
#include <csignal>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "tools/io/output.h"

namespace overtake::cli {
namespace {

volatile std::sig_atomic_t interrupt_seen = 0;
extern "C" void note_interrupt(int) { interrupt_seen = 1; }

}  // namespace

Progress::Progress(int64_t total, bool quiet) : total_(total), visible_(!quiet && total > 0 && isatty(STDERR_FILENO)) {}

void Progress::print_lines(const std::string& what, double every_s) {
  what_ = what, every_s_ = every_s;
  visible_ = false;
  begin_ = last_line_ = std::chrono::steady_clock::now();
}

void Progress::show_line(int64_t done) {
  const auto now = std::chrono::steady_clock::now();
  if (std::chrono::duration<double>(now - last_line_).count() < every_s_) return;
  last_line_ = now;
  const double percent = total_ > 0 ? 100.0 * double(done) / double(total_) : 100;
  std::fprintf(stderr, "%s %.1f %%, %.0f s so far\n", what_.c_str(), percent,
               std::chrono::duration<double>(now - begin_).count());
}

void Progress::show(int64_t done) {
  if (!what_.empty()) return show_line(done);
  const int64_t percent = total_ > 0 ? done * 100 / total_ : 100;
  if (!visible_ || percent == shown_percent_) return;
  shown_percent_ = percent;
  const auto bar = std::size_t(percent * 40 / 100);
  std::fprintf(stderr, "\r[%s%s] %lld of %lld", std::string(bar, '#').c_str(), std::string(40 - bar, '.').c_str(),
               static_cast<long long>(done), static_cast<long long>(total_));
}

void Progress::clear() {
  if (visible_ && shown_percent_ >= 0) std::fprintf(stderr, "\r\033[K");
  shown_percent_ = -1;
}

std::string printable(std::string_view text) {
  std::string out;
  char escape[16];
  for (std::size_t i = 0; i < text.size();) {
    // One UTF-8 character: the first byte gives the number of bytes that follow.
    const auto byte = [&](std::size_t k) { return uint32_t(static_cast<unsigned char>(text[k])); };
    const uint32_t first = byte(i);
    const std::size_t size = first < 0x80   ? 1
                             : first < 0xc2 ? 0
                             : first < 0xe0 ? 2
                             : first < 0xf0 ? 3
                             : first < 0xf5 ? 4
                                            : 0;
    uint32_t code = size <= 1 ? first : first & (0xffu >> (size + 1));
    bool valid = size > 0 && i + size <= text.size();
    for (std::size_t k = 1; valid && k < size; ++k) {
      valid = (byte(i + k) & 0xc0) == 0x80;
      code = code << 6 | (byte(i + k) & 0x3f);
    }
    valid = valid && !(size == 3 && (code < 0x800 || (code >= 0xd800 && code < 0xe000))) &&
            !(size == 4 && (code < 0x10000 || code > 0x10ffff));
    const bool control = code < 0x20 || (code >= 0x7f && code < 0xa0);
    const bool turns = code == 0x61c || code == 0x200e || code == 0x200f || (code >= 0x2028 && code <= 0x202e) ||
                       (code >= 0x2066 && code <= 0x2069);
    if (valid && !control && !turns) {
      out.append(text.substr(i, size));
    } else {
      if (!valid || code < 0x100)
        std::snprintf(escape, sizeof escape, "\\x%02x", unsigned(valid ? code : first));
      else
        std::snprintf(escape, sizeof escape, "\\u%04x", unsigned(code));
      out += escape;
    }
    i += valid ? size : 1;
  }
  return out;
}

void TextTable::add(std::vector<std::string> row) {
  for (std::string& cell : row) cell = printable(cell);
  rows_.push_back(std::move(row));
}

std::string TextTable::format(std::size_t most) const {
  const std::size_t skipped = size() > most ? size() - most : 0;
  std::vector<std::size_t> width(rows_[0].size(), 0);
  for (std::size_t r = 0; r < rows_.size(); ++r)
    for (std::size_t c = 0; c < rows_[r].size() && (r == 0 || r > skipped); ++c)
      width[c] = std::max(width[c], rows_[r][c].size());
  std::string text;
  for (std::size_t r = 0; r < rows_.size(); ++r) {
    if (r > 0 && r <= skipped) continue;
    if (skipped && r == skipped + 1) text += "  ... " + std::to_string(skipped) + " earlier ones ...\n";
    std::string line;
    for (std::size_t c = 0; c < rows_[r].size(); ++c) {
      const std::string& cell = rows_[r][c];
      const bool words = !rows_.back()[c].empty() && rows_.back()[c].find_first_of("0123456789-") != 0;
      const std::string gap(width[c] - cell.size(), ' ');
      line += "  " + (words ? cell + gap : gap + cell);
    }
    text += line.substr(0, line.find_last_not_of(' ') + 1) + '\n';
  }
  return text;
}

std::string fixed(double value, int32_t digits) {
  if (std::isnan(value)) return "-";
  char text[64];
  std::snprintf(text, sizeof text, "%.*f", digits, value);
  return text;
}

void catch_interrupt() {
  struct sigaction action {};
  action.sa_handler = note_interrupt;
  action.sa_flags = int(SA_RESETHAND);  // the second one ends the program
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
}

bool interrupted() { return interrupt_seen != 0; }

void make_folder(const std::string& path) { io::make_output_folder(path); }

}  // namespace overtake::cli
