// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
//
// rosbag2's SQLite files: topics(id, name, type, serialization_format), messages(id, topic_id, timestamp, data). Read
// in the order of the ids, which is the order of recording and needs no index.
#include <sqlite3.h>

#include <algorithm>
#include <filesystem>
#include <fstream>
#include <map>

#include "tools/io/bag_reader.h"
#include "tools/io/error.h"
#include "tools/io/formats.h"
#include "tools/io/memory_limit.h"
#include "tools/io/text.h"

namespace overtake::io {
namespace {

struct CloseDb {
  void operator()(sqlite3* db) const { sqlite3_close(db); }
};
struct EndStatement {
  void operator()(sqlite3_stmt* statement) const { sqlite3_finalize(statement); }
};

uint64_t file_bytes(const std::string& path) {
  std::error_code code;
  const auto bytes = std::filesystem::file_size(path, code);
  return code ? 0 : bytes;
}

class Db3Reader : public BagReader {
 public:
  explicit Db3Reader(const std::string& path) : path_(path), log_(path + "-wal") {
    refuse_special_file(path);
    sqlite3_hard_heap_limit64(int64_t(memory_limit()));  // of the process
    open(path, 0);
    if (needs_shared_memory()) open_unchanging();
    row_limit_ = (file_bytes(path_) + file_bytes(log_)) / 4;  // a row takes more; the limit ends loops in the tree
    read_topics();
    messages_ = prepare("SELECT id, topic_id, timestamp, data FROM messages ORDER BY id");
    last_id_ = largest_id();
  }

  bool next(BagMessage& out) override {
    if (!damage_.empty() || ended_) return false;
    while (true) {
      const int code = sqlite3_step(messages_.get());
      if (code == SQLITE_DONE) {
        ended_ = true;
        return false;
      }
      if (code != SQLITE_ROW) return stop(std::string("SQLite says ") + sqlite3_errmsg(db_.get()));
      const int64_t id = sqlite3_column_int64(messages_.get(), 0);
      if ((number_ > 0 && id <= id_) || number_ >= row_limit_) return stop("the message numbers do not grow");
      id_ = id;
      const auto topic = index_of_.find(sqlite3_column_int64(messages_.get(), 1));
      if (topic == index_of_.end()) return stop("a message of a topic that is not in the table of topics");
      const void* data = sqlite3_column_blob(messages_.get(), 3);
      const int size = sqlite3_column_bytes(messages_.get(), 3);
      if (!data && size > 0) return stop("a message cannot be read");
      out.topic = topic->second;
      out.log_ns = sqlite3_column_int64(messages_.get(), 2);
      out.number = number_++;
      out.data = {static_cast<const char*>(data), std::size_t(size)};
      return true;
    }
  }

  const std::vector<BagTopic>& topics() const override { return topics_; }
  const std::string& damage() const override { return damage_; }
  double progress() const override { return ended_ || last_id_ <= 0 ? 1 : double(id_) / double(last_id_); }
  std::string describe() const override { return "rosbag2, SQLite (.db3)"; }

 private:
  [[noreturn]] void fail(const std::string& what) {
    throw Error(path_, 0, what + ": SQLite says " + (db_ ? sqlite3_errmsg(db_.get()) : "out of memory"));
  }

  void open(const std::string& name, int name_kind) {
    sqlite3* raw = nullptr;
    const int code =
        sqlite3_open_v2(name.c_str(), &raw, SQLITE_OPEN_READONLY | SQLITE_OPEN_NOMUTEX | name_kind, nullptr);
    db_.reset(raw);
    if (code != SQLITE_OK) fail("cannot be opened");
    // Untrusted file: SQLite must not run code in its schema. WRITABLE_SCHEMA makes SQLite read a truncated file up to
    // its end; nothing can write the schema, because the file is open for reading only.
    sqlite3_db_config(raw, SQLITE_DBCONFIG_TRUSTED_SCHEMA, 0, nullptr);
    sqlite3_db_config(raw, SQLITE_DBCONFIG_WRITABLE_SCHEMA, 1, nullptr);
    // A view in place of a table could compute for ever.
    sqlite3_db_config(raw, SQLITE_DBCONFIG_ENABLE_VIEW, 0, nullptr);
    sqlite3_limit(raw, SQLITE_LIMIT_LENGTH, int(std::min<uint64_t>(1 << 30, memory_limit() / 4)));
  }

