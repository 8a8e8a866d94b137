//! The imports between the files of a crate, read from its source.

use std::collections::{BTreeMap, BTreeSet};
use std::path::{Path, PathBuf};
use syn::visit::Visit;

/// The workspace's root folder.
pub fn workspace_root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).parent().unwrap().to_owned()
}

/// Path of a module from the crate's root; empty: the root.
type ModulePath = Vec<String>;

/// A name that a module takes from elsewhere by `use`.
struct Taken {
    /// The name in this module.
    alias: String,
    /// Where it points to, as written.
    path: Vec<String>,
    /// `pub use`: a re-export.
    is_public: bool,
}

/// One module: a file, or an inline `mod` within one.
struct Module {
    /// Index of its file.
    file: usize,
    /// Modules declared in it.
    children: BTreeSet<String>,
    /// Its `use` declarations.
    taken: Vec<Taken>,
    /// Paths that its items contain, as written.
    paths: BTreeSet<Vec<String>>,
}

/// The files of a crate and the imports between them.
pub struct Crate {
    root: PathBuf,
    files: Vec<PathBuf>,
    modules: BTreeMap<ModulePath, Module>,
    /// For each import, the names imported.
    imports: BTreeMap<(usize, usize), BTreeSet<String>>,
    /// The same for what modules take from their own submodules.
    from_own: BTreeMap<(usize, usize), BTreeSet<String>>,
}

impl Crate {
    /// Reads a crate from its root file and follows its `mod` declarations; test modules are left out.
    ///
    /// # Errors
    /// A file cannot be read or parsed.
    pub fn read(root_file: &Path) -> Result<Self, String> {
        let root = root_file.parent().ok_or("no folder")?.to_owned();
        let mut source = Self { root, files: Vec::new(), modules: BTreeMap::new(), imports: BTreeMap::new(), from_own: BTreeMap::new() };
        source.read_file(root_file, Vec::new())?;
        source.resolve();
        Ok(source)
    }

    /// Number of files.
    pub fn file_count(&self) -> usize {
        self.files.len()
    }

    /// A file's path within the source folder.
    pub fn name(&self, file: usize) -> String {
        self.files[file].strip_prefix(&self.root).unwrap_or(&self.files[file]).display().to_string()
    }

    /// The first folder (or file without its ending) of a file's path within `folder` of the source, which ends with a slash or is empty;
    /// `None` for a file outside, and for the root file of the folder.
    pub fn top_folder(&self, folder: &str, file: usize) -> Option<String> {
        let name = self.name(file);
        let first = name.strip_prefix(folder)?.split('/').next().unwrap_or_default();
        let is_root = ["lib.rs", "main.rs", "mod.rs"].contains(&first);
        (!is_root).then(|| first.trim_end_matches(".rs").to_owned())
    }

    /// Each import once, also of what a module takes from its own submodules.
    pub fn imports_and_own(&self) -> Vec<(usize, usize)> {
        self.imports.keys().chain(self.from_own.keys()).copied().collect()
    }

    /// Each import once: the file that imports and the file that defines.
    pub fn imports(&self) -> Vec<(usize, usize)> {
        self.imports.keys().copied().collect()
    }

    /// The names that one file imports from another.
    pub fn names_imported(&self, from: usize, to: usize) -> Vec<String> {
        self.imports.get(&(from, to)).into_iter().flatten().cloned().collect()
    }

    fn read_file(&mut self, file: &Path, module: ModulePath) -> Result<(), String> {
        let text = std::fs::read_to_string(file).map_err(|error| format!("{}: {error}", file.display()))?;
        let parsed = syn::parse_file(&text).map_err(|error| format!("{}: {error}", file.display()))?;
        self.files.push(file.to_owned());
        let index = self.files.len() - 1;
        let is_root_of_folder = ["lib.rs", "main.rs", "mod.rs"].iter().any(|name| file.ends_with(name));
        let folder = if is_root_of_folder { file.parent().map(Path::to_owned) } else { Some(file.with_extension("")) };
        self.read_items(&parsed.items, module, index, &folder.ok_or("no folder")?)
    }

