"""The style sheet of the report's page: follows the reader's light or dark preference, prints light on A4."""

from __future__ import annotations

from armblocks.pictures.style import FONT_STACK, MONO_STACK, theme_variables
from armblocks.pictures.svg import page_rules


def page_css() -> str:
    """The complete style sheet."""
    return (
        f":root{{color-scheme:light dark;{theme_variables('light')}}}"
        f"@media (prefers-color-scheme:dark){{:root{{{theme_variables('dark')}}}}}"
        f"@media print{{:root{{color-scheme:light;{theme_variables('light')}}}}}"
        + page_rules()
        + _RULES.replace("FONTS", FONT_STACK).replace("MONO", MONO_STACK)
    )


_RULES = """
*{box-sizing:border-box}
html{font:15px/1.5 FONTS;background:var(--page);color:var(--ink);-webkit-text-size-adjust:100%}
body{margin:0}
main,header.top{max-width:1120px;margin:0 auto;padding:0 24px}
header.top{padding-top:36px}
h1{font-size:1.9rem;line-height:1.2;margin:0;letter-spacing:-.01em}
h2{font-size:1.3rem;line-height:1.3;margin:0 0 4px}
h3{font-size:1.02rem;margin:28px 0 8px}
p{margin:6px 0;max-width:75ch}
.lead{color:var(--muted);margin:6px 0 0}
a{color:var(--accent)}
nav ul{list-style:none;display:flex;flex-wrap:wrap;gap:2px 20px;padding:0;margin:14px 0 0}
.facts{display:grid;grid-template-columns:repeat(auto-fit,minmax(150px,1fr));gap:1px;margin:22px 0 0;
 padding:0;
 background:var(--surface);border:1px solid var(--hairline);border-radius:8px;overflow:hidden}
.facts div{padding:10px 14px;box-shadow:1px 1px 0 var(--hairline)}
.facts dt{color:var(--muted);font-size:.82rem}
.facts dd{margin:0;font-size:1.12rem;font-weight:600;font-variant-numeric:tabular-nums}
.facts small,.unit{color:var(--muted);font-weight:400;font-size:.86em}
section{background:var(--surface);border:1px solid var(--hairline);border-radius:10px;padding:22px 24px;
 margin:22px 0}
figure{margin:18px 0 0}
figure svg{display:block;width:100%;height:auto}
figcaption{color:var(--muted);font-size:.88rem;margin-top:6px}
.pair{display:grid;grid-template-columns:repeat(auto-fit,minmax(min(100%,300px),1fr));gap:8px 24px}
.pair figure{max-width:400px}
.scroll{overflow-x:auto}
table{border-collapse:collapse;font-variant-numeric:tabular-nums;font-size:.92rem;width:100%;margin:6px 0}
caption{text-align:left;color:var(--muted);font-size:.88rem;padding-bottom:6px}
th,td{padding:6px 10px;text-align:right;border-bottom:1px solid var(--grid);white-space:nowrap;
 vertical-align:top}
thead th{white-space:normal;border-bottom-color:var(--hairline);font-weight:600;vertical-align:bottom}
th:first-child,td:first-child{text-align:left;padding-left:0}
tbody th{font-weight:600}
th .unit{display:block}
td.text,.words thead th{text-align:left}
.run td{white-space:normal;overflow-wrap:anywhere}
tr:last-child>*{border-bottom:0}
.key{display:inline-block;width:18px;height:3px;border-radius:2px;margin-right:8px;vertical-align:middle}
td.bad{color:var(--error);background:var(--error-wash);font-weight:600}
td.bad small{display:block;font-weight:600}
.notes{list-style:none;margin:18px 0 0;padding:0}
.notes li{display:flex;gap:10px;align-items:flex-start;padding:9px 14px;margin:6px 0;border-radius:8px;
 border:1px solid}
.notes svg{flex:none;width:18px;height:18px;margin-top:2px}
.notes .error{color:var(--error);background:var(--error-wash)}
.notes .warning{color:var(--warning);background:var(--warning-wash)}
.matrix{font-family:MONO;font-size:.88rem;border-collapse:collapse;width:auto;margin:0}
.matrix td{border:0;padding:1px 10px 1px 0;text-align:right}
.sheet{border-top:1px solid var(--grid);padding:10px 0}
.sheet summary{cursor:pointer;font-weight:600}
.sheet figure{margin-top:10px}
code{font-family:MONO;font-size:.9em}
footer{color:var(--muted);font-size:.86rem;padding:4px 0 40px}
@media (max-width:640px){main,header.top{padding-left:14px;padding-right:14px}section{padding:16px 14px}
 figure.wide{overflow-x:auto}figure.wide svg{min-width:640px}}
@media (min-width:1900px){html{font-size:17px}main,header.top{max-width:1500px}}
@media print{@page{size:A4;margin:14mm}html{font-size:9.5pt;background:#fff}
 main,header.top{max-width:none;padding:0}
 section{border:0;padding:0;margin:14pt 0}nav,.screen{display:none}
 .sheet::details-content{content-visibility:visible;block-size:auto}.sheet{break-inside:avoid}
 figure,tr,.notes li{break-inside:avoid}
 h2,h3{break-after:avoid}.scroll{overflow:visible}table{font-size:8pt}th,td{padding:3px 5px}
 .pair{grid-template-columns:1fr 1fr 1fr}.scroll{break-inside:avoid}}
"""
