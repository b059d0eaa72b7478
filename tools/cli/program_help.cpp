// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/program_help.h"

#include <algorithm>

#include "tools/cli/command.h"
#include "tools/cli/command_line.h"
#include "tools/cli/command_options.h"
#include "tools/client/config.h"
#include "tools/io/memory_limit.h"
#include "tools/io/rig.h"
#include "tools/sim/scenario.h"

namespace overtake::cli {
namespace {

std::vector<std::string> preset_names() {
  std::vector<std::string> names;
  for (int32_t i = 0; ovt_preset_name(i); ++i) names.emplace_back(ovt_preset_name(i));
  return names;
}

std::vector<std::string> param_names() {
  std::vector<std::string> names;
  ovt_param_info info;
  for (int32_t i = 0; ovt_describe_param(i, &info) == OVT_OK; ++i) names.push_back(std::string(info.name) + "=");
  return names;
}

std::vector<std::string> capacity_words() {
  std::vector<std::string> words = {"points="};
  for (const io::CapacityKey& key : io::kCapacityKeys) words.push_back(std::string(key.name) + "=");
  return words;
}

// The words of "TEXT:{a,b}": those of an option that takes nothing else.
std::vector<std::string> choices_of(const std::string& type) {
  std::vector<std::string> words;
  const auto open = type.find('{'), close = type.find('}');
  if (open == std::string::npos || close == std::string::npos) return words;
  for (std::size_t at = open + 1; at < close;) {
    const std::size_t end = std::min(type.find(',', at), close);
    words.push_back(type.substr(at, end - at));
    at = end + 1;
  }
  return words;
}

// What the shell may propose for a value.
void add_values(const std::string& command, OptionHelp& option) {
  option.words = choices_of(option.value);
  if (!option.words.empty() || !option.value.starts_with("TEXT")) return;
  const std::string& name = option.names;
  if (name == "--preset") option.words = preset_names();
  if (name == "--set" || name == "--sweep") option.words = param_names();
  if (name == "--capacity") option.words = capacity_words();
  if (name == "--isa") option.words = {"ref", "sse2", "avx2", "avx512", "neon64"};
  if (name == "--rig") option.words = io::builtin_rig_names();
  if (name == "scenario") option.words = sim::builtin_scenario_names();
  const bool is_name = name == "--sensor" || (command == "simulate" && name == "--ego");
  option.takes_files = !is_name && (option.words.empty() || name == "--rig" || name == "scenario");
}

OptionHelp describe(const std::string& command, const CLI::Option& option) {
  OptionHelp help;
  help.names = option.get_name(option.get_positional(), !option.get_positional());
  help.text = option.get_description();
  help.required = option.get_required();
  if (option.get_type_size() != 0) {
    help.value = option.get_type_name();
    help.default_text = option.get_default_str();
    help.several = option.get_expected_max() == CLI::detail::expected_max_vector_size;
    for (const CLI::Option* needed : option.get_needs()) help.text += " (needs " + needed->get_name() + ")";
  }
  add_values(command, help);
  return help;
}

void describe_options(const std::string& name, const CLI::App& app, std::vector<OptionHelp>& arguments,
                      std::vector<OptionHelp>& options) {
  for (const CLI::Option* option : app.get_options())
    (option->get_positional() ? arguments : options).push_back(describe(name, *option));
}

}  // namespace

ProgramHelp describe_program() {
  const CommandTree tree;
  ovt_build_info build;
  ovt_read_build_info(&build);
  ProgramHelp program;
  program.version = build.version_text;
  program.text = tree.app().get_description();
  if (program.text.ends_with('.')) program.text.pop_back();
  std::vector<OptionHelp> none;
  describe_options("", tree.app(), none, program.options);
  for (const CLI::App* command : tree.listed()) {
    CommandHelp help;
    help.name = command->get_name();
    help.text = command->get_description();
    if (command->get_footer() != tree.app().get_footer()) help.footer = command->get_footer();
    describe_options(help.name, *command, help.arguments, help.options);
    program.commands.push_back(help);
  }
  for (OptionHelp& option : program.options) {  // the manual is for every machine
    const std::string memory = ", " + io::format_size(io::memory_limit());
    if (const auto at = option.text.find(memory); at != std::string::npos) option.text.erase(at, memory.size());
  }
  program.exit_codes.assign(std::begin(kExitCodes), std::end(kExitCodes));
  return program;
}

}  // namespace overtake::cli
