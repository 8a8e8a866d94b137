//! Quantities of a calibration in the units that the user chose.
//!
//! Records, JSON and the certificate stay in the units of the record; only texts and pages use the chosen ones. A quantity in another unit
//! loses the unit in its name: `bias_rad_s` in °/h is `bias`.

use crate::units::{Dimension, Scale, Units};
use stand_records::stored_record::{StoredQuantity, StoredRecord};

/// Beginnings of units of which the user can choose another, with the factor to the SI unit of their dimension.
const CHOOSABLE: [(&str, Dimension, f64); 4] = [
    ("rad/s", Dimension::Rate, 1.0),
    ("m/s²", Dimension::Acceleration, 1.0),
    ("1/K", Dimension::Ratio, 1.0),
    ("%", Dimension::Ratio, 0.01),
];
/// Endings of names that are units.
const ENDINGS: [&str; 7] = ["_rad_s_g", "_K_rad_s", "_rad_s", "_m_s2", "_percent_fs", "_percent", "_rad_s_K"];

/// Factor and symbol for a unit of a record; `None` where it stays.
fn scale(unit: &str, units: &Units) -> Option<Scale> {
    let (beginning, dimension, to_si) = CHOOSABLE.iter().find(|(beginning, ..)| unit.starts_with(beginning))?;
    let is_chosen = match dimension {
        Dimension::Acceleration => units.acceleration.is_some(),
        Dimension::Ratio => units.ratio.is_some(),
        _ => units.rate.is_some(),
    };
    let rest = unit.strip_prefix(beginning).unwrap_or("");
    // "rad/s/V" of the drive and "rad/s²" are not rates.
    if !is_chosen || !["", "/K", "/g", "/d"].contains(&rest) {
        return None;
    }
    let chosen = units.scale(*dimension);
    let rest = if *beginning == "1/K" { "/K" } else { rest };
    Some(Scale { factor: chosen.factor * to_si, unit: format!("{}{rest}", chosen.unit) })
}

/// A quantity in the chosen units.
pub fn displayed(q: &StoredQuantity, units: &Units) -> StoredQuantity {
    let Some(scale) = scale(&q.unit, units) else { return q.clone() };
    let stem = ENDINGS.iter().find_map(|ending| q.name.strip_suffix(ending)).unwrap_or(&q.name);
    let name = if q.name.ends_with("_K_rad_s") { format!("{stem}_K") } else { stem.to_owned() };
    let contributions = q.contributions.iter().map(|c| c.clone().scaled(scale.factor)).collect();
    StoredQuantity { name, unit: scale.unit, value: q.value * scale.factor, contributions, ..q.clone() }
}

/// A record in the chosen units.
pub fn displayed_record(record: &StoredRecord, units: &Units) -> StoredRecord {
    StoredRecord { quantities: record.quantities.iter().map(|q| displayed(q, units)).collect(), header: record.header.clone() }
}

#[cfg(test)]
mod tests {
    use super::*;
    use identification::statistics::uncertainty::Contribution;

    #[test]
    fn chosen_units_scale_value_and_uncertainty() {
        let q = |name: &str, unit: &str, value: f64| {
            StoredQuantity::new(name, unit, value, vec![Contribution::type_a("noise", 0.1 * value, 9.0, String::new())])
        };
        let units: Units = "deg/h,ppm,mg".parse().unwrap();
        let bias = displayed(&q("bias_rad_s", "rad/s", 1e-5), &units);
        assert_eq!((bias.name.as_str(), bias.unit.as_str()), ("bias", "°/h"));
        assert!((bias.value - 2.062_648).abs() < 1e-5 && (bias.combined_u() / bias.value - 0.1).abs() < 1e-12);
        let per_K = displayed(&q("bias_per_K_rad_s", "rad/s/K", 1e-5), &units);
        assert_eq!((per_K.name.as_str(), per_K.unit.as_str()), ("bias_per_K", "°/h/K"));
        let nonlinearity = displayed(&q("nonlinearity_percent_fs", "%", 0.1), &units);
        assert_eq!((nonlinearity.name.as_str(), nonlinearity.unit.as_str()), ("nonlinearity", "ppm"));
        assert!((nonlinearity.value - 1000.0).abs() < 1e-9);
        let force = displayed(&q("bias_x_m_s2", "m/s²", 9.806_65e-3), &units);
        assert!((force.value - 1.0).abs() < 1e-12 && force.unit == "mg");
        for (name, unit) in [("scale", "1"), ("rate_per_voltage_rad_s_V", "rad/s/V"), ("coast_dry_rad_s2", "rad/s²"), ("delay_s", "s")] {
            assert_eq!(displayed(&q(name, unit, 2.0), &units), q(name, unit, 2.0));
        }
    }
}
