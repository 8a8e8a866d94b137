//! Parser of a line: commands separated by `;`, each with a header and parameters. Nothing is copied.
//!
//! Header words match in long or short form, in any case (`SOURce:RATE`: SOURCE or SOUR). A command after `;` continues the path of the
//! command before it (`SOURce:MODE RATE;RATE 5`). A leading `:` or `*` starts at the root, and STOP always does. A word may end with the
//! numeric suffix 1 (`OUTPut1`): there is one of each.

use super::errors::{Code, ErrorEntry};
use super::quantity::{Quantity, number};
use crate::text::{Ascii, Significant};
use core::fmt::{self, Display};

/// Iterator over the commands of a line.
#[derive(Clone, Debug)]
pub struct Commands<'a> {
    rest: Option<&'a [u8]>,
    path: &'a [u8],
}

/// One command.
#[derive(Clone, Copy, Debug)]
pub struct Command<'a> {
    /// The path of the command before it: its header without the last word.
    path: &'a [u8],
    header: &'a [u8],
    /// The header ends with `?`.
    pub is_query: bool,
    parameters: &'a [u8],
}

impl<'a> Commands<'a> {
    /// The commands of a line, which is without its check sum.
    pub fn new(line: &'a [u8]) -> Self {
        Self { rest: Some(line), path: b"" }
    }
}

impl<'a> Iterator for Commands<'a> {
    type Item = Command<'a>;

    fn next(&mut self) -> Option<Command<'a>> {
        loop {
            let (text, rest) = split_unquoted(self.rest?, b';');
            self.rest = rest;
            let text = text.trim_ascii();
            if text.is_empty() {
                continue;
            }
            let end = text.iter().position(|byte| matches!(byte, b' ' | b'\t' | b'?')).unwrap_or(text.len());
            let (header, after) = text.split_at_checked(end)?;
            let (is_query, parameters) = match after.split_first() {
                Some((b'?', parameters)) => (true, parameters),
                _ => (false, after),
            };
            let at_root = header.starts_with(b":") || header.starts_with(b"*") || header.eq_ignore_ascii_case(b"STOP");
            let header = if let [b':', rest @ ..] = header { rest } else { header };
            let path = if at_root { b"" } else { self.path };
            let command = Command { path, header, is_query, parameters: parameters.trim_ascii() };
            if !header.starts_with(b"*") {
                // The next command continues the path of this header; a header of one word keeps the path before it.
                self.path = match header.iter().rposition(|byte| *byte == b':') {
                    Some(last) => header.get(..last).unwrap_or_default(),
                    None if at_root => b"",
                    None => path,
                };
            }
            return Some(command);
        }
    }
}

impl<'a> Command<'a> {
    /// Whether the header matches a pattern: words separated by `:`, the short form in capitals.
    ///
    /// The header continues the path. If it does not match there and has several words, it is read from the root.
    pub fn is(&self, pattern: &str) -> bool {
        self.matches(pattern, self.path) || (!self.path.is_empty() && self.header.contains(&b':') && self.matches(pattern, b""))
    }

    fn matches(&self, pattern: &str, path: &[u8]) -> bool {
        let mut words = self.words_after(path);
        let mut wanted = split_words(pattern.as_bytes());
        loop {
            match (words.next(), wanted.next()) {
                (None, None) => return true,
                (Some(word), Some(wanted)) if is_form(word, wanted) => {}
                _ => return false,
            }
        }
    }

    /// The last word of path and header, if all words before it match the pattern. As in [`Command::is`], a header of several words that
    /// does not match below the path is read from the root.
    pub fn last_below(&self, pattern: &str) -> Option<&'a [u8]> {
        let from_root = || (!self.path.is_empty() && self.header.contains(&b':')).then(|| self.last_after(pattern, b"")).flatten();
        self.last_after(pattern, self.path).or_else(from_root)
    }

    fn last_after(&self, pattern: &str, path: &'a [u8]) -> Option<&'a [u8]> {
        let mut words = self.words_after(path);
        for wanted in split_words(pattern.as_bytes()) {
            if !words.next().is_some_and(|word| is_form(word, wanted)) {
                return None;
            }
        }
        let last = words.next()?;
        words.next().is_none().then_some(last)
    }

    fn words_after<'p>(&self, path: &'p [u8]) -> impl Iterator<Item = &'p [u8]> + use<'p, 'a>
    where
        'a: 'p,
    {
        split_words(path).filter(|word| !word.is_empty()).chain(split_words(self.header)).map(without_suffix)
    }

    /// Whether a word of the header has a numeric suffix other than 1.
    pub fn has_other_suffix(&self) -> bool {
        split_words(self.header).any(|word| !matches!(word.get(without_suffix(word).len()..), Some(b"" | b"1")))
    }

    /// The header as received, for errors.
    pub fn header(&self) -> &'a [u8] {
        self.header
    }

    /// The parameters.
    pub fn parameters(&self) -> Parameters<'a> {
        Parameters { rest: (!self.parameters.is_empty()).then_some(self.parameters) }
    }
}

