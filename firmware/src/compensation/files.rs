//! Serialization of a list of harmonics: `[[firmware.compensation.harmonics]]` in a file.

use super::{Harmonic, Harmonics, MAX_HARMONICS};
use core::fmt;
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};

impl Serialize for Harmonics {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.as_slice())
    }
}

impl<'de> Deserialize<'de> for Harmonics {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(List)
    }
}

struct List;

impl<'de> Visitor<'de> for List {
    type Value = Harmonics;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a list of at most {MAX_HARMONICS} harmonics")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<Harmonics, A::Error> {
        let mut all = Harmonics::default();
        while let Some(harmonic) = sequence.next_element::<Harmonic>()? {
            all.push(harmonic).ok_or_else(|| A::Error::invalid_length(MAX_HARMONICS + 1, &self))?;
        }
        Ok(all)
    }
}
