// The run as a page: plain HTML with a few lines of script, pictures beside it.
#include <algorithm>
#include <cmath>
#include <cstdio>

#include "io/atomic_file.hpp"
#include "io/png.hpp"
#include "tribin/core/error.hpp"
#include "tribin/picking/report.hpp"

namespace tribin::picking {
namespace {

constexpr int kWidth_px = 320;  // of a picture

constexpr const char* kHead = R"(<!doctype html><html lang="en"><meta charset="utf-8"><title>tribin pick</title>
<style>:root{color-scheme:light dark}body{font:15px/1.5 system-ui,sans-serif;margin:2em auto;max-width:70em;padding:0 1em}
img{width:640px;max-width:100%;image-rendering:pixelated;border:1px solid #8888}table{border-collapse:collapse}
td,th{padding:.2em .7em;text-align:left;border-bottom:1px solid #8884;font-variant-numeric:tabular-nums}
tr.on{background:#48f3}tr[data-frame]{cursor:pointer}.bad{color:#c33}.rack td{border:1px solid #8888;text-align:center}
</style>)";

constexpr const char* kScript = R"(<script>
const rows=[...document.querySelectorAll('tr[data-frame]')],img=document.querySelector('img'),
range=document.querySelector('input'),play=document.querySelector('button');let at=0,timer=0;
function show(i){at=(i+rows.length)%rows.length;rows.forEach((r,k)=>r.classList.toggle('on',k===at));
img.src='scan_'+rows[at].dataset.frame.padStart(4,'0')+'.png';range.value=at}
rows.forEach((r,i)=>r.onclick=()=>show(i));range.max=rows.length-1;range.oninput=()=>show(+range.value);
play.onclick=()=>{if(timer){clearInterval(timer);timer=0;play.textContent='Play'}else
{timer=setInterval(()=>show(at+1),700);play.textContent='Stop'}};if(rows.length)show(0)
</script>)";

std::string escaped(const std::string& text) {
  std::string out;
  for (const char c : text) out += c == '<' ? "&lt;" : c == '>' ? "&gt;" : c == '&' ? "&amp;" : std::string(1, c);
  return out;
}

std::string cell_of(const std::string& text) { return "<td>" + escaped(text) + "</td>"; }

std::string number(double value, int decimals) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*f", decimals, value);
  return text;
}

/// The rack from above: grids as they stand, given slots in one row.
std::string rack_table(const Rack& rack, const Filling& filling) {
  const std::vector<Slot> slots = slots_of(rack);
  const auto columns = rack.given.empty() ? static_cast<std::size_t>(rack.slots.columns) : slots.size();
  std::string out = "<table class=\"rack\">";
  for (std::size_t i = 0; i < slots.size(); ++i) {
    if (i % columns == 0) out += "<tr>";
    out += "<td>" + std::to_string(slots[i].number) + "<br>" + (filling[i].empty() ? "&ndash;" : escaped(filling[i])) +
           "</td>";
  }
  return out + "</table>";
}

}  // namespace

Image<std::uint8_t> picture_of(const Scan& scan) {
  const int step = std::max(1, scan.z_mm.width / kWidth_px);
  Image<std::uint8_t> out(scan.z_mm.width / step, scan.z_mm.height / step);
  for (int v = 0; v < out.height; ++v)
    for (int u = 0; u < out.width; ++u) {
      const int x = std::clamp(u * step, step, scan.z_mm.width - step - 1),
                y = std::clamp(v * step, step, scan.z_mm.height - step - 1);
      const double z = scan.z_mm(x, y), right = scan.z_mm(x + step, y), below = scan.z_mm(x, y + step);
      if (!(z > 0) || !(right > 0) || !(below > 0)) continue;
      const double pitch = z * step / scan.camera.fx;  // mm between the pixels of the picture
      const Vec3 normal = Vec3((z - right) / pitch, (z - below) / pitch, 1).normalized();
      const double light = normal.dot(Vec3(0.4, 0.5, 1).normalized());
      out(u, v) = static_cast<std::uint8_t>(std::lround(30 + 225 * std::max(0.0, light)));
    }
  return out;
}

RunPage::RunPage(std::filesystem::path folder) : folder_(std::move(folder)) {
  std::error_code failed;
  std::filesystem::create_directories(folder_, failed);
  if (failed) throw Error(ErrorCode::bad_input, folder_.string() + ": cannot be made: " + failed.message());
}

void RunPage::show(const Image<std::uint8_t>& picture) {
  if (picture.empty()) return;
  char name[24];
  std::snprintf(name, sizeof name, "scan_%04d.png", ++pictures_);
  io::write_file(folder_ / name, io::encode_png8(picture));
}

void RunPage::add(const CycleReport& report) { rows_.push_back({pictures_, report}); }

void RunPage::finish(const WorkCell& cell, const RunEnd& end, const Filling& filling) const {
  std::string out = kHead;
  out += "<h1>" + escaped(end.status) + "</h1><p>" + escaped(end.message) + ". " + std::to_string(end.placed) +
         " parts placed in this run.</p>";
  out += "<p><img alt=\"the bin as the camera saw it\"><br><button>Play</button> <input type=\"range\" min=\"0\"></p>";
  if (cell.rack) out += "<h2>Rack</h2>" + rack_table(*cell.rack, filling);
  out +=
      "<h2>Cycles</h2><table><tr><th>scan<th>what<th>part<th>slot<th>grasp<th>gripper<th>resort<th>score<th>find "
      "ms<th>robot s<th></tr>";
  for (const auto& [picture, report] : rows_) {
    const bool good = report.state == "placed" || report.state == "put_down" || report.state == "pushed";
    out += "<tr data-frame=\"" + std::to_string(picture) + "\"" + (good ? "" : " class=\"bad\"") + ">" +
           cell_of(std::to_string(report.scene)) + cell_of(report.state) + cell_of(report.part) +
           cell_of(report.slot ? std::to_string(report.slot) : "") + cell_of(report.grasp) + cell_of(report.gripper) +
           cell_of(report.grasp.empty() ? "" : std::string(name_of(report.resort))) +
           cell_of(report.grasp.empty() ? "" : number(report.score, 3)) + cell_of(number(report.find_ms, 0)) +
           cell_of(number(report.robot_s, 1)) + cell_of(report.note) + "</tr>";
  }
  out += "</table>";
  std::map<std::string, int> reasons;
  for (const auto& row : rows_)
    for (const grasp::WhyCount& reason : row.second.refused) reasons[std::string(name_of(reason.why))] += reason.count;
  out += "<h2>Why grasps were refused</h2><table>";
  for (const auto& [reason, count] : reasons)
    out += "<tr>" + cell_of(reason) + cell_of(std::to_string(count)) + "</tr>";
  out += "</table>";
  io::write_file(folder_ / "index.html", out + kScript + "</html>\n");
}

}  // namespace tribin::picking
