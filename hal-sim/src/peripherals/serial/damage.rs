//! Damage of bytes on a bad cable: changed, lost and inserted bytes.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};
use stand_firmware::config::{ConfigError, within};

/// Damage rates; each is a fraction of the bytes, 0 … 1.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct DamageRates {
    /// Bytes in which one bit is changed.
    pub flip: f64,
    /// Bytes that do not arrive.
    pub lose: f64,
    /// Bytes after which a foreign byte is inserted.
    pub insert: f64,
}

impl DamageRates {
    /// No damage.
    pub const NONE: Self = Self { flip: 0.0, lose: 0.0, insert: 0.0 };

    /// Checks the values of a file.
    ///
    /// # Errors
    /// The name of the first value outside 0 … 1.
    pub fn check(&self) -> Result<(), ConfigError> {
        within("flip", self.flip, 0.0, 1.0)?;
        within("lose", self.lose, 0.0, 1.0)?;
        within("insert", self.insert, 0.0, 1.0)?;
        Ok(())
    }
}

/// Draws the damage of one direction by seed.
#[derive(Clone, Debug)]
pub(super) struct Damage {
    pub rates: DamageRates,
    generator: Xoshiro256PlusPlus,
    done: u64,
}

impl Damage {
    pub fn new(seed: u64) -> Self {
        Self { rates: DamageRates::NONE, generator: Xoshiro256PlusPlus::seed_from_u64(seed), done: 0 }
    }

    /// Number of bytes changed, lost or inserted so far.
    pub fn done(&self) -> u64 {
        self.done
    }

    /// The bytes that arrive for one sent byte: none, one or two.
    #[inline]
    pub fn pass(&mut self, byte: u8) -> [Option<u8>; 2] {
        if self.rates == DamageRates::NONE {
            return [Some(byte), None];
        }
        let DamageRates { flip, lose, insert } = self.rates;
        let inserted = self.happens(insert).then(|| self.generator.next_u64() as u8);
        if self.happens(lose) {
            return [None, inserted];
        }
        let flipped = if self.happens(flip) { 1 << (self.generator.next_u64() % 8) } else { 0 };
        [Some(byte ^ flipped), inserted]
    }

    fn happens(&mut self, share: f64) -> bool {
        // 53 bits of a uniform number below 1.
        let happens = share > 0.0 && (self.generator.next_u64() >> 11) as f64 * (1.0 / (1_u64 << 53) as f64) < share;
        self.done += u64::from(happens);
        happens
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn damage_has_the_set_rates_and_a_flip_changes_one_bit() {
        let mut damage = Damage::new(3);
        damage.rates = DamageRates { flip: 0.1, lose: 0.2, insert: 0.05 };
        let (mut flipped, mut lost, mut inserted) = (0, 0, 0);
        for _ in 0..100_000 {
            let [kept, foreign] = damage.pass(0x5A);
            lost += u32::from(kept.is_none());
            inserted += u32::from(foreign.is_some());
            if let Some(byte) = kept.filter(|byte| *byte != 0x5A) {
                assert_eq!((byte ^ 0x5A).count_ones(), 1);
                flipped += 1;
            }
        }
        // Six standard deviations of the binomial are 760, 570 and 410.
        assert!((20_000_i32 - lost as i32).abs() < 760, "{lost}");
        assert!((8_000_i32 - flipped).abs() < 570, "{flipped} of the received bytes");
        assert!((5_000_i32 - inserted as i32).abs() < 410, "{inserted}");
        assert_eq!(damage.done(), u64::from(lost + inserted) + flipped as u64);
    }
}
