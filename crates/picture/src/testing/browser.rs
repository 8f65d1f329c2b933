//! Asks Chromium about pictures and pages, if Chromium is installed.

use std::fmt::Write as _;
use std::path::Path;
use std::process::{Command, Stdio};

use super::{TextBox, misplaced};

/// Colour scheme preferred by the reader of a document.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Scheme {
    /// Dark letters on a light background.
    Light,
    /// Light letters on a dark background.
    Dark,
}

/// Script that writes the place of each text of each picture, in the picture's units, as lines of numbers and a text.
const PLACES: &str = "let lines=[];for(const [n,svg] of [...document.querySelectorAll('svg.cohaptic-picture')].entries()){\
    const o=svg.getBoundingClientRect(),v=svg.viewBox.baseVal,k=v.width/o.width;for(const t of svg.querySelectorAll('text')){const b=t.getBoundingClientRect();\
    lines.push([n,(b.left-o.left)*k,(b.top-o.top)*k,(b.right-o.left)*k,(b.bottom-o.top)*k,v.width,v.height].map(x=>x.toFixed(3)).join(' ')+' '+\
    encodeURIComponent(t.textContent))}}";

/// Script that writes the colours of each class of each element, each once.
const COLOURS: &str = "let lines=[...new Set([...document.querySelectorAll('[class],body')].map(e=>{const s=getComputedStyle(e);\
    return [e.tagName.toLowerCase()+'.'+(e.getAttribute('class')||''),s.fill,s.stroke,s.color,s.backgroundColor].join('|')}))];";

/// Script that writes by how much the page is wider than the window \[px\], first of a laptop, then of a phone of 390 px. No window of the browser is as narrow
/// as a phone, but a body of this width is laid out alike.
const WIDTH: &str = "lines.push('WIDER '+(document.documentElement.scrollWidth-document.documentElement.clientWidth));\
    document.body.style.width='390px';lines.push('WIDER '+(document.body.scrollWidth-390));";

/// Script that writes by how much the widest table or picture is cut off on a sheet of A4 with the margins of a browser \[px\]. The style for paper is made
/// the style for all media, because a browser that prints does not answer.
const PAPER: &str = "for(const r of document.styleSheets[0].cssRules)if(r.media&&r.media.mediaText==='print')r.media.mediaText='all';\
    document.body.style.width='';document.documentElement.style.width='718px';\
    lines.push('CUT '+Math.max(0,...[...document.querySelectorAll('.wide')].map(e=>e.scrollWidth-e.clientWidth)));";

/// Returns the misplaced texts of named pictures, as [`misplaced`] does, with the boxes measured by a browser. Returns `None` without a `chromium` on the path.
///
/// The page and the browser's data are written into `folder`, which the caller must remove.
///
/// # Panics
///
/// If the browser does not start or does not answer.
#[must_use]
pub fn in_browser(folder: &Path, pictures: &[(String, String)]) -> Option<Vec<String>> {
    let svgs: Vec<&str> = pictures.iter().map(|(_, svg)| svg.as_str()).collect();
    let lines = answer(folder, &format!("<!doctype html><meta charset=\"utf-8\"><body>{}", svgs.join("\n")), Scheme::Light, PLACES)?;
    let expected: Vec<(&str, usize)> = pictures.iter().map(|(name, svg)| (name.as_str(), svg.matches("<text ").count())).collect();
    Some(placed(&lines, &expected))
}