/// The parameters of a command, read one after the other.
#[derive(Clone, Copy, Debug)]
pub struct Parameters<'a> {
    rest: Option<&'a [u8]>,
}

impl<'a> Parameters<'a> {
    /// The next parameter as received, if there is one.
    pub fn next_text(&mut self) -> Option<&'a [u8]> {
        let (text, rest) = split_unquoted(self.rest?, b',');
        self.rest = rest;
        Some(text.trim_ascii())
    }

    /// The next parameter without quotes around it.
    ///
    /// # Errors
    /// The parameter is missing.
    pub fn text(&mut self) -> Result<&'a [u8], ErrorEntry> {
        let text = self.next_text().ok_or_else(|| ErrorEntry::new(Code::MISSING_PARAMETER))?;
        Ok(match text {
            [b'"', inner @ .., b'"'] | [b'\'', inner @ .., b'\''] => inner,
            text => text,
        })
    }

    /// The next parameter where no text in quotes is meant.
    fn unquoted(&mut self) -> Result<&'a [u8], ErrorEntry> {
        match self.next_text() {
            None => Err(ErrorEntry::new(Code::MISSING_PARAMETER)),
            Some(text @ [b'"' | b'\'', ..]) => Err(ErrorEntry::with(Code::STRING_NOT_ALLOWED, Ascii(text))),
            Some(text) => Ok(text),
        }
    }

    /// The next parameter as index of a word in `words`, in long or short form.
    ///
    /// # Errors
    /// The parameter is missing, is in quotes, or is not one of the words.
    pub fn choice(&mut self, words: &[&str]) -> Result<usize, ErrorEntry> {
        let text = self.unquoted()?;
        let choice = words.iter().position(|word| is_word(text, word));
        choice.ok_or_else(|| ErrorEntry::with(Code::ILLEGAL_VALUE, format_args!("{} is not one of {}", Ascii(text), Choices(words))))
    }

    /// The next parameter as a switch: `true` for ON or a number that is not rounded to 0, `false` for OFF or 0.
    ///
    /// # Errors
    /// The parameter is missing, is in quotes, or is neither.
    pub fn on_off(&mut self) -> Result<bool, ErrorEntry> {
        let mut copy = *self;
        match copy.unquoted().ok().and_then(number) {
            Some((value, b"")) => {
                *self = copy;
                Ok(libm::round(value) != 0.0)
            }
            _ => self.choice(&["OFF", "ON"]).map(|index| index == 1),
        }
    }

    /// The next parameter as a number in the unit of the range.
    ///
    /// # Errors
    /// The parameter is missing, is not a number, is in quotes, has a unit of another quantity, or is outside the range.
    pub fn number(&mut self, range: &Range) -> Result<f64, ErrorEntry> {
        let text = self.unquoted()?;
        if let Some(bound) = range.keyword(text) {
            return Ok(bound);
        }
        let Some((value, suffix)) = number(text) else {
            return Err(ErrorEntry::with(Code::NUMERIC_DATA, format_args!("{} is not a number", Ascii(text))));
        };
        let factor = range.quantity.factor(suffix.trim_ascii()).ok_or_else(|| {
            let unit = if range.quantity.unit.is_empty() { "no unit" } else { range.quantity.unit };
            ErrorEntry::with(Code::INVALID_SUFFIX, format_args!("the unit of {} is wrong; expected {unit}", Ascii(text)))
        })?;
        let value = value * factor;
        // The conversion of units may round a value at a bound to slightly outside.
        let tolerance = 1e-12 * (range.greatest.abs() + range.least.abs());
        if !(value >= range.least - tolerance && value <= range.greatest + tolerance) {
            let (side, limit) =
                if value < range.least { ("below the minimum", range.least) } else { ("above the maximum", range.greatest) };
            let unit = range.quantity.unit;
            let separator = if unit.is_empty() { "" } else { " " };
            let detail = format_args!("{} is {side} of {}{separator}{unit}", Ascii(text), Significant(limit, 6));
            return Err(ErrorEntry::with(Code::OUT_OF_RANGE, detail));
        }
        // Not `f64::clamp`: it panics if its bounds are swapped.
        Ok(f64::min(f64::max(value, range.least), range.greatest))
    }

    /// Checks that all parameters were read.
    ///
    /// # Errors
    /// There is another parameter.
    pub fn end(&mut self) -> Result<(), ErrorEntry> {
        self.next_text().map_or(Ok(()), |text| Err(ErrorEntry::with(Code::PARAMETER_NOT_ALLOWED, Ascii(text))))
    }
}

