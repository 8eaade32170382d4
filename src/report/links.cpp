#include "report/links.hpp"

#include <array>
#include <map>

#include "report/html.hpp"

namespace tribin::report {
namespace {

constexpr int kCell = 2;  // pixels: finer outlines are not seen and double the page

using Corner = std::array<int, 2>;

/// The directed sides of the cells of one id that lie against another id, by their first corner; the id on the right.
using Sides = std::multimap<Corner, Corner>;

/// Joins sides to closed loops; straight runs become one step.
std::string loops_of(Sides sides) {
  std::string path;
  while (!sides.empty()) {
    const Corner start = sides.begin()->first;
    Corner at = start, heading{0, 0};
    path += "M" + std::to_string(at[0]) + " " + std::to_string(at[1]);
    const auto draw = [&](const Corner& run) {
      if (run[0] != 0) path += "h" + std::to_string(run[0]);
      if (run[1] != 0) path += "v" + std::to_string(run[1]);
    };
    do {
      const auto side = sides.find(at);
      const Corner step{side->second[0] - at[0], side->second[1] - at[1]};
      const bool straight = (step[0] == 0) == (heading[0] == 0) && (step[1] == 0) == (heading[1] == 0) &&
                            step[0] * heading[0] >= 0 && step[1] * heading[1] >= 0;
      if (!straight) {
        draw(heading);
        heading = {0, 0};
      }
      heading = {heading[0] + step[0], heading[1] + step[1]};
      at = side->second;
      sides.erase(side);
    } while (at != start);
    draw(heading);
    path += "z";
  }
  return path;
}

}  // namespace

std::string scan_key(int primitive_id) { return "s" + std::to_string(primitive_id); }
std::string cad_key(int part_class, int primitive_id) {
  return "c" + std::to_string(part_class) + "-" + std::to_string(primitive_id);
}

std::string link_to(const std::vector<std::string>& keys) {
  std::string out;
  for (const std::string& key : keys) out += (out.empty() ? "" : " ") + key;
  return out.empty() ? "" : " data-k=\"" + out + "\"";
}

std::string region_layer(const Image<std::uint16_t>& ids, const std::function<Region(int id)>& region_of) {
  const int width = (ids.width + kCell - 1) / kCell, height = (ids.height + kCell - 1) / kCell;
  const auto at = [&](int u, int v) {
    return u < 0 || v < 0 || u >= width || v >= height ? 0 : static_cast<int>(ids(u * kCell, v * kCell));
  };
  std::map<int, Sides> regions;
  for (int v = 0; v < height; ++v)
    for (int u = 0; u < width; ++u) {
      const int id = at(u, v);
      if (id == 0) continue;
      Sides& sides = regions[id];
      if (at(u, v - 1) != id) sides.insert({{u, v}, {u + 1, v}});
      if (at(u + 1, v) != id) sides.insert({{u + 1, v}, {u + 1, v + 1}});
      if (at(u, v + 1) != id) sides.insert({{u + 1, v + 1}, {u, v + 1}});
      if (at(u - 1, v) != id) sides.insert({{u, v + 1}, {u, v}});
    }
  std::string out;
  for (const auto& [id, sides] : regions) {
    const Region region = region_of(id);
    if (region.key.empty()) continue;
    out += "<path" + link_to({region.key}) + " d=\"" + loops_of(sides) + "\"><title>" + escaped(region.title) +
           "</title></path>";
  }
  if (out.empty()) return "";
  return "<svg class=\"links\" aria-hidden=\"true\" viewBox=\"0 0 " + std::to_string(width) + " " +
         std::to_string(height) + "\">" + out + "</svg>";
}

std::string link_script() {
  return R"js(<script>
(() => {
  let held = null;
  const keys = (e) => { const at = e.target.closest('[data-k]'); return at ? at.dataset.k.split(' ') : []; };
  const light = (now) => {
    for (const e of document.querySelectorAll('.on')) e.classList.remove('on');
    for (const k of now) for (const e of document.querySelectorAll('[data-k~="' + k + '"]')) e.classList.add('on');
    document.body.classList.toggle('lit', now.length > 0);
  };
  document.addEventListener('pointerover', (e) => { if (!held) light(keys(e)); });
  document.addEventListener('click', (e) => {
    const k = keys(e);
    if (k.length === 0 && !held) return;
    held = k.length ? k : null;
    light(k);
  });
  document.addEventListener('keydown', (e) => { if (e.key === 'Escape') { held = null; light([]); } });
  const parts = [...document.querySelectorAll('[data-part]')];
  if (parts.length < 2) return;
  const bar = document.createElement('div');
  bar.className = 'switch';
  const show = (one) => parts.forEach((p, i) => {
    p.classList.toggle('off', i !== one);
    bar.children[i].setAttribute('aria-pressed', i === one);
  });
  parts.forEach((p, i) => {
    const button = document.createElement('button');
    button.textContent = p.dataset.part;
    button.onclick = () => show(i);
    bar.append(button);
  });
  parts[0].before(bar);
  show(0);
})();
</script>
)js";
}

}  // namespace tribin::report