/// Returns the faults of a page in a browser: misplaced texts of its pictures, a page that is wider than the window of a laptop or of a phone, and tables or
/// pictures cut off on paper. Returns `None` without a `chromium` on the path; see [`in_browser`].
///
/// # Panics
///
/// As [`in_browser`].
#[must_use]
pub fn page_in_browser(folder: &Path, page: &str) -> Option<Vec<String>> {
    let mut lines = answer(folder, page, Scheme::Light, &format!("{PLACES}{WIDTH}{PAPER}"))?;
    let mut last = |prefix: &str| lines.pop().and_then(|line| line.strip_prefix(prefix)?.parse::<i32>().ok());
    // The last line is popped first.
    let (cut, phone, laptop) = (last("CUT "), last("WIDER "), last("WIDER "));
    let pictures: Vec<&str> = page.split("<svg ").skip(1).collect();
    let names: Vec<String> = (1..=pictures.len()).map(|number| format!("picture {number}")).collect();
    let expected: Vec<(&str, usize)> = names.iter().map(String::as_str).zip(pictures.iter().map(|svg| svg.matches("<text ").count())).collect();
    let mut faults = placed(&lines, &expected);
    for (window, by) in [("phone", phone), ("laptop", laptop)] {
        faults.extend((by != Some(0)).then(|| format!("the page is wider than the window of a {window} by {by:?} px")));
    }
    faults.extend((cut != Some(0)).then(|| format!("a table or picture is cut off on paper by {cut:?} px")));
    Some(faults)
}

/// Returns the colours used by a browser for each kind of element of a document (`path.line s0|fill|stroke|color|background`), for a reader with the given
/// scheme. Returns `None` without a `chromium` on the path; see [`in_browser`].
///
/// # Panics
///
/// As [`in_browser`].
#[must_use]
pub fn computed_colours(folder: &Path, document: &str, scheme: Scheme) -> Option<Vec<String>> {
    answer(folder, document, scheme, COLOURS)
}

/// Parses the places of texts of several pictures, with known names and numbers of texts, and returns the faults as sentences.
fn placed(lines: &[String], expected: &[(&str, usize)]) -> Vec<String> {
    let rows: Vec<(Vec<f64>, &str)> =
        lines.iter().map(|line| (line.split(' ').take(7).filter_map(|word| word.parse().ok()).collect(), line.as_str())).collect();
    let mut faults = Vec::new();
    for (number, (name, texts)) in expected.iter().enumerate() {
        let own: Vec<_> = rows.iter().filter(|(row, _)| row.len() == 7 && (row[0] - crate::extent::count(number)).abs() < 0.5).collect();
        if own.len() != *texts {
            faults.push(format!("{name}: the browser shows {} of {texts} texts", own.len()));
        }
        let texts: Vec<TextBox> = own
            .iter()
            .map(|(row, line)| TextBox { text: line.rsplit(' ').next().unwrap_or_default().to_owned(), sides: [row[1], row[2], row[3], row[4]] })
            .collect();
        let size = own.first().map_or((0.0, 0.0), |(row, _)| (row[5], row[6]));
        faults.extend(misplaced(&texts, size).into_iter().map(|fault| format!("{name}: {fault}")));
    }
    faults
}

/// Opens a page in the browser, runs `script`, and returns the lines collected by the script in `lines`.
fn answer(folder: &Path, page: &str, scheme: Scheme, script: &str) -> Option<Vec<String>> {
    let found = Command::new("chromium").arg("--version").stdout(Stdio::null()).stderr(Stdio::null()).status().is_ok_and(|status| status.success());
    if !found {
        return None;
    }
    let mut page = page.to_owned();
    let _ = write!(
        page,
        "<pre id=\"answer\"></pre><script>{script}document.getElementById('answer').textContent='BEGIN\\n'+lines.join('\\n')+'\\nEND'</script>"
    );
    let file = folder.join("page.html");
    std::fs::write(&file, page).expect("the page can be written");
    // Chromium's setting is 0 for dark and 1 for light.
    let preferred = if scheme == Scheme::Dark { 0 } else { 1 };
    let output = Command::new("chromium")
        .args(["--headless", "--no-sandbox", "--disable-gpu", "--no-first-run", "--disable-background-networking", "--disable-component-update"])
        .args(["--disable-sync", "--window-size=1280,900", "--dump-dom"])
        .arg(format!("--blink-settings=preferredColorScheme={preferred}"))
        .arg(format!("--user-data-dir={}", folder.join("browser").display()))
        .arg(format!("file://{}", file.display()))
        .stderr(Stdio::null())
        .output()
        .expect("the browser starts");
    let text = String::from_utf8_lossy(&output.stdout);
    let answer = text.split_once("BEGIN\n").and_then(|(_, rest)| rest.split_once("\nEND")).expect("the browser has run the script").0;
    Some(answer.lines().map(str::to_owned).collect())
}
