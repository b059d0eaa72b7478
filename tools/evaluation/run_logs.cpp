// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/evaluation/run_logs.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>

#include "tools/client/console.h"
#include "tools/evaluation/kept_runs.h"
#include "tools/evaluation/odometry_log.h"
#include "tools/evaluation/pieces.h"
#include "tools/evaluation/report_pages.h"
#include "tools/evaluation/simulated_log.h"
#include "tools/evaluation/variant.h"
#include "tools/io/error.h"
#include "tools/io/output.h"
#include "tools/io/text.h"
#include "tools/io/words.h"
#include "tools/sim/workers.h"

namespace overtake::evaluation {
namespace {

namespace fs = std::filesystem;

std::string folder_of(const std::string& out, const std::string& variant, const std::string& log) {
  return out + "/runs/" + folder_name(variant) + "/" + log;
}

// Folders of earlier results are named by the variant's name itself.
void rename_folders(const std::string& out) {
  std::error_code code;
  std::vector<fs::path> old;
  for (fs::directory_iterator at(out + "/runs", code), end; !code && at != end; at.increment(code))
    if (at->path().filename().string().find(':') != std::string::npos) old.push_back(at->path());
  for (const fs::path& path : old) {
    const fs::path to = path.parent_path() / folder_name(path.filename().string());
    if (fs::exists(to)) throw io::Error(path.string(), 0, "holds runs of the same variant as " + to.string());
    fs::rename(path, to, code);
    if (code) throw io::Error(path.string(), 0, "cannot be renamed to " + to.string() + ": " + code.message());
  }
}

bool is_done(const std::string& folder) { return fs::exists(folder + "/about.json"); }

// The length of a closed centre line; 0 for others.
double lap_of(const io::MapData& map) {
  double length = 0;
  for (std::size_t i = 0; map.closed && i < map.x_m.size(); ++i) {
    const std::size_t next = (i + 1) % map.x_m.size();
    length += std::hypot(map.x_m[next] - map.x_m[i], map.y_m[next] - map.y_m[i]);
  }
  return length;
}

// What the configuration of a variant changes in its preset, one change a line; "" for a preset.
std::string config_text(const RunOptions& options, const std::string& name) {
  const ConfigFiles files = read_configs(options.configs);
  const auto file = files.find(name.substr(0, name.find_first_of(":@")));
  if (file == files.end()) return "";
  cli::Options of_file, of_preset;
  of_file.config = file->second;
  const cli::Config config = cli::load_config(of_file);
  of_preset.preset = config.preset;
  std::string text = "preset = " + config.preset;
  const cli::Config plain = cli::load_config(of_preset);
  for (int32_t i = 0; i < ovt_param_count(); ++i) {
    ovt_param_info info;
    ovt_describe_param(i, &info);
    double given = 0, usual = 0;
    ovt_get_param(&config.params, info.name, &given), ovt_get_param(&plain.params, info.name, &usual);
    if (given == usual || std::string_view(info.name) == "frame.period_s") continue;
    text += "\n" + std::string(info.name) + " = ";
    io::append_number(text, given);
  }
  for (const io::CapacityKey& key : io::kCapacityKeys)
    if (const int32_t rows = config.capacities.*key.rows; rows > 0)
      text += "\ncapacities." + std::string(key.name) + " = " + std::to_string(rows);
  return text;
}

// The inputs that a kept run must have.
About wanted_of(const RunOptions& options, const std::string& name, bool with_baselines, const std::string& input) {
  ovt_build_info build;
  ovt_read_build_info(&build);
  return {{"commit", build.commit},
          {"every",
           (with_baselines && !options.only_figures) || is_of_sweep(name) ? std::to_string(options.every) : "none"},
          {"compared", std::to_string(is_of_sweep(name) ? options.every : options.compare_every)},
          {"extent", options.only_figures ? "figures" : "whole"},
          {"frame_limit", options.most_frames == INT64_MAX ? "none" : std::to_string(options.most_frames)},
          {"config", config_text(options, name)},
          {"input", input}};
}

// The contents of the files that the log is read with; their paths alone would not show changes.
std::string text_of_input(const RunOptions& options) {
  if (options.rig.empty()) return "";
  return io::format_rig(io::load_rig(options.rig)) + (fs::exists(options.map) ? hash_input(options.map, "") : "");
}

std::unique_ptr<TruthLog> open_log(const RunOptions& options, const std::string& path) {
  if (options.rig.empty()) return std::make_unique<SimulatedLog>(path);
  return std::make_unique<OdometryLog>(path, io::load_rig(options.rig), options.map);
}

// The number of poses that the library keeps: it forgets earlier ones before the first frame of a piece.
int64_t poses_kept() {
  ovt_detector_def def;
  ovt_detector_def_init(&def, sizeof def);
  return def.ego_pose_capacity;
}

// One log and the variants that are run on it.
class LogRun {
 public:
  // Which of the variants are to run: those without a kept run of the same inputs.
  LogRun(const RunOptions& options, const std::string& path, const std::vector<std::string>& names);
  // False: interrupted. `damage`: why the log ended early; "": it did not.
  bool run(std::string& damage);

