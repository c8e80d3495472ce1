//! Module tree of one compilation target, and what its modules import from each other.

use super::imports::{Import, Source, read};
use std::collections::BTreeMap;
use std::fs;
use std::path::{Path, PathBuf};

/// Path of a module from the root of its target.
pub(super) type ModulePath = Vec<String>;

/// Import of one module by another, with the place that makes it.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(super) struct Edge {
    pub(super) from: ModulePath,
    pub(super) to: ModulePath,
    pub(super) file: PathBuf,
    pub(super) line: usize,
}

/// Modules of a target with what they import.
#[derive(Debug, Default)]
pub(super) struct Tree {
    modules: BTreeMap<ModulePath, Vec<(PathBuf, Import)>>,
}

/// Re-exports that lead to re-exports, at most.
const MAX_ALIASES: usize = 8;

impl Tree {
    /// From the root file of a target (`lib.rs`, `main.rs`, …).
    ///
    /// # Errors
    /// When a file can't be read.
    pub(super) fn of(root: &Path) -> Result<Self, String> {
        let mut tree = Self::default();
        tree.take_file(root, Vec::new(), &parent(root))?;
        Ok(tree)
    }

    /// Take in a file of a module, whose child modules lie in a folder.
    fn take_file(&mut self, file: &Path, module: ModulePath, folder: &Path) -> Result<(), String> {
        let text = fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))?;
        let Source { files, inline, imports } = read(&text);
        let nested = |within: &[String]| [&module[..], within].concat();
        self.modules.entry(module.clone()).or_default();
        for within in &inline {
            self.modules.entry(nested(within)).or_default();
        }
        for import in imports {
            let own = self.modules.entry(nested(&import.within)).or_default();
            own.push((file.to_path_buf(), import));
        }
        for (within, name) in files {
            let folder = within.iter().fold(folder.to_path_buf(), |folder, name| folder.join(name));
            let flat = folder.join(format!("{name}.rs"));
            let file = if flat.is_file() { flat } else { folder.join(&name).join("mod.rs") };
            // Generated at build time, or elsewhere by an attribute: no file of this tree.
            if file.is_file() {
                self.take_file(&file, [nested(&within), vec![name.clone()]].concat(), &folder.join(&name))?;
            }
        }
        Ok(())
    }

    /// Imports between modules of the target. A module that re-exports what its own children hold does not import them.
    pub(super) fn edges(&self) -> Vec<Edge> {
        let mut edges = Vec::new();
        for (from, imports) in &self.modules {
            for (file, import) in imports {
                let Some(to) = self.resolve(from, import, 0) else { continue };
                let is_door = import.is_public && to.starts_with(from);
                if to != *from && !is_door {
                    edges.push(Edge { from: from.clone(), to, file: file.clone(), line: import.line });
                }
            }
        }
        edges
    }

    /// The module that holds what a module imports; none where that is another crate, or a name that `use` brought in.
    fn resolve(&self, from: &[String], import: &Import, aliases: usize) -> Option<ModulePath> {
        let mut segments = import.path.iter();
        let first = segments.next()?;
        let mut module = match first.as_str() {
            "crate" => Vec::new(),
            "self" => from.to_vec(),
            "super" => parent_module(from)?,
            name => {
                let child = [from, &[name.to_string()]].concat();
                self.modules.contains_key(&child).then_some(child)?
            }
        };
        while let Some(segment) = segments.next() {
            if segment == "super" {
                module = parent_module(&module)?;
                continue;
            }
            let child = [&module[..], std::slice::from_ref(segment)].concat();
            if self.modules.contains_key(&child) {
                module = child;
                continue;
            }
            // A name that the module has from elsewhere stands for its origin.
            let has_it =
                |(_, other): &&(PathBuf, Import)| other.is_use && other.name.as_ref() == Some(segment);
            let origin = self.modules[&module].iter().find(has_it);
            let rest: Vec<String> = segments.cloned().collect();
            return match origin {
                Some((_, origin)) if aliases < MAX_ALIASES => {
                    let path = [&origin.path[..], &rest].concat();
                    self.resolve(&module, &Import { path, ..origin.clone() }, aliases + 1)
                }
                _ => Some(module),
            };
        }
        Some(module)
    }
}

fn parent(file: &Path) -> PathBuf {
    file.parent().map(Path::to_path_buf).unwrap_or_default()
}

fn parent_module(module: &[String]) -> Option<ModulePath> {
    module.split_last().map(|(_, above)| above.to_vec())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A tree of files, written for a test.
    fn edges_of(files: &[(&str, &str)]) -> Vec<(String, String, usize)> {
        let folder = tempfile::tempdir().expect("a folder");
        for (name, text) in files {
            let file = folder.path().join(name);
            fs::create_dir_all(parent(&file)).expect("a folder");
            fs::write(file, text).expect("a file");
        }
        let tree = Tree::of(&folder.path().join("lib.rs")).expect("a tree");
        tree.edges().into_iter().map(|e| (e.from.join("::"), e.to.join("::"), e.line)).collect()
    }

    fn edge(from: &str, to: &str, line: usize) -> (String, String, usize) {
        (from.into(), to.into(), line)
    }

    #[test]
    fn imports_are_followed_through_re_exports_and_doors_do_not_count() {
        let edges = edges_of(&[
            ("lib.rs", "mod a;\nmod b;\npub use a::A;\npub use b::C;"),
            ("a.rs", "use crate::b::C;\nuse std::fmt;\nfn f() { crate::b::deep::g(); }"),
            ("b/mod.rs", "mod deep;\npub(crate) use deep::C;\nuse super::A;"),
            (
                "b/deep.rs",
                "use super::super::a::B;\nuse super::D;\nfn h() { self::i::j() }\nmod i { use super::k; }",
            ),
        ]);
        let expected = [
            edge("a", "b::deep", 1),
            edge("a", "b::deep", 3),
            edge("b", "a", 3),
            edge("b::deep", "a", 1),
            edge("b::deep", "b", 2),
            edge("b::deep", "b::deep::i", 3),
            edge("b::deep::i", "b::deep", 4),
        ];
        assert_eq!(edges, expected);
    }
}
