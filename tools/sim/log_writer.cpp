// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/sim/log_writer.h"

#include <filesystem>

#include "tools/io/error.h"
#include "tools/io/text.h"
#include "tools/io/words.h"

namespace overtake::sim {

bool is_mcap_name(const std::string& out, const std::string& place) {
  namespace fs = std::filesystem;
  const std::string extension = io::lower_case(fs::path(out).extension().string());
  if (extension == ".mcap") return true;
  std::error_code code;
  const bool has_letter = extension.size() > 1 && extension.size() < 7 && extension[1] >= 'a' && extension[1] <= 'z';
  if (has_letter && !fs::is_directory(out, code))
    throw io::Error(place, 0,
                    "a log's name ends in .mcap, not in " + extension + "; for a folder of this name end it with /");
  return false;
}

std::vector<TruthRow> truth_at(const World& world, double time_s) {
  std::vector<TruthRow> rows;
  const CarState ego = world.motions[std::size_t(world.ego)]->at(time_s);
  for (int32_t i = 0; i < int32_t(world.motions.size()); ++i) {
    const Motion& motion = *world.motions[std::size_t(i)];
    TruthRow row{i, motion.name(), i == world.ego, {}, {}, motion.at(time_s), {}, 0};
    row.center = row.state.T_map_vehicle * Vec3{kCarCenterXM, 0, 0};
    row.angles = angles_of(row.state.T_map_vehicle.rotation);
    row.in_ego = ego.T_map_vehicle.inverse_times(row.center);
    const Vec3 ahead = ego.T_map_vehicle.rotation.transposed_times(row.state.T_map_vehicle.rotation.x);
    row.heading_in_ego = atan2_of(ahead.y, ahead.x);
    rows.push_back(row);
  }
  return rows;
}

std::string rig_text(const Simulator& simulator) { return io::format_rig(simulator.rig()); }

std::string map_text(const Simulator& simulator) {
  const SurveyedMap map = simulator.map();
  std::string text = "x_m,y_m,w_tr_right_m,w_tr_left_m,banking_rad\n";
  for (std::size_t i = 0; i < map.x_m.size(); ++i) {
    const double row[] = {map.x_m[i], map.y_m[i], map.width_right_m[i], map.width_left_m[i], map.banking_rad[i]};
    for (int k = 0; k < 5; ++k) {
      io::append_number(text, row[k]);
      text += k < 4 ? ',' : '\n';
    }
  }
  return text;
}

}  // namespace overtake::sim
