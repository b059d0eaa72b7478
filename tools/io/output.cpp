// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/io/output.h"

#include <fcntl.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <unistd.h>

#include <algorithm>
#include <cerrno>
#include <cstdio>
#include <filesystem>
#include <fstream>
#include <set>

#include "core/hash.h"
#include "tools/io/error.h"
#include "tools/io/formats.h"
#include "tools/io/mcap_format.h"
#include "tools/io/mcap_reader.h"
#include "tools/io/text.h"

namespace overtake::io {
namespace {

namespace fs = std::filesystem;

constexpr std::string_view kListHead =
    "# Results of overtake in this folder: hash, bytes, name. One that differs is overwritten with --force only.\n";
// The first bytes of a trace (tools/cli/trace_file.cpp).
constexpr std::string_view kTraceHead = "{\"otherData\":{\"writer\":\"overtake\"}";
constexpr std::streamoff kHashedBytes = 4 << 20;  // at either end of a file

OutputGuard* current_guard = nullptr;

void fail_unless_folder(const std::string& path, const std::error_code& code) {
  if (path.empty()) throw Error("''", 0, "is no name of a folder");
  if (code) throw Error(path, 0, "the folder cannot be made: " + code.message());
  if (!fs::is_directory(path)) throw Error(path, 0, "the folder cannot be made: a file has this name");
}

// The path with its folder's links resolved: each directory entry has one such text.
std::string real_place(const std::string& path) {
  std::error_code code;
  const fs::path whole = fs::absolute(path, code);
  const fs::path folder = fs::weakly_canonical(whole.parent_path(), code);
  return code ? whole.string() : (folder / whole.filename()).string();
}

std::string digest(const std::string& path) {
  std::ifstream file(path, std::ios::binary | std::ios::ate);
  const std::streamoff size = file.tellg();
  if (!file || size < 0) return "";
  Hash hash;
  std::vector<char> bytes(std::size_t(std::min(size, kHashedBytes)));
  const auto add = [&](std::streamoff begin) {
    file.seekg(begin);
    file.read(bytes.data(), std::streamsize(bytes.size()));
    hash.add_bytes(bytes.data(), bytes.size());
  };
  add(0);
  if (size > kHashedBytes) add(size - kHashedBytes);
  char text[64];
  std::snprintf(text, sizeof text, "%016llx %lld", static_cast<unsigned long long>(hash.value()),
                static_cast<long long>(size));
  return text;
}

// Whether the first bytes identify a result of Overtake, or the file is empty.
bool begins_like_ours(const std::string& path) {
  std::ifstream file(path, std::ios::binary);
  std::string head(256, '\0');
  file.read(head.data(), std::streamsize(head.size()));
  head.resize(std::size_t(file.gcount()));
  if (head.empty() || head.starts_with(kTraceHead)) return true;
  if (!head.starts_with(kMcapMagic)) return false;
  // After the magic: the header record with two texts, profile and library.
  const std::size_t profile = kMcapMagic.size() + kMcapRecordHead;
  const auto text_at = [&](std::size_t at) -> std::string_view {
    if (at + 4 > head.size()) return {};
    uint32_t size = 0;
    for (std::size_t k = 0; k < 4; ++k) size |= uint32_t(uint8_t(head[at + k])) << (8 * k);
    return size <= head.size() - at - 4 ? std::string_view(head).substr(at + 4, size) : std::string_view();
  };
  return text_at(profile + 4 + text_at(profile).size()) == "overtake";
}

bool is_of_recording(const fs::path& path) {
  const std::string name = lower_case(path.filename().string()), end = lower_case(path.extension().string());
  return find_format_by_name(name) || end == ".txt" || name == "rig.toml" || name == "map.csv" || name == "ego.csv" ||
         name == "metadata.yaml";
}

bool is_below(const std::string& place, const std::string& folder) {
  return place.size() > folder.size() + 1 && place.starts_with(folder) && place[folder.size()] == '/';
}

}  // namespace

OutputGuard::OutputLock::OutputLock(int file, const std::string& path, const char* busy) : file_(file) {
  if (file_ < 0 || flock(file_, LOCK_EX | LOCK_NB) == 0 || errno != EWOULDBLOCK) return;
  close(file_);
  throw Error(path, 0, busy);
}

OutputGuard::OutputLock OutputGuard::OutputLock::of_folder(const std::string& path) {
  return {open(path.c_str(), O_RDONLY | O_DIRECTORY | O_CLOEXEC), path,
          "another command writes its results there: wait until it ends, or choose another folder"};
}

constexpr const char* kFileIsBusy = "another command writes it: wait until it ends, or choose another name";

OutputGuard::OutputLock OutputGuard::OutputLock::of_part(const std::string& path) {
  const std::string part = path + kPartSuffix;
  struct stat status {};
  if (lstat(part.c_str(), &status) != 0 || !S_ISREG(status.st_mode)) return {};
  return {open(part.c_str(), O_RDONLY | O_NOFOLLOW | O_CLOEXEC), path, kFileIsBusy};
}

OutputGuard::OutputLock OutputGuard::OutputLock::new_part(const std::string& path) {
  return {open((path + kPartSuffix).c_str(), O_WRONLY | O_CREAT | O_EXCL | O_CLOEXEC, 0666), path, kFileIsBusy};
}

OutputGuard::OutputLock::~OutputLock() {
  if (file_ >= 0) close(file_);
}

OutputGuard::OutputGuard(bool force) : force_(force) { current_guard = this; }

OutputGuard* OutputGuard::current() { return current_guard; }

OutputGuard::~OutputGuard() {
  current_guard = nullptr;
  std::error_code code;
  if (keep_ && !pending_.empty()) return;
  for (const Pending& p : pending_) fs::remove(p.path + kPartSuffix, code);
  for (const Folder& folder : folders_)
    if (folder.made_list && folder.files.empty()) fs::remove(fs::path(folder.place) / kOutputList, code);
  for (auto made = made_.rbegin(); made != made_.rend(); ++made)
    if (fs::is_empty(*made, code) && !code) fs::remove(*made, code);
}

void OutputGuard::add_input(const std::string& path) {
  const std::lock_guard lock(mutex_);
  if (path.empty()) return;
  inputs_.emplace_back(path, false);
  const auto comma = path.find(',');
  if (comma == std::string::npos || fs::exists(path)) return;
  inputs_.emplace_back(path.substr(0, comma), false);
  inputs_.emplace_back(path.substr(comma + 1), false);
}

void OutputGuard::add_input_tree(const std::string& folder) {
  const std::lock_guard lock(mutex_);
  inputs_.emplace_back(folder, true);
}

// Lists the input files only when an output already exists: a recording may have a hundred thousand files.
bool OutputGuard::is_input(const std::string& path, std::string& which) {
  const auto add = [this](const std::string& file) {
    struct stat status {};
    if (stat(file.c_str(), &status) == 0) input_ids_.emplace(std::pair(status.st_dev, status.st_ino), file);
  };
  std::error_code code;
  for (const auto& [input, tree] : inputs_) {
    if (inputs_listed_) break;
    add(input);
    if (tree) {
      for (fs::recursive_directory_iterator at(input, code), end; !code && at != end; at.increment(code))
        if (at->is_regular_file(code)) add(at->path().string());
    } else if (fs::is_directory(input, code)) {
      for (fs::directory_iterator at(input, code), end; !code && at != end; at.increment(code))
        if (is_of_recording(at->path())) add(at->path().string());
    }
  }
  inputs_listed_ = true;
  struct stat status {};
  if (stat(path.c_str(), &status) != 0) return false;
  const auto found = input_ids_.find({status.st_dev, status.st_ino});
  if (found != input_ids_.end()) which = found->second;
  return found != input_ids_.end();
}

OutputGuard::Folder* OutputGuard::folder_of(const std::string& place) {
  Folder* best = nullptr;
  for (Folder& folder : folders_)
    if (is_below(place, folder.place) && (!best || folder.place.size() > best->place.size())) best = &folder;
  return best;
}

bool OutputGuard::is_ours(const std::string& path, const std::string& place) {
  if (const Folder* folder = folder_of(place)) {
    const std::string name = place.substr(folder->place.size() + 1);
    const auto known = folder->files.find(name);
    if (known != folder->files.end()) return known->second == digest(path);
    // A .part file of a killed command: no other program writes such names into a folder of results.
    if (folder->has_list && name.ends_with(kPartSuffix)) return true;
  }
  return begins_like_ours(path);
}

void OutputGuard::check_place(const std::string& path, const std::string& place) {
  struct stat status {};
  if (lstat(path.c_str(), &status) != 0) return;  // if the folder is missing, opening the file reports it
  std::string which;
  if (is_input(path, which))
    throw Error(path, 0,
                "is read by this command" + (which == path ? "" : " as " + which) + ": an output never replaces it");
  if (S_ISLNK(status.st_mode)) {
    if (force_) return;
    throw Error(path, 0, "is a symbolic link, outputs do not follow links: remove it, or replace it with --force");
  }
  if (!S_ISREG(status.st_mode)) throw Error(path, 0, "is not a regular file: an output never replaces it");
  if (force_ || is_ours(path, place)) return;
  throw Error(path, 0,
              "exists and is not a result of Overtake, or was changed since: choose another name, or give --force");
}

void OutputGuard::check(const std::string& path) {
  const std::lock_guard lock(mutex_);
  OutputLock::of_part(path);
  check_place(path, real_place(path));
  const std::string part = path + kPartSuffix;
  check_place(part, real_place(part));
}

std::string OutputGuard::begin(const std::string& path) {
  const std::lock_guard lock(mutex_);
  const std::string place = real_place(path), part = path + kPartSuffix;
  struct stat status {};
  const bool part_exists = lstat(part.c_str(), &status) == 0;  // if not, no output of this command uses the name
  for (auto p = pending_.begin(); part_exists && p != pending_.end(); ++p)
    if (p->place == place) throw Error(path, 0, "is the name of two outputs of this command");
  Folder* folder = folder_of(place);
  OutputLock file_lock = folder ? OutputLock() : OutputLock::of_part(path);
  check_place(path, place);
  check_place(part, real_place(part));
  std::error_code code;
  fs::remove(part, code);  // never overwritten in place: it may have other names (hard links)
  if (!folder) file_lock = OutputLock::new_part(path);
  if (folder && !folder->has_list) {
    folder->has_list = folder->made_list = true;
    write_list(*folder);
  }
  pending_.push_back({path, place, std::move(file_lock)});
  return part;
}

void OutputGuard::make_folder(const std::string& path) {
  const std::lock_guard lock(mutex_);
  std::error_code code;
  std::vector<std::string> missing;
  for (fs::path at = fs::absolute(path, code).lexically_normal(); !at.empty() && !fs::exists(at, code);
       at = at.parent_path())
    if (at.has_filename()) missing.push_back(at.string());
  fs::create_directories(path, code);
  fail_unless_folder(path, code);
  made_.insert(made_.end(), missing.rbegin(), missing.rend());
}

void OutputGuard::add_folder(const std::string& path) {
  make_folder(path);
  const std::lock_guard lock(mutex_);
  std::error_code code;
  Folder folder;
  folder.place = fs::canonical(path, code).string();
  for (const Folder& known : folders_)
    if (known.place == folder.place) return;
  folder.lock = OutputLock::of_folder(path);
  read_list(folder);
  folders_.push_back(std::move(folder));
}

void OutputGuard::check_clear(const std::string& folder) {
  const std::lock_guard lock(mutex_);
  std::error_code code;
  for (fs::recursive_directory_iterator at(folder, code), end; !code && at != end; at.increment(code))
    if (!at->is_directory(code) || at->is_symlink(code))
      check_place(at->path().string(), real_place(at->path().string()));
}

void OutputGuard::clear(const std::string& folder) {
  check_clear(folder);
  const std::lock_guard lock(mutex_);
  std::error_code code;
  std::vector<std::string> results;
  for (fs::recursive_directory_iterator at(folder, code), end; !code && at != end; at.increment(code)) {
    if (at->is_directory(code) && !at->is_symlink(code)) continue;
    const std::string path = at->path().string(), place = real_place(path);
    Folder* const known = folder_of(place);
    const bool is_listed = known && known->files.erase(place.substr(known->place.size() + 1)) > 0;
    if (is_listed || path.ends_with(kPartSuffix)) results.push_back(path);
  }
  for (const std::string& path : results) {
    fs::remove(path, code);
    if (code) throw Error(path, 0, "cannot be removed: " + code.message());
  }
}

void OutputGuard::remove_leftovers(const std::string& path, std::string_view beginning, std::string_view ending) {
  const std::lock_guard lock(mutex_);
  std::error_code code;
  const std::string place = fs::canonical(path, code).string();
  const auto folder = std::find_if(folders_.begin(), folders_.end(), [&](const Folder& f) { return f.place == place; });
  if (folder == folders_.end() || folder->made_list) return;  // Overtake wrote nothing there before
  std::set<std::string> replaced;
  for (const Pending& p : pending_) replaced.insert({p.place, p.place + kPartSuffix});
  std::vector<std::string> leftovers;
  for (fs::directory_iterator at(place, code), end; !code && at != end; at.increment(code)) {
    const std::string file = at->path().string(), name = at->path().filename().string();
    if (replaced.contains(file) || !fs::is_regular_file(at->symlink_status(code))) continue;
    const bool is_part = name.ends_with(kPartSuffix);
    const std::string whole = is_part ? at->path().stem().string() : name;
    if (!whole.starts_with(beginning) || !whole.ends_with(ending)) continue;
    const auto known = folder->files.find(name);
    const bool old_result = known != folder->files.end() && known->second == digest(file);
    std::string which;
    if ((old_result || is_part) && !is_input(file, which)) leftovers.push_back(name);
  }
  for (const std::string& name : leftovers) {
    fs::remove(fs::path(place) / name, code);
    folder->files.erase(name);
  }
}

void OutputGuard::keep(bool keep) {
  const std::lock_guard lock(mutex_);
  keep_ = keep;
}

void OutputGuard::commit() {
  const std::lock_guard lock(mutex_);
  std::vector<Folder*> changed;
  for (const Pending& p : pending_) {
    std::error_code code;
    fs::rename(p.path + kPartSuffix, p.path, code);
    if (code) throw Error(p.path, 0, "cannot be written: " + code.message());
    Folder* folder = folder_of(p.place);
    if (!folder) continue;
    const std::string name = p.place.substr(folder->place.size() + 1);
    if (name.find('\n') == std::string::npos) folder->files[name] = digest(p.path);
    if (std::find(changed.begin(), changed.end(), folder) == changed.end()) changed.push_back(folder);
  }
  pending_.clear();
  for (const Folder* folder : changed) write_list(*folder);
}

void OutputGuard::read_list(Folder& folder) {
  const std::string path = (fs::path(folder.place) / kOutputList).string();
  refuse_special_file(path);
  std::ifstream file(path);
  for (std::string line; std::getline(file, line);) {
    folder.has_list = true;
    const auto first = line.find(' '), second = line.find(' ', first + 1);
    if (line.starts_with("#") || first == std::string::npos || second == std::string::npos) continue;
    folder.files[line.substr(second + 1)] = line.substr(0, second);
  }
}

void OutputGuard::write_list(const Folder& folder) {
  const std::string path = (fs::path(folder.place) / kOutputList).string();
  std::string text(kListHead);
  for (const auto& [name, value] : folder.files) text += value + ' ' + name + '\n';
  std::error_code code;
  fs::remove(path + kPartSuffix, code);
  errno = 0;
  std::ofstream file(path + kPartSuffix, std::ios::binary);
  file << text << std::flush;
  if (!file) fail_write(path, errno ? errno : EIO);
  file.close();
  fs::rename(path + kPartSuffix, path, code);
  if (code) throw Error(path, 0, "cannot be written: " + code.message());
}

std::string begin_output(const std::string& path) { return current_guard ? current_guard->begin(path) : path; }

void make_output_folder(const std::string& path) {
  if (current_guard) return current_guard->make_folder(path);
  std::error_code code;
  fs::create_directories(path, code);
  fail_unless_folder(path, code);
}

void commit_outputs() {
  if (current_guard) current_guard->commit();
}

void check_clear_output(const std::string& folder) {
  if (current_guard) current_guard->check_clear(folder);
}

void clear_output(const std::string& folder) {
  if (current_guard) return current_guard->clear(folder);
  fs::remove_all(folder);
}

std::string why_partial(const std::string& path) {
  const std::string by_name = "the program that wrote it was interrupted or failed: its name ends in .part";
  std::error_code code;
  if (fs::is_directory(path, code)) {
    int64_t count = 0;
    std::string first;
    for (fs::directory_iterator at(path, code), end; !code && at != end; at.increment(code)) {
      const std::string name = at->path().filename().string();
      if (name.ends_with(".mcap"))
        if (const std::string why = why_partial(at->path().string()); !why.empty()) return name + ": " + why;
      if (!name.ends_with(kPartSuffix) || name.starts_with(kOutputList)) continue;
      if (count++ == 0 || name < first) first = name;
    }
    if (count == 0) return "";
    return "the program that wrote it was interrupted or failed: " + std::to_string(count) +
           (count == 1 ? " name ends" : " names end") + " in .part (" + first + ")";
  }
  refuse_special_file(path);
  std::ifstream file(path, std::ios::binary);
  std::string magic(kMcapMagic.size(), '\0');
  file.read(magic.data(), std::streamsize(magic.size()));
  if (file && magic == kMcapMagic) {
    McapReader reader(path);
    reader.list_attachments();
    const auto partial = reader.metadata().find(kPartialMetadata);
    if (partial != reader.metadata().end() && partial->second.count("reason")) return partial->second.at("reason");
  }
  return path.ends_with(kPartSuffix) ? by_name : "";
}

}  // namespace overtake::io
