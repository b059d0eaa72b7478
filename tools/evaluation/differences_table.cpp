// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// Differences between configurations as tables of text, and as a section of the report.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <map>

#include "tools/client/console.h"
#include "tools/evaluation/differences.h"
#include "tools/evaluation/report_html.h"
#include "tools/evaluation/svg_plot.h"
#include "tools/io/text.h"
#include "tools/io/words.h"

namespace overtake::evaluation {
namespace {

std::string with_sign(double value, int32_t digits) { return (value > 0 ? "+" : "") + cli::fixed(value, digits); }

// "+0.012 (+0.004 to +0.019)*"
std::string difference_text(const metrics::Estimate& e, int32_t digits) {
  if (!std::isfinite(e.value)) return "-";
  const double half = 0.5 * std::pow(10.0, -digits);  // what is less is written as 0
  const bool has_interval = std::isfinite(e.low);
  if (std::max({std::fabs(e.value), has_interval ? std::fabs(e.low) : 0.0, has_interval ? std::fabs(e.high) : 0.0}) <
      half)
    return "0";
  std::string text = with_sign(e.value, digits);
  if (!has_interval) return text;
  text += " (" + with_sign(e.low, digits) + " to " + with_sign(e.high, digits) + ")";
  return text + (e.low > 0 || e.high < 0 ? "*" : "");
}

void add_header(std::vector<std::string>& row) {
  for (const Measure& m : kMeasures) row.push_back(m.name);
}

std::string note_of(const Differences& d) {
  std::string text = "On " + io::counted(d.logs, "log") + ", " + io::counted(d.events, "overtaking event") +
                     " drawn again for the 95 % intervals; *: the interval does not contain 0.";
  if (d.logs_left_out > 0)
    text += " Left out: " + io::counted(d.logs_left_out, "log") + " that not all of them ran on, with the same truth.";
  return text;
}

std::string value_text(double value) {
  std::string text;
  io::append_number(text, value);
  return text;
}

// The plots of one parameter: what its values change in three measures.
std::string plots_of(const std::vector<const ParameterValue*>& values) {
  std::string html;
  for (const std::size_t m : {std::size_t(0), std::size_t(1), std::size_t(6)}) {
    Series series = {"", kBlue, {}, {}, {}, {}, true, true};
    double low = 0, high = 0;
    for (const ParameterValue* p : values) {
      const metrics::Estimate& e = p->differences[m];
      if (!std::isfinite(e.value)) continue;
      series.x.push_back(p->value), series.y.push_back(e.value);
      series.low.push_back(std::isfinite(e.low) ? e.low : e.value);
      series.high.push_back(std::isfinite(e.high) ? e.high : e.value);
      low = std::min(low, series.low.back()), high = std::max(high, series.high.back());
    }
    if (series.x.size() < 2 || !(low < high)) continue;
    const double room = 0.08 * (high - low), from = series.x.front(), to = series.x.back();
    Axes axes;
    axes.title = std::string("change of ") + kMeasures[m].name;
    axes.x_label = values[0]->parameter;
    axes.x_low = from - 0.05 * (to - from), axes.x_high = to + 0.05 * (to - from);
    axes.y_low = low - room, axes.y_high = high + room;
    axes.width = 320, axes.height = 240;
    html += line_plot(axes, {series});
  }
  return html;
}

}  // namespace

Rows difference_rows(const Differences& d) {
  Rows rows(1, {"less " + d.base});
  add_header(rows[0]);
  for (const ContestantDifference& c : d.contestants) {
    rows.push_back({c.contestant});
    for (std::size_t m = 0; m < kMeasureCount; ++m)
      rows.back().push_back(c.contestant == d.base ? cli::fixed(c.values[m].value, kMeasures[m].digits)
                                                   : difference_text(c.differences[m], kMeasures[m].digits));
  }
  return rows;
}

Rows parameter_rows(const Differences& d) {
  Rows rows(1, {"preset", "parameter", "value", "configurations"});
  add_header(rows[0]);
  for (const ParameterValue& p : d.parameters) {
    rows.push_back({p.preset, p.parameter, value_text(p.value) + (p.is_reference ? " (reference)" : ""),
                    std::to_string(p.configurations)});
    for (std::size_t m = 0; m < kMeasureCount; ++m)
      rows.back().push_back(p.is_reference ? "" : difference_text(p.differences[m], kMeasures[m].digits));
  }
  return rows;
}

void print_differences(const Differences& d) {
  if (d.contestants.size() < 2) return;
  const auto print = [](const Rows& rows) {
    cli::TextTable table(rows[0]);
    for (std::size_t r = 1; r < rows.size(); ++r) table.add(rows[r]);
    std::printf("%s", table.format().c_str());
  };
  std::printf("\nDifferences. %s\n", note_of(d).c_str());
  print(difference_rows(d));
  if (d.parameters.empty()) return;
  std::printf("\nWhat each value of a parameter changes, over all configurations that differ in nothing else\n");
  print(parameter_rows(d));
}

std::string difference_section(const Differences& d) {
  if (d.contestants.size() < 2) return "";
  std::string html = heading("differences", "Differences between configurations") + paragraph(note_of(d)) +
                     table_html(difference_rows(d));
  if (d.parameters.empty()) return html;
  html += heading("parameters_cost", "Which parameter costs what") +
          paragraph(
              "The change by each value of a parameter against its reference (the preset's default, else the least "
              "value): the mean over all configurations that differ in nothing else.") +
          table_html(parameter_rows(d));
  std::map<std::pair<std::string, std::string>, std::vector<const ParameterValue*>> groups;
  for (const ParameterValue& p : d.parameters) groups[{p.preset, p.parameter}].push_back(&p);
  for (const auto& [key, values] : groups) html += "<div class=\"wide\">" + plots_of(values) + "</div>\n";
  return html;
}

}  // namespace overtake::evaluation
