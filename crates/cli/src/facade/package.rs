//! The generated packages: the real tokio under another name, and the package `tokio` that stands in for it.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::fs;
use std::path::{Path, PathBuf};

use toml::{Table, Value};

use super::sources::Sources;
use super::workspace::Workspace;
use crate::failure::Failure;
use crate::file::{read_text, write_file};

/// Name of the package with the sources of the real tokio.
pub(super) const REAL: &str = "cohaptic-real-tokio";

/// Embeds files of the folder `tokio`.
macro_rules! files {
    ($($path:literal),* $(,)?) => {
        [$(($path, include_str!(concat!("tokio/", $path)))),*]
    };
}

/// Sources of the package that stands in for tokio.
const SOURCES: [(&str, &str); 29] = files![
    "hosted.rs",
    "lib.rs",
    "net/addr.rs",
    "net/descriptors.rs",
    "net/listener.rs",
    "net/lookup.rs",
    "net/mod.rs",
    "net/ready.rs",
    "net/socket.rs",
    "net/stream.rs",
    "net/tcp/mod.rs",
    "net/tcp/owned.rs",
    "net/tcp/split.rs",
    "net/udp.rs",
    "net/udp_options.rs",
    "net/udp_receiving.rs",
    "process.rs",
    "runtime/builder.rs",
    "runtime/handle.rs",
    "runtime/local.rs",
    "runtime/mod.rs",
    "runtime/rt.rs",
    "signal/mod.rs",
    "signal/unix.rs",
    "task/join_set.rs",
    "task/local.rs",
    "task/mod.rs",
    "task/spawn.rs",
    "time.rs",
];

/// Code that is appended to files of the real tokio: what the package needs and the real tokio offers to itself only. The second text must be in the file.
const APPENDED: [(&str, &str, &str); 3] = [
    (
        "net/tcp/stream.rs",
        "fn poll_read_priv(",
        r"
/// Reading and writing through a shared reference, for the package `tokio` of `cohaptic tokio`.
#[doc(hidden)]
#[allow(missing_docs)]
impl TcpStream {
    #[inline]
    pub fn cohaptic_read(&self, cx: &mut Context<'_>, buf: &mut ReadBuf<'_>) -> Poll<io::Result<()>> {
        self.poll_read_priv(cx, buf)
    }

    #[inline]
    pub fn cohaptic_write(&self, cx: &mut Context<'_>, buf: &[u8]) -> Poll<io::Result<usize>> {
        self.poll_write_priv(cx, buf)
    }

    #[inline]
    pub fn cohaptic_write_vectored(&self, cx: &mut Context<'_>, bufs: &[io::IoSlice<'_>]) -> Poll<io::Result<usize>> {
        self.poll_write_vectored_priv(cx, bufs)
    }

    pub fn cohaptic_shut_down(&self) -> io::Result<()> {
        self.shutdown_std(std::net::Shutdown::Write)
    }
}
",
    ),
    (
        "util/rand.rs",
        "fn from_u64(seed: u64)",
        r#"
impl RngSeed {
    #[cfg(feature = "rt")]
    pub(crate) fn cohaptic(seed: u64) -> Self {
        Self::from_u64(seed)
    }
}
"#,
    ),
    (
        "runtime/builder.rs",
        "seed_generator: RngSeedGenerator",
        r"
/// The seed of `select!`, for the package `tokio` of `cohaptic tokio`.
#[doc(hidden)]
#[allow(missing_docs)]
impl Builder {
    pub fn cohaptic_seed(&mut self, seed: u64) -> &mut Self {
        self.seed_generator = RngSeedGenerator::new(RngSeed::cohaptic(seed));
        self
    }
}
",
    ),
];