  // SQLite wants to make NAME.db3-shm of a file in WAL mode, or to undo the changes in NAME.db3-journal, and cannot.
  bool needs_shared_memory() {
    sqlite3_stmt* raw = nullptr;
    const int code = sqlite3_prepare_v2(db_.get(), "SELECT id FROM topics", -1, &raw, nullptr);
    sqlite3_finalize(raw);
    return code == SQLITE_CANTOPEN || code == SQLITE_READONLY;
  }

  bool is_in_wal_mode() const {
    char head[20] = {};
    std::ifstream(path_, std::ios::binary).read(head, sizeof head);
    return head[18] == 2 && head[19] == 2;  // the file format's versions for writing and for reading
  }

  // Reads the file as one that nobody writes: without locks, and without its write-ahead log, which must be empty. A
  // rollback journal must be empty, too: it has what half a transaction in the file replaced.
  void open_unchanging() {
    const std::string journal = path_ + "-journal";
    if (file_bytes(journal) > 0)
      throw Error(path_, 0,
                  "its writer was stopped in a transaction, which " + journal +
                      " undoes: open the file once with sqlite3, in a folder that can be written");
    if (!is_in_wal_mode()) fail("cannot be read");
    if (file_bytes(log_) > 0)
      throw Error(path_, 0,
                  "is in SQLite's WAL mode, and a part of it is still in " + log_ +
                      ": SQLite must write beside the file to read both. Copy them to a folder that can be written");
    std::string name = "file://";
    for (const char c : std::filesystem::absolute(path_).string())
      name += c == '%' ? "%25" : c == '?' ? "%3f" : c == '#' ? "%23" : std::string(1, c);
    open(name + "?immutable=1", SQLITE_OPEN_URI);
  }

  bool stop(const std::string& what) {
    damage_ = "damaged after message " + std::to_string(number_) + ": " + what;
    return false;
  }

  std::unique_ptr<sqlite3_stmt, EndStatement> prepare(const char* sql) {
    sqlite3_stmt* raw = nullptr;
    if (sqlite3_prepare_v2(db_.get(), sql, -1, &raw, nullptr) != SQLITE_OK) fail("is not a rosbag2 recording");
    return std::unique_ptr<sqlite3_stmt, EndStatement>(raw);
  }

  void read_topics() {
    const auto rows = prepare("SELECT id, name, type, serialization_format FROM topics ORDER BY id");
    const auto text = [&](int column) {
      const auto* chars = sqlite3_column_text(rows.get(), column);
      return chars ? std::string(reinterpret_cast<const char*>(chars)) : std::string();
    };
    constexpr std::size_t kMostText = std::size_t(16) << 20;
    std::size_t text_bytes = 0;
    int code = SQLITE_ROW;
    while ((code = sqlite3_step(rows.get())) == SQLITE_ROW) {
      index_of_[sqlite3_column_int64(rows.get(), 0)] = int32_t(topics_.size());
      topics_.push_back({text(1), text(2), text(3)});
      text_bytes += topics_.back().name.size() + topics_.back().type.size() + topics_.back().encoding.size();
      if (text_bytes > kMostText) throw Error(path_, 0, "its table of topics is damaged: more than 16 MiB of names");
      if (topics_.size() > 65536) throw Error(path_, 0, "its table of topics is damaged: more than 65536 rows");
    }
    if (code != SQLITE_DONE) fail("its table of topics is damaged");
  }

  int64_t largest_id() {
    const auto row = prepare("SELECT MAX(id) FROM messages");
    return sqlite3_step(row.get()) == SQLITE_ROW ? sqlite3_column_int64(row.get(), 0) : 0;
  }

  std::string path_, log_, damage_;  // log_: SQLite's write-ahead log, where the file has one
  std::unique_ptr<sqlite3, CloseDb> db_;
  std::unique_ptr<sqlite3_stmt, EndStatement> messages_;
  std::vector<BagTopic> topics_;
  std::map<int64_t, int32_t> index_of_;
  int64_t id_ = 0, last_id_ = 0;
  uint64_t number_ = 0, row_limit_ = 0;
  bool ended_ = false;
};

bool looks_like_db3(std::string_view head) { return head.starts_with(std::string_view("SQLite format 3\0", 16)); }

}  // namespace

const BagFormat db3_format = {looks_like_db3, open_db3, nullptr};

std::unique_ptr<BagReader> open_db3(const std::string& path) { return std::make_unique<Db3Reader>(path); }

}  // namespace overtake::io