/// Words as `ONE, TWO or THREE`.
struct Choices<'a>(&'a [&'a str]);

impl Display for Choices<'_> {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (n, word) in self.0.iter().enumerate() {
            let separator = if n == 0 {
                ""
            } else if n + 1 == self.0.len() {
                " or "
            } else {
                ", "
            };
            write!(f, "{separator}{word}")?;
        }
        Ok(())
    }
}

/// The range of a numeric parameter.
#[derive(Clone, Copy, Debug)]
pub struct Range {
    /// The quantity, with its unit.
    pub quantity: Quantity,
    /// Smallest allowed value.
    pub least: f64,
    /// Greatest allowed value.
    pub greatest: f64,
    /// The value of the keyword DEFault.
    pub default: f64,
}

impl Range {
    /// A range in the unit of the quantity.
    pub const fn new(quantity: Quantity, least: f64, greatest: f64, default: f64) -> Self {
        Self { quantity, least, greatest, default }
    }

    /// The value of the keyword MINimum, MAXimum or DEFault.
    pub fn keyword(&self, text: &[u8]) -> Option<f64> {
        [("MINimum", self.least), ("MAXimum", self.greatest), ("DEFault", self.default)]
            .into_iter()
            .find(|(word, _)| is_word(text, word))
            .map(|(_, value)| value)
    }
}

/// As `least to greatest unit`.
impl Display for Range {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} to {}", Significant(self.least, 6), Significant(self.greatest, 6))?;
        if self.quantity.unit.is_empty() { Ok(()) } else { write!(f, " {}", self.quantity.unit) }
    }
}

/// A word without the decimal digits at its end, which are part of the unit in the name of a setting (`inertia_kg_m2`).
fn without_suffix(word: &[u8]) -> &[u8] {
    if word.contains(&b'_') {
        return word;
    }
    let length = word.iter().rposition(|byte| !byte.is_ascii_digit()).map_or(0, |last| last + 1);
    word.get(..length).unwrap_or_default()
}

/// Whether `text` is `pattern` in long form, or in short form (the part before the first lower-case letter), in any case.
pub fn is_word(text: &[u8], pattern: &str) -> bool {
    is_form(text, pattern.as_bytes())
}

fn is_form(text: &[u8], pattern: &[u8]) -> bool {
    let short = pattern.iter().position(u8::is_ascii_lowercase).unwrap_or(pattern.len());
    text.eq_ignore_ascii_case(pattern) || pattern.get(..short).is_some_and(|short| text.eq_ignore_ascii_case(short))
}

/// The words separated by `:`; one empty word for an empty text. Not `slice::split`: the compiler cannot prove that it does not panic.
fn split_words(text: &[u8]) -> impl Iterator<Item = &[u8]> {
    let mut rest = Some(text);
    core::iter::from_fn(move || {
        let text = rest?;
        let end = text.iter().position(|byte| *byte == b':');
        rest = end.and_then(|end| text.get(end + 1..));
        text.get(..end.unwrap_or(text.len()))
    })
}

/// Whether `text` is the name of a parameter (`dwell_s`) in any case: in full, without its unit, or in SCPI's short form (four letters,
/// three if the fourth is a vowel).
pub fn is_name(text: &[u8], name: &str) -> bool {
    let end = name.bytes().position(|byte| matches!(byte, b'_' | b'-')).unwrap_or(name.len());
    let base = name.get(..end).unwrap_or(name);
    let fourth_is_vowel = base.as_bytes().get(3).is_some_and(|byte| b"aeiouAEIOU".contains(byte));
    let short = if base.len() > 4 && fourth_is_vowel { 3 } else { 4 };
    let short = base.as_bytes().get(..short).unwrap_or(base.as_bytes());
    [name.as_bytes(), base.as_bytes(), short].into_iter().any(|form| text.eq_ignore_ascii_case(form))
}

