//! Coverage of a log in words.

use crate::numbers;
use identification::identify::explain::Coverage;

/// The range of operation that the log covers.
pub fn covered(c: &Coverage) -> String {
    let mut parts = vec![format!("{} s", numbers::plain(c.duration_s, 3))];
    if let Some((low, high)) = c.rates_rad_s {
        parts.push(format!("rates from {} to {} rad/s", numbers::significant(low, 2), numbers::significant(high, 2)));
    }
    if let Some(turns) = c.turns {
        parts.push(format!("{} turns", numbers::significant(turns, 2)));
    }
    if let Some(current) = c.current_A {
        parts.push(format!("currents up to {} A", numbers::significant(current, 2)));
    }
    if let Some(kelvin) = c.warming_K {
        parts.push(format!("warming of the winding by {} K", numbers::significant(kelvin, 2)));
    }
    format!("The log covers {}. Effects outside this range are not visible.", parts.join(", "))
}

/// One sentence for each range of operation that the log does not cover, with the effects that are not visible for this reason.
pub fn not_covered(c: &Coverage) -> Vec<String> {
    let mut list = Vec::new();
    if !c.both_ways {
        list.push(
            "The log has one direction of rotation only: Coulomb friction, a load and direction-dependent friction are not distinguishable."
                .to_owned(),
        );
    }
    if c.turns.is_none() {
        list.push("The log has no angle (theta_rad): effects periodic in the angle are not visible.".to_owned());
    } else if !c.slow_turns {
        list.push("The log has few slow whole turns: at high rates a small cogging torque or unbalance averages out.".to_owned());
    }
    match c.warming_K {
        None => {
            list.push("The log has no winding temperature (temp_C): warming is not distinguishable from other slow changes.".to_owned())
        }
        Some(k) if !c.warms => {
            list.push(format!(
                "The winding warms by only {} K: effects of its temperature are barely visible.",
                numbers::significant(k, 2)
            ));
        }
        Some(_) => {}
    }
    if c.current_A.is_none() {
        list.push("The log has no current (i_A): a voltage drop is not distinguishable from a braking torque.".to_owned());
    }
    list
}
