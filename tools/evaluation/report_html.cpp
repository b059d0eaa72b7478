// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/report_html.h"

#include "tools/client/console.h"
#include "tools/view/svg.h"

namespace overtake::evaluation {
namespace {

constexpr const char* kStyle = R"css(
:root{color-scheme:light dark;--page:#fff;--ink:#222;--soft:#666;--card:#fff;--edge:#d0d0d0;--grid:#e4e4e4;
--zero:#999;--head:#f3f4f6}
@media (prefers-color-scheme:dark){:root{--page:#16181d;--ink:#e4e6ea;--soft:#a0a4ab;--card:#1d2026;--edge:#3a3f48;
--grid:#31353d;--zero:#777;--head:#262a31}}
body{font-family:"DejaVu Sans",Helvetica,Arial,sans-serif;font-size:14px;line-height:1.45;max-width:1000px;
margin:2em auto;padding:0 1em;background:var(--page);color:var(--ink)}
h1{margin-bottom:0}h2{margin:2.2em 0 .4em;border-bottom:1px solid var(--edge);padding-bottom:.2em}
h3{margin:1.6em 0 .3em}
a{color:#4c8fe0}p{margin:.5em 0}.note{color:var(--soft);font-size:13px}
.simulated{display:inline-block;background:#b8500b;color:#fff;padding:1px 8px;border-radius:3px;font-size:13px;
font-weight:bold}
.recorded{display:inline-block;background:#2f6f4f;color:#fff;padding:1px 8px;border-radius:3px;font-size:13px;
font-weight:bold}
.wide{overflow-x:auto}table{border-collapse:collapse;font-size:12px;margin:.8em 0}
td,th{border:1px solid var(--edge);padding:3px 7px;text-align:right;vertical-align:top}th{background:var(--head)}
td:first-child,th:first-child{text-align:left}td{white-space:nowrap}table.words td{white-space:normal}
table.words td{text-align:left}table.words th{text-align:left}
table.words td.yes,table.words td.no,table.words td.unknown{white-space:nowrap}
td.yes{color:#2f9e44;font-weight:bold}td.no{color:#e05252;font-weight:bold}
svg{margin:4px 4px 4px 0;max-width:100%;height:auto}svg svg{margin:0}
svg text.ink{fill:var(--ink)}svg .ink:not(text){stroke:var(--ink)}svg circle.ink{fill:var(--ink);stroke:none}
svg .grid{stroke:var(--grid)}svg .zero{stroke:var(--zero)}svg rect.card{fill:var(--card)}svg .box{fill:var(--head)}
)css";

}  // namespace

std::string table_html(const Rows& rows) {
  std::string html = "<div class=\"wide\"><table>\n";
  for (std::size_t r = 0; r < rows.size(); ++r) {
    html += "<tr>";
    for (const std::string& cell : rows[r])
      html += (r == 0 ? "<th>" : "<td>") + cli::escape_xml(cell) + (r == 0 ? "</th>" : "</td>");
    html += "</tr>\n";
  }
  return html + "</table></div>\n";
}

std::string paragraph(const std::string& text) { return "<p>" + cli::escape_xml(text) + "</p>\n"; }

std::string heading(const std::string& id, const std::string& text) {
  return "<h2 id=\"" + id + "\">" + cli::escape_xml(text) + "</h2>\n";
}

std::string page_begin(const std::string& title) {
  return "<!DOCTYPE html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
         "content=\"width=device-width\"><title>" +
         cli::escape_xml(title) + "</title>\n<style>" + kStyle + "</style></head><body>\n<h1>" +
         cli::escape_xml(title) + "</h1>\n";
}

std::string page_end() { return "</body></html>\n"; }

std::string mean_and_deviation(const std::vector<double>& values, int32_t digits) {
  const metrics::Summary s = metrics::summarize(values);
  if (s.count == 0) return "not measured";
  return cli::fixed(s.mean, digits) + " +- " + cli::fixed(s.deviation, digits);
}

std::string words_of(Origin origin) {
  return origin == Origin::kSimulated  ? "simulated"
         : origin == Origin::kRecorded ? "recorded"
                                       : "simulated and recorded";
}

}  // namespace overtake::evaluation