/// The text before the first separator outside quotes, and the text after it.
fn split_unquoted(text: &[u8], separator: u8) -> (&[u8], Option<&[u8]>) {
    let mut quote = None;
    let place = text.iter().position(|byte| {
        match quote {
            Some(open) if open == *byte => quote = None,
            None if matches!(byte, b'"' | b'\'') => quote = Some(*byte),
            _ => {}
        }
        quote.is_none() && *byte == separator
    });
    match place {
        Some(place) => (text.get(..place).unwrap_or_default(), text.get(place + 1..)),
        None => (text, None),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn assert_headers(line: &str, patterns: &[&str]) {
        let all: Vec<_> = Commands::new(line.as_bytes()).collect();
        assert_eq!(all.len(), patterns.len(), "{line}");
        for (command, pattern) in all.iter().zip(patterns) {
            assert!(command.is(pattern), "{line}: {:?} is not {pattern}", String::from_utf8_lossy(command.header));
        }
    }

    #[test]
    fn a_parameter_below_a_node_is_also_found_from_the_root() {
        let last =
            |line: &'static [u8]| Commands::new(line).map(|command| command.last_below("PROFile").map(<[u8]>::to_vec)).last().flatten();
        assert_eq!(last(b"PROF:DWEL 1;AMP 2"), Some(b"AMP".to_vec()));
        assert_eq!(last(b"PROF:DWEL 1;PROF:AMP 2"), Some(b"AMP".to_vec()));
        assert_eq!(last(b"SOUR:RATE 1;AMP 2"), None);
    }

    #[test]
    fn headers_match_in_long_and_short_form_and_continue_the_path() {
        assert_headers("SOURce:RATE 5", &["SOURce:RATE"]);
        assert_headers("sour:rate 5;:outp on", &["SOURce:RATE", "OUTPut"]);
        assert_headers("SOURce:MODE RATE;RATE 100 DEG/S;*OPC?;RATE?", &["SOURce:MODE", "SOURce:RATE", "*OPC", "SOURce:RATE"]);
        assert_headers("SYST:ERR?;ERR:COUN?", &["SYSTem:ERRor", "SYSTem:ERRor:COUNt"]);
        assert_headers("PROF:STAR;STOP", &["PROFile:STARt", "STOP"]);
        assert_headers(";;*idn?; ;", &["*IDN"]);
        assert_headers("SOUR:RATE 1;SOUR:MODE OFF", &["SOURce:RATE", "SOURce:MODE"]);
        let not = |line: &str, pattern: &str| assert!(!Commands::new(line.as_bytes()).next().unwrap().is(pattern), "{line}");
        for line in ["SOURC:RATE", "SOU:RATE", "RATE", "SOUR:RAT", "SOUR:RATE:X", "SOUR:", "SOUR::RATE", ":"] {
            not(line, "SOURce:RATE");
        }
    }

    #[test]
    fn parameters_are_numbers_words_and_text() {
        let rate = Range::new(Quantity::RATE, -35.0, 35.0, 1.0);
        let of = |line: &'static str| Commands::new(line.as_bytes()).next().unwrap().parameters();
        let refused = of("X 100").number(&rate).unwrap_err();
        assert_eq!((refused.code, refused.detail()), (Code::OUT_OF_RANGE, "100 is above the maximum of 35 RAD/S"));
        let refused = of("X A").choice(&["ONE", "TWO", "THRee"]).unwrap_err();
        assert_eq!((refused.code, refused.detail()), (Code::ILLEGAL_VALUE, "A is not one of ONE, TWO or THRee"));
        assert_eq!(of("X -2.5 , 3").number(&rate).unwrap(), -2.5);
        assert!((of("X 360DEG/S").number(&rate).unwrap() - core::f64::consts::TAU).abs() < 1e-12);
        assert_eq!(
            (of("X MAX").number(&rate).unwrap(), of("X min").number(&rate).unwrap(), of("X DEF").number(&rate).unwrap()),
            (35.0, -35.0, 1.0)
        );
        assert_eq!(of("X 5 V").number(&rate).unwrap_err().code, Code::INVALID_SUFFIX);
        assert_eq!(of("X FAST").number(&rate).unwrap_err().code, Code::NUMERIC_DATA);
        assert_eq!(of("X").number(&rate).unwrap_err().code, Code::MISSING_PARAMETER);
        assert_eq!(of("X 1E400").number(&rate).unwrap_err().code, Code::OUT_OF_RANGE);
        let mut two = of("X \"a;b,c\", off");
        assert_eq!((two.text().unwrap(), two.on_off().unwrap()), (&b"a;b,c"[..], false));
        assert!(two.end().is_ok());
        assert_eq!(of("X 1,2").end().unwrap_err().code, Code::PARAMETER_NOT_ALLOWED);
    }

    #[test]
    fn parameter_names_match_in_full_without_unit_or_in_short_form() {
        for (text, name, matches) in [
            ("DWEL", "dwell_s", true),
            ("dwell_s", "dwell_s", true),
            ("DWELL", "dwell_s", true),
            ("amp", "amplitude", false),
            ("ACC", "acceleration", true),
            ("to", "to_Hz", true),
        ] {
            assert_eq!(is_name(text.as_bytes(), name), matches, "{text}");
        }
    }
}