    fn read_items(&mut self, items: &[syn::Item], module: ModulePath, file: usize, folder: &Path) -> Result<(), String> {
        let mut found = Module { file, children: BTreeSet::new(), taken: Vec::new(), paths: BTreeSet::new() };
        let mut below = Vec::new();
        for item in items {
            match item {
                syn::Item::Mod(inner) if !is_test(&inner.attrs) => {
                    found.children.insert(inner.ident.to_string());
                    below.push(inner);
                }
                syn::Item::Use(declaration) if !is_test(&declaration.attrs) => {
                    let is_public = !matches!(declaration.vis, syn::Visibility::Inherited);
                    flatten(&declaration.tree, &mut Vec::new(), is_public, &mut found.taken);
                }
                syn::Item::Macro(call) => macro_modules(call, &mut found.children),
                syn::Item::Mod(_) | syn::Item::Use(_) => {}
                other => Paths(&mut found.paths).visit_item(other),
            }
        }
        let by_macro: Vec<String> =
            found.children.iter().filter(|name| !below.iter().any(|inner| inner.ident == name.as_str())).cloned().collect();
        self.modules.insert(module.clone(), found);
        let child = |name: &str| [module.clone(), vec![name.to_owned()]].concat();
        for inner in below {
            let name = inner.ident.to_string();
            match &inner.content {
                Some((_, items)) => self.read_items(items, child(&name), file, &folder.join(&name))?,
                None => self.read_file(&file_of(folder, &name), child(&name))?,
            }
        }
        for name in by_macro {
            self.read_file(&file_of(folder, &name), child(&name))?;
        }
        Ok(())
    }

    /// Works out the imports of all modules.
    fn resolve(&mut self) {
        let mut imports: BTreeMap<(usize, usize), BTreeSet<String>> = BTreeMap::new();
        let mut from_own = imports.clone();
        for (path, module) in &self.modules {
            let used: BTreeSet<&str> = module.paths.iter().filter_map(|p| p.first()).map(String::as_str).collect();
            let taken =
                module.taken.iter().filter(|taken| !taken.is_public || used.contains(taken.alias.as_str())).map(|taken| &taken.path);
            for written in taken.chain(&module.paths) {
                if let Some((defined_in, file)) = self.definition(path, written, 0)
                    && file != module.file
                {
                    let is_own = defined_in.len() > path.len() && defined_in.starts_with(path);
                    let list = if is_own { &mut from_own } else { &mut imports };
                    list.entry((module.file, file)).or_default().insert(written.join("::"));
                }
            }
        }
        (self.imports, self.from_own) = (imports, from_own);
    }

    /// The module and the file that define what a path, written in a module, names; `None`: not of this crate.
    fn definition(&self, module: &[String], written: &[String], depth: usize) -> Option<(ModulePath, usize)> {
        if depth > 20 {
            return None;
        }
        let mut at: ModulePath;
        let mut rest = written;
        match written.first()?.as_str() {
            "crate" => {
                at = Vec::new();
                rest = &rest[1..];
            }
            "self" => {
                at = module.to_vec();
                rest = &rest[1..];
            }
            "super" => {
                at = module.to_vec();
                while rest.first().is_some_and(|segment| segment == "super") {
                    at.pop()?;
                    rest = &rest[1..];
                }
            }
            first => {
                let here = self.modules.get(module)?;
                at = module.to_vec();
                // A path that begins with a name of this module: a child, or a module taken by `use`.
                if !here.children.contains(first) {
                    let taken =
                        here.taken.iter().find(|taken| taken.alias == first && taken.path.first().is_none_or(|begin| begin != first))?;
                    let whole = [taken.path.clone(), rest[1..].to_vec()].concat();
                    return self.definition(module, &whole, depth + 1);
                }
            }
        }
        for (place, segment) in rest.iter().enumerate() {
            let here = self.modules.get(&at)?;
            if here.children.contains(segment) {
                at.push(segment.clone());
                continue;
            }
            if let Some(taken) = here.taken.iter().find(|taken| &taken.alias == segment) {
                let whole = [taken.path.clone(), rest[place + 1..].to_vec()].concat();
                return self.definition(&at, &whole, depth + 1);
            }
            break;
        }
        let file = self.modules.get(&at)?.file;
        Some((at, file))
    }
}

