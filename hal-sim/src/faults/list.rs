//! The list of faults of a stand: of bounded length, checked.

use super::{Fault, FaultKind};
use serde::de::{Error, SeqAccess, Visitor};
use serde::{Deserialize, Deserializer, Serialize, Serializer};
use std::fmt;

/// Largest number of faults of a stand.
pub const MAX_FAULTS: usize = 16;

/// Up to [`MAX_FAULTS`] faults, in their sequence.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Faults {
    list: [Option<Fault>; MAX_FAULTS],
}

/// An invalid fault.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
#[error("faults[{index}].{key} = {value}: must be {range}")]
pub struct FaultError {
    /// Index in the list, from 0.
    pub index: usize,
    /// The key.
    pub key: &'static str,
    /// The value.
    pub value: f64,
    /// The allowed range.
    pub range: String,
}

impl Faults {
    /// A list; `None` where there are too many.
    pub fn of(faults: impl IntoIterator<Item = Fault>) -> Option<Self> {
        let mut all = Self::default();
        faults.into_iter().try_for_each(|fault| all.push(fault))?;
        Some(all)
    }

    /// Adds a fault; `None` where the list is full.
    pub fn push(&mut self, fault: Fault) -> Option<()> {
        *self.list.iter_mut().find(|slot| slot.is_none())? = Some(fault);
        Some(())
    }

    /// Removes all faults of a kind.
    pub fn remove(&mut self, kind: FaultKind) {
        for slot in self.list.iter_mut().filter(|slot| slot.is_some_and(|fault| fault.kind == kind)) {
            *slot = None;
        }
    }

    /// The faults.
    pub fn iter(&self) -> impl DoubleEndedIterator<Item = &Fault> {
        self.list.iter().flatten()
    }

    /// Whether the list is empty.
    pub fn is_empty(&self) -> bool {
        self.iter().next().is_none()
    }

    /// The first fault of a kind by time.
    pub fn first(&self, kind: FaultKind) -> Option<&Fault> {
        self.iter().filter(|fault| fault.kind == kind).min_by(|a, b| a.from_s.total_cmp(&b.from_s))
    }

    /// The same faults relative to a power-on `by_s` later.
    pub fn later(&self, by_s: f64) -> Self {
        let shifted = |fault: &Fault| Fault { from_s: fault.from_s - by_s, ..*fault };
        Self { list: self.list.map(|slot| slot.as_ref().map(shifted)) }
    }

    /// Checks the values of a file.
    ///
    /// # Errors
    /// The first invalid number, by index and name.
    pub fn check(&self) -> Result<(), FaultError> {
        for (index, fault) in self.iter().enumerate() {
            let bad = |key, value, range: &str| Err(FaultError { index, key, value, range: range.to_owned() });
            if !(0.0..=1e9).contains(&fault.from_s) {
                return bad("from_s", fault.from_s, "seconds from 0 to 1e9");
            }
            if fault.for_s.is_nan() || fault.for_s <= 0.0 {
                return bad("for_s", fault.for_s, "seconds above 0");
            }
            match (fault.size, fault.kind.magnitude()) {
                (Some(size), None) => return bad("size", size, "left out: this fault has no size"),
                (Some(value), Some(magnitude)) if !(magnitude.range.0..=magnitude.range.1).contains(&value) => {
                    return bad("size", value, &format!("{}, from {} to {}", magnitude.meaning, magnitude.range.0, magnitude.range.1));
                }
                _ => {}
            }
        }
        Ok(())
    }
}

impl Serialize for Faults {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.collect_seq(self.iter())
    }
}

impl<'de> Deserialize<'de> for Faults {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        deserializer.deserialize_seq(List)
    }
}

struct List;

impl<'de> Visitor<'de> for List {
    type Value = Faults;

    fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "a list of at most {MAX_FAULTS} faults")
    }

    fn visit_seq<A: SeqAccess<'de>>(self, mut sequence: A) -> Result<Faults, A::Error> {
        let mut all = Faults::default();
        while let Some(fault) = sequence.next_element::<Fault>()? {
            all.push(fault).ok_or_else(|| A::Error::invalid_length(MAX_FAULTS + 1, &self))?;
        }
        Ok(all)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[derive(Debug, Deserialize)]
    struct File {
        faults: Faults,
    }

    fn read(text: &str) -> Result<Faults, String> {
        let file: File = toml::from_str(text).map_err(|e| e.message().to_owned())?;
        file.faults.check().map_err(|e| e.to_string())?;
        Ok(file.faults)
    }

    #[test]
    fn a_file_lists_faults_with_their_times() {
        let faults =
            read("[[faults]]\nwhat = \"supply-dip\"\nfrom_s = 2\nfor_s = 0.5\nsize = 7\n[[faults]]\nwhat = \"index-off\"\n").unwrap();
        let expected =
            [Fault::new(FaultKind::SupplyDip, 2.0, 0.5).with_magnitude(7.0), Fault::new(FaultKind::IndexOff, 0.0, f64::INFINITY)];
        assert!(faults.iter().eq(&expected));
        assert_eq!(faults.first(FaultKind::IndexOff).map(Fault::magnitude), Some(0.0));
    }

    #[test]
    fn each_kind_has_a_unique_name_that_reads_back() {
        for kind in FaultKind::ALL {
            let text = toml::to_string(&Fault::new(kind, 1.0, 2.0)).unwrap();
            assert_eq!(read(&format!("[[faults]]\n{text}")).unwrap().iter().next().unwrap().kind, kind);
        }
    }

    #[test]
    fn an_invalid_value_is_refused_with_index_and_name() {
        let one = |rest: &str| read(&format!("[[faults]]\nwhat = \"index-off\"\n[[faults]]\n{rest}")).unwrap_err();
        assert!(one("what = \"supply-dip\"\nfrom_s = -1").starts_with("faults[1].from_s = -1"));
        assert!(one("what = \"supply-dip\"\nfor_s = 0").starts_with("faults[1].for_s = 0"));
        assert!(one("what = \"supply-dip\"\nsize = nan").starts_with("faults[1].size = NaN"));
        assert!(one("what = \"line-flips\"\nsize = 2").contains("share of the bytes, from 0 to 1"));
        assert!(one("what = \"lost-ticks\"\nsize = 2").contains("has no size"));
        assert!(one("what = \"supply\"").contains("supply-dip"), "lists the known names");
        assert!(read(&"[[faults]]\nwhat = \"index-off\"\n".repeat(MAX_FAULTS + 1)).unwrap_err().contains("at most 16"));
    }
}
