// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// What is wrong now, in words: each fault is said once when it begins and once when it ends, and is part of the
// diagnostics in between. One thread.
#pragma once

#include <cstdint>
#include <functional>
#include <string>
#include <vector>

namespace overtake::ros2 {

enum class Level : uint8_t { kOk = 0, kWarning = 1, kError = 2, kStale = 3 };  // of diagnostic_msgs/DiagnosticStatus

class Faults {
 public:
  using Print = std::function<void(const std::string& line)>;
  explicit Faults(Print print) : print_(std::move(print)) {}

  // A state: from raise to lower. `part` is the part of the node that has it ("front"), `kind` tells a part's faults
  // apart. A new sentence replaces the old one silently.
  void raise(const std::string& part, const std::string& kind, Level level, const std::string& sentence,
             int64_t now_ns);
  // Prints `over` if the fault was raised.
  void lower(const std::string& part, const std::string& kind, const std::string& over = "");
  // An event: a fault until kEvent_ns after the last one of them. Each further one during this time is silent.
  void note(const std::string& part, const std::string& kind, Level level, const std::string& sentence, int64_t now_ns);
  // Ends the events that are over.
  void pass(int64_t now_ns);

  struct Fault {
    std::string part, kind, sentence;
    Level level = Level::kWarning;
    int64_t begin_ns = 0, until_ns = 0;
  };
  // Of a part, the worst first (an error is worse than silence), of these the newest.
  std::vector<Fault> of(const std::string& part) const;
  const std::vector<Fault>& all() const { return faults_; }

  static constexpr int64_t kEvent_ns = 3'000'000'000;

 private:
  void put(const Fault& fault);
  Print print_;
  std::vector<Fault> faults_;
};

}  // namespace overtake::ros2
