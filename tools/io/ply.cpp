// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/ply.h"

#include <algorithm>
#include <cstring>
#include <string_view>

#include "tools/io/error.h"
#include "tools/io/formats.h"
#include "tools/io/text.h"

namespace overtake::io {
namespace {

constexpr std::size_t kMostPlyHeaderBytes = 1 << 20, kMostPlyProperties = 1000, kMostPlyElements = 1000;

struct PlyProperty {
  std::string name;
  ValueType type = ValueType::kFloat32;
  bool is_list = false;
  ValueType count_type = ValueType::kUint8;  // of a list
};

struct PlyElement {
  std::string name;
  int64_t count = 0;
  std::vector<PlyProperty> properties;

  // Bytes of one row in binary data; with lists the minimum.
  std::size_t least_bytes() const {
    std::size_t sum = 0;
    for (const PlyProperty& p : properties) sum += size_of(p.is_list ? p.count_type : p.type);
    return sum;
  }
  bool has_list() const {
    return std::any_of(properties.begin(), properties.end(), [](const PlyProperty& p) { return p.is_list; });
  }
};

struct PlyHeader {
  PlyEncoding encoding = PlyEncoding::kAscii;
  std::vector<PlyElement> elements;
  std::size_t vertex = 0;       // index in elements
  std::size_t data_offset = 0;  // first byte after the line end_header
  int64_t data_line = 0;        // number of that line

  const PlyElement& vertices() const { return elements[vertex]; }
};

bool find_ply_type(std::string_view name, ValueType& out) {
  struct Row {
    const char* name;  // the other name is name_of(type)
    ValueType type;
  };
  static constexpr Row kRows[] = {{"float", ValueType::kFloat32}, {"double", ValueType::kFloat64},
                                  {"char", ValueType::kInt8},     {"uchar", ValueType::kUint8},
                                  {"short", ValueType::kInt16},   {"ushort", ValueType::kUint16},
                                  {"int", ValueType::kInt32},     {"uint", ValueType::kUint32}};
  for (const Row& row : kRows)
    if (name == row.name || name == name_of(row.type)) {
      out = row.type;
      return true;
    }
  return false;
}

class PlyHeaderParser {
 public:
  PlyHeaderParser(const std::string& path, const std::string& bytes) : path_(path), bytes_(bytes) {}

  PlyHeader run() {
    std::size_t at = 0;
    while (!ended_) {
      const std::size_t end = bytes_.find('\n', at);
      if (std::min(end, bytes_.size()) > kMostPlyHeaderBytes)
        throw Error(path_, 0, "no line end_header within the first MiB: not a PLY file");
      if (end == std::string::npos)
        throw Error(path_, 0, "no line end_header: not a PLY file, or cut off in its header");
      ++line_;
      read_line(split_words(std::string_view(bytes_).substr(at, end - at)));
      at = end + 1;
    }
    header_.data_offset = at;
    header_.data_line = line_;
    if (!has_encoding_) throw Error(path_, 0, "no line format");
    const auto vertex = std::find_if(header_.elements.begin(), header_.elements.end(),
                                     [](const PlyElement& element) { return element.name == "vertex"; });
    if (vertex == header_.elements.end()) throw Error(path_, 0, "has no element vertex: it holds no points");
    if (vertex->properties.empty()) throw Error(path_, 0, "its element vertex has no property");
    header_.vertex = std::size_t(vertex - header_.elements.begin());
    return std::move(header_);
  }

 private:
  using Words = std::vector<std::string_view>;
  [[noreturn]] void fail(const std::string& sentence) const { throw Error(path_, line_, sentence); }

  void read_line(const Words& words) {
    if (line_ == 1) {
      if (words.size() != 1 || words[0] != "ply") fail("not a PLY file");
    } else if (words.empty() || words[0] == "comment" || words[0] == "obj_info") {
    } else if (words[0] == "format") {
      read_encoding(words);
    } else if (words[0] == "element") {
      read_element(words);
    } else if (words[0] == "property") {
      read_property(words);
    } else if (words[0] == "end_header") {
      ended_ = true;
    } else {
      fail("'" + plain_word(words[0]) + "' is not a line of a PLY header");
    }
  }

