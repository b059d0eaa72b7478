// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/tune.h"

#include <algorithm>
#include <cmath>
#include <functional>

#include "tools/client/console.h"
#include "tools/evaluation/baselines/grid_ground.h"
#include "tools/evaluation/baselines/label_ground.h"
#include "tools/evaluation/evaluator.h"
#include "tools/evaluation/metrics/summary.h"
#include "tools/evaluation/simulated_log.h"
#include "tools/io/text.h"
#include "tools/sim/workers.h"

namespace overtake::evaluation {
namespace {

struct Scan {
  std::vector<float> x_m, y_m, z_m;  // vehicle frame
  std::vector<bool> positive;
};

struct Candidate {
  std::string method, text;
  std::function<std::vector<bool>(const Scan&)> mark;
  std::vector<double> tpr, ppv, f1;

  void judge(const Scan& scan, const std::vector<bool>& found) {
    double tp = 0, fp = 0, fn = 0;
    for (std::size_t i = 0; i < found.size(); ++i)
      tp += found[i] && scan.positive[i], fp += found[i] && !scan.positive[i], fn += !found[i] && scan.positive[i];
    tpr.push_back(tp / (tp + fn)), ppv.push_back(tp / (tp + fp)), f1.push_back(2 * tp / (2 * tp + fp + fn));
  }
};

std::vector<Candidate> make_candidates() {
  std::vector<Candidate> all;
  const auto text = [](double v) {
    std::string out;
    io::append_number(out, v);
    return out;
  };
  for (const double cell : {0.2, 0.3, 0.5, 0.75, 1.0, 1.5})
    for (const double height : {0.05, 0.1, 0.15, 0.2, 0.3, 0.4, 0.6}) {
      baselines::GridGroundParams p;
      p.cell_m = cell, p.height_m = height;
      all.push_back({"grid",
                     "cell_m=" + text(cell) + " height_m=" + text(height),
                     [p](const Scan& s) { return baselines::mark_nonground(s.x_m, s.y_m, s.z_m, p); },
                     {},
                     {},
                     {}});
    }
  for (const double flat : {30.0, 40.0, 50.0, 60.0})
    for (const int32_t neighbours : {8, 12, 20})
      for (const int32_t voters : {12, 24}) {
        baselines::LabelGroundParams p;
        p.flat_deg = flat, p.neighbours = neighbours, p.voters = voters;
        all.push_back({"label",
                       "flat_deg=" + text(flat) + " neighbours=" + text(neighbours) + " voters=" + text(voters),
                       [p](const Scan& s) { return baselines::label_nonground(s.x_m, s.y_m, s.z_m, p); },
                       {},
                       {},
                       {}});
      }
  return all;
}

// All sensors for the grid, each alone for the labelling.
std::vector<Scan> read_scans(const LogFrame& frame, const io::Rig& rig) {
  std::vector<Scan> out(1);
  for (std::size_t k = 0; k < frame.scans.scans.size(); ++k) {
    const io::SensorScan& from = frame.scans.scans[k];
    const io::Mounting mounting(rig.sensors[std::size_t(from.sensor)]);
    Scan scan;
    for (std::size_t i = 0; i < std::size_t(from.count); ++i) {
      const auto at = mounting.to_vehicle(from.x.value(i), from.y.value(i), from.z.value(i));
      for (Scan* to : {&scan, &out[0]}) {
        to->x_m.push_back(float(at[0])), to->y_m.push_back(float(at[1])), to->z_m.push_back(float(at[2]));
        to->positive.push_back(is_positive(kind_of(frame.surface[k][i])));
      }
    }
    out.push_back(std::move(scan));
  }
  return out;
}

}  // namespace

std::vector<std::string> tune_baselines(const std::vector<std::string>& logs, int32_t every, int64_t most_frames,
                                        int32_t workers, const std::string& out, bool print) {
  std::vector<Candidate> all = make_candidates();
  std::vector<std::string> damages;
  sim::Workers crew(workers);
  for (const std::string& path : logs) {
    SimulatedLog log(path);
    LogFrame frame;
    for (int64_t n = 0; n < most_frames && log.next(frame); ++n) {
      if (n % every != 0) continue;
      const std::vector<Scan> scans = read_scans(frame, log.rig());
      crew.for_each(int32_t(all.size()), [&](int32_t k) {
        Candidate& c = all[std::size_t(k)];
        const bool whole = c.method == "grid";
        for (std::size_t s = whole ? 0 : 1; s < (whole ? 1 : scans.size()); ++s) c.judge(scans[s], c.mark(scans[s]));
      });
    }
    if (!log.damage().empty()) damages.push_back(damage_sentence(path, log.damage()));
  }
  cli::make_folder(out);
  std::string csv = "method,parameters,scans,f1,tpr,ppv\n";
  std::map<std::string, const Candidate*> best;
  for (const Candidate& c : all) {
    const double f1 = metrics::summarize(c.f1).mean;
    csv += c.method + "," + c.text + "," + std::to_string(c.f1.size());
    for (const double v : {f1, metrics::summarize(c.tpr).mean, metrics::summarize(c.ppv).mean})
      csv += ",", io::append_number(csv, v);
    csv += "\n";
    const Candidate*& b = best[c.method];
    if (!b || f1 > metrics::summarize(b->f1).mean) b = &c;
  }
  io::write_whole_file(out + "/tuning.csv", csv);
  if (!print) return damages;
  for (const auto& [method, c] : best)
    std::printf("%-6s best: %s (F1 %.3f, TPR %.3f, PPV %.3f over %zu scans)\n", method.c_str(), c->text.c_str(),
                metrics::summarize(c->f1).mean, metrics::summarize(c->tpr).mean, metrics::summarize(c->ppv).mean,
                c->f1.size());
  std::printf("All of it simulated. Written to %s/tuning.csv\n", out.c_str());
  return damages;
}

}  // namespace overtake::evaluation
