//! The firmware's build script: the commit that `*IDN?` replies, and the files that run the script again.
#![allow(clippy::unwrap_used)]

use std::path::{Path, PathBuf};
use std::process::Command;

fn root() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("..")
}

/// Standard output of a git command, with an author and without the user's configuration.
fn git(folder: &Path, arguments: &[&str]) -> Option<String> {
    let mut command = Command::new("git");
    command.args(["-c", "user.name=test", "-c", "user.email=test@example.org", "-c", "init.defaultBranch=main"]);
    let output = command.args(arguments).current_dir(folder).env_remove("GIT_DIR").env_remove("GIT_WORK_TREE").output().ok()?;
    output.status.success().then(|| String::from_utf8(output.stdout).unwrap().trim().to_owned())
}

/// What the script printed.
struct Printed {
    commit: String,
    watched: Vec<PathBuf>,
}

/// Runs the compiled script in the folder `firmware` of a workspace, as cargo does.
fn run(script: &Path, workspace: &Path) -> Printed {
    let folder = workspace.join("firmware");
    let output = Command::new(script).current_dir(&folder).env_remove("CARGO_FEATURE_STM32").output().unwrap();
    assert!(output.status.success(), "{output:?}");
    let text = String::from_utf8(output.stdout).unwrap();
    let of = |key: &str| text.lines().filter_map(|line| line.strip_prefix(key)).map(str::to_owned).collect::<Vec<_>>();
    let [commit] = of("cargo::rustc-env=STAND_COMMIT=").try_into().unwrap();
    let watched: Vec<PathBuf> = of("cargo::rerun-if-changed=").iter().map(|path| folder.join(path)).collect();
    // Cargo runs a script at each build if a watched file does not exist.
    assert!(watched.iter().all(|path| path.exists()), "{watched:?}");
    Printed { commit, watched }
}

/// The build script as a program.
fn compiled(folder: &Path) -> PathBuf {
    let program = folder.join("build-script");
    let rustc = std::env::var("RUSTC").unwrap_or_else(|_| "rustc".to_owned());
    let built = Command::new(rustc).args(["--edition", "2024", "-o"]).arg(&program).arg(root().join("firmware/build.rs")).status().unwrap();
    assert!(built.success());
    program
}

/// A workspace with sources of a firmware and another file.
fn workspace(folder: &Path) {
    std::fs::create_dir_all(folder.join("firmware/src")).unwrap();
    for file in ["README.md", "Cargo.toml", "Cargo.lock", "memory.x", "firmware/Cargo.toml", "firmware/build.rs", "firmware/src/lib.rs"] {
        std::fs::write(folder.join(file), file).unwrap();
    }
}

fn commit(folder: &Path, message: &str) -> String {
    git(folder, &["add", "-A"]).unwrap();
    git(folder, &["commit", "--allow-empty", "-qm", message]).unwrap();
    git(folder, &["rev-parse", "--short=7", "HEAD"]).unwrap()
}

/// Contents of the watched files, and names in the watched folders.
fn state(watched: &[PathBuf]) -> Vec<Vec<u8>> {
    let names =
        |path: &Path| std::fs::read_dir(path).unwrap().map(|e| e.unwrap().file_name().into_encoded_bytes()).collect::<Vec<_>>().concat();
    watched.iter().map(|path| if path.is_dir() { names(path) } else { std::fs::read(path).unwrap() }).collect()
}

#[test]
fn the_commit_follows_head_and_the_firmwares_sources() {
    let folder = tempfile::tempdir().unwrap();
    let script = compiled(folder.path());
    let repository = folder.path().join("repository");
    workspace(&repository);
    assert_eq!(run(&script, &repository).commit, "unknown", "an archive");
    git(&repository, &["init", "-q"]).unwrap();
    let hash = commit(&repository, "first");
    assert_eq!(run(&script, &repository).commit, hash);

    std::fs::write(repository.join("README.md"), "another text").unwrap();
    assert_eq!(run(&script, &repository).commit, hash, "the image does not depend on it");
    std::fs::write(repository.join("firmware/src/lib.rs"), "another program").unwrap();
    assert_eq!(run(&script, &repository).commit, format!("{hash}-dirty"));
    commit(&repository, "second");
    std::fs::write(repository.join("firmware/src/new.rs"), "a module that git does not know").unwrap();
    assert!(run(&script, &repository).commit.ends_with("-dirty"));
    std::fs::remove_file(repository.join("firmware/src/new.rs")).unwrap();

    // An archive that was unpacked in another repository.
    let inner = repository.join("inner");
    workspace(&inner);
    assert_eq!(run(&script, &inner).commit, "unknown");
}

#[test]
fn a_commit_changes_a_watched_file_on_a_branch_in_packed_refs_in_a_worktree_and_without_a_branch() {
    let folder = tempfile::tempdir().unwrap();
    let script = compiled(folder.path());
    let repository = folder.path().join("repository");
    let worktree = folder.path().join("worktree");
    workspace(&repository);
    git(&repository, &["init", "-q"]).unwrap();
    commit(&repository, "first");
    git(&repository, &["worktree", "add", "-qb", "side", worktree.to_str().unwrap()]).unwrap();
    let advances = |place: &Path, what: &str| {
        let before = run(&script, place);
        assert_eq!(before.commit, git(place, &["rev-parse", "--short=7", "HEAD"]).unwrap(), "{what}");
        let state_before = state(&before.watched);
        let hash = commit(place, what);
        assert_ne!(state(&before.watched), state_before, "{what}: {:?}", before.watched);
        assert_eq!(run(&script, place).commit, hash, "{what}");
    };
    advances(&repository, "a branch");
    advances(&worktree, "a worktree");
    git(&repository, &["pack-refs", "--all"]).unwrap();
    advances(&repository, "a branch in packed-refs");
    git(&repository, &["pack-refs", "--all"]).unwrap();
    advances(&worktree, "a worktree whose branch is in packed-refs");
    git(&repository, &["checkout", "-q", "--detach"]).unwrap();
    advances(&repository, "no branch");
}

#[test]
fn this_build_carries_the_commit_of_its_sources() {
    let is_own = git(&root(), &["rev-parse", "--show-toplevel"])
        .is_some_and(|top| Path::new(&top).canonicalize().unwrap() == root().canonicalize().unwrap());
    let expected = if is_own { git(&root(), &["rev-parse", "--short=7", "HEAD"]).unwrap() } else { "unknown".to_owned() };
    assert_eq!(stand_firmware::COMMIT.trim_end_matches("-dirty"), expected);
    assert_eq!(stand_firmware::VERSION, format!("{}+{}", env!("CARGO_PKG_VERSION"), stand_firmware::COMMIT));
}
