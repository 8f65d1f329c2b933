//! The generated packages: the real tokio under another name, the test kit on top of it, and the package `tokio` that stands in for it.

use std::collections::BTreeSet;
use std::fmt::Write as _;
use std::path::{Path, PathBuf};

use toml::{Table, Value};

use super::files::{Files, list};
use super::loopback;
use super::sources::Sources;
use super::workspace::{Beside, Workspace};
use crate::failure::Failure;
use crate::file::read_text;

/// Name of the package with the sources of the real tokio.
pub(super) const REAL: &str = "cohaptic-real-tokio";

/// Embeds files of the folder `tokio`.
macro_rules! files {
    ($($path:literal),* $(,)?) => {
        [$(($path, include_str!(concat!("tokio/", $path)))),*]
    };
}

/// Sources of the package that stands in for tokio.
const SOURCES: [(&str, &str); 38] = files![
    "hosted.rs",
    "lib.rs",
    "net/addr.rs",
    "net/bed_socket.rs",
    "net/bytes.rs",
    "net/descriptors.rs",
    "net/halves.rs",
    "net/listener.rs",
    "net/lookup.rs",
    "net/mod.rs",
    "net/ready.rs",
    "net/socket.rs",
    "net/stream.rs",
    "net/tcp.rs",
    "net/udp.rs",
    "net/udp_options.rs",
    "net/udp_receiving.rs",
    "net/unix/datagrams.rs",
    "net/unix/halves.rs",
    "net/unix/listener.rs",
    "net/unix/mod.rs",
    "net/unix/pipe.rs",
    "net/unix/socket.rs",
    "net/unix/stream.rs",
    "process.rs",
    "runtime/builder.rs",
    "runtime/handle.rs",
    "runtime/local.rs",
    "runtime/mod.rs",
    "runtime/rt.rs",
    "signal/mod.rs",
    "signal/unix.rs",
    "task/builder.rs",
    "task/join_set.rs",
    "task/local.rs",
    "task/mod.rs",
    "task/spawn.rs",
    "time.rs",
];

/// Reading and writing a stream of the real tokio through a shared reference, as the halves of a stream do.
macro_rules! shared_calls {
    ($stream:literal) => {
        concat!(
            "
/// Reading and writing through a shared reference, for the package `tokio` of `cohaptic tokio`.
#[doc(hidden)]
#[allow(missing_docs)]
impl ",
            $stream,
            " {
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
"
        )
    };
}

