// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The files that a command writes. While an OutputGuard lives, every writer of tools/io asks it for the place to write
// to, so that no output destroys an input or a file of somebody else:
//
//   NAME.part   is written. commit() renames it to NAME. A command that fails removes it, one that was interrupted or
//               had results already leaves it (keep()).
//   NAME        that exists is replaced where it is an earlier result of Overtake: the list `.overtake` of its folder
//               holds its size and hash, or its first bytes say so (MCAP, trace), or it is empty. --force replaces
//               any other file as well.
//   never       a file that the command reads, under whatever name (device and inode are compared), a folder, a
//               device. A symbolic link needs --force, which replaces the link and not what it points to.
#pragma once

#include <sys/types.h>

#include <map>
#include <mutex>
#include <string>
#include <utility>
#include <vector>

namespace overtake::io {

inline constexpr const char* kPartSuffix = ".part";
inline constexpr const char* kOutputList = ".overtake";  // in a folder of results: their names, sizes and hashes
// Where MCAP metadata says that the log ends early; entry "reason".
inline constexpr const char* kPartialMetadata = "overtake_partial";

class OutputGuard {
 public:
  explicit OutputGuard(bool force = false);
  ~OutputGuard();  // what was not committed goes, folders made for it too, unless keep() was called
  OutputGuard(const OutputGuard&) = delete;
  OutputGuard& operator=(const OutputGuard&) = delete;
  static OutputGuard* current();

  // A file, "FILE1,FILE2", or a folder: the scans, boxes and tables of a recording that lie in it. "" and what does not
  // exist are fine.
  void add_input(const std::string& path);
  void add_input_tree(const std::string& folder);  // every file below it
  // A folder for results, made with its parents. Throws Error.
  void add_folder(const std::string& path);
  void make_folder(const std::string& path);  // inside of one
  // Throws what begin() would throw for this file, before any work is done.
  void check(const std::string& path);
  // The path to write to instead. Throws Error.
  std::string begin(const std::string& path);
  // Empties a folder of results of ours. Throws Error where any file below it is none.
  void check_clear(const std::string& folder);
  void clear(const std::string& folder);
  // Whether what is not committed at the end stays as NAME.part.
  void keep(bool keep = true);
  void commit();  // gives what was written so far its name; may be called again. Throws Error.

 private:
  struct Pending {
    std::string path, place;  // as asked for; by its canonical folder
  };
  struct Folder {
    std::string place;                         // canonical
    std::map<std::string, std::string> files;  // name below it, "HASH SIZE"
    bool has_list = false, made_list = false;
  };
  void check_place(const std::string& path, const std::string& place);
  bool is_input(const std::string& path, std::string& which);
  bool is_ours(const std::string& path, const std::string& place);
  Folder* folder_of(const std::string& place);
  static void read_list(Folder& folder);
  static void write_list(const Folder& folder);

  std::mutex mutex_;
  const bool force_;
  bool keep_ = false;
  std::vector<std::pair<std::string, bool>> inputs_;  // path; all below it
  bool inputs_listed_ = false;
  std::map<std::pair<dev_t, ino_t>, std::string> input_ids_;
  std::vector<Pending> pending_;
  std::vector<Folder> folders_;
  std::vector<std::string> made_;  // folders, parents first
};

// What every writer opens: the guard's NAME.part, or the path itself where there is no guard.
std::string begin_output(const std::string& path);
// Makes the folder and its parents. Throws Error.
void make_output_folder(const std::string& path);
// The guard's commit(), check_clear() and clear(); without a guard nothing, nothing, and the folder goes.
void commit_outputs();
void check_clear_output(const std::string& folder);
void clear_output(const std::string& folder);

// Why a recording or a folder of results is not whole: "" where nothing says so. Names that end in .part, and what an
// MCAP log of ours says of itself.
std::string why_partial(const std::string& path);

}  // namespace overtake::io
