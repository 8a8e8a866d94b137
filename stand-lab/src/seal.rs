//! The teacher's key, and the seeds that it determines: HMAC-SHA256 (RFC 2104) of the key and of work, student, attempt and purpose.
//!
//! Without the key nobody can compute a seed, so that logs made elsewhere do not contain the true values. A work without a key is a
//! practice work: its key is public, and so are its true values.

use std::fmt::Write;
use std::path::Path;

use hmac::{Hmac, KeyInit, Mac};
use sha2::Sha256;

use super::LabError;
use identification::files;

/// Length of a key, bytes: the length of the hash, beyond which a longer key adds no strength (RFC 2104, §3).
const KEY_BYTES: usize = 32;
/// Key of practice works. It is public.
const PRACTICE_KEY: &[u8] = b"rotary stand: practice works have no secret";
/// Begins every authenticated message, so that the key serves no other purpose.
const CONTEXT: &str = "rotary-stand-lab-1";

/// A key from which the seeds of works are derived.
#[derive(Clone, PartialEq, Eq)]
pub struct Key(Vec<u8>);

impl Key {
    /// The public key of practice works.
    pub fn practice() -> Self {
        Key(PRACTICE_KEY.to_vec())
    }

    /// Reads a key file: 64 hexadecimal digits.
    ///
    /// # Errors
    /// The file cannot be read or is not a key.
    pub fn read(path: &Path) -> Result<Self, LabError> {
        let text = std::fs::read_to_string(path).map_err(|source| LabError::file(path, "read", source))?;
        let digits = text.trim();
        let invalid = || LabError::invalid(path, format!("a key has {} hexadecimal digits; `stand lab key` writes one", 2 * KEY_BYTES));
        if digits.len() != 2 * KEY_BYTES || !digits.is_ascii() {
            return Err(invalid());
        }
        let bytes = (0..KEY_BYTES).map(|k| u8::from_str_radix(&digits[2 * k..2 * k + 2], 16)).collect::<Result<_, _>>();
        bytes.map(Key).map_err(|_| invalid())
    }

    /// Writes a new random key to a new file.
    ///
    /// # Errors
    /// The file exists or cannot be written, or the operating system has no random numbers.
    pub fn create(path: &Path) -> Result<Self, LabError> {
        let mut bytes = [0; KEY_BYTES];
        getrandom::fill(&mut bytes).map_err(|error| LabError::file(path, "write", std::io::Error::other(error.to_string())))?;
        let text = format!("{}\n", hexadecimal(&bytes));
        files::create_new(path, |file| std::io::Write::write_all(file, text.as_bytes())).map_err(|source| match source.kind() {
            std::io::ErrorKind::AlreadyExists => LabError::invalid(path, "the file exists; a key is never overwritten"),
            _ => LabError::file(path, "write", source),
        })?;
        Ok(Key(bytes.to_vec()))
    }

    /// HMAC-SHA256 of `message`.
    fn authenticate(&self, message: &[u8]) -> [u8; 32] {
        // A key of any length is valid.
        let Ok(mut mac) = Hmac::<Sha256>::new_from_slice(&self.0) else { unreachable!("HMAC takes keys of any length") };
        mac.update(message);
        mac.finalize().into_bytes().into()
    }

    /// The seed for a purpose of an attempt.
    pub fn seed(&self, attempt: &Attempt, purpose: &str) -> u64 {
        // No field contains a zero byte, so that different fields give different messages.
        let message = [CONTEXT, &attempt.lab, &attempt.student, &attempt.number.to_string(), purpose].join("\0");
        let code = self.authenticate(message.as_bytes());
        code[..8].iter().fold(0, |seed, byte| seed << 8 | u64::from(*byte))
    }

    /// The authentication code of a content for a purpose of an attempt, in hexadecimal. Only the key gives it.
    pub fn code(&self, attempt: &Attempt, purpose: &str, content: &str) -> String {
        let message = [CONTEXT, &attempt.lab, &attempt.student, &attempt.number.to_string(), purpose, content].join("\0");
        hexadecimal(&self.authenticate(message.as_bytes()))
    }
}

impl std::fmt::Debug for Key {
    /// Without the key, so that no message shows it.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.write_str("Key(…)")
    }
}

/// One attempt of a student at a work.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Attempt {
    /// Identifier of the work.
    pub lab: String,
    /// Name or number of the student, without control characters.
    pub student: String,
    /// Number of the attempt, from 1.
    pub number: u32,
}

/// Bytes as hexadecimal digits.
pub fn hexadecimal(bytes: &[u8]) -> String {
    bytes.iter().fold(String::new(), |mut text, byte| {
        let _ = write!(text, "{byte:02x}");
        text
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn attempt(lab: &str, student: &str, number: u32) -> Attempt {
        Attempt { lab: lab.to_owned(), student: student.to_owned(), number }
    }

    /// RFC 4231, test cases 1, 2 and 6: a short key, a key shorter than the hash, a key longer than the block.
    #[test]
    fn authentication_code_is_that_of_rfc_4231() {
        let code = |key: &[u8], data: &[u8]| hexadecimal(&Key(key.to_vec()).authenticate(data));
        assert_eq!(code(&[0x0b; 20], b"Hi There"), "b0344c61d8db38535ca8afceaf0bf12b881dc200c9833da726e9376c2e32cff7");
        assert_eq!(code(b"Jefe", b"what do ya want for nothing?"), "5bdcc146bf60754e6a042426089575c75a003f089d2739839dec58b964ec3843");
        assert_eq!(
            code(&[0xaa; 131], b"Test Using Larger Than Block-Size Key - Hash Key First"),
            "60e431591ee0b67f0d8a26aacbf5b77f8e0bc6213728c5140546040f0ee37f54"
        );
    }

    #[test]
    fn each_field_changes_the_seed() {
        let (key, other) = (Key(vec![1; 32]), Key(vec![2; 32]));
        let given = key.seed(&attempt("motor", "anna", 1), "device");
        let changed = [
            other.seed(&attempt("motor", "anna", 1), "device"),
            key.seed(&attempt("hunt", "anna", 1), "device"),
            key.seed(&attempt("motor", "ann", 1), "device"),
            key.seed(&attempt("motor", "anna", 11), "device"),
            key.seed(&attempt("motor", "anna", 1), "noise"),
        ];
        assert!(!changed.contains(&given));
        assert_eq!(given, key.seed(&attempt("motor", "anna", 1), "device"));
    }

    #[test]
    fn code_depends_on_key_attempt_purpose_and_content() {
        let (key, other, anna) = (Key(vec![1; 32]), Key(vec![2; 32]), attempt("motor", "anna", 1));
        let given = key.code(&anna, "reference", "a");
        let changed = [
            other.code(&anna, "reference", "a"),
            key.code(&attempt("motor", "anna", 2), "reference", "a"),
            key.code(&anna, "real stand", "a"),
            key.code(&anna, "reference", "b"),
        ];
        assert!(!changed.contains(&given));
        assert_eq!(given, key.code(&anna, "reference", "a"));
    }

    #[test]
    fn key_file_reads_back_and_is_not_overwritten() {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("teacher.key");
        let key = Key::create(&path).expect("a new key");
        assert_eq!(Key::read(&path).expect("a key"), key);
        assert!(Key::create(&path).is_err());
        std::fs::write(&path, "abc").expect("written");
        assert!(Key::read(&path).is_err());
        assert!(!format!("{key:?}").contains(&hexadecimal(&key.0)));
    }
}