 private:
  enum class Part { kEvaluated, kLeftOut, kEnd };

  std::string folder_of_run(const std::string& variant) const { return folder_of(options_.out, variant, name_); }
  void write_map();
  void make_variants();
  bool push_frames();  // false: interrupted
  Part part_of(const LogFrame& frame);
  void push_to_all(const LogFrame& frame, sim::Workers& workers);
  void write_results(Variant& variant);

  const RunOptions& options_;
  const std::string path_;
  const std::vector<std::string>& names_;
  const PieceTimes piece_;
  const std::string name_;
  std::map<std::string, About> wanted_;
  std::vector<std::string> todo_;
  std::unique_ptr<TruthLog> log_;
  std::string map_file_;
  double lap_m_ = 0;
  std::vector<std::unique_ptr<Variant>> variants_;
  int64_t frames_ = 0, first_ns_ = -1;
  bool is_open_;  // the piece has begun; a whole log has no cuts
};

LogRun::LogRun(const RunOptions& options, const std::string& path, const std::vector<std::string>& names)
    : options_(options),
      path_(path),
      names_(names),
      piece_(options.from_s, options.to_s, options.warm_up_s),
      name_(piece_.name_of(log_stem(path))),
      is_open_(piece_.is_whole()) {
  const std::string input = hash_input(path, text_of_input(options));
  for (const std::string& name : names) {
    wanted_[name] = wanted_of(options, name, name == names[0], input);
    piece_.add_to(wanted_[name], log_stem(path));
    const std::string why = why_not_kept(folder_of_run(name), wanted_[name]);
    if (why.empty()) continue;
    todo_.push_back(name);
    io::check_clear_output(folder_of_run(name));  // checked before the work
    if (!options.quiet && why != kNotThere)
      std::printf("%s: %s was run before with %s; again\n", name_.c_str(), name.c_str(), why.c_str());
  }
}

bool LogRun::run(std::string& damage) {
  if (todo_.empty()) {
    if (!options_.quiet) std::printf("%s: done before\n", name_.c_str());
    damage = read_about(folder_of_run(names_[0]))["damage"];
    return true;
  }
  log_ = open_log(options_, path_);
  write_map();
  make_variants();
  if (!push_frames()) return false;
  if (!is_open_ && !options_.quiet)
    std::printf("note: %s: the log ends before --from: nothing was compared\n", name_.c_str());
  for (auto& variant : variants_) write_results(*variant);
  if (!options_.quiet)
    std::printf("%s: %s, %s\n", name_.c_str(), io::counted(frames_, "frame").c_str(),
                io::counted(int64_t(variants_.size()), "variant").c_str());
  damage = log_->damage();
  return true;
}

void LogRun::write_map() {
  if (log_->map_text().empty()) return;
  cli::make_folder(options_.out + "/maps");
  map_file_ = options_.out + "/maps/" + name_ + ".csv";
  io::write_whole_file(map_file_, log_->map_text());
  io::commit_outputs();
  lap_m_ = lap_of(io::read_map(map_file_));
}

void LogRun::make_variants() {
  const ConfigFiles files = read_configs(options_.configs);
  for (const std::string& name : todo_)
    variants_.push_back(std::make_unique<Variant>(name, *log_, map_file_, options_.every, files));
  if (!options_.only_figures) variants_[0]->evaluator().use_baselines(todo_[0] == names_[0] ? options_.every : 0);
  for (auto& variant : variants_) {
    if (!is_of_sweep(variant->name())) variant->evaluator().compare_every(options_.compare_every);
    if (options_.only_figures)
      variant->evaluator().leave_out_times();
    else if (variant->name().find_first_of(":@") == std::string::npos)
      variant->take_pictures();
  }
}

bool LogRun::push_frames() {
  cli::Progress progress(1000, options_.quiet);
  if (options_.progress_s >= 0) progress.print_lines(name_ + ": evaluated", options_.progress_s);
  LogFrame frame;
  sim::Workers workers(options_.workers);
  for (; frames_ < options_.most_frames && log_->next(frame); ++frames_) {
    if (cli::interrupted()) return false;
    const Part part = piece_.is_whole() ? Part::kEvaluated : part_of(frame);
    if (part == Part::kEnd) break;
    if (part == Part::kLeftOut) continue;
    push_to_all(frame, workers);
    progress.show(int64_t(1000 * log_->progress()));
  }
  progress.clear();
  return true;
}

// Begins the piece at its first frame, and shows the variants the frames after its end.
LogRun::Part LogRun::part_of(const LogFrame& frame) {
  const int64_t stamp_ns = first_stamp(frame);
  if (first_ns_ < 0) {
    first_ns_ = stamp_ns;
    for (auto& variant : variants_) variant->evaluator().start_at(first_ns_);
    if (piece_.warm_up_ns() > 0) frames_ += log_->skip_frames(piece_.warm_up_ns(), poses_kept());
  }
  const int64_t at_ns = stamp_ns - first_ns_;
  if (at_ns < piece_.warm_up_ns()) return Part::kLeftOut;
  if (at_ns >= piece_.end_ns()) {
    if (!is_open_ || at_ns >= piece_.end_ns() + kLookAheadNs) return Part::kEnd;
    for (auto& variant : variants_)
      if (variant->takes(frames_)) variant->evaluator().look_ahead(frame);
    return Part::kLeftOut;
  }
  if (!is_open_ && at_ns >= piece_.begin_ns()) {
    is_open_ = true;
    for (auto& variant : variants_) variant->begin_piece();
  }
  return Part::kEvaluated;
}

// The first variant runs alone, because the report uses its times. All others run at the same time after it.
void LogRun::push_to_all(const LogFrame& frame, sim::Workers& workers) {
  std::vector<std::function<void()>> jobs;
  if (!options_.only_figures) {
    if (variants_[0]->takes(frames_)) variants_[0]->push(frame);
    jobs.push_back([&] { variants_[0]->evaluator().evaluate_baselines(); });
  }
  for (std::size_t k = options_.only_figures ? 0 : 1; k < variants_.size(); ++k)
    if (variants_[k]->takes(frames_)) jobs.push_back([&, k] { variants_[k]->push(frame); });
  workers.for_each(int32_t(jobs.size()), [&](int32_t k) { jobs[std::size_t(k)](); });
}

void LogRun::write_results(Variant& variant) {
  variant.finish();
  for (const std::string& sentence : variant.full_capacities())
    std::printf("note: %s, %s: %s\n", name_.c_str(), variant.name().c_str(), sentence.c_str());
  if (!piece_.is_whole()) {
    if (!is_open_) variant.begin_piece();  // it begins after the end of the log
    variant.evaluator().end_piece();
  }
  const std::string folder = folder_of_run(variant.name());
  io::clear_output(folder);  // of another build or other options
  cli::make_folder(folder);
  write_tables(folder, variant.evaluator().tables());
  if (const SnapshotPicker* album = variant.picker()) write_pictures(folder, album->finish(), path_);
  About about = log_->about();
  for (const auto& [key, value] : wanted_[variant.name()]) about[key] = value;
  about["contestant"] = variant.name();
  about["frames"] = std::to_string(variant.frames());
  if (lap_m_ > 0) about["lap_m"] = nlohmann::json(lap_m_).dump();
  about["period_s"] = nlohmann::json(log_->rig().period_s).dump();
  about["damage"] = log_->damage();
  about["cpu"] = cpu_name();
  write_about(folder, about);
  io::commit_outputs();
}

}  // namespace

std::string folder_name(std::string variant) {
  std::replace(variant.begin(), variant.end(), ':', '+');
  return variant;
}

std::vector<std::string> sweep_values(const std::string& text) {
  if (text.empty()) return {};
  const std::size_t equals = text.find('='), first = text.find(':', equals), second = text.find(':', first + 1);
  double from = 0, to = 0, step = 0;
  const auto part = [&](std::size_t begin, std::size_t end) {
    return std::string_view(text).substr(begin + 1, end == std::string::npos ? end : end - begin - 1);
  };
  const bool good = equals != std::string::npos && first != std::string::npos && second != std::string::npos &&
                    io::parse_number(part(equals, first), from) && io::parse_number(part(first, second), to) &&
                    io::parse_number(part(second, std::string::npos), step);
  if (!good || !(step > 0) || !(to >= from) || (to - from) / step > 1000)
    throw io::Error("--sweep " + text, 0, "not of the form group.name=FROM:TO:STEP with at most 1,000 steps");
  std::vector<std::string> values;
  for (int32_t k = 0; from + k * step <= to + 1e-9 * step; ++k) {
    std::string value = text.substr(0, equals + 1);
    io::append_number(value, std::round((from + k * step) * 1e9) / 1e9);
    values.push_back(value);
  }
  return values;
}

ConfigFiles read_configs(const std::vector<std::string>& files) {
  ConfigFiles out;
  for (const std::string& file : files) {
    const std::string name = config_name(file);
    if (name.empty() || name.find_first_of(":@+,") != std::string::npos)
      throw io::Error("--config " + file, 0, "the file's name is that of the configuration: without : @ + and ,");
    for (int32_t i = 0; ovt_preset_name(i); ++i)
      if (name == ovt_preset_name(i)) throw io::Error("--config " + file, 0, "has the name of a preset");
    if (!out.emplace(name, file).second)
      throw io::Error("--config " + file, 0, "two configurations have the name '" + name + "'");
  }
  return out;
}

std::vector<std::string> variants_to_run(const RunOptions& options) {
  const ConfigFiles files = read_configs(options.configs);
  std::vector<std::string> names = options.presets;
  for (const std::string& file : options.configs)
    if (std::find(names.begin(), names.end(), config_name(file)) == names.end()) names.push_back(config_name(file));
  if (names.empty()) throw io::Error("--preset", 0, "is needed");
  for (const std::string& name : names) check_variant(name, files);
  const std::string first = names[0];
  for (const std::string& value : sweep_values(options.sweep)) {
    names.push_back(first + "@" + value);
    try {
      check_variant(names.back(), files);
    } catch (const io::Error& error) {
      const std::string sentence = error.what();  // names --set NAME=VALUE, which the user did not type
      throw io::Error("--sweep " + options.sweep, 0, sentence.substr(sentence.find(": ") + 2));
    }
  }
  return names;
}

bool run_logs(const RunOptions& options, std::vector<std::string>* damages) {
  const std::vector<std::string> names = variants_to_run(options);
  std::set<std::string> stems;
  for (const std::string& log : options.logs)
    if (!stems.insert(log_stem(log)).second)
      throw io::Error(log, 0, "two logs have this name: their results would lie in one folder");
  cli::catch_interrupt();
  rename_folders(options.out);
  for (const std::string& log : options.logs) {
    std::string damage;
    if (!LogRun(options, log, names).run(damage)) return false;
    if (damages && !damage.empty()) damages->push_back(damage_sentence(log, damage));
  }
  return true;
}

namespace {

// Throws io::Error.
Run read_run(const fs::path& folder) {
  Run run{"", folder.filename().string(), read_about(folder.string()), {}};
  const std::string name = folder.parent_path().filename().string();
  run.folder = folder.string();
  run.variant = run.about.count("contestant") ? run.about["contestant"] : name;
  if (folder_name(run.variant) != folder_name(name))
    throw io::Error(folder.string(), 0, "is of variant '" + run.variant + "', its folder has another name");
  run.tables = read_tables(folder.string());
  return run;
}

}  // namespace

std::vector<Run> read_runs(const std::string& out) {
  std::vector<Run> runs;
  std::vector<fs::path> folders;
  if (!fs::is_directory(out + "/runs")) throw io::Error(out, 0, "holds no runs of overtake evaluate");
  for (const auto& variant : fs::directory_iterator(out + "/runs")) {
    if (!variant.is_directory()) continue;  // Snakemake's note of the time
    for (const auto& log : fs::directory_iterator(variant.path()))
      if (is_done(log.path().string())) folders.push_back(log.path());
  }
  std::sort(folders.begin(), folders.end());
  for (const fs::path& folder : folders) {
    runs.push_back(read_run(folder));
    if (runs.back().about["commit"] != runs.front().about["commit"])
      throw io::Error(folder.string(), 0,
                      "is of build " + runs.back().about["commit"] + ", other runs of this report of build " +
                          runs.front().about["commit"] + ": evaluate the log again, or delete the folder");
  }
  return runs;
}

namespace {

// Throws io::Error.
void write_run(const Run& run, const std::vector<std::string>& sources, const std::string& out) {
  const std::string target = folder_of(out, run.variant, run.log);
  cli::make_folder(target);
  write_tables(target, run.tables);
  for (const std::string& source : sources) copy_pictures(source, target);
  write_about(target, run.about);
}

bool are_equal(const Table& a, const Table& b) {
  const auto same = [](double x, double y) { return x == y || (std::isnan(x) && std::isnan(y)); };
  return a.columns == b.columns && std::equal(a.cells.begin(), a.cells.end(), b.cells.begin(), b.cells.end(), same);
}

// What of `a` differs in `b`: a key of about.json or a table; "": nothing. Times differ each time.
std::string find_difference(const Run& a, const Run& b) {
  const About first = portable(a.about), second = portable(b.about);
  for (const auto& [one, other] : {std::pair(&first, &second), std::pair(&second, &first)})
    for (const auto& [key, value] : *one)
      if (const auto found = other->find(key); found == other->end() || found->second != value)
        return "'" + key + "' of about.json";
  for (const auto& [name, table] : a.tables)
    if (name != "times" && !are_equal(table, b.tables.at(name))) return name + ".csv";
  return "";
}

// Commits rarely: each commit writes the list of all results in the folder (tools/io/output.h) anew.
class Commits {
 public:
  void count() {
    if (++waiting_ < std::max<int64_t>(16, committed_ / 4)) return;
    io::commit_outputs();
    committed_ += waiting_, waiting_ = 0;
  }

