#include "report/html.hpp"
#include "report/links.hpp"
#include "report/palette.hpp"
#include "report/spaces.hpp"

namespace tribin::report {
namespace {

// The tokens of the viewer, light and dark. The pictures' colours in palette.cpp are the same.
const char* const kLight = R"css(
--bg:#F5F6F8;--surface:#FFFFFF;--sunken:#ECEEF2;--line:#DDE1E7;--line-2:#7C8491;--text:#14171C;--text-2:#454D59;--text-3:#5E6774;
--accent:#4B45C6;--ok:#00786A;--warn:#945F00;--bad:#930120;--ok-soft:#E2F4F1;--warn-soft:#FBF1DD;--bad-soft:#FBE3E3;
--plane:#1B55B3;--cylinder:#D0640A;--cone:#0A9686;--sphere:#8A1A55;--free:#7A828E;
--ca:#282B86;--cb:#A06A00;--cc:#1D8475;--cd:#944AAD;--ce:#495D00;--cf:#661E1F;--ax:#B8141F;--ay:#00786A;--az:#1B55B3;color-scheme:light;
)css";
const char* const kDark = R"css(
--bg:#0F1115;--surface:#171A20;--sunken:#20242C;--line:#2B303A;--line-2:#6F7887;--text:#E9ECF1;--text-2:#B4BBC6;--text-3:#939CA9;
--accent:#A29EFF;--ok:#3FE0C0;--warn:#FEC21F;--bad:#FF6B66;--ok-soft:#0F332D;--warn-soft:#3A2D08;--bad-soft:#401A1B;
--plane:#4A93F5;--cylinder:#F7A03C;--cone:#5CE6D3;--sphere:#D04A8C;--free:#8A929E;
--ca:#B8C0F8;--cb:#E5A111;--cc:#4BAB94;--cd:#A870BE;--ce:#D1F29F;--cf:#CF661E;--ax:#FF6B66;--ay:#3FE0C0;--az:#6FB1F5;color-scheme:dark;
)css";

