// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// create_failures [--list] [--inline]: refuses every k-th heap request during create, of any caller (this library, the
// C++ library, libtbb), then every k-th thread; each k in a separate child process. Expected results:
//   - a request of this library: OVT_NO_MEMORY (a thread: OVT_NO_THREADS), nothing kept, and the next create works
//   - a request inside libtbb: the same if libtbb reports it. Cases in which libtbb ends the process or never returns
//     are listed (--list) and described in pipeline/README.md. Its flow graph also keeps memory of a node whose
//     construction failed half-way
// --inline: only worker_count 1, which does not use libtbb.
#include <csignal>

#include <sys/wait.h>
#include <unistd.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>
#include <vector>

#include "pipeline/overtake.h"
#include "tests/support/failing_heap.h"
#include "tests/support/test_method.h"

using namespace overtake::test;

namespace {

enum class What { heap, thread };

struct Outcome {  // a child's report
  bool reached, created, out_is_null, next_works, in_tbb;
  ovt_status status;
  int64_t kept;  // blocks after the failure minus blocks before
  char where[400];
};

struct Def {
  explicit Def(int32_t workers) {
    for (ovt_sensor_def& sensor : sensors) {
      sensor = ovt_default_sensor_def();
      sensor.rows = 8, sensor.cols = 64, sensor.point_capacity = 128;
    }
    for (int32_t i = 0; i < 20; ++i) x[i] = 5.0 * i, y[i] = 0, width[i] = 4;
    map = ovt_default_map_def();
    map.count = 20;
    map.x_m = x, map.y_m = y, map.width_left_m = map.width_right_m = width;
    params = overtake::test::test_params();
    def = ovt_default_detector_def();
    def.sensors = sensors;
    def.sensor_count = 2;
    def.params = &params;
    def.map = &map;
    def.cluster_capacity = def.candidate_capacity = def.track_capacity = 16;
    def.worker_count = workers;
  }
  ovt_sensor_def sensors[2];
  double x[20], y[20], width[20];
  ovt_map_def map;
  ovt_params params;
  ovt_detector_def def;
};

// Whether the detector works.
bool works(ovt_detector* detector) {
  ovt_points empty;
  ovt_points_init(&empty, sizeof empty);
  empty.x.type = empty.y.type = empty.z.type = OVT_F32;
  empty.layer.type = OVT_U8;
  ovt_reader* reader = nullptr;
  bool good = ovt_create_reader(detector, &reader) == OVT_OK;
  good = good && ovt_push_scan(detector, &empty) == OVT_OK && ovt_flush(detector) == OVT_OK;
  good = good && ovt_next_frame(reader, nullptr) == OVT_OK;
  ovt_destroy_reader(reader);
  return good;
}

bool create_and_work(const Def& def) {
  ovt_detector* detector = nullptr;
  const bool good = ovt_create_detector(&def.def, &detector) == OVT_OK && works(detector);
  ovt_destroy_detector(detector);
  return good;
}

// Runs in the child. `warm`: an earlier detector existed, so libtbb has already allocated its process-wide memory.
Outcome try_one(What what, int64_t k, int32_t workers, bool warm) {
  Outcome outcome{};
  Def def(workers);
  if (warm && !create_and_work(def)) _exit(3);
  prepare_refusal();
  const int64_t before = live_blocks();
  ovt_detector* detector = reinterpret_cast<ovt_detector*>(&def);
  (what == What::heap ? refuse_heap : refuse_thread)(k);
  outcome.status = ovt_create_detector(&def.def, &detector);
  refuse_heap(0);
  refuse_thread(0);
  outcome.reached = was_refused();
  outcome.in_tbb = refused_inside("libtbb");
  outcome.created = outcome.status == OVT_OK;
  outcome.out_is_null = detector == nullptr;
  if (outcome.created) outcome.next_works = works(detector), ovt_destroy_detector(detector);
  outcome.kept = live_blocks() - before;
  if (!outcome.created) outcome.next_works = create_and_work(def);
  describe_refusal(outcome.where, sizeof outcome.where);
  return outcome;
}

int report;
void report_and_end(int signal) {
  Outcome last{};
  last.reached = was_refused();
  last.in_tbb = refused_inside("libtbb");
  describe_refusal(last.where, sizeof last.where);
  if (write(report, &last, sizeof last) != sizeof last) _exit(4);
  std::signal(signal, SIG_DFL);
  raise(signal);
}

// False: the child ended without a report; `signal` tells how, outcome.where the source of the request.
bool run_child(What what, int64_t k, int32_t workers, bool warm, Outcome& outcome, int& signal) {
  int ends[2];
  if (pipe(ends) != 0) std::abort();
  std::fflush(stdout);
  const pid_t child = fork();
  if (child == 0) {
    close(ends[0]);
    report = ends[1];
    for (const int ending : {SIGABRT, SIGSEGV, SIGALRM}) std::signal(ending, report_and_end);
    alarm(20);                                                   // ends a child that never returns
    if (freopen("/dev/null", "w", stderr) == nullptr) _exit(4);  // suppresses terminate's message
    const Outcome mine = try_one(what, k, workers, warm);
    _exit(write(ends[1], &mine, sizeof mine) == sizeof mine ? 0 : 4);
  }
  close(ends[1]);
  outcome = {};
  const bool told = read(ends[0], &outcome, sizeof outcome) == sizeof outcome;
  close(ends[0]);
  int status = 0;
  waitpid(child, &status, 0);
  signal = WIFSIGNALED(status) ? WTERMSIG(status) : 0;
  return told && WIFEXITED(status) && WEXITSTATUS(status) == 0;
}

int32_t failures = 0;
void complain(const char* kind, int64_t k, const std::string& sentence, const Outcome& outcome) {
  std::printf("FAILED %s %lld: %s: %s\n", kind, static_cast<long long>(k), sentence.c_str(), outcome.where);
  ++failures;
}

void try_all(What what, int32_t workers, bool warm, bool list) {
  const char* kind = what == What::heap ? "request" : "thread";
  const ovt_status expected = what == What::heap ? OVT_NO_MEMORY : OVT_NO_THREADS;
  int64_t ours = 0, theirs = 0, ended = 0, absorbed = 0;
  // Blocks that libtbb keeps for the process after a complete run: not a leak of a failed create.
  Outcome whole;
  int signal = 0;
  if (!run_child(what, INT64_MAX, workers, warm, whole, signal)) {
    complain(kind, 0, "nothing was refused, but it does not work", whole);
    return;
  }
  for (int64_t k = 1; k < 5000; ++k) {
    Outcome o;
    if (!run_child(what, k, workers, warm, o, signal)) {
      if (!o.in_tbb) {
        complain(kind, k, "ended the process by signal " + std::to_string(signal), o);
      } else {
        ++ended;
        if (list)
          std::printf("  %s: %s %lld: %s\n", signal == SIGALRM ? "never returns" : "ends the process", kind,
                      static_cast<long long>(k), o.where);
      }
      continue;
    }
    if (!o.reached) break;  // create makes fewer requests
    (o.in_tbb ? theirs : ours) += 1;
    if (o.created) {  // the caller does not need the memory
      ++absorbed;
      if (list) std::printf("  done without: %s %lld: %s\n", kind, static_cast<long long>(k), o.where);
      if (!o.next_works) complain(kind, k, "a detector that was created does not work", o);
      continue;
    }
    // A thread that failed for lack of memory may give either status.
    if (o.status != expected && o.status != OVT_NO_THREADS)
      complain(kind, k, std::string("status: ") + ovt_status_text(o.status), o);
    if (!o.out_is_null) complain(kind, k, "a failed create left a pointer", o);
    if (!o.next_works) complain(kind, k, "the next create does not work", o);
    const int64_t kept = o.kept - whole.kept;
    if (kept > (o.in_tbb ? 2 : 0)) complain(kind, k, std::to_string(kept) + " blocks kept", o);
    if (kept > 0 && list)
      std::printf("  keeps %lld blocks: %s %lld: %s\n", static_cast<long long>(kept), kind, static_cast<long long>(k),
                  o.where);
  }
  std::printf(
      "%d workers, %s, %ss: %lld of ours and %lld of libtbb's gave a status (%lld of them had no effect), %lld of "
      "libtbb's ended the process, or never returned\n",
      workers, warm ? "not the first" : "the first", kind, static_cast<long long>(ours), static_cast<long long>(theirs),
      static_cast<long long>(absorbed), static_cast<long long>(ended));
  if (ours + theirs + ended == 0 && (what == What::heap || workers > 1))
    complain(kind, 0, "nothing was refused", whole);
}

}  // namespace

int main(int argc, char** argv) {
  bool list = false;
  int32_t most_workers = 2;
  for (int i = 1; i < argc; ++i) {
    list = list || !std::strcmp(argv[i], "--list");
    if (!std::strcmp(argv[i], "--inline")) most_workers = 1;
  }
  if (!can_refuse()) {
    std::printf("skipped: create_failures: a sanitizer brings its own heap\n");
    return 77;
  }
  for (int32_t workers = 1; workers <= most_workers; ++workers)
    for (const bool warm : {false, true}) {
      try_all(What::heap, workers, warm, list);
      try_all(What::thread, workers, warm, list);
    }
  return failures ? 1 : 0;
}
