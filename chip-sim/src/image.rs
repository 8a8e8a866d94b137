//! The flashed image: loadable segments and symbols of an ELF file.

use object::read::elf::{ElfFile32, ProgramHeader};
use object::{Endianness, Object, ObjectSymbol, SymbolKind};
use std::collections::BTreeMap;
use std::path::Path;

/// Why an image cannot be loaded.
#[derive(Debug, thiserror::Error)]
pub enum ImageError {
    /// The file cannot be read.
    #[error("{path}: {error}")]
    File {
        /// The file.
        path: String,
        /// The cause.
        error: std::io::Error,
    },
    /// The file is not a 32-bit ELF file for this chip.
    #[error("{path}: not an ELF image of the STM32F446: {reason}")]
    Format {
        /// The file.
        path: String,
        /// The cause.
        reason: String,
    },
}

/// An image.
pub struct Image {
    /// Physical address and contents of each segment.
    pub segments: Vec<(u32, Vec<u8>)>,
    /// Name and address of each symbol; functions without their Thumb bit.
    symbols: BTreeMap<String, u32>,
    /// Start address and name of each function.
    functions: BTreeMap<u32, String>,
}

impl Image {
    /// Reads an ELF file.
    ///
    /// # Errors
    /// The file cannot be read, or is not an image of this chip.
    pub fn read(path: &Path) -> Result<Self, ImageError> {
        let name = path.display().to_string();
        let bytes = std::fs::read(path).map_err(|error| ImageError::File { path: name.clone(), error })?;
        Self::parse(&bytes).map_err(|reason| ImageError::Format { path: name, reason })
    }

    fn parse(bytes: &[u8]) -> Result<Self, String> {
        let file = ElfFile32::<Endianness>::parse(bytes).map_err(|error| error.to_string())?;
        if file.architecture() != object::Architecture::Arm {
            return Err(format!("its architecture is {:?}", file.architecture()));
        }
        let endian = file.endian();
        let mut segments = Vec::new();
        for header in file.elf_program_headers() {
            let data = header.data(endian, bytes).map_err(|()| "a segment lies outside the file".to_owned())?;
            if header.p_type(endian) == object::elf::PT_LOAD && !data.is_empty() {
                segments.push((header.p_paddr(endian), data.to_vec()));
            }
        }
        let (mut symbols, mut functions) = (BTreeMap::new(), BTreeMap::new());
        for symbol in file.symbols() {
            let Ok(name) = symbol.name() else { continue };
            let is_function = symbol.kind() == SymbolKind::Text;
            let address = symbol.address() as u32 & if is_function { !1 } else { !0 };
            let name = format!("{:#}", rustc_demangle::demangle(name));
            if is_function {
                functions.insert(address, name.clone());
            }
            symbols.insert(name, address);
        }
        Ok(Self { segments, symbols, functions })
    }

    /// Address of a symbol by its whole name.
    pub fn symbol(&self, name: &str) -> Option<u32> {
        self.symbols.get(name).copied()
    }

    /// Name and address of each symbol.
    pub fn symbols(&self) -> impl Iterator<Item = (&str, u32)> {
        self.symbols.iter().map(|(name, address)| (name.as_str(), *address))
    }

    /// Functions whose name contains `part`.
    pub fn functions_named<'a>(&'a self, part: &'a str) -> impl Iterator<Item = (u32, &'a str)> {
        self.functions.iter().filter(move |(_, name)| name.contains(part)).map(|(address, name)| (*address, name.as_str()))
    }

    /// Function that contains `address`, with the offset in it, for messages.
    pub fn place(&self, address: u32) -> String {
        match self.functions.range(..=address).next_back() {
            Some((start, name)) => format!("{address:#010x} ({name} + {:#x})", address - start),
            None => format!("{address:#010x}"),
        }
    }
}