  void read_encoding(const Words& words) {
    static constexpr const char* kNames[] = {"ascii", "binary_little_endian", "binary_big_endian"};
    const auto* name = words.size() == 3 && words[2] == "1.0"
                           ? std::find(std::begin(kNames), std::end(kNames), words[1])
                           : std::end(kNames);
    if (name == std::end(kNames)) fail("format is not ascii, binary_little_endian or binary_big_endian 1.0");
    header_.encoding = PlyEncoding(name - kNames);
    has_encoding_ = true;
  }

  void read_element(const Words& words) {
    PlyElement element;
    if (words.size() != 3) fail("element needs a name and a number");
    if (!parse_integer(words[2], element.count) || element.count < 0 || element.count > INT32_MAX)
      fail("element " + plain_word(words[1]) + " has '" + plain_word(words[2]) +
           "' rows, not a whole number up to 2147483647");
    element.name = words[1];
    for (const PlyElement& other : header_.elements)
      if (other.name == element.name) fail("element '" + plain_word(words[1]) + "' is declared twice");
    if (header_.elements.size() == kMostPlyElements) fail("more than 1000 elements");
    header_.elements.push_back(std::move(element));
  }

  void read_property(const Words& words) {
    if (header_.elements.empty()) fail("a property before the first element");
    std::vector<PlyProperty>& properties = header_.elements.back().properties;
    PlyProperty property;
    property.is_list = words.size() > 1 && words[1] == "list";
    if (words.size() != (property.is_list ? 5u : 3u)) fail("property needs a type and a name");
    property.name = words.back();
    for (const PlyProperty& other : properties)
      if (other.name == property.name) fail("property '" + plain_word(property.name) + "' is declared twice");
    if (properties.size() == kMostPlyProperties) fail("more than 1000 properties of an element");
    if (!find_ply_type(words[words.size() - 2], property.type) ||
        (property.is_list && (!find_ply_type(words[2], property.count_type) || is_float(property.count_type))))
      fail("property '" + plain_word(property.name) + "' has an unknown type");
    properties.push_back(std::move(property));
  }

  const std::string& path_;
  const std::string& bytes_;
  int64_t line_ = 0;
  bool has_encoding_ = false, ended_ = false;
  PlyHeader header_;
};

// A cloud of the vertices' scalar properties, without columns.
Cloud fields_of(const PlyElement& vertices) {
  Cloud cloud;
  cloud.points = vertices.count;
  const auto has = [&](std::string_view name) {
    return std::any_of(vertices.properties.begin(), vertices.properties.end(),
                       [&](const PlyProperty& p) { return p.name == name; });
  };
  constexpr std::string_view kPrefix = "scalar_";
  for (const PlyProperty& p : vertices.properties) {
    if (p.is_list) continue;
    const bool prefixed = p.name.starts_with(kPrefix) && p.name.size() > kPrefix.size();
    const std::string plain = prefixed ? p.name.substr(kPrefix.size()) : p.name;
    cloud.fields.push_back({has(plain) ? p.name : plain, p.type, 1});
  }
  return cloud;
}

// Reads binary data value by value, and converts each to the machine's byte order.
class PlyBinary {
 public:
  PlyBinary(const std::string& path, const std::string& bytes, const PlyHeader& header)
      : path_(path), bytes_(bytes), at_(header.data_offset), swap_(header.encoding == PlyEncoding::kBigEndian) {}

  // Checks the declared number of rows against the file's size.
  void check_size(const PlyElement& element) const {
    const std::size_t least = element.least_bytes();
    if (least > 0 && (bytes_.size() - at_) / least < std::size_t(element.count))
      fail_end(element, int64_t((bytes_.size() - at_) / least));
  }

  void skip(const PlyElement& element) {
    check_size(element);
    if (!element.has_list()) {
      at_ += element.least_bytes() * std::size_t(element.count);
      return;
    }
    for (int64_t row = 0; row < element.count; ++row)
      for (const PlyProperty& p : element.properties)
        p.is_list ? skip_list(p, element, row) : void(take(size_of(p.type), element, row));
  }

