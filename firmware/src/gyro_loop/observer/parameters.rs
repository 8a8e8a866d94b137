//! Parameters of an observer, as `stand observer design` computes them and the flash stores them.
//!
//! One array with named fields rather than a structure, so that console and stored record handle it by one loop each. The names of the
//! fields are the console's (`OBServer:…`).

use super::MAX_STATES;

/// Position of a field in the array.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Field {
    /// Name.
    pub name: &'static str,
    /// Index of its first number.
    pub at: usize,
    /// Number of numbers.
    pub count: usize,
}

const fn field(name: &'static str, at: usize, count: usize) -> Field {
    Field { name, at, count }
}

const SQUARE: usize = MAX_STATES * MAX_STATES;
/// Γ, per N m.
pub const GAMMA: Field = field("gamma", SQUARE, MAX_STATES);
/// K: gains of the angle's innovation.
pub const GAIN: Field = field("gain", SQUARE + MAX_STATES, MAX_STATES);
/// Gains of the regulator; the gain of an estimated moment feeds it forward.
pub const REGULATOR: Field = field("regulator", SQUARE + 2 * MAX_STATES, MAX_STATES);
const SINGLE: usize = SQUARE + 3 * MAX_STATES;
/// Number of states; 0: no observer.
pub const STATES: Field = field("states", SINGLE, 1);
/// 1 if the last state is a disturbing moment, N m.
pub const MOMENT: Field = field("moment", SINGLE + 1, 1);
/// Moment of the torquer per current, N m/A.
pub const TORQUER: Field = field("torquer_N_m_A", SINGLE + 2, 1);
/// Time until the estimates have settled, s.
pub const SETTLE: Field = field("settle_s", SINGLE + 3, 1);
/// Averaging window of the vibration correction, s (0: none); H/k_α, s; (Jx−Jz)/k_α, s².
pub const VIBRATION: Field = field("vibration", SINGLE + 4, 3);
/// Inverse response of the observer at the vibration frequency, for the vibration correction: of α̂′, real part and imaginary part over the
/// angular frequency, s; likewise of β̂′. All 0: not known.
pub const RESPONSE: Field = field("response", SINGLE + 7, 4);
/// Length of the array.
pub const COUNT: usize = SINGLE + 11;

/// Row of Φ, from 0.
pub const fn phi(row: usize) -> Field {
    field("phi", row * MAX_STATES, MAX_STATES)
}

/// All parameters of an observer.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ObserverParameters(pub [f64; COUNT]);

impl Default for ObserverParameters {
    fn default() -> Self {
        Self([0.0; COUNT])
    }
}

impl ObserverParameters {
    /// The numbers of a field.
    pub fn get(&self, field: Field) -> &[f64] {
        self.0.get(field.at..field.at.saturating_add(field.count)).unwrap_or_default()
    }

    /// The numbers of a field, mutable.
    pub fn get_mut(&mut self, field: Field) -> &mut [f64] {
        self.0.get_mut(field.at..field.at.saturating_add(field.count)).unwrap_or_default()
    }

    /// The first number of a field.
    pub fn value(&self, field: Field) -> f64 {
        self.get(field).first().copied().unwrap_or(0.0)
    }

    /// Number of states, at most [`MAX_STATES`]; 0: no observer.
    pub fn states(&self) -> usize {
        (self.value(STATES) as u32 as usize).min(MAX_STATES)
    }

    /// A field as an array.
    pub(super) fn array(&self, field: Field) -> [f64; MAX_STATES] {
        let mut array = [0.0; MAX_STATES];
        for (to, from) in array.iter_mut().zip(self.get(field)) {
            *to = *from;
        }
        array
    }

    /// Φ.
    pub(super) fn phi(&self) -> [[f64; MAX_STATES]; MAX_STATES] {
        core::array::from_fn(|row| self.array(phi(row)))
    }
}
