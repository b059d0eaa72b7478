// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// JSON as text. Paths and names of files may hold any bytes: what is not UTF-8 becomes U+FFFD, where dump() throws.
#pragma once

#include <string>

namespace overtake::io {

// Json: nlohmann::json or ordered_json; indent -1: one line.
template <class Json>
std::string dump_json(const Json& json, int indent = -1) {
  return json.dump(indent, ' ', false, Json::error_handler_t::replace);
}

}  // namespace overtake::io
