// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include <algorithm>
#include <cctype>

#include "tools/cli/program_help.h"
#include "tools/io/error.h"
#include "tools/io/words.h"

namespace overtake::cli {
namespace {

// Text for roff: its special characters escaped, and no line that begins with a request.
std::string roff(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '\\')
      out += "\\e";
    else if (c == '-')
      out += "\\-";
    else if ((c == '.' || c == '\'') && (out.empty() || out.back() == '\n'))
      out += std::string("\\&") + c;
    else
      out += c;
  }
  return out;
}

std::string bold(const std::string& text) { return "\\fB" + roff(text) + "\\fR"; }
std::string italic(const std::string& text) { return "\\fI" + roff(text) + "\\fR"; }

std::string upper_case(std::string text) {
  std::transform(text.begin(), text.end(), text.begin(), [](unsigned char c) { return char(std::toupper(c)); });
  return text;
}

std::string header(const std::string& name, const std::string& version) {
  return ".\\\" Made from the texts of --help.\n.TH " + upper_case(name) + " 1 \"\" \"overtake " + version +
         "\" \"Overtake\"\n";
}

std::string section(const char* name) { return std::string(".SH ") + name + "\n"; }

void append_option(std::string& page, const OptionHelp& option, bool is_argument) {
  page += ".TP\n";
  page += is_argument ? italic(option.names) : bold(option.names);
  if (!option.value.empty()) page += " " + italic(option.value);
  if (!option.default_text.empty()) page += "=" + roff(option.default_text);
  if (option.several) page += " ...";
  if (option.required) page += " (required)";
  page += "\n" + roff(option.text) + "\n";
}

void append_exit_codes(std::string& page, const ProgramHelp& program) {
  page += section("EXIT STATUS");
  for (const ExitCode& code : program.exit_codes)
    page += ".TP\n" + bold(std::to_string(code.code)) + "\n" + roff(code.meaning) + "\n";
}

std::string program_page(const ProgramHelp& program) {
  std::string page = header("overtake", program.version);
  page += section("NAME") + "overtake \\- " + roff(program.text) + "\n";
  page += section("SYNOPSIS") + bold("overtake") + " " + italic("COMMAND") + " [" + italic("OPTIONS") + "]\n";
  page += section("COMMANDS");
  for (const CommandHelp& command : program.commands)
    page += ".TP\n" + bold("overtake-" + command.name) + "(1)\n" + roff(command.text) + "\n";
  page += section("OPTIONS");
  for (const OptionHelp& option : program.options) append_option(page, option, false);
  append_exit_codes(page, program);
  page += section("FILES") + "Installed with the program: its documents, beginning with README.md, in\n" +
          italic("share/doc/overtake") + ", and examples of rigs in\n" + italic("share/overtake/rigs") + ".\n";
  return page;
}

std::string command_page(const ProgramHelp& program, const CommandHelp& command) {
  const std::string name = "overtake-" + command.name;
  std::string page = header(name, program.version);
  page += section("NAME") + roff(name) + " \\- " + roff(command.text) + "\n";
  page += section("SYNOPSIS") + bold("overtake " + command.name) + " [" + italic("OPTIONS") + "]";
  for (const OptionHelp& argument : command.arguments)
    page += (argument.required ? " " : " [") + italic(argument.names) + (argument.several ? " ..." : "") +
            (argument.required ? "" : "]");
  page += "\n";
  if (!command.arguments.empty()) page += section("ARGUMENTS");
  for (const OptionHelp& argument : command.arguments) append_option(page, argument, true);
  page += section("OPTIONS");
  for (const OptionHelp& option : command.options) append_option(page, option, false);
  page += ".PP\nOptions of every command: see " + bold("overtake") + "(1).\n";
  if (!command.footer.empty()) page += section("NOTES") + ".nf\n" + roff(command.footer) + "\n.fi\n";
  append_exit_codes(page, program);
  return page + section("SEE ALSO") + bold("overtake") + "(1)\n";
}

}  // namespace

std::string manual_page(const ProgramHelp& program, const std::string& command) {
  if (command.empty()) return program_page(program);
  std::vector<std::string> names;
  for (const CommandHelp& known : program.commands) {
    if (known.name == command) return command_page(program, known);
    names.push_back(known.name);
  }
  throw io::Error("", 0, "there is no command '" + command + "'" + io::did_you_mean(command, names));
}

}  // namespace overtake::cli
