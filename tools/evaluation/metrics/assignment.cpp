// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/metrics/assignment.h"

namespace overtake::metrics {

// The Hungarian method row by row (Kuhn 1955; potentials as in Lawler 1976). Every row also has a private column with
// the cost of staying alone, so that each row finds a partner. Rows and columns count from 1; column 0 holds the row
// that currently searches for a column.
std::vector<int32_t> assign(int32_t rows, int32_t columns, double alone,
                            const std::function<double(int32_t, int32_t)>& cost) {
  const auto n = std::size_t(rows), m = std::size_t(columns), all = m + n;
  std::vector<double> table(n * all, kForbidden);
  for (std::size_t i = 0; i < n; ++i) {
    for (std::size_t j = 0; j < m; ++j) table[i * all + j] = cost(int32_t(i), int32_t(j));
    table[i * all + m + i] = alone;
  }

  std::vector<double> row_price(n + 1, 0.0), column_price(all + 1, 0.0);
  std::vector<std::size_t> row_of(all + 1, 0), came_from(all + 1, 0);
  for (std::size_t i = 1; i <= n; ++i) {
    std::vector<double> slack(all + 1, kForbidden);
    std::vector<bool> used(all + 1, false);
    std::size_t at = 0;
    row_of[0] = i;
    do {
      used[at] = true;
      const std::size_t row = row_of[at];
      double least = kForbidden;
      std::size_t next = 0;
      for (std::size_t j = 1; j <= all; ++j) {
        if (used[j]) continue;
        const double reduced = table[(row - 1) * all + j - 1] - row_price[row] - column_price[j];
        if (reduced < slack[j]) slack[j] = reduced, came_from[j] = at;
        if (slack[j] < least) least = slack[j], next = j;
      }
      for (std::size_t j = 0; j <= all; ++j) {
        if (used[j]) row_price[row_of[j]] += least, column_price[j] -= least;
        if (!used[j]) slack[j] -= least;
      }
      at = next;
    } while (row_of[at] != 0);
    for (; at != 0; at = came_from[at]) row_of[at] = row_of[came_from[at]];
  }

  std::vector<int32_t> column_of(n, -1);
  for (std::size_t j = 1; j <= m; ++j)
    if (row_of[j] != 0) column_of[row_of[j] - 1] = int32_t(j) - 1;
  return column_of;
}

}  // namespace overtake::metrics
