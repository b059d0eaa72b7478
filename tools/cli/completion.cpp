// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/cli/program_help.h"
#include "tools/io/text.h"

namespace overtake::cli {
namespace {

std::vector<std::string> names_of(const OptionHelp& option) {
  std::vector<std::string> names;
  for (std::size_t at = 0; at < option.names.size();) {
    const std::size_t end = std::min(option.names.find(',', at), option.names.size());
    names.push_back(option.names.substr(at, end - at));
    at = end + 1;
  }
  return names;
}

std::vector<std::string> all_names(const std::vector<OptionHelp>& options) {
  std::vector<std::string> all;
  for (const OptionHelp& option : options)
    for (const std::string& name : names_of(option)) all.push_back(name);
  return all;
}

// In single quotes of a shell.
std::string shell_quoted(const std::string& text) {
  std::string out = "'";
  for (const char c : text) out += c == '\'' ? std::string("'\\''") : std::string(1, c);
  return out + "'";
}

// ---- bash -----------------------------------------------------------------------------------------------------------

// The statement that completes a value.
std::string bash_values(const OptionHelp& option) {
  std::string text;
  if (!option.words.empty()) text += "_overtake_words " + shell_quoted(io::join(option.words, " ")) + "; ";
  if (option.takes_files) text += "_overtake_files; ";
  return text + "return";
}

void append_bash_case(std::string& text, const std::string& indent, const std::vector<OptionHelp>& options) {
  text += indent + "case $prev in\n";
  for (const OptionHelp& option : options)
    if (!option.value.empty())
      text += indent + "  " + io::join(names_of(option), " | ") + ") " + bash_values(option) + " ;;\n";
  text += indent + "esac\n";
}

// ---- zsh ------------------------------------------------------------------------------------------------------------

// Explanations in the brackets of _arguments, and messages between its colons.
std::string zsh_text(const std::string& text) {
  std::string out;
  for (const char c : text) {
    if (c == '[' || c == ']' || c == ':' || c == '\\') out += '\\';
    out += c;
  }
  return out;
}

std::string zsh_action(const OptionHelp& option) {
  std::string words;
  for (const std::string& word : option.words) words += (words.empty() ? "" : " ") + word;
  const bool before_value = !option.words.empty() && option.words[0].ends_with('=');
  const std::string list = before_value ? "compadd -S '' -- " + words : "compadd -- " + words;
  if (!option.words.empty() && option.takes_files) return "{ " + list + "; _files }";
  if (!option.words.empty()) return "{ " + list + " }";
  return option.takes_files ? "_files" : " ";
}

std::string zsh_option(const OptionHelp& option) {
  std::string text;
  for (const std::string& name : names_of(option)) {
    const std::string value = option.value.empty() ? "" : ":" + zsh_text(option.value) + ":" + zsh_action(option);
    const bool takes_equals = !option.value.empty() && name.starts_with("--");
    text += "    " +
            shell_quoted((option.several ? "*" : "") + name + (takes_equals ? "=" : "") + "[" + zsh_text(option.text) +
                         "]" + value) +
            " \\\n";
  }
  return text;
}

}  // namespace

std::string bash_completion(const ProgramHelp& program) {
  std::vector<std::string> names;
  for (const CommandHelp& command : program.commands) names.push_back(command.name);
  std::string text = R"(# Completion of overtake in bash. Made from the texts of --help.
_overtake_words() {
  local word
  for word in $(compgen -W "$1" -- "$cur"); do COMPREPLY+=("$word"); done
  [[ ${COMPREPLY[0]:-} != *= ]] || compopt -o nospace 2>/dev/null
}
_overtake_files() {
  local name
  while IFS= read -r name; do COMPREPLY+=("$name"); done < <(compgen -f -- "$cur")
  compopt -o filenames 2>/dev/null
}
_overtake() {
  local cur=${COMP_WORDS[COMP_CWORD]} prev=${COMP_WORDS[COMP_CWORD - 1]} command='' i
  COMPREPLY=()
  # bash splits --option=value at the equals sign
  if [[ $cur == = ]]; then
    cur=''
  elif [[ $prev == = ]]; then
    prev=${COMP_WORDS[COMP_CWORD - 2]}
  fi
  for ((i = 1; i < COMP_CWORD; ++i)); do
    case ${COMP_WORDS[i]} in
)";
  for (const OptionHelp& option : program.options)
    if (!option.value.empty()) text += "      " + io::join(names_of(option), " | ") + ") ((++i)) ;;\n";
  text += R"(      -*) ;;
      *) command=${COMP_WORDS[i]}; break ;;
    esac
  done
)";
  append_bash_case(text, "  ", program.options);
  text += "  case $command in\n    '') _overtake_words " +
          shell_quoted(io::join(names, " ") + " " + io::join(all_names(program.options), " ")) + " ;;\n";
  for (const CommandHelp& command : program.commands) {
    text += "    " + command.name + ")\n";
    append_bash_case(text, "      ", command.options);
    text += "      if [[ $cur == -* ]]; then\n        _overtake_words " +
            shell_quoted(io::join(all_names(command.options), " ")) + "\n        return\n      fi\n";
    for (const OptionHelp& argument : command.arguments) {
      text += "      " + bash_values(argument) + "\n";
      break;
    }
    text += "      ;;\n";
  }
  return text + "  esac\n}\ncomplete -F _overtake overtake\n";
}

std::string zsh_completion(const ProgramHelp& program) {
  std::string text =
      "#compdef overtake\n# Completion of overtake in zsh. Made from the texts of --help.\n_overtake() {\n";
  text += "  local curcontext=$curcontext state line\n  typeset -A opt_args\n  local -a commands\n  commands=(\n";
  for (const CommandHelp& command : program.commands)
    text += "    " + shell_quoted(command.name + ":" + zsh_text(command.text)) + "\n";
  text += "  )\n  _arguments -C \\\n";
  for (const OptionHelp& option : program.options) text += zsh_option(option);
  text += "    '1:command:->command' '*::argument:->argument'\n";
  text += "  case $state in\n  command) _describe command commands ;;\n  argument)\n    case $words[1] in\n";
  for (const CommandHelp& command : program.commands) {
    text += "    " + command.name + ") _arguments \\\n";
    for (const OptionHelp& option : command.options) text += zsh_option(option);
    for (const OptionHelp& argument : command.arguments)
      text += "    " +
              shell_quoted(std::string(argument.several ? "*" : "") + ":" + zsh_text(argument.names) + ":" +
                           zsh_action(argument)) +
              " \\\n";
    text += "    ;;\n";
  }
  return text + "    esac ;;\n  esac\n}\n_overtake \"$@\"\n";
}

}  // namespace overtake::cli
