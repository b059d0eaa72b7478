// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Pictures of the method and of single moments, and the parameters.
#include <algorithm>
#include <cmath>

#include "pipeline/overtake.h"
#include "tools/client/console.h"
#include "tools/client/session.h"
#include "tools/evaluation/report_html.h"
#include "tools/view/svg.h"

namespace overtake::evaluation {
namespace {

std::string time_text(const Figures& f, const char* stage) {
  const auto found = f.times_ms.find(stage);
  return found == f.times_ms.end() ? "" : cli::fixed(metrics::summarize(found->second).median, 2) + " ms";
}

// The paper's block diagram with the inputs and the median times of this report.
std::string draw_blocks(const Figures& f) {
  constexpr int32_t kWidth = 870, kHeight = 518;
  cli::Svg svg(kWidth, kHeight);
  svg.add(
      "<defs><marker id=\"tip\" viewBox=\"0 0 10 10\" refX=\"9\" refY=\"5\" markerWidth=\"7\" markerHeight=\"7\" "
      "orient=\"auto-start-reverse\"><path d=\"M0,0 L10,5 L0,10 z\" fill=\"#888\"/></marker></defs>");
  const auto box = [&](double x, double y, double w, double h, const std::string& name, const std::string& words,
                       const std::string& time, bool round = false) {
    svg.rectangle(x, y, w, h,
                  std::string(" class=\"box ink\" fill=\"#f3f4f6\" stroke=\"#333\"") + (round ? " rx=\"12\"" : ""));
    const double middle = x + w / 2;
    svg.text(middle, y + (words.empty() ? h / 2 + 4 : 18), name, "middle", " font-weight=\"bold\" font-size=\"12\"");
    svg.text(middle, y + 34, words, "middle", " font-size=\"10\"");
    if (!time.empty()) svg.text(middle, y + h - 7, time, "middle", " fill=\"#2f7fd0\" font-size=\"11\"");
  };
  const auto arrow = [&](cli::SvgPoint a, cli::SvgPoint b) {
    svg.line(a, b, " stroke=\"#888\" stroke-width=\"1.6\" marker-end=\"url(#tip)\"");
  };
  svg.text(kWidth / 2.0, 18, "From scans to tracks", "middle", " font-size=\"13\" font-weight=\"bold\"");
  const char* lidars[] = {"LiDAR 1", "LiDAR ..", "LiDAR n"};
  for (int32_t k = 0; k < 3; ++k) {
    const double x = 20 + 215 * k;
    box(x + 40, 34, 110, 30, lidars[k], "", "", true);
    arrow({x + 95, 64}, {x + 95, 88});
    box(x, 88, 190, 96, "Range image segmentation", "image, gaps, angles, smoothing,", time_text(f, "segment"));
    svg.text(x + 95, 88 + 48, "ground, repair (NGRIR),", "middle", " font-size=\"10\"");
    svg.text(x + 95, 88 + 62, "labels, clusters", "middle", " font-size=\"10\"");
    arrow({x + 95, 184}, {x + 95, 212});
  }
  box(20, 212, 620, 58, "Cluster merging", "across the seams of neighbouring sensors, vehicle frame",
      time_text(f, "merge"));
  arrow({165, 270}, {165, 298});
  box(20, 298, 290, 62, "Candidates", "size of a car, place on the track", time_text(f, "gate"));
  box(350, 298, 290, 62, "Pose", "psi_REF, psi_VAR, rectangle of known size", time_text(f, "pose"));
  arrow({310, 329}, {350, 329});
  arrow({495, 360}, {495, 388});
  box(20, 388, 620, 62, "Target tracking", "EKF (constant speed and turn rate), global nearest neighbour, M of N",
      time_text(f, "track"));
  arrow({330, 450}, {330, 476});
  svg.text(330, 491, "tracks: place, speed, heading, course, yaw rate, covariance, predicted path", "middle");
  svg.text(330, 507, "whole frame: " + time_text(f, "frame"), "middle", " fill=\"#2f7fd0\"");
  box(690, 298, 160, 62, "Localisation, map", "poses of the own car;", "", true);
  svg.text(770, 348, "centre line and widths", "middle", " font-size=\"10\"");
  const char* kFlow = " stroke=\"#888\" stroke-width=\"1.6\" stroke-dasharray=\"5 4\"";
  svg.polyline({{770, 298}, {770, 284}, {240, 284}}, kFlow);
  arrow({240, 284}, {240, 298}), arrow({690, 329}, {640, 329});
  svg.polyline({{770, 360}, {770, 419}}, kFlow);
  arrow({770, 419}, {640, 419});
  return svg.finish();
}

// A word of a command line, quoted where a shell would change it.
std::string shell_word(const std::string& word) {
  constexpr std::string_view kPlain = "abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ0123456789/._-+:=,@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string out = "'";
  for (const char c : word) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

// The commands that show a picture's moments in the viewer.
std::string view_commands(const NamedPicture& picture, const std::vector<Run>& runs) {
  const auto run = std::find_if(runs.begin(), runs.end(), [&](const Run& r) { return r.log == picture.log; });
  if (picture.stamps_ns.empty() || picture.path.empty() || run == runs.end()) return "";
  const std::string log = shell_word(picture.path);
  std::string lines;
  for (const int64_t stamp_ns : picture.stamps_ns)
    lines += "overtake view " + log + " --at " + std::to_string(stamp_ns) + "\n";
  const auto said = [&](const char* key) {
    const auto found = run->about.find(key);
    return found == run->about.end() ? std::string() : found->second;
  };
  std::string words = "In the viewer (for labels, boxes and tracks, view the file of overtake run " + log +
                      " --preset " + run->variant.substr(0, run->variant.find_first_of(":@")) + " --mcap FILE";
  if (is_simulated(*run) && !said("scenario").empty() && !said("seed").empty())
    words += "; overtake simulate " + said("scenario") + " --seed " + said("seed") + " makes the log";
  return "<p class=\"note\">" + cli::escape_xml(words) + "):</p>\n<pre>" + cli::escape_xml(lines) + "</pre>\n";
}

}  // namespace

std::string picture_section(const std::map<std::string, NamedPicture>& pictures, const Figures& f,
                            const std::vector<Run>& runs) {
  struct Shown {
    const char *name, *title, *words, *missing;
  };
  static constexpr Shown kKinds[] = {
      {"race", "The race", "Where the ego drove and where one car passed the other.", "no log of a race"},
      {"strip", "One scan on its way",
       "From the cloud to the labels. Rows of the images are scan lines, columns azimuths; (c) and (d) have one row "
       "less, as they stand between two lines. The colours of (b) and (e) end at the 0.5th and "
       "the 99.5th percentile of each image, beyond that all are alike: the same range has two colours in the two.",
       "no log has a car 10 to 25 m away in one scan"},
      {"clouds", "The clouds of all sensors, and merged",
       "Each point in the frame of the vehicle. The strip between the fields of view is blind; the two parts of the "
       "car are one cluster all the same.",
       "no log has a car over a seam that became one cluster"},
      {"fits", "Both rectangles on a car that begins to spin",
       "psi_REF is the heading of the map's centre line, psi_VAR that of the points (variance criterion); the one "
       "whose rectangle of known size holds more points is taken, psi_REF where they hold as many.",
       "no log has a car that begins to spin and is detected on the way (tools/dev/evaluate_set adds spin_near)"},
      {"sensors", "Sensors and fields of view", "Blind strips as the mounting says.", "no rig"}};
  const bool knows_points =
      std::any_of(runs.begin(), runs.end(), [](const Run& r) { return r.tables.at("scans").rows() > 0; });
  const auto is_recorded = [&](const std::string& log) {
    return std::any_of(runs.begin(), runs.end(), [&](const Run& r) { return r.log == log && !is_simulated(r); });
  };
  std::string html = heading("blocks", "The pipeline") +
                     paragraph("Blue: median time of this report's runs; segmentation: of one sensor.") +
                     draw_blocks(f) + heading("pictures", "Pictures");
  for (const Shown& kind : kKinds) {
    const auto found = pictures.find(kind.name);
    html += "<h3 id=\"" + std::string(kind.name) + "\">" + cli::escape_xml(kind.title) + "</h3>\n";
    if (found == pictures.end()) {
      const bool is_by_points = kind.name == std::string("strip") || kind.name == std::string("clouds");
      html += "<p class=\"note\">Not here: " +
              cli::escape_xml(is_by_points && !knows_points
                                  ? "chosen by a car's points, and no log says what each point lies on"
                                  : kind.missing) +
              ".</p>\n";
    } else {
      html += paragraph(kind.words) + "<p class=\"note\">" +
              (is_recorded(found->second.log) ? "Recorded: " : "Simulated: ") + cli::escape_xml(found->second.caption) +
              ".</p>\n" + view_commands(found->second, runs) + found->second.svg;
    }
  }
  return html;
}

std::string parameter_section() {
  struct Entry {
    const char *symbol, *paper;
    std::vector<const char*> names;
  };
  static const Entry kEntries[] = {
      {"sz_SG", "5", {"smooth.window"}},
      {"th_gnd", "20 deg", {"ground.threshold_deg"}},
      {"th_seg", "2.5 deg", {"cluster.threshold_deg"}},
      {"w_s", "9", {"repair.window"}},
      {"th_r", "5 m", {"repair.range_limit_m"}},
      {"th_mrg", "1.8 m", {"merge.distance_m"}},
      {"Q_diag",
       "0.005 0.005 0.5 0.005 0.0005",
       {"tracker.q_x", "tracker.q_y", "tracker.q_speed", "tracker.q_course", "tracker.q_yaw_rate"}},
      {"R_diag", "5 5", {"tracker.r_x", "tracker.r_y"}},
      {"N", "20", {"tracker.window"}},
      {"M_c", "6", {"tracker.confirm_hits"}},
      {"M_e", "5", {"tracker.keep_hits"}}};
  ovt_params params;
  cli::check(ovt_params_init(&params, sizeof params, "paper"), "preset paper");
  Rows rows = {{"symbol", "paper", "preset paper", "parameter"}};
  for (const Entry& e : kEntries) {
    std::string values, names;
    for (const char* name : e.names) {
      double value = 0;
      cli::check(ovt_get_param(&params, name, &value), name);
      char text[32];
      std::snprintf(text, sizeof text, "%.6g", value);
      values += (values.empty() ? "" : " ") + std::string(text);
      names += (names.empty() ? "" : ", ") + std::string(name);
    }
    rows.push_back({e.symbol, e.paper, values, names});
  }
  return heading("parameters", "Parameters") +
         paragraph("Images of 32 rows and 857 columns a sensor (n, m), as in the paper.") + table_html(rows);
}

}  // namespace overtake::evaluation