const char* const kStyle = R"css(
*{box-sizing:border-box}html,body{margin:0}
body{background:var(--bg);color:var(--text);font:14px/22px "Inter Variable",Inter,system-ui,"Segoe UI",Roboto,"DejaVu Sans",sans-serif;font-variant-numeric:tabular-nums slashed-zero}
h1,h2,h3,p{margin:0}a{color:inherit}
.doc{max-width:1120px;margin:0 auto;padding:28px 32px 56px}
header{display:grid;grid-template-columns:auto 1fr auto;gap:4px 16px;align-items:center;padding-bottom:18px}
header .logo{width:40px;height:40px;fill:none;stroke-width:1.5}
header h1{font-size:26px;line-height:32px;font-weight:650;letter-spacing:-.02em;overflow-wrap:anywhere}
header p{grid-column:2/4;color:var(--text-2);max-width:76ch}
nav{display:flex;gap:18px;flex-wrap:wrap;border-block:1px solid var(--line);padding:7px 0;font-size:13px}nav a{color:var(--text-2);text-decoration:none}nav a:hover{color:var(--accent)}
section{margin-top:30px}h2{font-size:18px;line-height:26px;font-weight:600;letter-spacing:-.01em;margin:0 0 4px}
h3{font-size:14px;line-height:20px;font-weight:600;margin:14px 0 8px;display:flex;gap:8px;align-items:center}
section>p{color:var(--text-2);max-width:84ch;margin-bottom:10px;font-size:13px;line-height:20px}
.box{background:var(--surface);border:1px solid var(--line);border-radius:8px;overflow-x:auto}
table{border-collapse:collapse;width:100%}td,th{padding:7px 10px;font-size:13px;line-height:18px;text-align:left;border-bottom:1px solid var(--line);white-space:nowrap}
th{font-weight:500;color:var(--text-3);font-size:12px}td.num,th.num{text-align:right}td.wrap{white-space:normal;min-width:22ch}tr:last-child td{border-bottom:0}
.u,.muted{color:var(--text-3);font-weight:400}.test{display:inline-block;margin-right:14px;font-size:12px;line-height:17px}.test b{color:var(--text-2);font-weight:500}.t2{color:var(--text-2)}.bad-text{color:var(--bad);font-weight:600}
details>summary{cursor:pointer;padding:6px 2px;font-size:13px;color:var(--text-2)}.two td,.two th{padding:6px 5px}.two td:first-child,.two th:first-child{padding-left:10px}.two td:last-child,.two th:last-child{padding-right:10px}.two .rail{width:78px}.two{align-items:start}
.name{display:inline-flex;gap:8px;align-items:center;font-weight:600}
.chip{display:inline-flex;align-items:center;gap:5px;height:24px;padding:0 10px;border-radius:12px;font-size:12px;white-space:nowrap}
.chip.ok{background:var(--ok-soft);color:var(--ok)}.chip.warn{background:var(--warn-soft);color:var(--warn)}.chip.bad{background:var(--bad-soft);color:var(--bad)}
.state{width:12px;height:12px;fill:none;stroke:currentColor;stroke-width:1.4;stroke-linejoin:round;flex:none}
.warning{display:flex;gap:8px;align-items:baseline;background:var(--warn-soft);border-radius:6px;padding:6px 12px;margin-top:6px;font-size:13px;line-height:20px}.warning .state{color:var(--warn);transform:translateY(1px)}
.cls{display:inline-grid;place-items:center;width:18px;height:18px;border-radius:4px;font-size:11px;line-height:18px;font-weight:700;color:var(--surface);flex:none}
.cls.ca{background:var(--ca)}.cls.cb{background:var(--cb)}.cls.cc{background:var(--cc)}.cls.cd{background:var(--cd)}.cls.ce{background:var(--ce)}.cls.cf{background:var(--cf)}
.ty{width:16px;height:16px;vertical-align:-3px;flex:none;fill:none;stroke-width:1.4;stroke-linejoin:round}
.ty.plane{stroke:var(--plane)}.ty.cylinder{stroke:var(--cylinder)}.ty.cone{stroke:var(--cone)}.ty.sphere,.ty.torus{stroke:var(--sphere)}
figure{margin:0;background:var(--surface);border:1px solid var(--line);border-radius:8px;overflow:hidden;display:flex;flex-direction:column}
figure .art{aspect-ratio:1/1;position:relative;display:grid;place-items:center}figure .art>*,figure img{display:block;width:100%;height:auto}
figure.wide{margin-top:12px}figure.wide .art{aspect-ratio:auto}
figcaption{padding:7px 9px 9px;font-size:12px;line-height:16px;color:var(--text-2);border-top:1px solid var(--line);flex:1}figcaption b{color:var(--text)}
figure .none{padding:16px;color:var(--text-3);font-size:12px;line-height:16px;text-align:center}
.pics{display:grid;grid-template-columns:repeat(5,minmax(0,1fr));gap:10px}.two{display:grid;grid-template-columns:repeat(auto-fit,minmax(460px,1fr));gap:14px}
.leg{display:flex;align-items:center;gap:6px 14px;flex-wrap:wrap;font-size:12px;line-height:16px;color:var(--text-2);margin-top:8px}.leg span{display:inline-flex;gap:5px;align-items:center}
.ramp{width:90px;height:8px;border-radius:2px;display:inline-block}.ramp.viridis{background:linear-gradient(90deg,#440154,#3B528B,#21918C,#5EC962,#FDE725)}
.globe{fill:var(--sunken);fill-opacity:.55;stroke:var(--line)}.graticule{fill:none;stroke:var(--line);stroke-width:.7}
.dot{fill:none;stroke-linecap:round}.ring{fill:none;stroke-width:1.6}.ring.plane{stroke:var(--plane)}.ring.cylinder{stroke:var(--cylinder)}.twin{stroke-dasharray:3 3}
.mark{font-size:10px;font-weight:600;fill:var(--text);paint-order:stroke;stroke:var(--surface);stroke-width:3px;stroke-linejoin:round}
.circle{fill:none;stroke-width:1.8}.circle.cylinder{stroke:var(--cylinder)}.circle.cone{stroke:var(--cone)}.circle-halo{fill:none;stroke:var(--surface);stroke-width:3.6;stroke-opacity:.8}
.links{position:absolute;inset:0;width:100%;height:100%}.links path{fill:transparent;stroke:none;stroke-linejoin:round}[data-k]{cursor:pointer}
.links path.on{stroke:var(--text);stroke-width:1.6;filter:drop-shadow(0 0 1px var(--surface)) drop-shadow(0 0 1px var(--surface))}.ring.on{stroke-width:3.4}.circle.on{stroke-width:4}.lit .circle:not(.on),.lit .ring:not(.on),.lit .dot{opacity:.4}tr.on{background:var(--sunken);box-shadow:inset 3px 0 var(--accent)}
.switch{display:inline-flex;border:1px solid var(--line);border-radius:6px;overflow:hidden;margin:4px 0}.switch button{font:inherit;font-size:12px;line-height:16px;padding:6px 12px;border:0;background:var(--surface);color:var(--text-2);cursor:pointer}.switch button[aria-pressed=true]{background:var(--accent);color:var(--surface)}
.axis{font-size:10px;font-weight:600}.a0{fill:var(--ax)}.a1{fill:var(--ay)}.a2{fill:var(--az)}
.rail{width:100px;height:14px;display:block}.rail rect{fill:var(--sunken)}.rail .ticks{stroke:var(--line-2);stroke-width:1.2}.rail .bar{stroke:var(--text-2);stroke-width:3}.rail circle{fill:var(--text)}.rail.bad circle{fill:var(--bad)}.rail.bad .bar{stroke:var(--bad)}
.lg{display:grid;grid-template-columns:190px 1fr 92px 92px;gap:0 10px;font-size:13px;padding:10px 12px;align-items:center}.lg>*{padding:3px 0}.lg .hd{font-size:12px;color:var(--text-3);text-align:right}.lg .num{text-align:right;white-space:nowrap}
.tr{position:relative;height:20px}.tr i{position:absolute;left:0;height:7px;border-radius:2px}.tr .paper{top:2px;background:var(--line-2);opacity:.55}.tr .ours{top:11px;background:var(--accent)}
code,pre{font:12px/18px "JetBrains Mono",ui-monospace,"DejaVu Sans Mono",monospace}pre{margin:0;padding:10px 12px;overflow:auto;background:var(--sunken);border-radius:6px;white-space:pre-wrap;overflow-wrap:anywhere}
.foot{margin-top:30px;border-top:1px solid var(--line);padding-top:10px;font-size:12px;line-height:18px;color:var(--text-3);overflow-wrap:anywhere}
@media (max-width:1000px){.doc{padding:20px 24px}.two{grid-template-columns:1fr}.lg{grid-template-columns:150px 1fr 80px 80px}.pics{grid-template-columns:repeat(auto-fill,minmax(190px,1fr))}}
@page{size:A4;margin:12mm}
@media screen{.off{display:none}}
@media print{.switch{display:none}body{background:#fff;font-size:11px;line-height:16px}.doc{max-width:none;padding:0}figure,.box,h2,h3,tr{break-inside:avoid}h2,h3{break-after:avoid}nav{display:none}td,th{font-size:10px;padding:4px 5px}.two{grid-template-columns:1fr}section{margin-top:18px}figcaption{font-size:9.5px;line-height:12px}.chip,.cls,.globe,.ramp,.tr i,.warning,pre{print-color-adjust:exact;-webkit-print-color-adjust:exact}}
)css";

/// The vote colours: magma, turned round on light pages so that "none" is the paper's colour.
std::string vote_colours(bool dark) {
  std::string out;
  for (int i = 0; i < kVoteColours; ++i) {
    const double f = i / (kVoteColours - 1.0);
    out += "--m" + std::to_string(i) + ":" + hex(dark ? magma(0.30 + 0.68 * f) : magma(0.88 - 0.80 * f)) + ";";
  }
  return out;
}

std::string style() {
  std::string out = ":root{" + std::string(kLight) + vote_colours(false) + "}";
  out += "@media screen and (prefers-color-scheme:dark){:root{" + std::string(kDark) + vote_colours(true) + "}}";
  std::string ramp = ".ramp.magma{background:linear-gradient(90deg";
  for (int i = 0; i < kVoteColours; ++i) {
    const std::string m = std::to_string(i);
    out += ".m" + m + "{stroke:var(--m" + m + ")}";
    ramp += ",var(--m" + m + ")";
  }
  return out + ramp + ")}" + kStyle;
}

const char* const kLogo =
    R"svg(<svg class="logo" viewBox="0 0 30 30" role="img" aria-label="tribin"><circle cx="9" cy="9" r="5.5" stroke="var(--plane)"/><path d="M18 4h8v8h-8zM18 8h8M22 4v8" stroke="var(--cylinder)"/><path d="M8 20l7-4 7 4v5l-7 4-7-4zM8 20l7 4 7-4M15 24v5" stroke="var(--text)"/></svg>)svg";

}  // namespace

std::string page(const std::string& title, const std::string& verdict, const std::string& lead,
                 const std::string& state, const std::string& chip, const std::vector<TocEntry>& contents,
                 const std::string& body) {
  std::string out =
      "<!doctype html>\n<html lang=\"en\"><head><meta charset=\"utf-8\"><meta name=\"viewport\" "
      "content=\"width=device-width,initial-scale=1\"><meta name=\"generator\" content=\"tribin " TRIBIN_VERSION
      "\"><title>" +
      escaped(title) + "</title><style>" + style() + "</style></head>\n<body><main class=\"doc\">\n<header>" + kLogo +
      "<h1>" + escaped(verdict) + "</h1><span class=\"chip " + state + "\">" + state_icon(state) + escaped(chip) +
      "</span>";
  if (!lead.empty()) out += "<p>" + lead + "</p>";
  out += "</header>\n<nav aria-label=\"Contents\">";
  for (const TocEntry& entry : contents) out += "<a href=\"#" + entry.id + "\">" + escaped(entry.title) + "</a>";
  out += "</nav>\n" + body;
  out +=
      "<div class=\"foot\">This page holds everything it shows and loads nothing from the network. Written by "
      "tribin " TRIBIN_VERSION ".</div>\n</main>\n" +
      link_script() + "</body></html>\n";
  return out;
}

}  // namespace tribin::report
