//! Files that are replaced as a whole, and files that several processes edit.
//!
//! A reader sees the previous file or the new one, never a part: the contents are written to a temporary file in the same folder, synced to
//! the disk, and renamed. A killed program leaves at most a temporary file whose name begins with a dot.

use std::fs::{File, OpenOptions};
use std::io::{self, BufWriter, Write};
use std::path::{Path, PathBuf};

/// Writes a file as a whole. A symbolic link keeps pointing to its file; a device (`/dev/stdout`) is written directly.
///
/// # Errors
/// `contents` fails, or the file system does; the previous file is then unchanged.
pub fn replace(path: &Path, contents: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>) -> io::Result<()> {
    if path.exists() && !path.is_file() {
        let mut device = OpenOptions::new().write(true).open(path)?;
        let mut out = BufWriter::new(&mut device);
        contents(&mut out)?;
        return out.flush();
    }
    let target = path.canonicalize().unwrap_or_else(|_| path.to_owned());
    written(&target, contents)?.persist(&target).map_err(|error| error.error)?;
    sync_folder(&folder_of(&target))
}

/// Writes a new file as a whole.
///
/// # Errors
/// `AlreadyExists`: there is a file at `path`, which is unchanged. Otherwise as [`replace`], and there is no file.
pub fn create_new(path: &Path, contents: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>) -> io::Result<()> {
    if path.symlink_metadata().is_ok() {
        return Err(io::ErrorKind::AlreadyExists.into());
    }
    written(path, contents)?.persist_noclobber(path).map_err(|error| error.error)?;
    sync_folder(&folder_of(path))
}

/// The contents in a temporary file beside `target`, on the disk.
fn written(target: &Path, contents: impl FnOnce(&mut BufWriter<&mut File>) -> io::Result<()>) -> io::Result<tempfile::NamedTempFile> {
    let mut temporary = new_temporary(target)?.tempfile_in(folder_of(target))?;
    let mut out = BufWriter::with_capacity(1 << 18, temporary.as_file_mut());
    contents(&mut out)?;
    out.flush()?;
    drop(out);
    temporary.as_file().sync_all()?;
    Ok(temporary)
}

/// Writes text as a whole file.
///
/// # Errors
/// As [`replace`].
pub fn replace_text(path: &Path, text: &str) -> io::Result<()> {
    replace(path, |out| out.write_all(text.as_bytes()))
}

/// Checks that a file can be created in a folder.
///
/// # Errors
/// The folder cannot be written.
pub fn check_folder(folder: &Path) -> io::Result<()> {
    tempfile::tempfile_in(folder).map(drop)
}

/// Renames a complete file to `path`, which may exist, after its contents are on the disk.
///
/// # Errors
/// The file system fails.
pub fn rename_synced(from: &Path, path: &Path) -> io::Result<()> {
    File::open(from)?.sync_all()?;
    std::fs::rename(from, path)?;
    sync_folder(&folder_of(path))
}

/// Locks an existing file against other processes that edit it with this function, until the returned file is dropped. Waits for their end.
///
/// # Errors
/// The file cannot be opened or locked.
pub fn lock(path: &Path) -> io::Result<File> {
    loop {
        let file = File::open(path)?;
        file.lock()?;
        // Another process may have replaced the file while this one waited.
        if is_at(&file, path)? {
            return Ok(file);
        }
    }
}

fn folder_of(path: &Path) -> PathBuf {
    path.parent().filter(|folder| !folder.as_os_str().is_empty()).map_or_else(|| PathBuf::from("."), Path::to_owned)
}

/// A temporary file with the permissions of the file that it replaces, or else those of a new file.
#[cfg(unix)]
fn new_temporary(target: &Path) -> io::Result<tempfile::Builder<'static, 'static>> {
    use std::os::unix::fs::PermissionsExt;
    let mut builder = tempfile::Builder::new();
    let permissions = std::fs::metadata(target).map_or_else(|_| std::fs::Permissions::from_mode(0o666), |metadata| metadata.permissions());
    builder.permissions(permissions);
    Ok(builder)
}

