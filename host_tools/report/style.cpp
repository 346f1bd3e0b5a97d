// SPDX-License-Identifier: MIT
#include <cmath>

#include <fmt/format.h>

#include "report/parts.hpp"

namespace rim::diagnose::report {

namespace {

// Okabe and Ito's palette (Color Universal Design, 2008): vermillion before, blue after, purple for
// regions, green for good.
constexpr const char *kDay = R"(
--paper:#fff;--page:#f3f4f6;--ink:#1a1d21;--ink2:#545b66;--rule:#d5d9df;--grid:#e9ebee;
--before:#d55e00;--after:#0072b2;--measured:#1a1d21;--good:#00785a;--warn:#b84300;--gate:#cc79a7;
--soft:#f5f6f8;--callout:#fff5d6;--edge:#e69f00;--beaten:#9aa3ae;--lane:#dfe2e7;--faint:#5a6270;
)";
constexpr const char *kNight = R"(
--paper:#1b1e23;--page:#121417;--ink:#e9ebee;--ink2:#a8aeb8;--rule:#3a3f47;--grid:#2a2e35;
--before:#f08a3c;--after:#56b4e9;--measured:#f4f5f7;--good:#35c79b;--warn:#ff9b57;--gate:#d98fb8;
--soft:#23272d;--callout:#3a3115;--edge:#e69f00;--beaten:#6f7782;--lane:#343941;--faint:#a8aeb8;
)";

constexpr const char *kLayout = R"(
*{box-sizing:border-box}
html{color-scheme:light dark;-webkit-text-size-adjust:100%}
body{margin:0;background:var(--page);color:var(--ink);
 font:16px/1.5 system-ui,-apple-system,"Segoe UI","Helvetica Neue","DejaVu Sans",Arial,sans-serif}
main{max-width:1100px;margin:0 auto;padding:28px 20px 60px}
h1{font-size:clamp(1.35rem,2.6vw,1.9rem);line-height:1.28;margin:.35em 0 .6em;font-weight:650;
 text-wrap:pretty}
h1.long{font-size:clamp(1.1rem,1.9vw,1.4rem)}
h2{font-size:1.3rem;line-height:1.3;margin:0 0 .5em}
h3{font-size:1rem;margin:1.4em 0 .5em;color:var(--ink2)}
p{margin:.5em 0;max-width:75ch}
section,header{background:var(--paper);border:1px solid var(--rule);border-radius:8px;
 padding:22px 28px;margin:0 0 20px;overflow-wrap:break-word}
header p.top{margin:0;color:var(--ink2);font-size:.9rem;display:flex;flex-wrap:wrap;gap:6px 14px;
 align-items:center;max-width:none}
.verdict{font-weight:700;padding:2px 10px;border-radius:99px;border:2px solid;font-size:.85rem}
.verdict.bad{color:var(--warn)}.verdict.fine{color:var(--good)}
.facts{display:flex;flex-wrap:wrap;gap:4px 26px;margin:1em 0 0;font-size:.92rem}
.facts div{display:flex;gap:.5em}.facts dt{color:var(--ink2)}.facts dd{margin:0;font-weight:600}
.overview{display:flex;flex-wrap:wrap;gap:8px 28px;align-items:flex-start}
.tiles{display:flex;flex-wrap:wrap;gap:14px;margin:.4em 0}
.tile{background:var(--soft);border-left:4px solid var(--after);padding:10px 14px;border-radius:4px;
 display:flex;flex-direction:column;flex:0 1 300px}
.tile.bad{border-color:var(--warn)}
.big{font-size:1.9rem;font-weight:700;line-height:1.2;color:var(--after)}
.tile.bad .big{color:var(--warn)}
.ci,.note{color:var(--ink2);font-size:.87rem}
ol.contents{margin:.4em 0;padding-left:2.1em;flex:1 1 300px}
ol.many{flex-basis:100%;columns:2 300px;column-gap:40px}ol.contents a{color:var(--after)}
.jump{display:flex;flex-wrap:wrap;gap:2px 18px;margin-top:.8em;font-size:.9rem;color:var(--ink2)}
.jump a{color:var(--after)}.jump a[hidden]{display:none}
.finding{border-top:5px solid var(--mine)}
.badge{display:inline-block;font-size:.8rem;font-weight:600;padding:1px 9px;border-radius:99px;
 border:1.5px solid var(--rule);color:var(--ink2);margin-right:6px;white-space:nowrap}
