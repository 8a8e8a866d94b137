//! What a tool designs and the flash keeps: all numbers of an observer, in one row.
//!
//! One list with places in it, not a structure: the console sets and tells it, and the record holds it, by one loop each. The names of the
//! places are the console's (`OBServer:…`).

use super::MOST_STATES;

/// Where something lies, and how many numbers it is.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Place {
    /// What it is called.
    pub name: &'static str,
    /// Its first number.
    pub at: usize,
    /// How many there are.
    pub count: usize,
}

const fn place(name: &'static str, at: usize, count: usize) -> Place {
    Place { name, at, count }
}

const SQUARE: usize = MOST_STATES * MOST_STATES;
/// Γ, per N m.
pub const GAMMA: Place = place("gamma", SQUARE, MOST_STATES);
/// K.
pub const GAIN: Place = place("gain", SQUARE + MOST_STATES, MOST_STATES);
/// Gains of the regulator; that of an estimated moment feeds it forward.
pub const REGULATOR: Place = place("regulator", SQUARE + 2 * MOST_STATES, MOST_STATES);
const SINGLE: usize = SQUARE + 3 * MOST_STATES;
/// How many states there are; 0: no observer.
pub const STATES: Place = place("states", SINGLE, 1);
/// 1 where the last state is a moment from outside, N m.
pub const MOMENT: Place = place("moment", SINGLE + 1, 1);
/// Moment of the torquer per current, N m/A.
pub const TORQUER: Place = place("torquer_N_m_A", SINGLE + 2, 1);
/// After that time the estimates have settled, s.
pub const SETTLE: Place = place("settle_s", SINGLE + 3, 1);
/// Window of the vibration's means, s; 0: none. H/k_α, s. (Jx−Jz)/k_α, s².
pub const VIBRATION: Place = place("vibration", SINGLE + 4, 3);
/// All numbers.
pub const COUNT: usize = SINGLE + 7;

/// A row of Φ, from 0.
pub const fn phi(row: usize) -> Place {
    place("phi", row * MOST_STATES, MOST_STATES)
}

/// The numbers.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Numbers(pub [f64; COUNT]);

impl Default for Numbers {
    fn default() -> Self {
        Self([0.0; COUNT])
    }
}

impl Numbers {
    /// The numbers of a place.
    pub fn of(&self, place: Place) -> &[f64] {
        self.0.get(place.at..place.at.saturating_add(place.count)).unwrap_or_default()
    }

    /// The same, to be set.
    pub fn of_mut(&mut self, place: Place) -> &mut [f64] {
        self.0.get_mut(place.at..place.at.saturating_add(place.count)).unwrap_or_default()
    }

    /// The first number of a place.
    pub fn one(&self, place: Place) -> f64 {
        self.of(place).first().copied().unwrap_or(0.0)
    }

    /// How many states there are, at most [`MOST_STATES`]; 0: no observer.
    pub fn states(&self) -> usize {
        (self.one(STATES) as u32 as usize).min(MOST_STATES)
    }

    /// A place as an array.
    pub(super) fn array(&self, place: Place) -> [f64; MOST_STATES] {
        let mut array = [0.0; MOST_STATES];
        for (to, from) in array.iter_mut().zip(self.of(place)) {
            *to = *from;
        }
        array
    }

    /// Φ.
    pub(super) fn phi(&self) -> [[f64; MOST_STATES]; MOST_STATES] {
        core::array::from_fn(|row| self.array(phi(row)))
    }
}