/// Writes both packages. Returns the folder of the package `tokio`.
pub(super) fn write(workspace: &Workspace, sources: &Sources) -> Result<PathBuf, Failure> {
    let Sources { version, folder: sources } = sources;
    let manifest = sources.join("Cargo.toml");
    let manifest: Table =
        read_text(&manifest)?.parse().map_err(|error| Failure::System(format!("{} cannot be read: {error}", manifest.display())))?;
    write_real(&workspace.folder().join("real-tokio"), version, sources, &manifest)?;
    let package = workspace.folder().join("tokio");
    let mut files = Files::new(&package);
    files.write("Cargo.toml", &standing_in(version, &manifest, &workspace.sockets))?;
    for (path, text) in SOURCES {
        files.write(&format!("src/{path}"), &chosen(text, sources)?)?;
    }
    files.remove_others()?;
    Ok(package)
}

/// Writes the real tokio under its other name.
fn write_real(folder: &Path, version: &str, sources: &Path, manifest: &Table) -> Result<(), Failure> {
    let mut manifest = manifest.clone();
    if let Some(package) = manifest.get_mut("package").and_then(Value::as_table_mut) {
        package.insert("name".to_owned(), Value::String(REAL.to_owned()));
        package.insert("publish".to_owned(), Value::Boolean(false));
        package.remove("readme");
    }
    // Tests of tokio are not copied, and what they need is not wanted.
    for key in ["test", "bench", "example", "dev-dependencies"] {
        manifest.remove(key);
    }
    for target in manifest.get_mut("target").and_then(Value::as_table_mut).into_iter().flat_map(|targets| targets.iter_mut()) {
        target.1.as_table_mut().map(|target| target.remove("dev-dependencies"));
    }
    manifest.insert("workspace".to_owned(), Value::Table(Table::new()));
    let mut files = Files::new(folder);
    files.write("Cargo.toml", &manifest.to_string())?;
    let mut appended = 0;
    for path in list(&sources.join("src"), Path::new(""))? {
        let mut text = read_text(&sources.join("src").join(&path))?;
        for (_, needed, more) in APPENDED.iter().filter(|(name, ..)| *name == path) {
            appended += usize::from(text.contains(needed));
            text += more;
        }
        files.write(&format!("src/{path}"), &text)?;
    }
    if appended < APPENDED.len() {
        let text = format!(
            "tokio {version} is built in another way than the versions that this program knows: expected a newer cohaptic, or an older tokio"
        );
        return Err(Failure::System(text));
    }
    files.remove_others()
}

/// Returns the paths of all files below `folder` with `/` between names, relative to `folder`.
fn list(folder: &Path, below: &Path) -> Result<Vec<String>, Failure> {
    let here = folder.join(below);
    let unread = |error| Failure::File { verb: "read", path: here.clone(), error };
    let mut found = Vec::new();
    for entry in fs::read_dir(&here).map_err(unread)? {
        let entry = entry.map_err(unread)?;
        let path = below.join(entry.file_name());
        if entry.file_type().map_err(unread)?.is_dir() {
            found.append(&mut list(folder, &path)?);
        } else {
            found.push(path.to_string_lossy().replace('\\', "/"));
        }
    }
    Ok(found)
}

/// Returns a source of the package for one version of tokio. A line `//@ has FILE|TEXT` stands before an item that exists only if the file of the real tokio
/// contains the text.
fn chosen(text: &str, sources: &Path) -> Result<String, Failure> {
    let mut chosen = String::new();
    for line in text.lines() {
        match line.trim_start().strip_prefix("//@ has ").and_then(|has| has.split_once('|')) {
            Some((file, needed)) => {
                let path = sources.join("src").join(file);
                if !path.exists() || !read_text(&path)?.contains(needed) {
                    chosen.push_str("#[cfg(any())]\n");
                }
            }
            None => {
                chosen.push_str(line);
                chosen.push('\n');
            }
        }
    }
    Ok(chosen)
}

