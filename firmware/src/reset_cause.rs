//! Why the controller has started.
//!
//! In: the reset flags of the chip (RCC_CSR, RM0390 §6.3.21) and a note that the program leaves in memory before it resets the chip itself.
//! Out: a [`ResetCause`], for the log and `SYSTem:RESet:CAUSe?`.

/// Cause of the last reset.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum ResetCause {
    /// The supply was switched on.
    #[default]
    PowerOn,
    /// The supply of the chip fell below the brown-out level.
    BrownOut,
    /// The reset button, or a debugger.
    Pin,
    /// The independent watchdog: control tick, tasks or measurement had stopped.
    Watchdog,
    /// The window watchdog, which this program does not use.
    WindowWatchdog,
    /// Software, without a note.
    Software,
    /// A low-power mode was entered, which this program does not do.
    LowPower,
    /// The external clock failed.
    ClockFailure,
    /// The supply of the chip fell below 2.9 V.
    SupplyDip,
    /// A panic of the program.
    Panic,
    /// A fault of the processor: invalid memory or instruction.
    HardFault,
}

/// High half of a note. After power-on the memory is random: one of 65 000 power-ons reads it by chance, and then the flags decide.
const MAGIC: u32 = 0xA5C3_0000;

impl ResetCause {
    /// All causes.
    pub const ALL: [Self; 11] = [
        Self::PowerOn,
        Self::BrownOut,
        Self::Pin,
        Self::Watchdog,
        Self::WindowWatchdog,
        Self::Software,
        Self::LowPower,
        Self::ClockFailure,
        Self::SupplyDip,
        Self::Panic,
        Self::HardFault,
    ];

    /// The note that names this cause after the reset.
    pub fn note(self) -> u32 {
        MAGIC | self as u32
    }

    /// The cause by the flags in RCC_CSR and the note. Each reset also sets the flag of the pin, and power-on that of brown-out.
    pub fn of_flags(csr: u32, note: u32) -> Self {
        let has = |bit: u32| csr >> bit & 1 == 1;
        let noted = Self::ALL.into_iter().find(|cause| cause.note() == note);
        // The watchdog may be faster than the delay of a reset by software, which lets a probe read the log.
        match noted {
            Some(cause) if has(28) || has(29) => return cause,
            _ => {}
        }
        match () {
            () if has(31) => Self::LowPower,
            () if has(30) => Self::WindowWatchdog,
            () if has(29) => Self::Watchdog,
            () if has(28) => Self::Software,
            () if has(27) => Self::PowerOn,
            () if has(25) => Self::BrownOut,
            () => Self::Pin,
        }
    }

    /// Its name.
    pub fn name(self) -> &'static str {
        match self {
            Self::PowerOn => "power-on",
            Self::BrownOut => "brown-out",
            Self::Pin => "reset pin",
            Self::Watchdog => "watchdog",
            Self::WindowWatchdog => "window watchdog",
            Self::Software => "software",
            Self::LowPower => "low power",
            Self::ClockFailure => "clock failure",
            Self::SupplyDip => "supply dip",
            Self::Panic => "panic",
            Self::HardFault => "hard fault",
        }
    }

    /// Whether the controller was switched on or reset by a person.
    pub fn is_ordinary(self) -> bool {
        matches!(self, Self::PowerOn | Self::Pin)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Flags as RM0390 describes them: the pin's flag comes with every reset.
    const PIN: u32 = 1 << 26;

    #[test]
    fn flags_name_the_cause() {
        let cases = [
            (PIN | 1 << 27 | 1 << 25, ResetCause::PowerOn),
            (PIN | 1 << 25, ResetCause::BrownOut),
            (PIN, ResetCause::Pin),
            (PIN | 1 << 29, ResetCause::Watchdog),
            (PIN | 1 << 30, ResetCause::WindowWatchdog),
            (PIN | 1 << 28, ResetCause::Software),
            (PIN | 1 << 31, ResetCause::LowPower),
        ];
        for (csr, cause) in cases {
            assert_eq!(ResetCause::of_flags(csr, 0x1234_5678), cause, "{csr:#x}");
        }
    }

    #[test]
    fn a_note_counts_after_a_reset_by_software_or_watchdog_only() {
        for cause in ResetCause::ALL {
            assert_eq!(ResetCause::of_flags(PIN | 1 << 28, cause.note()), cause);
            assert_eq!(ResetCause::of_flags(PIN | 1 << 29, cause.note()), cause, "the watchdog was faster");
            assert_eq!(ResetCause::of_flags(PIN | 1 << 27 | 1 << 25, cause.note()), ResetCause::PowerOn, "random memory");
            assert!(ResetCause::ALL.iter().all(|other| *other == cause || other.name() != cause.name()));
        }
    }
}