 private:
  int64_t committed_ = 0, waiting_ = 0;
};

}  // namespace

void merge_runs(const std::vector<std::string>& from, const std::string& out) {
  for (const char* name : {"scaling.json", "recordings.json", "tuning.csv"})  // measured once, in any folder
    for (const std::string& folder : from)
      if (fs::exists(folder + "/" + name) && !fs::exists(out + "/" + name)) {
        cli::make_folder(out);
        io::write_whole_file(out + "/" + name, io::read_whole_file(folder + "/" + name));
        io::commit_outputs();
      }
  Commits commits;
  std::set<std::string> targets;
  std::map<std::pair<std::string, std::string>, std::vector<Run>> pieces;  // variant and log
  for (const std::string& folder : from)
    for (Run& run : read_runs(folder)) {
      if (is_piece(run)) {
        pieces[{run.variant, run.about.at("log")}].push_back(std::move(run));
        continue;
      }
      const std::string source = run.folder, target = folder_of(out, run.variant, run.log);
      if (!targets.insert(target).second) io::commit_outputs();  // the earlier one may wait
      if (is_done(target)) {
        if (const std::string what = find_difference(run, read_run(target)); !what.empty())
          throw io::Error(source, 0, "differs from " + target + " in " + what);
        continue;
      }
      write_run(run, {source}, out);
      commits.count();
    }
  for (auto& [of, runs] : pieces) {
    Run whole = join_pieces(std::move(runs));
    const std::string target = folder_of(out, whole.variant, whole.log);
    if (!targets.insert(target).second) io::commit_outputs();
    if (is_done(target)) {  // an earlier merge of these pieces
      if (const std::string what = find_difference(whole, read_run(target)); !what.empty())
        throw io::Error(target, 0, "differs in " + what + " from the pieces of " + whole.variant + " on " + whole.log);
      continue;
    }
    write_run(whole, {}, out);
    commits.count();
  }
  io::commit_outputs();
}

}  // namespace overtake::evaluation
