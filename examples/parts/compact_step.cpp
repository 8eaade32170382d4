#include "compact_step.hpp"

#include <algorithm>
#include <cctype>
#include <map>
#include <regex>
#include <vector>

namespace parts {
namespace {

struct Entity {
  int id = 0;
  std::string body;
};

/// The text with each reference #n replaced.
std::string renumbered(const std::string& body, const std::map<int, int>& to) {
  std::string out;
  for (std::size_t i = 0; i < body.size();) {
    out += body[i++];
    if (out.back() != '#') continue;
    std::size_t end = i;
    while (end < body.size() && std::isdigit(static_cast<unsigned char>(body[end]))) ++end;
    const int id = std::stoi(body.substr(i, end - i));
    const auto found = to.find(id);
    out += std::to_string(found == to.end() ? id : found->second);
    i = end;
  }
  return out;
}

bool is_geometry(const std::string& body) {
  static const char* const kinds[] = {"CARTESIAN_POINT(", "DIRECTION(", "VECTOR(", "AXIS2_PLACEMENT_3D("};
  return std::any_of(std::begin(kinds), std::end(kinds), [&](const char* kind) { return body.starts_with(kind); });
}

}  // namespace

std::string compact_step(const std::string& text) {
  const std::size_t data = text.find("DATA;"), end = text.find("ENDSEC;", data);
  std::vector<Entity> entities;
  for (std::size_t at = text.find('#', data); at < end;) {  // no string in these files holds a semicolon
    const std::size_t equals = text.find('=', at), stop = text.find(';', at);
    std::string body = text.substr(equals + 1, stop - equals - 1);
    std::erase_if(body, [](char c) { return c == '\n' || c == '\r'; });
    body.erase(0, body.find_first_not_of(' '));
    entities.push_back({std::stoi(text.substr(at + 1)), body});
    at = text.find('#', stop);
  }
  // A vector is equal to another only once their directions are one: repeat until nothing joins any more.
  for (std::size_t before = 0; before != entities.size();) {
    before = entities.size();
    std::map<std::string, int> first;
    std::map<int, int> to;
    std::vector<Entity> kept;
    for (const Entity& e : entities) {
      if (is_geometry(e.body)) {
        const auto [found, is_new] = first.emplace(e.body, e.id);
        if (!is_new) {
          to[e.id] = found->second;
          continue;
        }
      }
      kept.push_back(e);
    }
    for (Entity& e : kept) e.body = renumbered(e.body, to);
    entities = std::move(kept);
  }
  std::map<int, int> to;
  for (const Entity& e : entities) to.emplace(e.id, static_cast<int>(to.size()) + 1);
  std::string out = text.substr(0, data) + "DATA;\n";
  for (const Entity& e : entities)
    out.append("#").append(std::to_string(to[e.id])).append("=").append(renumbered(e.body, to)).append(";\n");
  return std::regex_replace(out + text.substr(end), std::regex("[0-9]{4}-[0-9]{2}-[0-9]{2}T[0-9]{2}:[0-9]{2}:[0-9]{2}"),
                            "2020-01-01T00:00:00", std::regex_constants::format_first_only);
}

}  // namespace parts