/// Returns the manifest of the package that stands in: the same version and the same features as the real one.
fn standing_in(version: &str, real: &Table, sockets: &str) -> String {
    let features = real.get("features").and_then(Value::as_table).cloned().unwrap_or_default();
    let parts = |list: &Value| -> Vec<String> { list.as_array().into_iter().flatten().filter_map(Value::as_str).map(str::to_owned).collect() };
    let named: BTreeSet<String> = features.values().flat_map(parts).filter_map(|part| part.strip_prefix("dep:").map(str::to_owned)).collect();
    // An optional dependency is a feature, unless a feature names the dependency with `dep:`.
    let implicit: BTreeSet<String> = optional(real).into_iter().filter(|name| !named.contains(name) && !features.contains_key(name)).collect();
    let mut text = format!(
        "# Generated by `cohaptic tokio`: stands in for tokio in tests. Do not edit.\n[package]\nname = \"tokio\"\nversion = \"{version}\"\nedition = \"2024\"\n\
         license = \"MIT\"\npublish = false\n\n[features]\n"
    );
    let is_feature = |part: &String| features.contains_key(part) || implicit.contains(part);
    // Writing to a string does not fail.
    for (name, list) in &features {
        let mut own = vec![format!("real/{name}")];
        own.extend(parts(list).into_iter().filter(is_feature));
        if name == "io-util" && !implicit.contains("bytes") {
            own.push("dep:bytes".to_owned());
        }
        let _ = writeln!(text, "{} = {own:?}", Value::String(name.clone()));
    }
    for name in &implicit {
        let bytes = if name == "bytes" { ", \"dep:bytes\"" } else { "" };
        let _ = writeln!(text, "{name} = [\"real/{name}\"{bytes}]");
    }
    let _ = write!(
        text,
        "\n[dependencies]\nbytes = {{ version = \"1\", optional = true }}\ncohaptic-sockets = {sockets}\n\
         real = {{ package = \"{REAL}\", path = \"../real-tokio\", default-features = false }}\n\n[workspace]\n\n[lints.rust]\nwarnings = \"allow\"\n"
    );
    text
}

/// Returns the names of the optional dependencies of a package.
fn optional(package: &Table) -> BTreeSet<String> {
    let targets = package.get("target").and_then(Value::as_table).into_iter().flat_map(|targets| targets.values());
    let tables = std::iter::once(package).chain(targets.filter_map(Value::as_table));
    let dependencies = tables.filter_map(|table| table.get("dependencies")).filter_map(Value::as_table).flatten();
    dependencies.filter(|(_, needed)| needed.get("optional").and_then(Value::as_bool) == Some(true)).map(|(name, _)| name.clone()).collect()
}

/// Folder whose files are written only if they change, so that cargo compiles nothing again that is the same.
struct Files {
    folder: PathBuf,
    written: BTreeSet<String>,
}

impl Files {
    fn new(folder: &Path) -> Self {
        Self { folder: folder.to_owned(), written: BTreeSet::new() }
    }

    fn write(&mut self, name: &str, text: &str) -> Result<(), Failure> {
        let path = self.folder.join(name);
        if fs::read(&path).is_ok_and(|old| old == text.as_bytes()) {
            self.written.insert(name.to_owned());
            return Ok(());
        }
        make_folder(path.parent().unwrap_or(&self.folder))?;
        write_file(&path, text)?;
        self.written.insert(name.to_owned());
        Ok(())
    }

    /// Removes files of another version.
    fn remove_others(&self) -> Result<(), Failure> {
        for name in list(&self.folder, Path::new(""))? {
            // Cargo writes the lock file and the folder `target` if somebody builds the package by itself.
            if !self.written.contains(&name) && name.starts_with("src/") {
                let path = self.folder.join(name);
                fs::remove_file(&path).map_err(|error| Failure::File { verb: "remove", path, error })?;
            }
        }
        Ok(())
    }
}

/// Makes a folder with the folders above it.
pub(super) fn make_folder(path: &Path) -> Result<(), Failure> {
    fs::create_dir_all(path).map_err(|error| Failure::File { verb: "make", path: path.to_owned(), error })
}
