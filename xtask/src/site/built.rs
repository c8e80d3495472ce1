//! Check of a built site: every address within it leads to a file, and every anchor to an element.

use regex::Regex;
use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

/// Pages that are not read: all others again, for printing; and the one for missing pages, whose addresses begin at the root of a server.
const NOT_READ: &[&str] = &["print.html", "404.html"];

/// Addresses of the book's pages that lead nowhere, and the number of addresses. Pages of `api` are rustdoc's.
///
/// # Errors
/// When a page can't be read.
pub fn check(site: &Path) -> Result<(Vec<String>, usize), String> {
    let address = Regex::new(r#"(?:href|src)="([^"]*)""#).map_err(|error| error.to_string())?;
    let mut pages = Vec::new();
    collect(site, &mut pages)?;
    let mut ids: BTreeMap<PathBuf, BTreeSet<String>> = BTreeMap::new();
    let (mut found, mut count) = (Vec::new(), 0);
    for page in &pages {
        let shown = page.strip_prefix(site).unwrap_or(page).display().to_string();
        if NOT_READ.contains(&shown.as_str()) {
            continue;
        }
        let text = fs::read_to_string(page).map_err(|error| format!("{shown}: {error}"))?;
        let folder = page.parent().unwrap_or(site);
        for target in address.captures_iter(&text).filter_map(|found| found.get(1)) {
            let target = target.as_str().replace("&amp;", "&");
            if target.is_empty() || target.contains(':') {
                continue;
            }
            count += 1;
            let (path, anchor) = target.split_once('#').unwrap_or((&target, ""));
            let file = if path.is_empty() { page.clone() } else { folder.join(path) };
            if !file.is_file() {
                found.push(format!("{shown}: {target}: there is no such file"));
            } else if !anchor.is_empty() {
                if !ids.contains_key(&file) {
                    ids.insert(file.clone(), ids_of(&file)?);
                }
                if ids.get(&file).is_some_and(|ids| !ids.contains(anchor)) {
                    found.push(format!("{shown}: {target}: there is no such anchor"));
                }
            }
        }
    }
    Ok((found, count))
}

/// Pages of the book below a folder.
fn collect(folder: &Path, pages: &mut Vec<PathBuf>) -> Result<(), String> {
    let entries = fs::read_dir(folder).map_err(|error| format!("{}: {error}", folder.display()))?;
    for path in entries.flatten().map(|entry| entry.path()) {
        if path.is_dir() && path.file_name().is_some_and(|name| name != "api" && name != "files") {
            collect(&path, pages)?;
        } else if path.extension().is_some_and(|ending| ending == "html") {
            pages.push(path);
        }
    }
    Ok(())
}

fn ids_of(page: &Path) -> Result<BTreeSet<String>, String> {
    let text = fs::read_to_string(page).map_err(|error| format!("{}: {error}", page.display()))?;
    let ids = text.split(" id=\"").skip(1).filter_map(|rest| rest.split_once('"'));
    Ok(ids.map(|(id, _)| id.to_string()).collect())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn addresses_that_lead_nowhere_are_told() {
        let folder = tempfile::tempdir().expect("a folder");
        let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).expect("a file");
        write(
            "a.html",
            r##"<a href="b.html#x"> <a href="b.html#y"> <img src="p.png"> <a href="https://a.b"> <a href="#z">"##,
        );
        write("b.html", r#"<h1 id="x">"#);
        let (found, count) = check(folder.path()).expect("a site");
        let expected = [
            "a.html: b.html#y: there is no such anchor",
            "a.html: p.png: there is no such file",
            "a.html: #z: there is no such anchor",
        ];
        assert_eq!((found, count), (expected.map(str::to_string).to_vec(), 4));
    }
}
