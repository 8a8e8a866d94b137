//! Is a scale that a calibration finds one that a sensor can have? A wrong unit or a reversed axis gives a scale with a small uncertainty,
//! too, of which a certificate must not be made.

use std::f64::consts::PI;

/// Scales of a sensor whose readings and reference have the units that they are stated in.
const PLAUSIBLE: std::ops::Range<f64> = 0.5..2.0;
/// Relative distance to a factor between units at which it is named.
const UNIT_TOLERANCE: f64 = 0.1;
/// Readings over reference, for units that are confused, and what is confused.
const CONFUSED: [(f64, &str); 6] = [
    (180.0 / PI, "the readings are in degrees per second where rad/s are stated, or the reference is the other way round"),
    (PI / 180.0, "the reference is in degrees per second where rad/s are stated, or the readings are the other way round"),
    (30.0 / PI, "the readings are in revolutions per minute where rad/s are stated"),
    (PI / 30.0, "the reference is in revolutions per minute where rad/s are stated"),
    (1000.0, "the readings are in thousandths of their stated unit"),
    (1e-3, "the reference is in thousandths of its stated unit"),
];

/// Why this ratio of readings to reference cannot be the scale of a sensor in the stated units; `None` where it can.
pub fn objection(ratio: f64) -> Option<String> {
    if PLAUSIBLE.contains(&ratio) {
        return None;
    }
    let times = format!("the readings are {ratio:.4} times the reference");
    let size = ratio.abs();
    let cause = if PLAUSIBLE.contains(&size) {
        "the signs are reversed: where the sensor is mounted the other way round, state the reference with the other sign".to_owned()
    } else if let Some((_, cause)) = CONFUSED.iter().find(|(factor, _)| (size / factor - 1.0).abs() < UNIT_TOLERANCE) {
        (*cause).to_owned()
    } else {
        "the readings are no values in their stated unit, but counts of a converter?".to_owned()
    };
    Some(format!("{times}: {cause}"))
}

#[cfg(test)]
mod tests {
    use super::objection;

    #[test]
    fn a_scale_is_near_one() {
        for scale in [0.7, 1.0, 1.3] {
            assert_eq!(objection(scale), None);
        }
        for (ratio, word) in
            [(0.017_668, "degrees"), (57.9, "degrees"), (-1.0123, "signs"), (132.6, "counts"), (0.1047, "minute"), (f64::NAN, "counts")]
        {
            assert!(objection(ratio).is_some_and(|text| text.contains(word)), "{ratio}: {:?}", objection(ratio));
        }
    }
}
