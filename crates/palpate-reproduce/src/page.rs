//! A report as one web page: text, tables and drawings, no script and nothing from elsewhere.
//!
//! Figures and tables are numbered through. Texts are escaped here, except where a parameter says that it is html.

use crate::html::escape;
use crate::surface_picture::PICTURE_STYLE;
use crate::system_drawing::SYSTEM_STYLE;
use base64::Engine;
use base64::engine::general_purpose::STANDARD;

/// The whole page.
#[derive(Clone, Debug)]
pub struct Page {
    /// Heading, also the browser's title; plain text.
    pub title: String,
    /// Html between the heading and the contents.
    pub intro: String,
    /// Sections, in order.
    pub sections: Vec<Section>,
}

/// A part of the page that the contents link to.
#[derive(Clone, Debug)]
pub struct Section {
    /// Anchor, unique in the page: letters, digits and hyphens.
    pub id: String,
    /// Heading; plain text.
    pub heading: String,
    /// Html below the heading.
    pub body: String,
}

/// Colours by theme, then type and layout. Paper is always light.
const PAGE_STYLE: &str = "\
:root{color-scheme:light dark;--paper:#fff;--ink:#1b1f24;--soft:#59636e;--rule:#c9d0d8;--grid:#e6eaee;
--shade:#f5f7f9;--link:#0a5cad;--series-1:#0069b4;--series-2:#cf4a00;--series-3:#00805c;--series-4:#9c3f86;
--series-5:#8a6400;--series-6:#56616b}
@media screen and (prefers-color-scheme:dark){:root{--paper:#14181c;--ink:#e6e9ec;--soft:#a3adb7;
--rule:#434c55;--grid:#2a3138;--shade:#1d2329;--link:#7cbcff;
--series-1:#62b6f7;--series-2:#ff9152;--series-3:#3fce9f;
--series-4:#e79fd0;--series-5:#e8c447;--series-6:#aab6c0}}
*{box-sizing:border-box}
html{background:var(--paper);color:var(--ink);font:100%/1.55 system-ui,-apple-system,'Segoe UI',Roboto,
'Noto Sans','Liberation Sans',sans-serif}
body{max-width:60rem;margin:0 auto;padding:2.5rem 1.5rem 4rem}
p,li{max-width:44rem}
h1{font-size:1.9rem;line-height:1.2;margin:0 0 1rem;text-wrap:balance}
h2{font-size:1.35rem;line-height:1.25;margin:3rem 0 .75rem;padding-top:.9rem;border-top:1px solid var(--rule)}
a{color:var(--link);text-underline-offset:.15em}
nav{margin:1.75rem 0;padding:.8rem 1.2rem;background:var(--shade);border-radius:6px;max-width:44rem}
nav h2{font-size:1rem;margin:0;padding:0;border:0}
nav ol{margin:.3rem 0 0;padding-left:1.4rem}
figure,.table{margin:1.75rem 0;overflow-x:auto}
figcaption,caption{color:var(--soft);font-size:.9rem;line-height:1.45;max-width:44rem;text-align:left}
figcaption{margin-top:.7rem}
caption{padding-bottom:.5rem}
table{border-collapse:collapse;font-size:.95rem;font-variant-numeric:tabular-nums lining-nums}
th,td{padding:.36rem .5rem .36rem 1.4rem;text-align:right;vertical-align:top}
tr>:first-child{padding-left:.2rem;text-align:left;font-weight:400}
thead th,thead tr>:first-child{font-weight:600;vertical-align:bottom}
thead{border-top:2px solid var(--ink);border-bottom:1px solid var(--ink)}
tbody tr+tr{border-top:1px solid var(--grid)}
tbody{border-bottom:2px solid var(--ink)}
code,pre{font:.88rem/1.5 ui-monospace,'Cascadia Mono',Menlo,Consolas,'DejaVu Sans Mono',monospace}
pre{background:var(--shade);padding:.8rem 1rem;border-radius:6px;overflow-x:auto;max-width:44rem}
.listing th,.listing td,.listing thead tr>*{text-align:left;padding:.45rem 1.1rem .45rem .2rem}
.listing table{font-size:.9rem}.listing td code{font-size:.72rem}
.listing td:last-child{max-width:8.5rem}.listing tr>:nth-child(2){min-width:10rem}
.verdict b{white-space:nowrap}
.image{margin:0;color:var(--soft);font-size:.82rem;line-height:1.35}
.image img{display:block;width:100%;height:auto;border-radius:4px;margin-bottom:.35rem}
.gallery{display:grid;gap:.6rem 1rem;max-width:calc(15rem*var(--columns) + 1rem*(var(--columns) - 1));
grid-template-columns:repeat(auto-fill,minmax(max(9.5rem,100%/var(--columns) - 1rem),1fr))}
@media print{html{font-size:10pt}body{max-width:none;padding:0}nav{display:none}a{color:inherit}
h2,p:has(+figure){break-after:avoid}figure,.table,tr,pre{break-inside:avoid}figure,.table,pre{overflow:visible}
.listing{break-inside:auto}.listing td code{font-size:.6rem}.table table{font-size:.85rem}.table th,.table td{padding-left:.7rem}.table tr>:first-child{padding-left:.2rem}figure .chart{max-width:27rem}figure .system{max-width:30rem}
figure,.table{margin:1.1rem 0}
pre{white-space:pre-wrap}svg{print-color-adjust:exact;-webkit-print-color-adjust:exact}}
";

/// Style sheet of the charts.
const CHART_STYLE: &str = "\
.chart{display:block;width:100%;max-width:44rem;height:auto;overflow:visible}
.chart text{font-size:13px;fill:var(--soft)}
.chart .title{font-size:15px;font-weight:600;fill:var(--ink)}
.chart .label{fill:var(--ink)}
.chart path{fill:none;stroke-linecap:round;stroke-linejoin:round}
.chart .grid{stroke:var(--grid)}
.chart .axis{stroke:var(--soft)}
.chart .reference{stroke:var(--ink);stroke-width:1;stroke-opacity:.65}
.chart .line{stroke:currentColor;stroke-width:2.2}
.chart .thin{stroke:currentColor;stroke-width:1.5}
.chart path.markers{fill:currentColor}
.chart .s1{color:var(--series-1)}.chart .s2{color:var(--series-2)}.chart .s3{color:var(--series-3)}
.chart .s4{color:var(--series-4)}.chart .s5{color:var(--series-5)}.chart .s6{color:var(--series-6)}
";

impl Page {
    /// The page as one self-contained file.
    pub fn html(&self) -> String {
        let title = escape(&self.title);
        let contents: String = (self.sections.iter())
            .map(|s| format!("<li><a href=\"#{}\">{}</a></li>\n", escape(&s.id), escape(&s.heading)))
            .collect();
        let contents = match contents.as_str() {
            "" => contents,
            _ => format!("<nav aria-label=\"Contents\">\n<h2>Contents</h2>\n<ol>\n{contents}</ol>\n</nav>\n"),
        };
        let sections: String = (self.sections.iter())
            .map(|Section { id, heading, body }| {
                let (id, heading) = (escape(id), escape(heading));
                format!("<section id=\"{id}\">\n<h2>{heading}</h2>\n{body}</section>\n")
            })
            .collect();
        let (chart, picture) = (CHART_STYLE, PICTURE_STYLE);
        let body = numbered(
            &numbered(&format!("{}{contents}{sections}", self.intro), "<figcaption>", "Figure"),
            "<caption>",
            "Table",
        );
        format!(
            "<!DOCTYPE html>\n<html lang=\"en\">\n<head>\n<meta charset=\"utf-8\">\n\
             <meta name=\"viewport\" content=\"width=device-width, initial-scale=1\">\n\
             <title>{title}</title>\n<style>\n{PAGE_STYLE}{chart}{picture}{SYSTEM_STYLE}</style>\n</head>\n\
             <body>\n<main>\n<h1>{title}</h1>\n{body}</main>\n</body>\n</html>\n"
        )
    }
}

/// Html with a name and a number, from 1, behind each of its opening tags of a kind.
fn numbered(html: &str, tag: &str, name: &str) -> String {
    let mut pieces = html.split(tag);
    let first = pieces.next().unwrap_or_default().to_owned();
    pieces
        .enumerate()
        .fold(first, |page, (at, piece)| format!("{page}{tag}<b>{name} {}.</b> {piece}", at + 1))
}

/// A table of plain texts; the first column is on the left and names its row.
pub fn table(caption: &str, head: &[&str], rows: &[Vec<String>]) -> String {
    let head: String = head.iter().map(|cell| format!("<th scope=\"col\">{}</th>", escape(cell))).collect();
    let mut body = String::new();
    for row in rows {
        body.push_str("<tr>");
        for (column, cell) in row.iter().enumerate() {
            // Short cells, numbers with their powers above all, stay on one line.
            let is_short = cell.chars().count() <= 26;
            let cell = if is_short { escape(cell).replace(' ', "\u{a0}") } else { escape(cell) };
            body.push_str(&match column {
                0 => format!("<th scope=\"row\">{cell}</th>"),
                _ => format!("<td>{cell}</td>"),
            });
        }
        body.push_str("</tr>\n");
    }
    let caption = escape(caption);
    format!(
        "<div class=\"table\"><table>\n<caption>{caption}</caption>\n<thead><tr>{head}</tr></thead>\n\
         <tbody>\n{body}</tbody>\n</table></div>\n"
    )
}

/// A table of texts: the first column links to an anchor for each row, the third is a verdict with its reason behind a colon, the last is a command.
pub fn listing(caption: &str, head: [&str; 5], rows: &[[String; 5]], anchors: &[&str]) -> String {
    let head = head.map(|cell| format!("<th scope=\"col\">{}</th>", escape(cell))).concat();
    let mut body = String::new();
    for (cells, anchor) in rows.iter().zip(anchors) {
        let [place, says, verdict, found, command] = cells.each_ref().map(|cell| escape(cell));
        let section = escape(anchor);
        let (verdict, why) = verdict.split_once(':').unwrap_or((&verdict, ""));
        body += &format!(
            "<tr><th scope=\"row\"><a href=\"#{section}\">{place}</a></th><td>{says}</td><td class=\"verdict\"><b>{verdict}</b>:{why}</td><td>{found}</td><td><code>{command}</code></td></tr>\n"
        );
    }
    let caption = escape(caption);
    format!(
        "<div class=\"table listing\"><table>\n<caption>{caption}</caption>\n<thead><tr>{head}</tr></thead>\n\
         <tbody>\n{body}</tbody>\n</table></div>\n"
    )
}

/// A PNG within the page, over its caption; for a gallery.
pub fn image(png: &[u8], caption: &str) -> String {
    let caption = escape(caption);
    format!(
        "<div class=\"image\"><img alt=\"{caption}\" src=\"data:image/png;base64,{}\"/>{caption}</div>\n",
        STANDARD.encode(png)
    )
}

/// Html, such as a chart, over its caption.
pub fn figure(html: &str, caption: &str) -> String {
    format!("<figure>\n{html}<figcaption>{}</figcaption>\n</figure>\n", escape(caption))
}

/// Small pictures in rows of at most four, over their key (html, such as a colour bar; may be empty) and one
/// caption.
pub fn gallery(pictures: &[String], key: &str, caption: &str) -> String {
    // Rows without a gap at the end where that is possible.
    let columns = [4, 3].into_iter().find(|columns| pictures.len().is_multiple_of(*columns)).unwrap_or(4);
    let pictures = pictures.concat();
    figure(
        &format!("<div class=\"gallery\" style=\"--columns:{columns}\">\n{pictures}</div>\n{key}"),
        caption,
    )
}

/// A paragraph of plain text.
pub fn paragraph(text: &str) -> String {
    format!("<p>{}</p>\n", escape(text))
}

/// Lines to be typed or read as they are.
pub fn code(text: &str) -> String {
    format!("<pre><code>{}</code></pre>\n", escape(text))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::html::tests::assert_well_formed;
    fn page() -> Page {
        let body = [
            paragraph("1 < 2"),
            table("Table 1. a & b", &["property", "<paper>"], &[vec!["\"x\"".into(), "<1".into()]]),
            gallery(&["<svg></svg>\n".into(), image(b"\x89PNG", "0 s: \"let\" go")], "", "Figure 1."),
            listing(
                "a < b",
                ["", "a", "verdict", "b", "c"],
                &[["what", "1", "holds: 1 < 3", "<2", "palpate"].map(String::from)],
                &["one"],
            ),
            code("palpate reproduce -o <dir>"),
        ];
        let section = Section { id: "one".into(), heading: "One & two".into(), body: body.concat() };
        Page { title: "A <b>".into(), intro: paragraph("intro"), sections: vec![section] }
    }

    #[test]
    fn page_is_well_formed_and_the_same_every_time() {
        let html = page().html();
        // A style sheet may hold >, which is no tag's end.
        let (before, rest) = html.split_once("<style>").expect("as it was drawn");
        let (_, after) = rest.split_once("</style>").expect("as it was drawn");
        assert_well_formed(&format!("{before}{after}"));
        assert_eq!(html, page().html());
    }

    #[test]
    fn page_loads_nothing_and_runs_nothing() {
        // Pictures are in the page itself.
        let html = page().html().replace("src=\"data:image/png;base64,", "");
        assert!(
            ["http", "url(", "@import", "<script", "src=", "<link"].iter().all(|word| !html.contains(word))
        );
    }

    #[test]
    fn texts_are_escaped() {
        assert_eq!(escape("<a href=\"b\">&'\u{0}\n"), "&lt;a href=&quot;b&quot;&gt;&amp;&#39;\n");
        let html = page().html();
        assert!(html.contains("<title>A &lt;b&gt;</title>") && html.contains("<td>&lt;1</td>"));
        assert!(html.contains("<th scope=\"row\">&quot;x&quot;</th>") && html.contains("&lt;dir&gt;"));
    }

    #[test]
    fn contents_link_to_sections() {
        let html = page().html();
        assert!(html.contains("<a href=\"#one\">One &amp; two</a>") && html.contains("<section id=\"one\">"));
        assert!(!Page { sections: Vec::new(), ..page() }.html().contains("<nav"));
    }
}