.badge.doubt{border-color:var(--edge);color:var(--ink)}
.lead{font-size:1.08rem}
.expression{font:600 1.12rem/1.4 ui-monospace,"DejaVu Sans Mono",Menlo,Consolas,monospace;
 background:var(--soft);padding:10px 14px;border-radius:4px;margin:.8em 0;max-width:none}
.code{font:.86rem/1.4 ui-monospace,"DejaVu Sans Mono",Menlo,Consolas,monospace}
.pair{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,430px),1fr));gap:6px 36px}
.pair>div{min-width:0}
table{border-collapse:collapse;font-size:.92rem}
th{text-align:left;font-weight:600;vertical-align:top}td{vertical-align:middle}
th,td{padding:4px 16px 4px 0}
.number{text-align:right;font-variant-numeric:tabular-nums;white-space:nowrap}
.parameters td{font-weight:600}
.parameters th,.where th{color:var(--ink2);vertical-align:baseline}
.where{width:100%;max-width:480px;table-layout:fixed}.where th{width:9.5em}
.where svg{max-width:100%;height:auto}
.where td{padding:4px 0 10px;vertical-align:baseline}
.ends{display:flex;justify-content:space-between;font-size:.75rem;color:var(--ink2);
 line-height:1;width:290px;max-width:100%;padding:0 4px}
.scroll{overflow-x:auto;margin:.6em 0}.scroll svg,.where svg{display:block}
th.name{max-width:22ch}
.causes,.gain{width:100%}
.causes thead th,.gain thead th,.channels thead th{font-size:.82rem;color:var(--ink2);
 border-bottom:1px solid var(--rule);vertical-align:bottom}
.causes tbody td,.causes tbody th,.channels td,.channels th{border-bottom:1px solid var(--grid)}
.claimed{background:var(--soft)}.claimed th{color:var(--after)}
.causes th:first-child{padding-left:8px;white-space:nowrap}
.gain{font-size:.88rem;line-height:1.35}.gain td,.gain th{padding:0 12px 0 0;white-space:nowrap}
.gain td:last-child,.gain th:last-child{padding-right:0}
.gain tbody td{border-top:1px solid var(--grid)}
.gain tr.first th,.gain tr.first td{border-top:1px solid var(--rule)}
.gain thead tr th{border-bottom:0}
.gain svg{display:block}.gain tbody th{vertical-align:middle}
.worse{color:var(--warn);font-weight:700}
.callout{background:var(--callout);border-left:4px solid var(--edge);padding:10px 14px;
 border-radius:4px;max-width:none}
figure{margin:18px 0 6px;break-inside:avoid}
figcaption{display:flex;flex-wrap:wrap;gap:4px 18px;align-items:baseline;margin-bottom:6px}
.keys{display:flex;flex-wrap:wrap;gap:2px 16px;font-size:.85rem;color:var(--ink2)}
.key{display:inline-flex;gap:6px;align-items:center;white-space:nowrap}
.drawing{overflow-x:auto}.drawing>svg{max-width:100%;height:auto;display:block}
.small{display:grid;grid-template-columns:repeat(auto-fit,minmax(300px,1fr));gap:8px 12px}
.small svg{max-width:100%;height:auto}
pre{background:var(--soft);padding:12px 14px;border-radius:4px;white-space:pre-wrap;margin:.6em 0;
 overflow-wrap:anywhere;font:.88rem/1.5 ui-monospace,"DejaVu Sans Mono",Menlo,Consolas,monospace}
ul{padding-left:1.3em;margin:.5em 0}
footer{color:var(--ink2);font-size:.85rem;text-align:center}
)";

constexpr const char *kDrawing = R"(
svg text{fill:var(--ink2);font-size:12px;font-family:inherit}
svg .label{fill:var(--ink);font-size:12.5px}svg .head{fill:var(--ink);font-weight:600;
 font-size:13px}
