// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// The files that a command writes. While an OutputGuard exists, every writer of tools/io asks it for the path to write
// to, so that no output destroys an input or a foreign file:
//
//   NAME.part   is written. commit() renames it to NAME. A failed command removes it; a command that was interrupted or
//               already had results leaves it (keep()).
//   NAME        if it exists, is replaced if it is an earlier result of Overtake: the list `.overtake` of its folder
//               contains its size and hash, or its first bytes identify it (MCAP, trace), or it is empty. --force
//               replaces any other file as well.
//   never       replaced: a file that the command reads, under any name (device and inode are compared), a folder, a
//               device. A symbolic link needs --force, which replaces the link and not its target.
//
// A folder of results (add_folder) belongs to one command until that ends: another one that asks for it is refused.
#pragma once

#include <sys/types.h>

#include <map>
#include <mutex>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

namespace overtake::io {

inline constexpr const char* kPartSuffix = ".part";
inline constexpr const char* kOutputList = ".overtake";  // in a folder of results: their names, sizes and hashes
// Name of the MCAP metadata that marks a log with an early end; entry "reason".
inline constexpr const char* kPartialMetadata = "overtake_partial";

class OutputGuard {
 public:
  explicit OutputGuard(bool force = false);
  ~OutputGuard();  // removes everything not committed, and folders made for it, unless keep() was called
  OutputGuard(const OutputGuard&) = delete;
  OutputGuard& operator=(const OutputGuard&) = delete;
  static OutputGuard* current();

  // A file, "FILE1,FILE2", or a folder: its scans, boxes and tables of a recording. "" and missing files are allowed.
  void add_input(const std::string& path);
  void add_input_tree(const std::string& folder);  // every file below it
  // Makes a folder for results, with its parents. Throws Error.
  void add_folder(const std::string& path);
  void make_folder(const std::string& path);  // inside of a result folder
  // Throws what begin() would throw for this file; call it before any work.
  void check(const std::string& path);
  // Returns the path to write to. Throws Error.
  std::string begin(const std::string& path);
  // Removes Overtake's results from a folder. Throws Error if it holds any other file; with force those stay.
  void check_clear(const std::string& folder);
  void clear(const std::string& folder);
  // Removes from a result folder what earlier commands left there and this command does not replace: unchanged results
  // whose names begin and end so, and NAME.part of such names. Call it before the last commit().
  void remove_leftovers(const std::string& folder, std::string_view beginning, std::string_view ending);
  // Whether uncommitted files remain as NAME.part.
  void keep(bool keep = true);
  void commit();  // renames everything written so far; may be called again. Throws Error.

 private:
  // A lock on a folder or a file, which ends with the object or the process. File systems without locks grant every
  // one, NFS one to each host.
  class OutputLock {
   public:
    OutputLock() = default;
    static OutputLock of_folder(const std::string& path);  // throws Error if another command has it
    static OutputLock of_part(const std::string& path);    // of NAME.part of this file, if there is one; the same
    static OutputLock new_part(const std::string& path);   // makes it; without one if it cannot be made
    OutputLock(OutputLock&& other) noexcept : file_(std::exchange(other.file_, -1)) {}
    OutputLock& operator=(OutputLock&& other) noexcept {
      std::swap(file_, other.file_);
      return *this;
    }
    ~OutputLock();

   private:
    OutputLock(int file, const std::string& path, const char* busy);
    int file_ = -1;
  };
  struct Pending {
    std::string path, place;  // as given; in its canonical folder
    OutputLock lock;          // of a file outside of the folders of results, which have their own
  };
  struct Folder {
    std::string place;                         // canonical
    std::map<std::string, std::string> files;  // name below it, "HASH SIZE"
    bool has_list = false, made_list = false;
    OutputLock lock;
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
  std::vector<std::pair<std::string, bool>> inputs_;  // path; whether all files below it count
  bool inputs_listed_ = false;
  std::map<std::pair<dev_t, ino_t>, std::string> input_ids_;
  std::vector<Pending> pending_;
  std::vector<Folder> folders_;
  std::vector<std::string> made_;  // folders, parents first
};

// The path that every writer opens: the guard's NAME.part, or the path itself without a guard.
std::string begin_output(const std::string& path);
// Makes the folder and its parents. Throws Error.
void make_output_folder(const std::string& path);
// The guard's commit(), check_clear() and clear(). Without a guard: nothing, nothing, and removing the folder.
void commit_outputs();
void check_clear_output(const std::string& folder);
void clear_output(const std::string& folder);

// Why a recording or a folder of results is partial: "" if it is not known to be. Uses names that end in .part, and the
// metadata of Overtake's MCAP logs.
std::string why_partial(const std::string& path);

}  // namespace overtake::io
