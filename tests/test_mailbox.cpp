// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// One producer, one consumer: the newest scan is pending, every posted scan is acquired or replaced, none is torn.
#include "pipeline/mailbox.h"

#include <doctest/doctest.h>

#include <atomic>
#include <thread>

using namespace overtake;

namespace {

constexpr int32_t kPoints = 64;

void build(Mailbox<Scan>& box) { REQUIRE(box.build(kPoints, default_allocator())); }

bool post(Mailbox<Scan>& box, int64_t number) {
  Scan& scan = box.writable();
  scan.stamp_ns = number;
  scan.table.count = kPoints;
  for (int32_t i = 0; i < kPoints; ++i) scan.table.layer[i] = int32_t(number) + i;
  return box.post();
}

bool is_whole(const Scan& scan) {
  for (int32_t i = 0; i < kPoints; ++i)
    if (scan.table.layer[i] != int32_t(scan.stamp_ns) + i) return false;
  return scan.table.count == kPoints;
}

}  // namespace

TEST_CASE("mailbox: an empty one gives nothing") {
  Mailbox<Scan> box;
  build(box);
  bool replaced = true;
  CHECK_FALSE(box.acquire(replaced));
  CHECK(box.pending() == nullptr);
}

TEST_CASE("mailbox: a newer scan replaces the pending one, and the acquired one does not change") {
  Mailbox<Scan> box;
  build(box);
  bool replaced = true;
  CHECK_FALSE(post(box, 1));
  REQUIRE(box.acquire(replaced));
  CHECK_FALSE(replaced);
  REQUIRE(box.pending());
  CHECK_FALSE(post(box, 2));
  for (int64_t n = 3; n < 20; ++n) CHECK(post(box, n));
  CHECK(box.pending()->stamp_ns == 1);
  CHECK(is_whole(*box.pending()));
  REQUIRE(box.acquire(replaced));
  CHECK(replaced);  // the acquired one was given back
  CHECK(box.pending()->stamp_ns == 19);
  CHECK(is_whole(*box.pending()));
  CHECK_FALSE(box.acquire(replaced));
  box.release();
  CHECK(box.pending() == nullptr);
  CHECK_FALSE(box.acquire(replaced));
}

TEST_CASE("mailbox: 100,000 racing posts lose none and tear none") {
  constexpr int64_t kPosts = 100000;
  Mailbox<Scan> box;
  build(box);
  std::atomic<bool> done{false};
  int64_t replaced_waiting = 0;
  std::thread producer([&] {
    for (int64_t n = 1; n <= kPosts; ++n) {
      if (n % 5000 == 0) std::this_thread::yield();
      replaced_waiting += post(box, n);
    }
    done.store(true);
  });
  int64_t taken = 0, replaced_pending = 0, torn = 0, backwards = 0, last = 0;
  for (bool more = true; more;) {
    more = !done.load();  // read before the acquire: nothing posted earlier is missed
    bool replaced = false;
    if (!box.acquire(replaced)) continue;
    more = true;
    replaced_pending += replaced;
    torn += !is_whole(*box.pending());
    backwards += box.pending()->stamp_ns <= last;
    last = box.pending()->stamp_ns;
    if (last % 3 != 0) {
      box.release();
      ++taken;
    }
  }
  producer.join();
  if (box.pending()) ++taken;
  CHECK(torn == 0);
  CHECK(backwards == 0);
  CHECK(last == kPosts);
  CHECK(taken + replaced_pending + replaced_waiting == kPosts);
}

TEST_CASE("mailbox: a producer that waits until its scan is acquired loses none") {
  constexpr int64_t kPosts = 20000;
  Mailbox<Scan> box;
  build(box);
  int64_t replaced_waiting = 0;
  std::thread producer([&] {
    for (int64_t n = 1; n <= kPosts; ++n) {
      box.wait_until_acquired();
      replaced_waiting += post(box, n);
    }
  });
  int64_t wrong = 0;
  for (int64_t next = 1; next <= kPosts;) {
    bool replaced = false;
    if (!box.acquire(replaced)) continue;
    wrong += box.pending()->stamp_ns != next || !is_whole(*box.pending());
    box.release();
    ++next;
  }
  producer.join();
  CHECK(wrong == 0);
  CHECK(replaced_waiting == 0);
}
