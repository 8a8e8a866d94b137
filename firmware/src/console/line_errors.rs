//! Line break and lost bytes by the flags of a serial receiver whose data register is read by DMA alone.
//!
//! The flags of a framing error and of an overrun stay until the status and then the data are read. The interrupt reads the status only: if
//! it read the data too, a byte that is complete between both reads would be taken from DMA. A flag is therefore seen again and again until
//! DMA reads the next byte, and only its rise counts.

/// State of the flags at the last look.
#[derive(Clone, Copy, Debug, Default)]
pub struct LineErrors {
    had_framing_error: bool,
    had_overrun: bool,
}

/// What a look has found.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LineEvents {
    /// A break has begun.
    pub is_break: bool,
    /// A byte was lost.
    pub is_overrun: bool,
}

impl LineErrors {
    /// No flag was set.
    pub const fn new() -> Self {
        Self { had_framing_error: false, had_overrun: false }
    }

    /// Looks at the flags and the level of the line. A break: a byte without a stop bit, and the line is still low.
    #[inline]
    pub fn update(&mut self, framing_error: bool, overrun: bool, is_low: bool) -> LineEvents {
        let is_break = framing_error && !self.had_framing_error && is_low;
        let is_overrun = overrun && !self.had_overrun;
        *self = Self { had_framing_error: framing_error, had_overrun: overrun };
        LineEvents { is_break, is_overrun }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_break_counts_once_and_the_low_bits_of_later_bytes_are_no_break() {
        let mut errors = LineErrors::new();
        assert!(errors.update(true, false, true).is_break);
        // The flag stays until the next byte; its start bit is low.
        assert!(!errors.update(true, false, false).is_break && !errors.update(true, false, true).is_break);
        assert!(!errors.update(false, false, true).is_break);
        assert!(errors.update(true, false, true).is_break, "the next break");
    }

    #[test]
    fn a_framing_error_by_noise_is_no_break_and_an_overrun_counts_once() {
        let mut errors = LineErrors::new();
        assert_eq!(errors.update(true, true, false), LineEvents { is_break: false, is_overrun: true });
        assert_eq!(errors.update(true, true, true), LineEvents::default());
        errors.update(false, false, false);
        assert!(errors.update(false, true, false).is_overrun);
    }
}