svg .middle{text-anchor:middle}svg .end{text-anchor:end}
svg path,svg line{fill:none;stroke-width:1.6;stroke-linejoin:round}
svg .grid{stroke:var(--grid);stroke-width:1}svg .axis{stroke:var(--ink2);stroke-width:1}
svg .zero{stroke:var(--ink2);stroke-width:1;stroke-dasharray:5 4}
svg .one{stroke:var(--ink2);stroke-width:1.4}
svg .before{stroke:var(--before)}svg .after{stroke:var(--after)}
svg .measured{stroke:var(--measured);stroke-width:1.3;opacity:.5}
svg .fit{stroke:var(--after);stroke-width:2.6}
svg .normal{stroke:var(--ink2);stroke-dasharray:3 3;stroke-width:1.3}
svg .dashed{stroke-dasharray:5 4;stroke-width:1.2}
svg .thin{stroke-width:1;opacity:.75}svg .bar{stroke-width:1.5}
svg .whisker{stroke-width:2.2}
svg .dots{stroke-linecap:round}svg .bead{stroke-width:5}svg .big{stroke-width:9}
svg .flagged{stroke:var(--gate);stroke-width:5}
svg .faint{stroke:var(--faint);stroke-width:2.2;opacity:.28}
svg .speck{stroke-width:2.2;opacity:.35}
svg .warn{stroke:var(--warn)}
svg .gate{fill:var(--gate);fill-opacity:.2;stroke:var(--gate);stroke-width:1}
svg .gate.strong{fill-opacity:.75}
svg .acts{fill:var(--gate);fill-opacity:.09;stroke:none}svg .acts.strip{fill-opacity:.85}
svg .band{fill:var(--after);fill-opacity:.1;stroke:none}
svg .outline{stroke:var(--ink);stroke-width:2;stroke-dasharray:7 3}
svg .outline.under{stroke:var(--paper);stroke-width:4.5;stroke-dasharray:none;opacity:.8}
svg .lane{fill:var(--lane);stroke:none}
svg .rival{fill:var(--edge)}svg .beaten{fill:var(--beaten)}
svg .crowd0{opacity:.35}svg .crowd1{opacity:.7}
.f0{--mine:#cc79a7}.f1{--mine:#e69f00}.f2{--mine:#009e73}.f3{--mine:#56b4e9}.f4{--mine:#d55e00}
.f5{--mine:#0072b2}.f6{--mine:#b8ab00}
svg .f0,svg .f1,svg .f2,svg .f3,svg .f4,svg .f5,svg .f6{fill:var(--mine);stroke:none}
)";

constexpr const char *kPaper = R"(
@media print{body{font-size:10.5pt;background:none}.jump{display:none}main{max-width:none;padding:0}
section,header{border:0;padding:8px 0;border-radius:0}.finding{border-top:3px solid var(--mine)}
.scroll,.drawing{overflow:visible}h2,h3,.callout{break-after:avoid}
*{print-color-adjust:exact;-webkit-print-color-adjust:exact}.tiles,tr,figure{break-inside:avoid}}
@page{margin:16mm 14mm}
)";

// From vermillion over nearly nothing to blue: a measured value below the simulated one is blue.
std::string colours(const int (&nothing)[3], const int (&low)[3], const int (&high)[3]) {
  std::string text;
  for (int i = 0; i <= 10; ++i) {
    const double share = std::pow(std::abs(i - 5) / 5.0, 0.85);
    const int(&end)[3] = i < 5 ? low : high;
    int mixed[3];
    for (int k = 0; k < 3; ++k)
      mixed[k] = static_cast<int>(std::lround(nothing[k] + share * (end[k] - nothing[k])));
    text += fmt::format("--c{}:#{:02x}{:02x}{:02x};", i, mixed[0], mixed[1], mixed[2]);
  }
  return text;
}

} // namespace

std::string style_sheet() {
  const std::string day = kDay + colours({232, 232, 228}, {0, 84, 150}, {200, 80, 0});
  const std::string night = kNight + colours({62, 66, 72}, {86, 190, 245}, {250, 140, 50});
  std::string text = ":root{" + day + "}\n@media screen and (prefers-color-scheme:dark){:root{" +
                     night + "}}\n" + kLayout + kDrawing;
  for (int i = 0; i <= 10; ++i)
    text += fmt::format("svg .c{0}{{fill:var(--c{0});stroke:none}}\n", i);
  return text + kPaper;
}

} // namespace rim::diagnose::report