  void read(const PlyElement& element, std::vector<CloudColumn>& columns) {
    for (int64_t row = 0; row < element.count; ++row) {
      std::size_t c = 0;
      for (const PlyProperty& p : element.properties) {
        if (p.is_list) {
          skip_list(p, element, row);
          continue;
        }
        const std::size_t size = size_of(p.type);
        unsigned char* out = columns[c++].bytes.data() + std::size_t(row) * size;
        std::memcpy(out, take(size, element, row), size);
        if (swap_) std::reverse(out, out + size);
      }
    }
  }

 private:
  [[noreturn]] void fail_end(const PlyElement& element, int64_t row) const {
    throw Error(path_, 0,
                "the data ends at byte " + std::to_string(bytes_.size()) + ", within row " + std::to_string(row) +
                    " of the " + std::to_string(element.count) + " of element " + plain_word(element.name));
  }

  const char* take(std::size_t size, const PlyElement& element, int64_t row) {
    if (size > bytes_.size() - at_) fail_end(element, row);
    at_ += size;
    return bytes_.data() + (at_ - size);
  }

  void skip_list(const PlyProperty& p, const PlyElement& element, int64_t row) {
    CloudColumn count{p.count_type, 1, std::vector<unsigned char>(size_of(p.count_type))};
    std::memcpy(count.bytes.data(), take(count.bytes.size(), element, row), count.bytes.size());
    if (swap_) std::reverse(count.bytes.begin(), count.bytes.end());
    const int64_t values = count.integer(0);
    if (values < 0)
      throw Error(path_, 0,
                  "list '" + plain_word(p.name) + "' of row " + std::to_string(row) + " of element " +
                      plain_word(element.name) + " has " + std::to_string(values) + " values");
    take(std::size_t(values) * size_of(p.type), element, row);  // < 2^32 values of at most 8 bytes: no overflow
  }

  const std::string& path_;
  const std::string& bytes_;
  std::size_t at_;
  bool swap_;
};

// Reads ASCII data: one row per line; skips empty lines.
class PlyText {
 public:
  PlyText(const std::string& path, const std::string& bytes, const PlyHeader& header)
      : path_(path), rest_(std::string_view(bytes).substr(header.data_offset)), line_(header.data_line) {}

  // A value takes at least a digit and a separator.
  void check_size(const PlyElement& element) const {
    const std::size_t values = std::max<std::size_t>(element.properties.size(), 1);
    if (element.count > 0 && (rest_.size() + 1) / 2 / values < std::size_t(element.count))
      throw Error(path_, 0,
                  "the data is too short: " + std::to_string(rest_.size()) + " bytes cannot hold the declared " +
                      std::to_string(element.count) + " rows of element " + plain_word(element.name));
  }

  void skip(const PlyElement& element) {
    if (element.properties.empty()) return;
    check_size(element);
    for (int64_t row = 0; row < element.count; ++row) next_row(element, row);
  }

  void read(const PlyElement& element, std::vector<CloudColumn>& columns) {
    for (int64_t row = 0; row < element.count; ++row) {
      next_row(element, row);
      std::size_t c = 0;
      for (const PlyProperty& p : element.properties) {
        const std::string_view word = next_word(element, row);
        if (p.is_list) {
          int64_t values = 0;
          if (!parse_integer(word, values) || values < 0) fail_value(p, row, word);
          for (int64_t i = 0; i < values; ++i) next_word(element, row);  // throws at the end of the row
          continue;
        }
        CloudColumn& column = columns[c++];
        if (!store_text(p.type, word, column.bytes.data() + std::size_t(row) * size_of(p.type)))
          fail_value(p, row, word);
      }
      if (!trim(row_).empty())
        throw Error(path_, line_, "vertex " + std::to_string(row) + " has more values than the header declares");
    }
  }

 private:
  [[noreturn]] void fail_value(const PlyProperty& p, int64_t row, std::string_view word) const {
    throw Error(path_, line_,
                "property '" + plain_word(p.name) + "' of vertex " + std::to_string(row) + " is '" + plain_word(word) +
                    "', which its type cannot hold");
  }

  void next_row(const PlyElement& element, int64_t row) {
    do {
      if (rest_.empty())
        throw Error(path_, line_,
                    "the data ends after " + std::to_string(row) + " of the " + std::to_string(element.count) +
                        " rows of element " + plain_word(element.name));
      row_ = rest_.substr(0, rest_.find('\n'));
      rest_.remove_prefix(std::min(rest_.size(), row_.size() + 1));
      ++line_;
    } while (trim(row_).empty());
  }

