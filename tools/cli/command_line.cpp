// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/command_line.h"

#include <CLI/CLI.hpp>
#include <algorithm>
#include <cstdio>
#include <vector>

#include "pipeline/overtake.h"
#include "tools/cli/command.h"
#include "tools/cli/report_json.h"
#include "tools/io/memory_limit.h"
#include "tools/io/text.h"
#include "tools/io/words.h"

namespace overtake::cli {

#define OVT_COMMAND(name) Command name##_command();
#include "tools/cli/commands.def"
#undef OVT_COMMAND

namespace {

constexpr int kBadUsage = 2;
constexpr const char* kExitCodesInHelp =
    "Exit codes: 0 done; 1 an error; 2 a wrong command line; 3 the recording is damaged (what came before it is "
    "done),\n"
    "the map or the ego poses do not fit it, or doctor found something wrong; 130 ended by Ctrl-C (the results so far\n"
    "are kept).";

// With --json, one object.
std::string version_text(bool json) {
  ovt_build_info build;
  ovt_read_build_info(&build);
  if (json) return version_json(build);
  return "overtake " + std::string(build.version_text) + "\ncommit   " + build.commit + "\ncompiler " + build.compiler +
         "\nISAs     " + build.isas;
}

bool is_listed(const CLI::App* command) { return command->get_group() != kHidden; }

std::vector<std::string> listed_names(const CommandTree& tree) {
  std::vector<std::string> names;
  for (const CLI::App* command : tree.listed()) names.push_back(command->get_name());
  return names;
}

bool is_known(const CLI::App& app, const std::string& name) {
  return !app.get_subcommands([&](const CLI::App* command) { return command->get_name() == name; }).empty();
}

// The first word that is neither an option of the program nor its value: it should be a command. `end`: there is none.
std::vector<std::string>::const_iterator find_command(const CLI::App& app, const std::vector<std::string>& words) {
  auto word = words.begin();
  for (; word != words.end() && word->starts_with("-"); ++word) {
    const CLI::Option* option = app.get_option_no_throw(*word);
    const bool takes_value = option && option->get_items_expected_max() > 0;
    if (takes_value && word + 1 != words.end()) ++word;
  }
  return word;
}

// The error of the command line, in one sentence. CLI11 reports missing options first, but an unknown word explains
// more: it may be a misspelled option.
std::string usage_error(const CommandTree& tree, const std::vector<std::string>& words, const CLI::ParseError& error) {
  const CLI::App& app = tree.app();
  const auto names = listed_names(tree);
  const std::string help = " (overtake --help)";
  if (words.empty()) return "a command is needed: " + io::join(names, ", ") + help;
  const auto first = find_command(app, words);
  if (first != words.end() && !is_known(app, *first))
    return "unknown command '" + *first + "'" + io::did_you_mean(*first, names) + help;
  const auto parsed = app.get_subcommands();
  const CLI::App& command = parsed.empty() ? app : *parsed[0];
  const std::string place = parsed.empty() ? "" : command.get_name() + ": ";
  const std::string its_help = parsed.empty() ? help : " (overtake " + command.get_name() + " --help)";
  std::vector<std::string> options;
  for (const CLI::Option* option : command.get_options())
    for (const std::string& name : option->get_lnames()) options.push_back("--" + name);
  const auto rest = app.remaining(true);
  for (const std::string& word : rest)
    if (word.starts_with("-")) {
      const std::string name = word.substr(0, word.find('='));
      return place + "unknown option '" + name + "'" + io::did_you_mean(name, options) + its_help;
    }
  if (!rest.empty()) return place + "'" + rest[0] + "' is one argument too many" + its_help;
  return place + error.what() + its_help;
}

// An empty word is no value: it stands for a variable of the shell that is not set, for instance.
void refuse_empty_words(const CLI::App& app) {
  for (const CLI::App* command : app.get_subcommands())
    for (const CLI::Option* option : command->get_options())
      for (const std::string& word : option->results())
        if (word.empty()) throw CLI::ValidationError(option->get_name(), "is empty; a value is needed");
}

// An option of every command: limits the memory for reading one file.
void add_max_memory(CLI::App& app) {
  app.add_option_function<std::string>(
         "--max-memory",
         [](const std::string& text) {
           uint64_t bytes = 0;
           if (!io::parse_size(text, bytes))
             throw CLI::ValidationError("--max-memory", "'" + text + "' is not a size of 1M or more (4G, 512M)");
           io::set_memory_limit(bytes);
         },
         "limit of the memory for reading one file, as 4G or 512M (default: half of the machine's, " +
             io::format_size(io::memory_limit()) + ")")
      ->type_name("SIZE");
  for (CLI::App* command : app.get_subcommands({})) command->fallthrough();
}

}  // namespace

CommandTree::CommandTree()
    : commands_{
#define OVT_COMMAND(name) name##_command(),
#include "tools/cli/commands.def"
#undef OVT_COMMAND
      },
      app_(std::make_unique<CLI::App>("Sees and tracks other cars with LiDAR.", "overtake")) {
  app_->require_subcommand(1);
  app_->footer(kExitCodesInHelp);
  app_->set_version_flag(
      "--version", [this] { return version_text(json_); },
      "print version, commit, compiler and ISAs (with --json: one JSON object) and exit");
  for (const Command& command : commands_)
    command.add_options(*app_->add_subcommand(command.name, command.help)->group(command.group));
  add_max_memory(*app_);
}

CommandTree::~CommandTree() = default;

std::vector<const CLI::App*> CommandTree::listed() const {
  const CLI::App& app = *app_;
  return app.get_subcommands(is_listed);
}

int run_command_line(int argc, const char* const* argv) {
  const std::vector<std::string> words(argv + 1, argv + argc);
  CommandTree tree;
  CLI::App& app = tree.app();
  tree.set_json(std::find(words.begin(), words.end(), "--json") != words.end());
  try {
    app.parse(argc, argv);
    refuse_empty_words(app);
    for (const Command& command : tree.commands())
      if (app.got_subcommand(command.name)) return command.run();
    return 0;
  } catch (const CLI::ParseError& error) {
    if (error.get_exit_code() == 0) return app.exit(error);  // --help, --version
    std::fprintf(stderr, "overtake: %s\n", usage_error(tree, words, error).c_str());
    return kBadUsage;
  }
}

}  // namespace overtake::cli
