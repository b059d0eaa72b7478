// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Spare workers take parts of the work of others.
#include "pipeline/spare_workers.h"

#include <doctest/doctest.h>

#include <atomic>
#include <chrono>
#include <optional>
#include <thread>
#include <vector>

using namespace overtake;

TEST_CASE("spare workers: there are as many parts as workers with nothing to do, and one, up to the most") {
  SpareWorkers workers(4, 3);
  CHECK(workers.count_parts() == 1);
  std::optional<SpareWorkers::Visit> first(workers), second(workers), third(workers);
  CHECK(workers.count_parts() == 3);
  first.reset(), second.reset();
  CHECK(workers.count_parts() == 2);
  third.reset();
  CHECK(workers.count_parts() == 1);
}

TEST_CASE("spare workers: without any the caller runs each part once, and none is left over") {
  SpareWorkers workers(1, 4);
  std::vector<int32_t> runs(4);
  workers.run(0, 4, [&](int32_t part) { ++runs[std::size_t(part)]; });
  CHECK(runs == std::vector<int32_t>(4, 1));
  SpareWorkers::Visit visit(workers);
  CHECK_FALSE(visit.take_part());
}

TEST_CASE("spare workers: a part that another thread took is waited for") {
  SpareWorkers workers(1, 2);
  std::atomic<bool> here{false}, ends{false};
  std::thread other([&] {
    SpareWorkers::Visit visit(workers);
    here.store(true);
    while (!ends.load() && !visit.take_part()) std::this_thread::yield();
  });
  while (!here.load()) std::this_thread::yield();
  // Part 1 goes to one thread, part 0 to the other: each waits until both run. That of the other thread takes longer.
  const std::thread::id owner = std::this_thread::get_id();
  std::atomic<int32_t> begun{0}, ended{0};
  workers.run(0, 2, [&](int32_t) {
    begun.fetch_add(1);
    while (begun.load() < 2) std::this_thread::yield();
    if (std::this_thread::get_id() != owner) std::this_thread::sleep_for(std::chrono::milliseconds(50));
    ended.fetch_add(1);
  });
  CHECK(ended.load() == 2);
  ends.store(true);
  other.join();
}

TEST_CASE("spare workers: several threads offer and take parts at the same time, and each part runs once") {
  constexpr int32_t kOwners = 2, kHelpers = 2, kParts = 4, kRounds = 5000;
  SpareWorkers workers(kOwners, kParts);
  std::atomic<bool> ends{false};
  std::atomic<int32_t> wrong{0};
  std::vector<std::thread> helpers, owners;
  for (int32_t h = 0; h < kHelpers; ++h)
    helpers.emplace_back([&] {
      SpareWorkers::Visit visit(workers);
      while (!ends.load())
        if (!visit.take_part()) std::this_thread::yield();
    });
  for (int32_t owner = 0; owner < kOwners; ++owner)
    owners.emplace_back([&, owner] {
      for (int32_t round = 0; round < kRounds; ++round) {
        int32_t runs[kParts] = {};  // plain: a part that runs twice, or after the end, is also a data race
        const int32_t count = 1 + round % kParts;
        workers.run(owner, count, [&](int32_t part) { ++runs[part]; });
        for (int32_t part = 0; part < kParts; ++part) wrong.fetch_add(runs[part] != (part < count ? 1 : 0));
      }
    });
  for (std::thread& thread : owners) thread.join();
  ends.store(true);
  for (std::thread& thread : helpers) thread.join();
  CHECK(wrong.load() == 0);
}