#[cfg(not(unix))]
fn new_temporary(_: &Path) -> io::Result<tempfile::Builder<'static, 'static>> {
    Ok(tempfile::Builder::new())
}

/// A rename survives a power cut only when its folder is on the disk.
#[cfg(unix)]
fn sync_folder(folder: &Path) -> io::Result<()> {
    File::open(folder)?.sync_all()
}

#[cfg(not(unix))]
fn sync_folder(_: &Path) -> io::Result<()> {
    Ok(())
}

#[cfg(unix)]
fn is_at(file: &File, path: &Path) -> io::Result<bool> {
    use std::os::unix::fs::MetadataExt;
    let (open, there) = (file.metadata()?, std::fs::metadata(path)?);
    Ok((open.dev(), open.ino()) == (there.dev(), there.ino()))
}

/// An open file cannot be replaced here.
#[cfg(not(unix))]
fn is_at(_: &File, _: &Path) -> io::Result<bool> {
    Ok(true)
}

#[cfg(test)]
#[allow(clippy::unwrap_used)]
mod tests {
    use super::*;

    #[test]
    fn failed_writing_leaves_the_previous_file_and_no_other() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        replace_text(&path, "first").unwrap();
        let failed = replace(&path, |out| {
            out.write_all(&[0; 1 << 20])?;
            Err(io::Error::other("full"))
        });
        assert_eq!(failed.unwrap_err().to_string(), "full");
        assert_eq!(std::fs::read_to_string(&path).unwrap(), "first");
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 1);
    }

    #[test]
    fn new_file_replaces_none() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.txt");
        let write = |text: &str| create_new(&path, |out| out.write_all(text.as_bytes()));
        assert!(create_new(&path, |_| Err(io::Error::other("broken off"))).is_err() && !path.exists());
        write("first").unwrap();
        assert_eq!(write("second").unwrap_err().kind(), io::ErrorKind::AlreadyExists);
        // A file that appears while the contents are written stays as well.
        let other = folder.path().join("b.txt");
        let raced = create_new(&other, |out| {
            std::fs::write(&other, "theirs")?;
            out.write_all(b"ours")
        });
        assert_eq!(raced.unwrap_err().kind(), io::ErrorKind::AlreadyExists);
        assert_eq!([&path, &other].map(|path| std::fs::read_to_string(path).unwrap()), ["first", "theirs"]);
        assert_eq!(std::fs::read_dir(folder.path()).unwrap().count(), 2);
    }

    #[cfg(unix)]
    #[test]
    fn links_and_permissions_stay() {
        use std::os::unix::fs::PermissionsExt;
        let folder = tempfile::tempdir().unwrap();
        let [file, link] = ["file", "link"].map(|name| folder.path().join(name));
        replace_text(&file, "first").unwrap();
        let plain = folder.path().join("plain");
        std::fs::write(&plain, "").unwrap();
        let mode = |path: &Path| std::fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(mode(&file), mode(&plain), "as any new file");
        std::fs::set_permissions(&file, std::fs::Permissions::from_mode(0o640)).unwrap();
        std::os::unix::fs::symlink("file", &link).unwrap();
        replace_text(&link, "second").unwrap();
        assert!(link.is_symlink());
        assert_eq!((std::fs::read_to_string(&file).unwrap().as_str(), mode(&file) & 0o777), ("second", 0o640));
        replace_text(Path::new("/dev/null"), "third").unwrap();
        assert!(!Path::new("/dev/null").is_file());
    }

    #[test]
    fn locked_edits_lose_nothing() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("count");
        replace_text(&path, "").unwrap();
        std::thread::scope(|scope| {
            for _ in 0..4 {
                scope.spawn(|| {
                    for _ in 0..25 {
                        let _locked = lock(&path).unwrap();
                        let text = std::fs::read_to_string(&path).unwrap();
                        replace_text(&path, &(text + "x")).unwrap();
                    }
                });
            }
        });
        assert_eq!(std::fs::read_to_string(&path).unwrap().len(), 100);
    }
}
