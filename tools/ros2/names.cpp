// Copyright 2026 The Overtake authors
// SPDX-License-Identifier: Apache-2.0
#include "tools/ros2/names.h"

#include <algorithm>

#include "tools/io/error.h"
#include "tools/io/text.h"
#include "tools/io/words.h"

namespace overtake::ros2 {
namespace {

bool is_letter(char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; }
bool is_digit(char c) { return c >= '0' && c <= '9'; }

// Words of letters, digits and underscores, divided by single slashes; "/" and "~/" may stand in front.
bool is_name(std::string_view text) {
  if (text.starts_with("~/"))
    text.remove_prefix(2);
  else if (text.starts_with("/"))
    text.remove_prefix(1);
  char before = '/';
  for (const char c : text) {
    const bool fits = before == '/' ? is_letter(c) : is_letter(c) || is_digit(c) || c == '/';
    if (!fits) return false;
    before = c;
  }
  return before != '/';
}

void check_name(const std::string& place, const std::string& name) {
  if (!is_name(name))
    throw io::Error(place, 0,
                    "'" + name +
                        "' is not a name of ROS 2: words of letters, digits and _, divided by /, none of which "
                        "begins with a digit");
}

// FROM may have the name of a sensor, which may hold a - or begin with a digit: that is no name of ROS 2.
std::string as_name(std::string from) {
  std::replace(from.begin(), from.end(), '-', '_');
  if (!from.empty() && from[0] >= '0' && from[0] <= '9') from[0] = '_';
  return from;
}

}  // namespace

Names::Names(std::string name_space, std::string node, const std::vector<std::string>& remaps,
             const std::vector<std::string>& file_remaps)
    : name_space_(std::move(name_space)), node_(std::move(node)) {
  if (name_space_ == "/") name_space_.clear();
  if (!name_space_.empty() && name_space_[0] != '/') name_space_ = "/" + name_space_;
  if (!name_space_.empty()) check_name("--namespace", name_space_);
  check_name("--name", node_);
  if (node_.find('/') != std::string::npos)
    throw io::Error("--name", 0, "'" + node_ + "' has a /; --namespace has them");
  add(remaps);
  add(file_remaps);
}

void Names::add(const std::vector<std::string>& remaps) {
  std::vector<Remap> added;
  for (const std::string& text : remaps) {
    const Remap remap = parse(text);
    for (const Remap& other : added)
      if (other.from == remap.from)
        throw io::Error("--remap " + text, 0, remap.from + " is remapped twice: also by " + other.text);
    added.push_back(remap);
  }
  std::erase_if(added, [&](const Remap& remap) { return find(remap.from) != nullptr; });
  remaps_.insert(remaps_.end(), added.begin(), added.end());
}

Names::Remap Names::parse(const std::string& text) const {
  const auto sign = text.find(":=");
  if (sign == std::string::npos) throw io::Error("--remap " + text, 0, "FROM:=TO is needed");
  const std::string from(io::trim(std::string_view(text).substr(0, sign)));
  const std::string to(io::trim(std::string_view(text).substr(sign + 2)));
  check_name("--remap " + text, as_name(from));
  check_name("--remap " + text, to);
  return {text, absolute(from), absolute(to)};
}

const Names::Remap* Names::find(const std::string& from) const {
  const auto at = std::find_if(remaps_.begin(), remaps_.end(), [&](const Remap& remap) { return remap.from == from; });
  return at == remaps_.end() ? nullptr : &*at;
}

std::string Names::absolute(const std::string& name) const {
  if (name.starts_with("~/")) return name_space_ + "/" + node_ + name.substr(1);
  return name.starts_with("/") ? name : name_space_ + "/" + name;
}

std::string Names::resolve(const std::string& name) {
  const std::string full = absolute(name);
  known_.insert(full);
  const Remap* remap = find(full);
  return remap ? remap->to : full;
}

bool Names::is_remapped(const std::string& name) const { return find(absolute(name)) != nullptr; }

void Names::check_used() const {
  for (const Remap& remap : remaps_) {
    if (known_.count(remap.from) > 0) continue;
    const std::vector<std::string> names(known_.begin(), known_.end());
    throw io::Error("--remap " + remap.text, 0,
                    "has no effect: this node has no topic " + remap.from + io::did_you_mean(remap.from, names) +
                        "; it has " + io::join(names, ", "));
  }
}

std::string dds_topic_of(const std::string& name) { return name.starts_with("/") ? "rt" + name : name; }

std::string ros_topic_of(const std::string& dds_name) {
  return dds_name.starts_with("rt/") ? dds_name.substr(2) : dds_name;
}

std::string ros_type_of(const std::string& dds_type) {
  std::string text = dds_type;
  const auto part = text.find("::dds_::");
  if (part == std::string::npos || !text.ends_with("_")) return dds_type;
  text.pop_back();
  text.replace(part, 8, "/");
  for (auto at = text.find("::"); at != std::string::npos; at = text.find("::")) text.replace(at, 2, "/");
  return text;
}

}  // namespace overtake::ros2