/// The file of a module declared without a body.
fn file_of(folder: &Path, name: &str) -> PathBuf {
    let single = folder.join(format!("{name}.rs"));
    if single.is_file() { single } else { folder.join(name).join("mod.rs") }
}

/// Whether an item is compiled for tests alone.
fn is_test(attributes: &[syn::Attribute]) -> bool {
    attributes.iter().any(|attribute| {
        attribute.path().is_ident("cfg") && matches!(&attribute.meta, syn::Meta::List(list) if list.tokens.to_string().starts_with("test"))
    })
}

/// The modules that the call of a `catalogue!` macro declares: each `module::Type` of its list.
fn macro_modules(call: &syn::ItemMacro, children: &mut BTreeSet<String>) {
    if call.mac.path.is_ident("catalogue") {
        for entry in call.mac.tokens.to_string().split(',') {
            if let Some((module, _)) = entry.split_once("::") {
                children.insert(module.trim().to_owned());
            }
        }
    }
}

/// The single names of a `use` tree; a glob stands for its module.
fn flatten(tree: &syn::UseTree, path: &mut Vec<String>, is_public: bool, found: &mut Vec<Taken>) {
    match tree {
        syn::UseTree::Path(part) => {
            path.push(part.ident.to_string());
            flatten(&part.tree, path, is_public, found);
            path.pop();
        }
        syn::UseTree::Group(group) => group.items.iter().for_each(|tree| flatten(tree, path, is_public, found)),
        syn::UseTree::Glob(_) => found.push(Taken { alias: "*".to_owned(), path: path.clone(), is_public }),
        syn::UseTree::Name(name) => {
            let ident = name.ident.to_string();
            let is_self = ident == "self";
            let alias = if is_self { path.last().cloned().unwrap_or_default() } else { ident.clone() };
            let whole = if is_self { path.clone() } else { [path.clone(), vec![ident]].concat() };
            found.push(Taken { alias, path: whole, is_public });
        }
        syn::UseTree::Rename(rename) => {
            let whole = [path.clone(), vec![rename.ident.to_string()]].concat();
            found.push(Taken { alias: rename.rename.to_string(), path: whole, is_public });
        }
    }
}

/// Collects the paths of items.
struct Paths<'a>(&'a mut BTreeSet<Vec<String>>);

impl<'ast> Visit<'ast> for Paths<'_> {
    fn visit_path(&mut self, path: &'ast syn::Path) {
        self.0.insert(path.segments.iter().map(|segment| segment.ident.to_string()).collect());
        syn::visit::visit_path(self, path);
    }

    fn visit_visibility(&mut self, _: &'ast syn::Visibility) {
        // The path of `pub(super)` or `pub(in …)` imports nothing.
    }

    fn visit_macro(&mut self, call: &'ast syn::Macro) {
        // Arguments of format-like macros are expressions; others are not read.
        let arguments = call.parse_body_with(syn::punctuated::Punctuated::<syn::Expr, syn::Token![,]>::parse_terminated);
        arguments.into_iter().flatten().collect::<Vec<_>>().iter().for_each(|argument| self.0.extend(paths_of(argument)));
        syn::visit::visit_macro(self, call);
    }

    fn visit_item_mod(&mut self, inner: &'ast syn::ItemMod) {
        if !is_test(&inner.attrs) {
            syn::visit::visit_item_mod(self, inner);
        }
    }
}

/// The paths of an expression.
fn paths_of(expression: &syn::Expr) -> BTreeSet<Vec<String>> {
    let mut found = BTreeSet::new();
    Paths(&mut found).visit_expr(expression);
    found
}
