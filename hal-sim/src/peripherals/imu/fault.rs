//! Faults of a sensor under test and of its bus.

/// Start of the sequence of flipped bits.
pub(super) const FLIP_SEED: u64 = 0x9E37_79B9_7F4A_7C15;

/// A fault of the chip or its bus.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub enum Fault {
    /// None.
    #[default]
    None,
    /// Every byte reads as this value: 0x00 without supply, 0xFF with an open bus.
    Silent(u8),
    /// Outputs and FIFO stand still; the registers respond.
    Stuck,
    /// The (first) identity register reads as this value.
    Named(u8),
    /// One bit in this number is wrong on the bus.
    FlippedBits(u32),
}

impl Fault {
    /// What the bus shows of a byte that the chip sends.
    pub(super) fn on_bus(self, byte: u8, flips: &mut u64) -> u8 {
        match self {
            Self::Silent(shown) => shown,
            Self::FlippedBits(every) => (0..8).fold(byte, |byte, bit| {
                *flips ^= *flips << 13;
                *flips ^= *flips >> 7;
                *flips ^= *flips << 17;
                if (*flips >> 16).is_multiple_of(u64::from(every.max(1))) { byte ^ 1 << bit } else { byte }
            }),
            _ => byte,
        }
    }
}
