// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/base64.h"

#include <doctest/doctest.h>

using namespace overtake::io;

TEST_CASE("base64: the test vectors of RFC 4648") {
  const char* plain[] = {"", "f", "fo", "foo", "foob", "fooba", "foobar"};
  const char* encoded[] = {"", "Zg==", "Zm8=", "Zm9v", "Zm9vYg==", "Zm9vYmE=", "Zm9vYmFy"};
  for (int32_t k = 0; k < 7; ++k) CHECK(encode_base64(plain[k]) == encoded[k]);
  CHECK(encode_base64("\xff\xfe\xfd") == "//79");
}