  std::string_view next_word(const PlyElement& element, int64_t row) {
    const auto begin = std::min(row_.find_first_not_of(" \t\r"), row_.size());
    const auto end = std::min(row_.find_first_of(" \t\r", begin), row_.size());
    if (begin == end)
      throw Error(path_, line_, plain_word(element.name) + " " + std::to_string(row) + " has too few values");
    const std::string_view word = row_.substr(begin, end - begin);
    row_.remove_prefix(end);
    return word;
  }

  const std::string& path_;
  std::string_view rest_, row_;
  int64_t line_;
};

template <class Data>
void read_vertices(const std::string& path, const std::string& bytes, const PlyHeader& header, Cloud& cloud) {
  Data data(path, bytes, header);
  for (std::size_t e = 0; e < header.vertex; ++e) data.skip(header.elements[e]);
  const PlyElement& vertices = header.vertices();
  data.check_size(vertices);
  uint64_t point_bytes = 0;
  for (const CloudField& field : cloud.fields) point_bytes += size_of(field.type);
  check_memory(path, bytes.size() + uint64_t(cloud.points) * point_bytes,
               "reading its " + std::to_string(cloud.points) + " points");
  cloud.columns = make_columns(cloud.fields, cloud.points);
  data.read(vertices, cloud.columns);
}

bool looks_like_ply(std::string_view head) { return head.starts_with("ply\n") || head.starts_with("ply\r\n"); }

Cloud header_of_ply(const std::string& path, const std::string& bytes) {
  return fields_of(PlyHeaderParser(path, bytes).run().vertices());
}

std::vector<CloudExample> ply_examples(const Cloud& cloud) {
  std::vector<CloudExample> out;
  for (const auto encoding : {PlyEncoding::kAscii, PlyEncoding::kLittleEndian, PlyEncoding::kBigEndian}) {
    const std::string bytes = format_ply(cloud, encoding);
    out.push_back({bytes, bytes.find("end_header")});
  }
  return out;
}

}  // namespace

const CloudFormat ply_format = {looks_like_ply, header_of_ply, parse_ply, ply_examples};

Cloud parse_ply(const std::string& path, const std::string& bytes) {
  const PlyHeader header = PlyHeaderParser(path, bytes).run();
  Cloud cloud = fields_of(header.vertices());
  if (header.encoding == PlyEncoding::kAscii)
    read_vertices<PlyText>(path, bytes, header, cloud);
  else
    read_vertices<PlyBinary>(path, bytes, header, cloud);
  return cloud;
}

std::string format_ply(const Cloud& cloud, PlyEncoding encoding) {
  static constexpr const char* kEncoding[] = {"ascii", "binary_little_endian", "binary_big_endian"};
  static constexpr const char* kType[] = {"float", "double", "char", "uchar", "short", "ushort", "int", "uint"};
  std::string out = "ply\nformat " + std::string(kEncoding[std::size_t(encoding)]) + " 1.0\nelement vertex " +
                    std::to_string(cloud.points) + "\n";
  std::vector<const CloudColumn*> columns;
  for (std::size_t f = 0; f < cloud.fields.size(); ++f) {
    const CloudField& field = cloud.fields[f];
    if (field.count != 1 || std::size_t(field.type) >= std::size(kType)) continue;
    out += "property " + std::string(kType[std::size_t(field.type)]) + " " + field.name + "\n";
    columns.push_back(&cloud.columns[f]);
  }
  out += "end_header\n";
  for (std::size_t i = 0; i < std::size_t(cloud.points); ++i) {
    for (const CloudColumn* column : columns) {
      if (encoding == PlyEncoding::kAscii) {
        append_value_text(out, *column, i);
        out += column == columns.back() ? '\n' : ' ';
        continue;
      }
      const std::size_t size = size_of(column->type), begin = out.size();
      out.append(reinterpret_cast<const char*>(column->bytes.data()) + i * size, size);
      if (encoding == PlyEncoding::kBigEndian) std::reverse(out.begin() + std::ptrdiff_t(begin), out.end());
    }
  }
  return out;
}

}  // namespace overtake::io