/// Code that is appended to files of the real tokio: what the package needs and the real tokio offers to itself only. The second text must be in the file.
const APPENDED: [(&str, &str, &str); 6] = [
    ("net/tcp/stream.rs", "fn poll_read_priv(", shared_calls!("TcpStream")),
    ("net/unix/stream.rs", "fn poll_read_priv(", shared_calls!("UnixStream")),
    (
        "net/unix/ucred.rs",
        "pid: Option<unix::pid_t>",
        r"
/// Credentials of a process, for the package `tokio` of `cohaptic tokio`.
#[doc(hidden)]
#[allow(missing_docs)]
impl UCred {
    pub fn cohaptic_of(pid: Option<unix::pid_t>, uid: unix::uid_t, gid: unix::gid_t) -> Self {
        Self { pid, uid, gid }
    }
}
",
    ),
    (
        "net/unix/socketaddr.rs",
        "pub struct SocketAddr(",
        r"
/// Conversion from an address of the standard library, for the package `tokio` of `cohaptic tokio`.
#[doc(hidden)]
#[allow(missing_docs)]
impl SocketAddr {
    pub fn cohaptic_of(address: std::os::unix::net::SocketAddr) -> Self {
        Self(address)
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

/// Writes the packages. Returns the folder of the package `tokio`.
pub(super) fn write(workspace: &Workspace, sources: &Sources) -> Result<PathBuf, Failure> {
    let Sources { version, folder: sources, kit } = sources;
    let manifest = sources.join("Cargo.toml");
    let manifest: Table =
        read_text(&manifest)?.parse().map_err(|error| Failure::System(format!("{} cannot be read: {error}", manifest.display())))?;
    write_real(&workspace.folder().join("real-tokio"), version, sources, &manifest)?;
    Files::new(&workspace.folder().join("loopback")).write("Cargo.toml", &loopback::manifest(kit, &workspace.beside.sockets))?;
    let package = workspace.folder().join("tokio");
    let mut files = Files::new(&package);
    files.write("Cargo.toml", &standing_in(version, &manifest, &workspace.beside))?;
    for (path, text) in SOURCES {
        files.write(&format!("src/{path}"), &chosen(text, sources)?)?;
    }
    // Files of an earlier version of tokio or of this program would be compiled as well.
    files.remove_others()?;
    Ok(package)
}

/// Writes the real tokio under its other name.
fn write_real(folder: &Path, version: &str, sources: &Path, manifest: &Table) -> Result<(), Failure> {
    let mut manifest = manifest.clone();
    if let Some(package) = manifest.get_mut("package").and_then(Value::as_table_mut) {
        package.insert("name".to_owned(), Value::String(REAL.to_owned()));
        // The copy is for this workspace alone and must not reach a registry.
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
    // Without this table, cargo would look for the workspace of the package in the folders above, and find the workspace of the user.
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
    // If a text is missing, the code that the appended code calls has changed, and the package would fail to compile without a hint.
    if appended < APPENDED.len() {
        let text = format!(
            "tokio {version} is built in another way than the versions that this program knows: expected a newer cohaptic, or an older tokio"
        );
        return Err(Failure::System(text));
    }
    files.remove_others()
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
                    // `any()` of nothing is false: the compiler leaves the item out, and a reader still finds the item in the file.
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
fn standing_in(version: &str, real: &Table, beside: &Beside) -> String {
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
        // Each feature turns the feature of the same name of the real tokio on.
        let mut own = vec![format!("real/{name}")];
        own.extend(parts(list).into_iter().filter(is_feature));
        // The generated package uses these two packages itself. A feature that carries the name of the package already brings the dependency.
        for (feature, package) in [("io-util", "bytes"), ("net", "socket2")] {
            if name == feature && !implicit.contains(package) {
                own.push(format!("dep:{package}"));
            }
        }
        // Only sockets have descriptors here, so the packages for descriptors come with the feature of sockets.
        if name == "net" {
            own.extend(["cohaptic-descriptors", "cohaptic-libc"].map(|package| format!("dep:{package}")));
        }
        // Only runtimes have loopbacks.
        if name == "rt" {
            own.push("dep:loopback".to_owned());
        }
        let _ = writeln!(text, "{} = {own:?}", Value::String(name.clone()));
    }
    for name in &implicit {
        let own = if ["bytes", "socket2"].contains(&&**name) { format!(", \"dep:{name}\"") } else { String::new() };
        let _ = writeln!(text, "{name} = [\"real/{name}\"{own}]");
    }
    let Beside { sockets, descriptors, libc, catches_calls } = beside;
    let _ = write!(
        text,
        "\n[dependencies]\nbytes = {{ version = \"1\", optional = true }}\ncohaptic-sockets = {{ {sockets} }}\n\
         loopback = {{ package = \"{}\", path = \"../loopback\", default-features = false, features = [\"loopback\", \"pcapng\"], optional = true }}\n\
         real = {{ package = \"{REAL}\", path = \"../real-tokio\", default-features = false }}\nsocket2 = {{ version = \"0.6\", features = [\"all\"], optional = true \
         }}\n\n[target.'cfg(unix)'.dependencies]\ncohaptic-descriptors = {{ {descriptors}, optional = true }}\n\
         cohaptic-libc = {{ {libc}, default-features = {catches_calls}, optional = true }}\n\n[workspace]\n\n[lints.rust]\nwarnings = \"allow\"\n",
        loopback::NAME
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

#[cfg(test)]
mod tests {
    use super::super::files::make_folder;
    use super::*;
    use crate::file::write_file;

    #[test]
    fn items_that_a_version_lacks_are_left_out() {
        let folder = tempfile::tempdir().unwrap();
        make_folder(&folder.path().join("src")).unwrap();
        write_file(&folder.path().join("src/a.rs"), "pub fn new_one() {}").unwrap();
        let text = "//@ has a.rs|fn new_one\nfn one() {}\n    //@ has a.rs|fn newer\n    fn other() {}\n//@ has b.rs|fn any\nfn third() {}\n";
        let expected = "fn one() {}\n#[cfg(any())]\n    fn other() {}\n#[cfg(any())]\nfn third() {}\n";
        assert_eq!(chosen(text, folder.path()).unwrap(), expected);
    }

    /// A version may name its optional dependencies as features, or with `dep:`. The package needs `bytes` of its own where tokio does.
    #[test]
    fn features_bring_what_the_package_itself_needs() {
        for (form, expected) in [("bytes", "[\"real/io-util\", \"bytes\"]"), ("dep:bytes", "[\"real/io-util\", \"dep:bytes\"]")] {
            let real = format!("[features]\nio-util = [{form:?}]\nrt = []\n[dependencies.bytes]\nversion = \"1\"\noptional = true\n");
            let own = standing_in("1.99.0", &real.parse().unwrap(), &Beside::default());
            assert!(own.contains(&format!("\"io-util\" = {expected}\n\"rt\" = [\"real/rt\", \"dep:loopback\"]\n")), "{own}");
            assert_eq!(own.contains("bytes = [\"real/bytes\", \"dep:bytes\"]\n"), form == "bytes", "{own}");
        }
    }

    /// Sources in which the places that the appended code needs are named otherwise.
    #[test]
    fn a_tokio_that_is_built_in_another_way_is_refused() {
        let (sources, folder) = (tempfile::tempdir().unwrap(), tempfile::tempdir().unwrap());
        for (file, needed, _) in APPENDED {
            let path = sources.path().join("src").join(file);
            make_folder(path.parent().unwrap()).unwrap();
            write_file(&path, needed).unwrap();
        }
        let write = || write_real(folder.path(), "1.99.0", sources.path(), &Table::new());
        write().unwrap();
        assert!(read_text(&folder.path().join("src/util/rand.rs")).unwrap().contains("fn cohaptic(seed: u64)"));
        write_file(&sources.path().join("src/util/rand.rs"), "fn other()").unwrap();
        assert!(matches!(write(), Err(Failure::System(text)) if text.contains("tokio 1.99.0 is built in another way")));
    }
}
